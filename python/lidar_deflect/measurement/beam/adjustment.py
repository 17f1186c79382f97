"""Unloaded and loaded holds in one adjustment, from a start metres away to the last micrometre."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from lidar_deflect import _native
from lidar_deflect.errors import MeasurementError
from lidar_deflect.measurement import paper
from lidar_deflect.measurement.beam.clocks import unknown
from lidar_deflect.measurement.beam.drawing import Drawing, drawing_of
from lidar_deflect.measurement.beam.rig import RigPrior, rig_prior
from lidar_deflect.measurement.beam.schedule import DRAWN, SETTLED, UNDRAWN

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    from numpy.typing import NDArray

    from lidar_deflect.holds import Hold
    from lidar_deflect.measurement.beam.expected import Expected
    from lidar_deflect.measurement.beam.schedule import Schedule
    from lidar_deflect.measurement.inputs import Inputs
    from lidar_deflect.measurement.plan import Plan

    Floats = NDArray[np.float64]

MARGIN_NS = 150_000_000
"""A hold begins so long after the load says so, and ends so long before: a ramp moves fast."""
SHORTEST_NS = 700_000_000
"""A shorter hold is no hold."""
LONGEST_NS = 6_000_000_000
"""More of a hold adds time, not accuracy."""
SEEN_SHARE = 0.45
"""The surface is free to differ from the drawing outboard of this share of the length."""
ECHOES, ECHOES_GENERIC = 8_000, 20_000
"""Echoes of a hold that are used, evenly thinned, with a drawing and without: what they have in
common, surface and range errors, does not shrink with their number as their noise does."""

NOISE_M, SURFACE_M, EDGE_RAD = 0.015, 0.002, 1e-4


@dataclass(frozen=True)
class Solved:
    """What the holds told.

    Attributes
    ----------
    native
        The adjustment, from which states follow.
    holds, spans_ns, shares
        Holds that took part, least load first, the stretches of them that were used, and their
        loads as shares of full load.
    told
        What became of the data in the last step.
    steps
        Steps it took.
    source
        Where the blade's shape began: ``drawing`` or ``generic``.
    plan
        Where the blade is looked for.
    clocks
        What holds the clock of each stand of a lidar.
    ahead
        What was seen in the spans that were read with the holds.
    """

    native: _native.BeamAdjustment
    holds: tuple[Hold, ...]
    spans_ns: tuple[tuple[int, int], ...]
    shares: tuple[float, ...]
    told: Mapping[str, Any]
    steps: int
    source: str
    plan: Plan
    clocks: tuple[str, ...]
    ahead: Sequence[_native.BeamSeen]


def spans_of(inputs: Inputs, holds: Sequence[Hold]) -> list[tuple[Hold, tuple[int, int]]]:
    """Return holds with the stretch of each that is used, within the limits of the measurement."""
    spans = []
    for hold in holds:
        start = max(hold.from_ns + MARGIN_NS, inputs.start_ns)
        stop = min(hold.to_ns - MARGIN_NS, inputs.stop_ns, start + LONGEST_NS)
        if stop - start >= SHORTEST_NS:
            spans.append((hold, (start, stop)))
    return spans


def reading(inputs: Inputs, plan: Plan, windows_ns: Sequence[tuple[int, int]]) -> _native.BeamFeed:
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


def _seen_in(
    inputs: Inputs, plan: Plan, spans_ns: Sequence[tuple[int, int]]
) -> list[_native.BeamSeen]:
    """Return what was seen in spans that may come in any order."""
    order = sorted(range(len(spans_ns)), key=lambda place: spans_ns[place])
    feed = reading(inputs, plan, [spans_ns[place] for place in order])
    found = dict(zip(order, feed.take(len(order), inputs.listener("read")), strict=True))
    return [found[place] for place in range(len(order))]


def solve(inputs: Inputs, expected: Expected, ahead_ns: Sequence[tuple[int, int]] = ()) -> Solved:
    """Adjust all holds together; `ahead_ns` are spans that are wanted later, read with them.

    Raises
    ------
    MeasurementError
        If there is no hold, or the blade is not found in one.
    """
    used = spans_of(inputs, expected.holds)
    if not used:
        raise MeasurementError(
            "the load never stands still for long enough",
            code="measurement.no_hold",
            hint="see the load channel; a hold lasts a second or more",
        )
    holds, spans = zip(*used, strict=True)
    shares = tuple(expected.hold_share(hold) for hold in holds)
    order = np.argsort([abs(share) for share in shares], kind="stable")
    holds, spans = tuple(holds[i] for i in order), tuple(spans[i] for i in order)
    shares = tuple(shares[i] for i in order)
    drawing = drawing_of(inputs)
    plan = paper.plan_of(inputs)
    rig = rig_prior(inputs)
    seen = _seen_in(inputs, plan, [*spans, *ahead_ns])
    ahead = seen[len(spans) :]
    native = _started(inputs, drawing, rig, expected, seen[: len(spans)], spans, shares)
    schedule = UNDRAWN if drawing.source == "generic" else DRAWN
    told, steps = _settle(native, inputs, schedule)
    clocks = tuple(rig.clocks)
    return Solved(native, holds, spans, shares, told, steps, drawing.source, plan, clocks, ahead)


def _started(
    inputs: Inputs,
    drawing: Drawing,
    rig: RigPrior,
    expected: Expected,
    seen: Sequence[_native.BeamSeen],
    spans: Sequence[tuple[int, int]],
    shares: Sequence[float],
) -> _native.BeamAdjustment:
    forces = drawing.blade.forces_for(
        expected.direction, expected.s_m.tolist(), expected.deflection_m.tolist()
    )
    if forces is None:
        raise MeasurementError(
            "no load bends the drawing as far as predicted",
            code="measurement.no_start",
            hint="check [prediction] against the stiffness of the geometry",
        )
    full_n = forces[:, None] * expected.direction
    return _native.BeamAdjustment(
        drawing.blade,
        seen,
        spans_ns=list(spans),
        forces_n=np.array(shares)[:, None, None] * full_n,
        full_n=full_n,
        poses=rig.poses,
        channels=rig.channels,
        clock_s=unknown(rig.clocks).tolist(),
        rig_prior=rig.values,
        rig_covariance=rig.covariance,
        from_m=SEEN_SHARE * inputs.config.blade.length_m,
        trust=drawing.trust,
        shape_trust=drawing.shape_trust,
        noise_m=NOISE_M,
        surface_m=SURFACE_M,
        edge_rad=EDGE_RAD,
        echoes=ECHOES_GENERIC if drawing.source == "generic" else ECHOES,
        threads=inputs.threads,
    )


def _settle(
    native: _native.BeamAdjustment, inputs: Inputs, schedule: Schedule
) -> tuple[Mapping[str, Any], int]:
    """Bring the blade nearer stage by stage, then until nothing moves any more."""
    listener = inputs.listener("adjust")
    stages, steps, tries = len(schedule.first), 0, 0
    stage, last = 0, stages + schedule.more
    told: dict[str, Any] = {"largest": np.inf}
    while stage < stages or (told["largest"] > SETTLED and stage < last):
        told = native.step(*schedule.at(stage))
        steps, tries = steps + 1, tries + 1
        if schedule.is_over(stage, tries, told["moved_m"]):
            stage, tries = schedule.after(stage, told["moved_m"]), 0
        if listener:
            listener(stage, last)
    if listener:
        listener(last, last)
    return told | {"holds": [by_lidar(hold, inputs) for hold in native.told()]}, steps


def by_lidar(told: Mapping[str, Any], inputs: Inputs) -> Mapping[str, Any]:
    """Give what became of the data by number of the lidar instead of that of its stand."""
    of = inputs.stands.astype(np.uint32)
    met = {"lidar": of[told["lidar"]]}
    rejected = {"lidar": of[told["rejected"]["lidar"]]}
    return {**told, **met, "rejected": {**told["rejected"], **rejected}}
