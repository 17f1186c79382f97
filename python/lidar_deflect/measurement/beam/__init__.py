"""The beam method: a blade that bends as blades bend, fitted to every ray and edge at its own time.

`measure` adjusts all holds together with lidars and surface, then follows the blade between them;
the numbers are made in Rust. Source: docs/method.md.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from lidar_deflect.measurement.beam.adjustment import LAST, Solved, solve
from lidar_deflect.measurement.beam.expected import expected_of
from lidar_deflect.measurement.beam.following import Followed, follow
from lidar_deflect.measurement.beam.uncertainty import HoldCovariance, over_time
from lidar_deflect.measurement.states import DEGRADED, MISSING, OK, States

if TYPE_CHECKING:
    from collections.abc import Mapping

    from numpy.typing import NDArray

    from lidar_deflect.measurement.beam.expected import Expected
    from lidar_deflect.measurement.inputs import Inputs

    Floats = NDArray[np.float64]

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
    solved = solve(inputs, expected)
    times_ns = moments(inputs)
    names, sections = zip(*((x.name, x.s_m) for x in inputs.config.sections), strict=True)
    stations = _stations(inputs)
    s_m = np.array([*sections, *stations])
    followed = follow(inputs, expected, solved, s_m, times_ns)
    covariance = HoldCovariance.of(solved, s_m, LAST)
    reference = _reference(inputs, followed, times_ns, covariance)
    moved = followed.values[..., :3] - reference
    uncertainty = over_time(covariance, solved, expected, followed, times_ns, moved)
    of = slice(0, len(sections))
    status, reason = _grades(followed)
    every = max(1, round(inputs.rate_hz))
    return States(
        time_ns=times_ns,
        names=names,
        s_m=np.array(sections),
        position_m=followed.values[:, of, :3],
        reference_m=reference[of],
        n_points=np.repeat(followed.used.sum(axis=1)[:, None], len(sections), axis=1).astype(
            np.uint32
        ),
        lidars=_names(inputs, followed, len(sections)),
        status=np.repeat(status[:, None], len(sections), axis=1),
        reason=np.repeat(reason[:, None], len(sections), axis=1),
        blade_points=followed.used,
        contour=_contour(times_ns, stations, followed, uncertainty, len(sections), every),
        points=_points(inputs, followed),
        rejected=_rejected(),
        u_position_m=uncertainty.position_m[:, of],
        u_deflection_m=uncertainty.deflection_m[:, of],
        u_total_m=uncertainty.total_m[:, of],
        twist_deg=np.degrees(followed.values[:, of, 3]),
        u_twist_deg=np.degrees(uncertainty.twist_rad[:, of]),
        evidence=_evidence(expected, solved),
        warnings=_warnings(solved),
    )


def moments(inputs: Inputs) -> NDArray[np.int64]:
    """Moments of the states: multiples of the period within the limits."""
    period_ns = round(1e9 / inputs.rate_hz)
    first = inputs.start_ns // period_ns + 1
    last = inputs.stop_ns // period_ns
    return np.arange(first, last + 1, dtype=np.int64) * period_ns


def _reference(
    inputs: Inputs, followed: Followed, times_ns: NDArray[np.int64], covariance: HoldCovariance
) -> Floats:
    """Unloaded position of every section, shape (s, 3): the mean of the unloaded hold's states."""
    if inputs.unloaded_ns is None:
        return np.asarray(covariance.values[0, :, :3])
    inside = (times_ns >= inputs.unloaded_ns[0]) & (times_ns <= inputs.unloaded_ns[1])
    states = followed.values[inside, :, :3]
    known = ~np.isnan(states).any(axis=(1, 2))
    if not known.any():
        return np.asarray(covariance.values[0, :, :3])
    return np.asarray(states[known].mean(axis=0))


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


def _names(inputs: Inputs, followed: Followed, sections: int) -> NDArray[np.object_]:
    rows = [
        "+".join(name for name, count in zip(inputs.lidars, row, strict=True) if count)
        for row in followed.used
    ]
    return np.repeat(np.array(rows, dtype=object)[:, None], sections, axis=1)


def _contour(
    times_ns: NDArray[np.int64],
    stations: list[float],
    followed: Followed,
    uncertainty: Any,
    first: int,
    every: int,
) -> Mapping[str, Any]:
    """Blade line once a second."""
    known = np.flatnonzero(~np.isnan(followed.values).any(axis=(1, 2)))[::every]
    values = followed.values[known, first:].reshape(-1, 4)
    sigma = uncertainty.position_m[known, first:].reshape(-1, 3)
    return {
        "time": np.repeat(times_ns[known], len(stations)),
        "s_m": np.tile(stations, len(known)),
        **{f"{axis}_m": values[:, i] for i, axis in enumerate("xyz")},
        **{f"u{axis}_m": sigma[:, i] for i, axis in enumerate("xyz")},
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
        "residual_m": points["residual_m"][order],
        **{f"{axis}_m": points["xyz_m"][order, i] for i, axis in enumerate("xyz")},
    }


def _rejected() -> Mapping[str, Any]:
    empty = np.zeros(0)
    return {
        "time": np.zeros(0, dtype=np.int64),
        "reason": [],
        "count": np.zeros(0, dtype=np.uint32),
        "s_m": empty,
        **{f"{axis}_m": empty for axis in "xyz"},
    }


def _evidence(expected: Expected, solved: Solved) -> Mapping[str, Any]:
    holds = [
        {
            "hold": hold.label,
            "share": share,
            "echoes": len(told["residual_m"]),
            "rms_m": float(np.sqrt(np.mean(told["residual_m"] ** 2)))
            if len(told["residual_m"])
            else None,
            "rejected": told["rejected"],
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
        "holds": holds,
    }


def _warnings(solved: Solved) -> list[str]:
    if abs(solved.shares[0]) > 0.0:
        return ["no unloaded hold: deflections are since the hold with least load"]
    return []
