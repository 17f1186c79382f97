"""The time between the holds, cut into stretches that are followed one by one."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from collections.abc import Sequence

    from numpy.typing import NDArray

    from lidar_deflect.measurement.beam.expected import Expected

    Floats = NDArray[np.float64]
    Times = NDArray[np.int64]
    Span = tuple[int, int]

STRETCH_NS = 800_000_000
"""Time that is followed at once ..."""
LOAD_SHARE = 0.15
"""Less of it where the load changes by more: what the holds tell is taken between their loads."""
OVERLAPS_NS = (250_000_000, 200_000_000, 150_000_000, 100_000_000, 50_000_000)
"""... and what of its neighbours helps it: less of that, too, where the load changes by more."""


@dataclass(frozen=True)
class Stretch:
    """A stretch of time without a hold.

    Attributes
    ----------
    moments
        Numbers of its moments, shape (n,).
    span_ns
        First and last instant of what is looked at, nanoseconds: more than its moments.
    load
        Loads at its moments, shares of full load, shape (n,).
    """

    moments: NDArray[np.intp]
    span_ns: Span
    load: Floats


def stretches_of(
    expected: Expected, holds_ns: Sequence[Span], times_ns: Times
) -> tuple[Stretch, ...]:
    """Return the stretches that hold the moments `times_ns`, shape (t,), outside of the holds."""
    is_between = np.ones(len(times_ns), dtype=bool)
    for first_ns, last_ns in holds_ns:
        is_between &= (times_ns < first_ns) | (times_ns > last_ns)
    loads = expected.at(times_ns)
    return tuple(
        Stretch(moments, _span(expected, times_ns[moments]), loads[moments])
        for moments in _cut(times_ns, np.flatnonzero(is_between), loads)
    )


def _cut(times_ns: Times, between: NDArray[np.intp], shares: Floats) -> list[NDArray[np.intp]]:
    """Moments between holds, cut into stretches; `shares` are the loads at all moments."""
    if not between.size:
        return []
    breaks = [0]
    for place in range(1, len(between)):
        goes_on = between[place] == between[place - 1] + 1
        now, start = between[place], between[breaks[-1]]
        is_long = times_ns[now] - times_ns[start] >= STRETCH_NS
        if not goes_on or is_long or abs(shares[now] - shares[start]) > LOAD_SHARE:
            breaks.append(place)
    return np.split(between, breaks[1:])


def _span(expected: Expected, times_ns: Times) -> Span:
    first_ns, last_ns = int(times_ns[0]), int(times_ns[-1])
    before_ns, behind_ns = _overlap_ns(expected, first_ns, -1), _overlap_ns(expected, last_ns, 1)
    return first_ns - before_ns, last_ns + behind_ns


def _overlap_ns(expected: Expected, end_ns: int, side: int) -> int:
    """How much of a neighbour has nearly the load of the end of a stretch."""
    shares = expected.at([end_ns, *(end_ns + side * apart_ns for apart_ns in OVERLAPS_NS)])
    is_alike = np.abs(shares[1:] - shares[0]) <= LOAD_SHARE
    return OVERLAPS_NS[int(np.argmax(is_alike)) if is_alike.any() else -1]
