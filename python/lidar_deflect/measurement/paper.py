"""The method of Hu et al. 2024: contour curves, their intersection, arc length back to sections.

`measure` runs steps 5 to 12 of docs/method.md over a capture; the numbers of each step are made in
Rust, in blocks of frames. Steps 1 to 4 are `lidar_deflect.registration`.
"""

from __future__ import annotations

from collections import Counter
from typing import TYPE_CHECKING, Any

import numpy as np

from lidar_deflect.measurement.contours import ContourRun, contours_of
from lidar_deflect.measurement.plan import Plan, make_plan
from lidar_deflect.measurement.plane import choose_plane
from lidar_deflect.measurement.reference import Reference, reference_of
from lidar_deflect.measurement.states import MISSING, States, joined_names
from lidar_deflect.measurement.status import (
    extrapolate,
    grade_frames,
    interpolate,
    refuse_stretched,
)

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    from numpy.typing import NDArray

    from lidar_deflect.measurement.inputs import Inputs

STATION_M = 1.0
"""Distance between stations of the blade line in the table `contour`."""


def measure(inputs: Inputs) -> States:
    """Measure all sections over the whole capture.

    Raises
    ------
    MeasurementError
        Where no frame gives contours, or the unloaded blade is not known.
    """
    plan = plan_of(inputs)
    contours = contours_of(inputs, plan)  # steps 5 to 10
    plane, plane_warnings = choose_plane(inputs.config, contours)  # step 10, auto
    reference = reference_of(inputs, contours, plane)  # (15) in the unloaded state
    position, status, reason = sections_over_time(inputs, contours, reference)  # steps 11, 12
    uses = contours.uses
    return States(
        time_ns=contours.time_ns,
        names=[section.name for section in inputs.config.sections],
        s_m=np.array([section.s_m for section in inputs.config.sections]),
        position_m=position,
        reference_m=reference.position_m,
        n_points=_per_section(uses.used.sum(axis=1), status),
        lidars=_names(inputs.lidars, uses.used > 0, status),
        status=status,
        reason=reason,
        blade_points=uses.used,
        contour=_blade_line(inputs, contours, reference),
        points=contours.points(inputs.lidars),
        rejected=contours.rejected(),
        evidence=_evidence(plan, contours, reference, reason[status == MISSING]),
        warnings=(*plan.warnings, *plane_warnings),
    )


def plan_of(inputs: Inputs) -> Plan:
    """Return the plan of this capture's unloaded hold, else the one kept with the calibration."""
    if inputs.plan is not None:
        return inputs.plan
    if inputs.clouds:
        return make_plan(inputs.config, inputs.calibration, inputs.clouds)
    return Plan.from_dict(inputs.calibration.reference["paper"]["plan"])


def sections_over_time(
    inputs: Inputs, contours: ContourRun, reference: Reference
) -> tuple[NDArray[np.float64], NDArray[np.uint8], NDArray[np.object_]]:
    """Walk back from the tip (step 11), grade each row and fill overhead ones (step 12).

    Returns
    -------
    tuple
        Positions, shape (t, s, 3), NaN where missing; status and reason, shape (t, s).
    """
    position = contours.sections(reference.plane, reference.to_tip_m)
    status, reason = grade_frames(
        contours.uses, contours.failures(reference.plane), reference.blade_points
    )
    count = position.shape[1]
    status = np.repeat(status[:, None], count, axis=1)
    reason = np.repeat(reason[:, None], count, axis=1)
    position[status == MISSING] = np.nan
    refuse_stretched(status, reason, position, reference.s_m)
    extrapolate(status, reason, position[:, :, 2], contours.seen_z_m)
    if inputs.config.paper.overhead == "interpolate":
        interpolate(contours.time_ns, position, status, reason)
    return position, status, reason


def calibrated_reference(inputs: Inputs) -> Mapping[str, Any]:
    """Return the unloaded blade for a calibration file: the reference and the plan that saw it."""
    plan = plan_of(inputs)
    contours = contours_of(inputs, plan)
    plane, _ = choose_plane(inputs.config, contours)
    reference = reference_of(inputs, contours, plane)
    return {"plan": plan.to_dict(), "state": reference.to_dict()}


def _per_section(points: NDArray[np.uint32], status: NDArray[np.uint8]) -> NDArray[np.uint32]:
    return np.where(status == MISSING, 0, points[:, None]).astype(np.uint32)


def _names(
    lidars: Sequence[str], used: NDArray[np.bool_], status: NDArray[np.uint8]
) -> NDArray[np.object_]:
    return np.where(status == MISSING, "", joined_names(lidars, used)[:, None])


def _blade_line(inputs: Inputs, contours: ContourRun, reference: Reference) -> Mapping[str, Any]:
    """Stations of the visible blade line once a second, by arc length from the tip."""
    length_m = inputs.config.blade.length_m
    first_seen = float(np.nanmedian(contours.seen_z_m[:, 0]))
    s_m = np.arange(np.ceil(first_seen / STATION_M) * STATION_M, length_m, STATION_M)
    every = max(1, round(inputs.rate_hz))
    line = contours.sections(reference.plane, reference.arc_to_tip_m(s_m))[::every]
    kept = ~np.isnan(line).any(axis=2)
    moment, station = np.nonzero(kept)
    return {
        "time": contours.time_ns[::every][moment],
        "s_m": s_m[station],
        **{f"{axis}_m": line[kept][:, i] for i, axis in enumerate("xyz")},
        "status": ["ok"] * int(kept.sum()),
    }


def _evidence(
    plan: Plan, contours: ContourRun, reference: Reference, refused: NDArray[np.object_]
) -> Mapping[str, Any]:
    failures = [name for name in contours.failures(reference.plane) if name is not None]
    return {
        "plan": plan.to_dict(),
        "plane": reference.plane,
        "reference": reference.to_dict(),
        "frames": len(contours.time_ns),
        "refused_frames": dict(sorted(Counter(failures).items())),
        "missing_states": dict(sorted(Counter(refused.tolist()).items())),
    }
