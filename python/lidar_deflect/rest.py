"""The unloaded hold of a test: what is taken of it, and no more of it kept than that.

All echoes of a hold are most of the memory of a measurement. Where the poses are given, the paper's
method needs of each lidar a few numbers and its static cells, so the hold is read for some lidars
at a time, and let go.
"""

from __future__ import annotations

from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

from lidar_deflect import drift, memory
from lidar_deflect.calibrate import calibrate
from lidar_deflect.calibration import with_reference
from lidar_deflect.measurement import beam, paper
from lidar_deflect.measurement.plan import HoldView, plan_of_views

if TYPE_CHECKING:
    from collections.abc import Iterator, Mapping, Sequence
    from concurrent.futures import Executor

    from lidar_deflect.calibration import Calibration
    from lidar_deflect.drift.cells import Cells
    from lidar_deflect.measurement import Inputs
    from lidar_deflect.measurement.unloaded import HoldCloud
    from lidar_deflect.opened import OpenedTest

    Window = tuple[int, int]

ECHOES = 1_300_000
"""Holds of several lidars are read at once where they have no more than so many echoes together."""


@dataclass(frozen=True)
class Rest:
    """What a method starts from, and the static cells of every lidar.

    Attributes
    ----------
    inputs
        With poses and plan; with all echoes of the hold for the beam method alone.
    cells
        None for a lidar that sees no surface.
    """

    inputs: Inputs
    cells: Mapping[str, Cells | None]

    @classmethod
    def of(
        cls,
        opened: OpenedTest,
        known: Calibration | None,
        method: str,
        limits: Window,
        rate_hz: float | None,
    ) -> Rest:
        """Find the unloaded hold and take what is needed of it; calibrate where that is left."""
        window = opened.unloaded_or_kept_ns(known)
        is_inside = window is not None and limits[0] <= window[0] < window[1] <= limits[1]
        if known is not None and window is not None and is_inside and method == "paper":
            inputs = opened.inputs(known, {}, window, limits=limits, rate_hz=rate_hz)
            return cls._of_some_at_a_time(opened, inputs, window)
        clouds = opened.hold(window) if window else {}
        known = known or calibrate(opened.config, clouds)
        if window and not is_inside:
            known = with_unloaded_state(opened, known, clouds, window)
            clouds, window = {}, None
        inputs = opened.inputs(known, clouds, window, limits=limits, rate_hz=rate_hz)
        with ThreadPoolExecutor(1) as beside:
            plan = beside.submit(paper.plan_of, inputs)
            cells = drift.static_cells(inputs)
            inputs = replace(inputs, plan=plan.result())
        return cls(inputs if method == "beam" else replace(inputs, clouds={}), cells)

    @classmethod
    def _of_some_at_a_time(cls, opened: OpenedTest, inputs: Inputs, window: Window) -> Rest:
        views: dict[str, HoldView] = {}
        cells: dict[str, Cells | None] = {}
        with memory.own_pages(), ThreadPoolExecutor(opened.threads) as side_by_side:
            for clouds in _some_at_a_time(opened, window):
                for lidar, (view, own) in _looked_at(inputs, clouds, side_by_side).items():
                    views[lidar], cells[lidar] = view, own
                del clouds
        return cls(replace(inputs, plan=plan_of_views(inputs.config, views)), cells)


def _some_at_a_time(opened: OpenedTest, window: Window) -> Iterator[Mapping[str, HoldCloud]]:
    """Gather the hold of lidar after lidar, of several at once where it has few echoes."""
    waiting = list(opened.lidars)
    while waiting:
        together = [waiting.pop(0)]
        while waiting and _echoes(opened, [*together, waiting[0]], window) < ECHOES:
            together.append(waiting.pop(0))
        yield opened.hold(window, together, with_intensity=False)


def _echoes(opened: OpenedTest, lidars: Sequence[str], window: Window) -> float:
    """About how many echoes lidars have in a stretch of time."""
    whole_ns = max(1, opened.capture.last_time_ns - opened.capture.first_time_ns)
    streams = opened.capture.streams
    points = sum(stream.points for stream in streams if any(map(stream.matches, lidars)))
    return points * (window[1] - window[0]) / whole_ns


def _looked_at(
    inputs: Inputs, clouds: Mapping[str, HoldCloud], side_by_side: Executor
) -> dict[str, tuple[HoldView, Cells | None]]:
    views = {lidar: side_by_side.submit(_view, inputs, lidar, own) for lidar, own in clouds.items()}
    cells = {
        lidar: side_by_side.submit(_cells, inputs, lidar, own) for lidar, own in clouds.items()
    }
    return {lidar: (views[lidar].result(), cells[lidar].result()) for lidar in clouds}


def _view(inputs: Inputs, lidar: str, cloud: HoldCloud) -> HoldView:
    return HoldView.of(inputs.config, inputs.calibration.pose(lidar), cloud)


def _cells(inputs: Inputs, lidar: str, cloud: HoldCloud) -> Cells | None:
    return drift.static_cells(replace(inputs, lidars=(lidar,), clouds={lidar: cloud}))[lidar]


def with_unloaded_state(
    opened: OpenedTest,
    calibration: Calibration,
    clouds: Mapping[str, HoldCloud],
    window_ns: tuple[int, int],
) -> Calibration:
    """Return the calibration with the state of the unloaded blade, so that it serves other runs."""
    inputs = opened.inputs(calibration, clouds, window_ns, limits=window_ns)
    known = with_reference(calibration, "paper", paper.calibrated_reference(inputs))
    if opened.config.measure.method != "beam":
        return known
    inputs = opened.inputs(known, clouds, window_ns, limits=window_ns)
    return with_reference(known, "beam", beam.calibrated_reference(inputs))
