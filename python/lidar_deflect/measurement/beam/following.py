"""States at every moment: in holds from the adjustment itself, between them stretch by stretch."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from lidar_deflect.measurement.beam import clocks
from lidar_deflect.measurement.beam.adjustment import by_lidar, reading
from lidar_deflect.measurement.beam.schedule import LAST
from lidar_deflect.measurement.beam.uncertainty import Spreads

if TYPE_CHECKING:
    from collections.abc import Iterator, Mapping, Sequence

    from numpy.typing import NDArray

    from lidar_deflect._native import BeamSeen
    from lidar_deflect.measurement.beam.adjustment import Solved
    from lidar_deflect.measurement.beam.clocks import ClockOffsets
    from lidar_deflect.measurement.beam.expected import Expected
    from lidar_deflect.measurement.beam.stretches import Span, Stretch
    from lidar_deflect.measurement.inputs import Inputs

    Floats = NDArray[np.float64]
    Times = NDArray[np.int64]

GATES = ((0.5, 0.5), (0.2, 0.2), (0.1, 0.1), LAST)
FITTING = 0.8
"""A stretch of which fewer echoes than this share lie on the blade was not found."""
SWAY_M = (0.15, 0.15, 0.04, 0.04)
"""Standard deviations of the sway in its first mode in x and y and in its second, at the tip ..."""
SWING_M = (4.0, 4.0, 0.5, 0.5)
"""... and of a blade that is swung."""
SWING_GATES = ((6.0, 5.0), (6.0, 5.0), (3.0, 3.0), (3.0, 2.0), (1.5, 1.5), *GATES)
"""The swing is as far away as the blade swings: the search begins wide."""
CHUNK = 48
"""Stretches that are worked on between two looks at Ctrl-C."""


@dataclass(frozen=True)
class Followed:
    """States of sections over time.

    Attributes
    ----------
    values
        x, y, z in metres and twist change in rad, shape (t, s, 4); NaN where nothing was found.
    spreads
        How well they are known.
    used
        Echoes that counted near each moment, shape (t, lidars).
    in_hold
        Number of the hold that each moment lies in, shape (t,); -1 between holds.
    points
        Columns of echoes that counted, to look at.
    clocks
        Offsets of the clocks of all stands of the lidars.
    """

    values: Floats
    spreads: Spreads
    used: NDArray[np.uint32]
    in_hold: NDArray[np.int64]
    points: Mapping[str, Any]
    clocks: ClockOffsets


def follow(
    inputs: Inputs,
    expected: Expected,
    solved: Solved,
    stretches: Sequence[Stretch],
    times_ns: Times,
    counts: tuple[int, int],
) -> Followed:
    """Find the state of every section at every moment, in the holds and in `stretches` between.

    `counts` are those of the sections and of the stations of the blade line behind them; in a hold,
    and in a stretch between holds, the latter have the spread of the middle instant.
    """
    shape = (len(times_ns), sum(counts), 4)
    values, spreads = np.full(shape, np.nan), Spreads.empty(*shape[:2])
    used = np.zeros((len(times_ns), len(inputs.lidars)), dtype=np.uint32)
    in_hold = np.full(len(times_ns), -1, dtype=np.int64)
    half_ns = round(0.5e9 / inputs.rate_hz)
    points: list[Mapping[str, Any]] = []
    for number, (span, told) in enumerate(zip(solved.spans_ns, solved.told["holds"], strict=True)):
        inside = np.flatnonzero((times_ns >= span[0]) & (times_ns <= span[1]))
        found, spread = solved.native.states(number, times_ns[inside].tolist(), counts[0])
        values[inside] = found.reshape(len(inside), *shape[1:])
        spreads.put(inside, spread)
        used[inside] = _count(told, times_ns[inside], half_ns, len(inputs.lidars))
        in_hold[inside] = number
        points.append(told)
    listener = inputs.listener("measure")
    offsets = _clocks(inputs, expected, solved, stretches)
    chunks = _seen(inputs, solved, stretches)
    for start in range(0, len(stretches), CHUNK):
        part = stretches[start : start + CHUNK]
        moments = [times_ns[stretch.moments] for stretch in part]
        states = _between(expected, solved, next(chunks), part, moments)
        for stretch, result in zip(part, states, strict=True):
            if result is None or not _fits(result[2]):
                continue
            inside = stretch.moments
            told = by_lidar(result[2], inputs)
            values[inside] = result[0].reshape(len(inside), *shape[1:])
            spreads.put(inside, result[1])
            used[inside] = _count(told, times_ns[inside], half_ns, len(inputs.lidars))
            points.append(told)
        if listener:
            listener(start + len(part), len(stretches))
    return Followed(values, spreads, used, in_hold, _joined(points), offsets)


def few(stretches: Sequence[Stretch]) -> Sequence[Span]:
    """Return the spans that may be read ahead, with the holds: all, unless they are too many."""
    return [stretch.span_ns for stretch in stretches] if len(stretches) <= CHUNK else []


def _seen(
    inputs: Inputs, solved: Solved, stretches: Sequence[Stretch]
) -> Iterator[Sequence[BeamSeen]]:
    """Yield what was seen in the stretches, chunk by chunk."""
    if len(solved.ahead) == len(stretches):
        yield solved.ahead
        return
    feed = reading(inputs, solved.plan, [stretch.span_ns for stretch in stretches])
    for start in range(0, len(stretches), CHUNK):
        yield feed.take(len(stretches[start : start + CHUNK]), inputs.listener("read"))


def _clocks(
    inputs: Inputs, expected: Expected, solved: Solved, stretches: Sequence[Stretch]
) -> ClockOffsets:
    """Find the offsets of the lidars' clocks in some stretches, for all that follow."""
    kinds, native = solved.clocks, solved.native
    native.set_clocks([0.0] * len(kinds), clocks.unknown(kinds).tolist(), tied=True)
    telling = clocks.telling([stretch.load for stretch in stretches], swings=expected.swings)
    part = [stretches[place] for place in telling]
    if len(solved.ahead) == len(stretches):
        seen = [solved.ahead[place] for place in telling]
    else:
        spans = [stretch.span_ns for stretch in part]
        seen = reading(inputs, solved.plan, spans).take(len(spans)) if spans else []
    found = _between(expected, solved, seen, part, [np.array([], dtype=np.int64)] * len(part))
    news = [result[2]["clocks"] for result in found if result is not None and _fits(result[2])]
    offsets = clocks.combined(kinds, [one for one in news if one is not None])
    native.set_clocks(offsets.offset_s.tolist(), offsets.deviation_s.tolist(), tied=False)
    return offsets


def _between(
    expected: Expected,
    solved: Solved,
    seen: Sequence[BeamSeen],
    stretches: Sequence[Stretch],
    moments: Sequence[Times],
) -> list[Any]:
    native, spans = solved.native, [stretch.span_ns for stretch in stretches]
    gates, sway_m = (SWING_GATES, SWING_M) if expected.swings else (GATES, SWAY_M)
    return native.follow(
        seen,
        spans,
        [expected.at(native.load_knots(span)).tolist() for span in spans],
        [times_ns.tolist() for times_ns in moments],
        list(solved.shares),
        list(gates),
        list(sway_m),
    )


def _fits(told: Mapping[str, Any]) -> bool:
    """Whether most of what met the blade of a stretch lies on it."""
    counted, rejected = len(told["s_m"]), len(told["rejected"]["s_m"])
    return counted > FITTING * (counted + rejected)


def _count(
    told: Mapping[str, Any], times_ns: Times, half_ns: int, lidars: int
) -> NDArray[np.uint32]:
    """Echoes that counted within half a period of each moment, by lidar."""
    counts = np.zeros((len(times_ns), lidars), dtype=np.uint32)
    for lidar in range(lidars):
        of_lidar = np.sort(told["time_ns"][told["lidar"] == lidar])
        counts[:, lidar] = np.searchsorted(of_lidar, times_ns + half_ns) - np.searchsorted(
            of_lidar, times_ns - half_ns
        )
    return counts


def _joined(parts: Sequence[Mapping[str, Any]]) -> Mapping[str, Any]:
    names = ("time_ns", "lidar", "ring", "s_m", "residual_m", "chord", "xyz_m")
    return {name: np.concatenate([part[name] for part in parts]) for name in names}
