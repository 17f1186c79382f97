"""Whether residuals are white: means over stretches of span and time against what noise leaves."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from lidar_deflect.measurement.states import Check

if TYPE_CHECKING:
    from collections.abc import Mapping

    from numpy.typing import NDArray

    Floats = NDArray[np.float64]

SPAN_M, TIME_NS = 3.0, 500_000_000
"""Stretches over which residuals are averaged."""
LIMIT_M, DEVIATIONS = 0.008, 4.0
"""A stretch whose mean is beyond both, in metres and in deviations of a mean, is not white."""
FEWEST = 40


def along_span(told: Mapping[str, Any], noise_m: Floats, where: str) -> Check:
    """Means over stretches of the span."""
    place = np.floor(told["s_m"] / SPAN_M).astype(np.int64)
    worst, at = _worst(told, noise_m, place)
    return _check("along the span", worst, f"{where}, {SPAN_M * (at + 0.5):.0f} m")


def along_time(
    told: Mapping[str, Any], noise_m: Floats, span_ns: tuple[int, int], where: str
) -> Check:
    """Means over stretches of time."""
    place = (told["time_ns"] - span_ns[0]) // TIME_NS
    worst, at = _worst(told, noise_m, place)
    return _check("in time", worst, f"{where}, {(at + 0.5) * TIME_NS * 1e-9:.1f} s after its start")


def _check(name: str, worst: tuple[float, float], where: str) -> Check:
    mean, deviations = worst
    return Check(
        f"residuals white {name}",
        f"{1e3 * mean:+.1f} mm, {deviations:.0f} deviations",
        f"{1e3 * LIMIT_M:g} mm or {DEVIATIONS:g} deviations",
        abs(mean) <= LIMIT_M or deviations <= DEVIATIONS,
        where,
    )


def _worst(
    told: Mapping[str, Any], noise_m: Floats, place: NDArray[np.int64]
) -> tuple[tuple[float, float], int]:
    """Mean residual of the stretch that is farthest from zero, with its deviations and place."""
    worst, at = (0.0, 0.0), 0
    for here in np.unique(place):
        inside = place == here
        residual = told["residual_m"][inside]
        if residual.size < FEWEST:
            continue
        sigma = noise_m[told["lidar"][inside]]
        mean = float(np.mean(residual))
        deviations = abs(mean) * residual.size / float(np.sqrt(np.sum(sigma**2)))
        if abs(mean) > abs(worst[0]):
            worst, at = (mean, deviations), int(here)
    return worst, at
