"""The beam method: a blade that bends as blades bend, fitted to every ray and edge at its own time.

`measure` adjusts all holds together with lidars and surface, then follows the blade between them;
the numbers are made in Rust. Source: docs/method.md.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from lidar_deflect.errors import MeasurementError
from lidar_deflect.measurement.beam import clocks, rotation
from lidar_deflect.measurement.beam.adjustment import Solved, solve, spans_of
from lidar_deflect.measurement.beam.budget import budget_of
from lidar_deflect.measurement.beam.check import checks, loose_edges, objects
from lidar_deflect.measurement.beam.expected import expected_of
from lidar_deflect.measurement.beam.following import Followed, few, follow
from lidar_deflect.measurement.beam.kept import Kept, calibrated_reference
from lidar_deflect.measurement.beam.outline import outline_of
from lidar_deflect.measurement.beam.schedule import LAST
from lidar_deflect.measurement.beam.stretches import stretches_of
from lidar_deflect.measurement.beam.swung import widened
from lidar_deflect.measurement.beam.uncertainty import HoldCovariance, over_time
from lidar_deflect.measurement.states import DEGRADED, MISSING, OK, States, joined_names

if TYPE_CHECKING:
    from collections.abc import Mapping

    from numpy.typing import NDArray

    from lidar_deflect.measurement.beam.expected import Expected
    from lidar_deflect.measurement.inputs import Inputs

    Floats = NDArray[np.float64]

__all__ = ["calibrated_reference", "measure", "moments"]

STATION_M = 1.0
"""Distance between stations of the blade line in the table `contour`."""
FIRST_STATION_SHARE = 0.5
"""The blade line begins at this share of the length."""
KEPT_POINTS = 20_000
"""Points that are kept to look at."""
FEW_POINTS = 0.5
"""Fewer points than this share of the unloaded hold's: `degraded`."""


def measure(inputs: Inputs) -> States:
    """Measure all sections over the whole capture.

    Raises
    ------
    MeasurementError
        Where the blade is not found in the holds.
    """
    expected = expected_of(inputs)
    times_ns = moments(inputs)
    holds_ns = [span_ns for _, span_ns in spans_of(inputs, expected.holds)]
    stretches = stretches_of(expected, holds_ns, times_ns)
    solved = solve(inputs, expected, few(stretches))
    names, sections = zip(*((x.name, x.s_m) for x in inputs.config.sections), strict=True)
    stations = _stations(inputs)
    s_m = np.array([*sections, *stations])
    holds = HoldCovariance.of(solved, s_m, LAST)
    counts = (len(sections), len(stations))
    followed = follow(inputs, expected, solved, stretches, times_ns, counts)
    reference, kept_m2 = _reference(inputs, s_m, followed, times_ns, solved, holds)
    moved = followed.values[..., :3] - reference
    uncertainty = over_time(followed.spreads, kept_m2, moved)
    if expected.swings:
        uncertainty = widened(uncertainty, holds, moved)
    of = slice(0, len(sections))
    status, reason = _grades(followed)
    asked = checks(inputs, solved, s_m, holds)
    every = max(1, round(inputs.rate_hz))
    line = slice(len(sections), None)
    turned = np.concatenate(
        [
            rotation.rotations_rad(s_m[line], followed.values[:, line, :3], reference[line]),
            rotation.over_time(
                rotation.variance_rad2(s_m[line], holds, line),
                np.array(solved.shares),
                expected.at(times_ns),
            ),
        ],
        axis=2,
    )
    return States(
        time_ns=times_ns,
        names=names,
        s_m=np.array(sections),
        position_m=followed.values[:, of, :3],
        reference_m=reference[of],
        n_points=np.repeat(followed.used.sum(axis=1)[:, None], len(sections), axis=1).astype(
            np.uint32
        ),
        lidars=np.repeat(
            joined_names(inputs.lidars, followed.used > 0)[:, None], len(sections), axis=1
        ),
        status=np.repeat(status[:, None], len(sections), axis=1),
        reason=np.repeat(reason[:, None], len(sections), axis=1),
        blade_points=followed.used,
        contour=_contour(times_ns, stations, followed, uncertainty, turned, every),
        points=_points(inputs, followed),
        rejected=objects(solved),
        u_position_m=uncertainty.position_m[:, of],
        u_deflection_m=uncertainty.deflection_m[:, of],
        u_total_m=uncertainty.total_m[:, of],
        twist_deg=np.degrees(followed.values[:, of, 3]),
        u_twist_deg=np.degrees(uncertainty.twist_rad[:, of]),
        evidence=_evidence(inputs, expected, solved, followed),
        warnings=[
            *_warnings(solved),
            *clocks.told(_stand_names(inputs), followed.clocks),
            *loose_edges(inputs, solved),
            *(c.text for c in asked if not c.passed and c.only_warns),
        ],
        failed=[c.text for c in asked if not c.passed and not c.only_warns],
        outline=outline_of(solved, names, s_m[of]),
        checks=asked,
        budget=budget_of(solved, names, s_m[of]),
    )


def moments(inputs: Inputs) -> NDArray[np.int64]:
    """Moments of the states: multiples of the period within the limits."""
    return np.arange(inputs.first_ns, inputs.stop_ns + 1, inputs.period_ns, dtype=np.int64)


def _reference(
    inputs: Inputs,
    s_m: Floats,
    followed: Followed,
    times_ns: NDArray[np.int64],
    solved: Solved,
    holds: HoldCovariance,
) -> tuple[Floats, Floats | None]:
    """Unloaded position of every section (s, 3); its covariance (s, 3, 3) where it is a kept one.

    The position is the mean of the unloaded hold's states, as the table of steps has it, else that
    of the calibration.
    """
    if inputs.unloaded_ns is None:
        return _kept_reference(inputs, s_m)
    # A blade that sways slowly has another mean over any other stretch of time.
    hold, (start_ns, stop_ns) = solved.holds[0], inputs.unloaded_ns
    if hold.from_ns < stop_ns and hold.to_ns > start_ns:
        start_ns, stop_ns = max(start_ns, hold.from_ns), min(stop_ns, hold.to_ns)
    inside = (times_ns >= start_ns) & (times_ns <= stop_ns)
    states = followed.values[inside, :, :3]
    known = ~np.isnan(states).any(axis=(1, 2))
    position = states[known].mean(axis=0) if known.any() else holds.values[0, :, :3]
    return np.asarray(position), None


def _kept_reference(inputs: Inputs, s_m: Floats) -> tuple[Floats, Floats]:
    if "beam" not in inputs.calibration.reference:
        raise MeasurementError(
            "neither these captures nor the calibration have the unloaded blade",
            code="measurement.no_reference",
            hint='calibrate from a capture with an unloaded hold, with method = "beam"',
        )
    return Kept.from_dict(inputs.calibration.reference["beam"]).at(s_m)


def _stations(inputs: Inputs) -> list[float]:
    length = inputs.config.blade.length_m
    first = np.ceil(FIRST_STATION_SHARE * length / STATION_M) * STATION_M
    return [float(s) for s in np.arange(first, length + 1e-9, STATION_M)]


def _grades(followed: Followed) -> tuple[NDArray[np.uint8], NDArray[np.object_]]:
    """Status and reason of each moment, shape (t,)."""
    status = np.full(len(followed.used), OK, dtype=np.uint8)
    reason = np.full(len(followed.used), None, dtype=object)
    rest = followed.in_hold == 0
    usual = np.median(followed.used[rest], axis=0) if rest.any() else followed.used.max(axis=0)
    few = followed.used.sum(axis=1) < 0.25 * FEW_POINTS * usual.sum()
    absent = ((followed.used == 0) & (usual > 0)).any(axis=1)
    for applies, name in ((few, "few_points"), (absent, "no_points")):
        status[applies], reason[applies] = DEGRADED, name
    lost = np.isnan(followed.values).any(axis=(1, 2))
    status[lost], reason[lost] = MISSING, "ill_posed"
    return status, reason


def _contour(
    times_ns: NDArray[np.int64],
    stations: list[float],
    followed: Followed,
    uncertainty: Any,
    turned: Floats,
    every: int,
) -> Mapping[str, Any]:
    """Blade line once a second; `turned` are rotations about x and y and their uncertainties."""
    first = followed.values.shape[1] - len(stations)
    known = np.flatnonzero(~np.isnan(followed.values).any(axis=(1, 2)))[::every]
    values = followed.values[known, first:].reshape(-1, 4)
    sigma = uncertainty.position_m[known, first:].reshape(-1, 3)
    return {
        "time": np.repeat(times_ns[known], len(stations)),
        "s_m": np.tile(stations, len(known)),
        **{f"{axis}_m": values[:, i] for i, axis in enumerate("xyz")},
        **{f"u{axis}_m": sigma[:, i] for i, axis in enumerate("xyz")},
        **{
            name: turned[known, :, i].ravel()
            for i, name in enumerate(("rx_rad", "ry_rad", "urx_rad", "ury_rad"))
        },
        "twist_deg": np.degrees(values[:, 3]),
        "utwist_deg": np.degrees(uncertainty.twist_rad[known, first:].ravel()),
        "status": ["ok"] * len(values),
    }


def _points(inputs: Inputs, followed: Followed) -> Mapping[str, Any]:
    points = followed.points
    stride = max(1, len(points["time_ns"]) // KEPT_POINTS)
    order = np.argsort(points["time_ns"], kind="stable")[::stride]
    return {
        "time": points["time_ns"][order],
        "lidar": [inputs.lidars[number] for number in points["lidar"][order]],
        "ring": points["ring"][order],
        "s_m": points["s_m"][order],
        "chord": points["chord"][order],
        "residual_m": points["residual_m"][order],
        **{f"{axis}_m": points["xyz_m"][order, i] for i, axis in enumerate("xyz")},
    }


def _stand_names(inputs: Inputs) -> list[str]:
    return [inputs.lidars[lidar] for lidar in inputs.stands]


def _evidence(
    inputs: Inputs, expected: Expected, solved: Solved, followed: Followed
) -> Mapping[str, Any]:
    offsets = zip(followed.clocks.offset_s, followed.clocks.u_s, strict=True)
    holds = [
        {
            "hold": hold.label,
            "share": share,
            "echoes": len(told["residual_m"]),
            "rms_m": float(np.sqrt(np.mean(told["residual_m"] ** 2)))
            if len(told["residual_m"])
            else None,
            "rejected": len(told["rejected"]["s_m"]),
            "edges": len(told["edges"]),
            "edges_left_out": list(told["edges_left_out"]),
        }
        for hold, share, told in zip(solved.holds, solved.shares, solved.told["holds"], strict=True)
    ]
    return {
        "start": expected.source,
        "steps": solved.steps,
        "largest_last_change": solved.told["largest"],
        "noise_m": list(solved.told["noise_m"]),
        "surface_m": solved.told["surface_m"],
        "holds": holds,
        "clocks": [
            {"lidar": lidar, "offset_ms": 1e3 * float(offset), "u_ms": 1e3 * float(u)}
            for lidar, (offset, u) in zip(_stand_names(inputs), offsets, strict=True)
        ],
    }


def _warnings(solved: Solved) -> list[str]:
    said = []
    if solved.source == "generic":
        said.append(
            "no drawing with contours and stiffness: the blade's shape is learned from the lidars, "
            "and what none of them saw of it is that of blades in general"
        )
    if abs(solved.shares[0]) > 0.0:
        said.append(
            "no unloaded hold in these captures: the twist is since the hold with least load"
        )
    return said
