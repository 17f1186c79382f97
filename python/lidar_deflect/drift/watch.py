"""One cheap pass over a capture that watches the static surfaces of every lidar."""

from __future__ import annotations

from dataclasses import dataclass
from itertools import groupby
from typing import TYPE_CHECKING, Any

import numpy as np

from lidar_deflect import tables
from lidar_deflect.drift.cells import MIN_CELLS, Cells, Plane, Sums
from lidar_deflect.errors import MeasurementError
from lidar_deflect.measurement import unloaded
from lidar_deflect.network import surveyed_surfaces

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    import polars as pl
    from numpy.typing import NDArray

    from lidar_deflect.capture import Sweep
    from lidar_deflect.drift.change import Change
    from lidar_deflect.measurement import Inputs
    from lidar_deflect.network import Surface

    Floats = NDArray[np.float64]

WINDOW_NS = 3_000_000_000
SWEEPS = 10
"""Sweeps of a window that are added up, evenly; more cost time and tell little more."""

MARGIN_M = 15.0
"""A surface is watched this far beyond its outermost control point."""

GROUND_M = 30.0
"""Ground that was not surveyed is watched this far around a lidar."""

_PARTS = (("turn_mrad", 0), ("shift_mm", 3))


@dataclass(frozen=True)
class Seen:
    """What one lidar's window told."""

    lidar: str
    start_ns: int
    stop_ns: int
    change: Change


class _Window:
    """One lidar's window while it lasts."""

    def __init__(self, cells: Cells, number: int) -> None:
        self.number = number
        self._sums = Sums(cells)
        self._edges_ns: list[int] = []

    def add(self, sweep: Sweep) -> None:
        """Add a sweep, if it is one of those that are looked at."""
        every = max(1, round(WINDOW_NS / SWEEPS / max(1, sweep.end_ns - sweep.start_ns)))
        if sweep.index % every == 0:
            self._sums.add(sweep)
            self._edges_ns += [sweep.start_ns, sweep.end_ns]

    def close(self, lidar: str) -> Seen | None:
        """Return what it told, None where too little was seen."""
        change = self._sums.change()
        if change is None:
            return None
        return Seen(lidar, min(self._edges_ns), max(self._edges_ns), change)


@dataclass(frozen=True)
class Drift:
    """What watching the lidars gave.

    Attributes
    ----------
    table
        Table ``poses``.
    warnings
        Lidars that moved, when and by how much; lidars that cannot be watched.
    facts
        The same for machines.
    """

    table: pl.DataFrame
    warnings: tuple[str, ...]
    facts: Mapping[str, Any]


def watch(inputs: Inputs) -> Drift:
    """Watch every lidar from `start_ns` to `stop_ns` against the reference hold.

    Where these captures have no reference hold, the first window stands for it: a tripod that
    moved before is not found then.
    """
    cells = {lidar: _cells(inputs, lidar) for lidar in inputs.lidars}
    blind = [lidar for lidar, own in cells.items() if own is None or own.seen < MIN_CELLS]
    watched = {id: own for id, own in cells.items() if own is not None and id not in blind}
    seen = _pass(inputs, watched) if watched else []
    first_ns = inputs.capture.first_time_ns
    moves = [move for lidar in watched for move in _moves(lidar, seen, first_ns)]
    unseen = [f"lidar {id} sees no static surface, so it is not watched" for id in blind]
    return Drift(
        _table(seen, first_ns),
        (*(_said(move) for move in moves), *unseen),
        {
            "moved": moves,
            "followed": False,
            "not_watched": blind,
            "window_s": WINDOW_NS * 1e-9,
        },
    )


def _cells(inputs: Inputs, lidar: str) -> Cells | None:
    pose = inputs.calibration.pose(lidar).world_from_sensor
    cloud = inputs.clouds.get(lidar)
    if cloud is None:
        window = (inputs.start_ns, min(inputs.stop_ns, inputs.start_ns + WINDOW_NS))
        try:
            cloud = unloaded.collect(inputs.capture, lidar, window)
        except MeasurementError:
            return None
    planes = _planes(inputs, lidar)
    return Cells.of(cloud, pose, planes) if planes else None


def _planes(inputs: Inputs, lidar: str) -> list[Plane]:
    """Return the surveyed surfaces, else the level ground that the registration found."""
    surfaces = surveyed_surfaces(inputs.config)
    if surfaces:
        return [
            Plane(s.normal, float(s.normal @ s.origin_m), s.origin_m, _reach_m(s)) for s in surfaces
        ]
    pose = inputs.calibration.pose(lidar)
    height_m = pose.evidence.get("ground_height_m")
    if height_m is None:
        return []
    return [Plane(np.array([0.0, 1.0, 0.0]), float(height_m), pose.position_m, GROUND_M)]


def _reach_m(surface: Surface) -> float:
    away = np.linalg.norm(surface.points_m - surface.origin_m, axis=1)
    return float(away.max()) + MARGIN_M


def _pass(inputs: Inputs, cells: Mapping[str, Cells]) -> list[Seen]:
    """Add the sweeps of every window up, and estimate when it is over."""
    start_s, stop_s = (
        (edge - inputs.capture.first_time_ns) * 1e-9 for edge in (inputs.start_ns, inputs.stop_ns)
    )
    running: dict[str, _Window] = {}
    over: list[Seen | None] = []
    for sweep in inputs.capture.sweeps(list(cells), start_s=start_s, stop_s=stop_s):
        lidar, number = sweep.lidar, (sweep.start_ns - inputs.start_ns) // WINDOW_NS
        if lidar not in running or running[lidar].number != number:
            over.append(running[lidar].close(lidar) if lidar in running else None)
            running[lidar] = _Window(cells[lidar], number)
        running[lidar].add(sweep)
    over += [window.close(lidar) for lidar, window in running.items()]
    seen = [each for each in over if each is not None]
    return sorted(seen, key=lambda each: (each.start_ns, each.lidar))


def _table(seen: Sequence[Seen], first_ns: int) -> pl.DataFrame:
    middle_ns = np.array([(each.start_ns + each.stop_ns) // 2 for each in seen], dtype=np.int64)
    step = np.array([each.change.step for each in seen]).reshape(-1, 6) * 1e3
    variances = [np.diag(each.change.covariance) for each in seen]
    u = np.sqrt(np.array(variances).reshape(-1, 6)) * 1e3
    names = [f"{kind}{axis}" for kind in "rt" for axis in "xyz"]
    units = ["mrad"] * 3 + ["mm"] * 3
    columns: dict[str, Any] = {
        "time": middle_ns,
        "t_s": (middle_ns - first_ns) * 1e-9,
        "lidar": [each.lidar for each in seen],
        "moved": [each.change.moved for each in seen],
    }
    for k, (name, unit) in enumerate(zip(names, units, strict=True)):
        columns[f"{name}_{unit}"], columns[f"u{name}_{unit}"] = step[:, k], u[:, k]
    return tables.build("poses", columns)


def _moves(lidar: str, seen: Sequence[Seen], first_ns: int) -> list[dict[str, Any]]:
    """Return the spans over which one lidar is not where it was calibrated."""
    own = [each for each in seen if each.lidar == lidar]
    numbers = range(len(own))
    moved = [list(span) for is_, span in groupby(numbers, lambda k: own[k].change.moved) if is_]
    return [_move(own, span, first_ns) for span in moved]


def _move(own: Sequence[Seen], span: Sequence[int], first_ns: int) -> dict[str, Any]:
    """Describe one span; in its first window the lidar may have stood half of the time."""
    whole = [own[k].change for k in (span[1:] or span)]
    step = np.median([change.step for change in whole], axis=0)
    variances = np.median([np.diag(change.covariance) for change in whole], axis=0)
    at_ns = _instant_ns(own[max(0, span[0] - 1) : span[0] + 1], step)
    return {
        "lidar": own[0].lidar,
        "at_s": round((at_ns - first_ns) * 1e-9, 1),
        "until_s": round((own[span[-1]].stop_ns - first_ns) * 1e-9, 1),
        "turn_mrad": [round(1e3 * float(value), 3) for value in step[:3]],
        "shift_mm": [round(1e3 * float(value), 2) for value in step[3:]],
        "u": [round(1e3 * float(value), 3) for value in np.sqrt(variances)],
    }


def _instant_ns(windows: Sequence[Seen], step: Floats) -> int:
    """When a lidar moved by `step`: how much of it the windows around that show tells it."""
    moved_ns = 0.0
    for window in windows:
        weight = np.linalg.solve(window.change.covariance, step)
        share = float(weight @ window.change.step) / float(weight @ step)
        moved_ns += min(1.0, max(0.0, share)) * (window.stop_ns - window.start_ns)
    return max(windows[0].start_ns, windows[-1].stop_ns - round(moved_ns))


def _said(move: Mapping[str, Any]) -> str:
    turn, shift = (_along(move[name], move["u"][k:]) for name, k in _PARTS)
    return (
        f"lidar {move['lidar']} moved at about {move['at_s']:.1f} s: until {move['until_s']:.1f} s "
        f"its static surfaces show a turn of {turn} mrad and a shift of {shift} mm since the "
        "reference (world axes, k = 2); what it measured then is not corrected for it"
    )


def _along(values: Sequence[float], u: Sequence[float]) -> str:
    axes = zip("xyz", values, u, strict=False)
    return ", ".join(f"{axis} {value:+.2f} ± {2 * own:.2f}" for axis, value, own in axes)
