"""What the lidars saw of the blade: which spans of holds are looked at, and the reading of them."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from lidar_deflect import _native

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence

    from lidar_deflect.holds import Hold
    from lidar_deflect.measurement.inputs import Inputs
    from lidar_deflect.measurement.plan import Plan

    Span = tuple[int, int]

MARGIN_NS = 150_000_000
"""A hold begins so long after the load says so, and ends so long before: a ramp moves fast."""
SHORTEST_NS = 700_000_000
"""A shorter hold is no hold."""
LONGEST_NS = 6_000_000_000
"""More of a hold adds time, not accuracy."""


def spans_of(inputs: Inputs, holds: Sequence[Hold]) -> list[tuple[Hold, Span]]:
    """Return holds with the stretch of each that is used, within the limits of the measurement."""
    spans = []
    for hold in holds:
        start = max(hold.from_ns + MARGIN_NS, inputs.start_ns)
        stop = min(hold.to_ns - MARGIN_NS, inputs.stop_ns, start + LONGEST_NS)
        if stop - start >= SHORTEST_NS:
            spans.append((hold, (start, stop)))
    return spans


def reading(inputs: Inputs, plan: Plan, windows_ns: Sequence[Span]) -> _native.BeamFeed:
    """Read what the lidars saw of the blade, window by window in the order of their starts."""
    return _native.BeamFeed(
        inputs.capture.native,
        lidars=inputs.capture.numbers(inputs.lidars),
        poses=inputs.poses,
        cut_azimuth_deg=plan.cuts_deg(inputs.lidars),
        box_m=np.ascontiguousarray(plan.box_m),
        windows_ns=list(windows_ns),
        moves=inputs.native_moves,
        threads=inputs.threads,
    )


def seen_in(inputs: Inputs, plan: Plan, spans_ns: Sequence[Span]) -> list[_native.BeamSeen]:
    """Return what was seen in spans that may come in any order, read ahead or now."""
    known = {} if inputs.ahead is None else inputs.ahead()
    if all(span_ns in known for span_ns in spans_ns):
        return [known[span_ns] for span_ns in spans_ns]
    return read_now(inputs, plan, spans_ns, inputs.listener("read"))


def read_now(
    inputs: Inputs,
    plan: Plan,
    spans_ns: Sequence[Span],
    listener: Callable[[int, int], None] | None,
) -> list[_native.BeamSeen]:
    """Return what was seen in spans; `listener` is told how much of the capture was read."""
    order = sorted(range(len(spans_ns)), key=lambda place: spans_ns[place])
    feed = reading(inputs, plan, [spans_ns[place] for place in order])
    found = dict(zip(order, feed.take(len(order), listener), strict=True))
    return [found[place] for place in range(len(order))]
