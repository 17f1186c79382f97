"""One cheap pass over a capture that watches the static surfaces of every lidar."""

from __future__ import annotations

from concurrent.futures import Future, ThreadPoolExecutor
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from lidar_deflect import _native, memory
from lidar_deflect.drift import told
from lidar_deflect.drift.cells import GRID, MIN_CELLS, Cells, Plane
from lidar_deflect.drift.echoes import Echoes, Kept
from lidar_deflect.drift.instant import instant_ns
from lidar_deflect.drift.move import Move
from lidar_deflect.drift.standing import Standing, found_again
from lidar_deflect.errors import MeasurementError
from lidar_deflect.measurement import unloaded
from lidar_deflect.network import surveyed_surfaces

if TYPE_CHECKING:
    from collections.abc import Mapping

    import polars as pl
    from numpy.typing import NDArray

    from lidar_deflect.drift.standing import Stay
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

REST_NS = 500_000_000
"""A pose is told from no less than this."""


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
    moves
        New poses that the measurement is to use, in order of time; none where drift is marked only.
    unsure
        Lidar and span of time, nanoseconds, in which it does not stand where it is taken to stand;
        None for a lidar whose echoes are left out while it moves.
    survey
        First pass over the frames that were planned, if it is of use: made in the same reading,
        with every tripod where it stood at first.
    """

    table: pl.DataFrame
    warnings: tuple[str, ...]
    facts: Mapping[str, Any]
    moves: tuple[Move, ...] = ()
    unsure: tuple[tuple[str | None, int, int], ...] = ()
    survey: _native.DistancePass | None = None


def static_cells(inputs: Inputs) -> Mapping[str, Cells | None]:
    """Find the static cells of every lidar in the reference hold; None without a surface.

    Where these captures have no reference hold, the first window stands for it: a tripod that
    moved before is not found then.
    """
    return {lidar: _cells(inputs, lidar) for lidar in inputs.lidars}


def watch(
    inputs: Inputs,
    cells: Mapping[str, Cells | None] | None = None,
    frames: _native.FramePlan | None = None,
) -> Drift:
    """Watch every lidar from `start_ns` to `stop_ns`.

    Parameters
    ----------
    cells
        Static cells of every lidar, where they are known.
    frames
        Frames to make in the same reading.
    """
    cells = static_cells(inputs) if cells is None else cells
    blind = [lidar for lidar, own in cells.items() if own is None or own.seen < MIN_CELLS]
    watched = {
        id: Standing(id, own) for id, own in cells.items() if own is not None and id not in blind
    }
    survey = _pass(inputs, watched, frames) if watched else None
    moves = [move for lidar, own in watched.items() for move in _moves(inputs, lidar, own)]
    follows = inputs.config.calibrate.drift == "follow"
    windows = [window for own in watched.values() for window in own.windows]
    poses = {lidar: own.cells.pose for lidar, own in watched.items()}
    span_ns = (inputs.capture.first_time_ns, inputs.stop_ns)
    told_ = told.told(windows, moves, poses, span_ns, follows=follows)
    unseen = tuple(f"lidar {id} sees no static surface, so it is not watched" for id in blind)
    return Drift(
        told_.table,
        (*told_.warnings, *unseen),
        told_.facts | {"not_watched": blind, "window_s": WINDOW_NS * 1e-9},
        tuple(sorted(moves, key=lambda move: move.from_ns)) if follows else (),
        told_.unsure,
        None if follows and moves else survey,
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


def _pass(
    inputs: Inputs, watched: Mapping[str, Standing], frames: _native.FramePlan | None
) -> _native.DistancePass | None:
    """Gather some sweeps of every window, and look at it when it is over."""
    standings = list(watched.values())
    windows = _windows(inputs, watched, frames)
    listener = None if frames is None else inputs.listener("survey")
    looks: list[Future[None]] = []
    with memory.own_pages(), ThreadPoolExecutor(1) as beside:  # the next windows are read meanwhile
        while (ready := windows.advance(inputs.threads, listener)) is not None:
            if ready:
                _wait_for(looks)
            while ready:
                place, cell, xyz, from_ns, to_ns = ready.pop(0)
                echoes = Echoes.thinned(cell, xyz)
                looks.append(beside.submit(standings[place].look, echoes, from_ns, to_ns))
        _wait_for(looks)
    for standing in standings:
        standing.finish()
    return windows.survey() if isinstance(windows, _native.WatchedPass) else None


def _wait_for(looks: list[Future[None]]) -> None:
    while looks:
        looks.pop(0).result()


def _windows(
    inputs: Inputs, watched: Mapping[str, Standing], frames: _native.FramePlan | None
) -> _native.CellPass | _native.WatchedPass:
    numbers = inputs.capture.numbers(list(watched))
    every = [_one_in(inputs, lidar) for lidar in watched]
    cells = [standing.cells.plane >= 0 for standing in watched.values()]
    if frames is not None:
        return _native.WatchedPass(
            frames, lidars=numbers, every=every, watched=cells, grid=GRID, window_ns=WINDOW_NS
        )
    return _native.CellPass(
        inputs.capture.native,
        lidars=numbers,
        every=every,
        watched=cells,
        grid=GRID,
        start_ns=inputs.start_ns,
        stop_ns=inputs.stop_ns,
        window_ns=WINDOW_NS,
    )


def _one_in(inputs: Inputs, lidar: str) -> int:
    """One sweep in so many makes `SWEEPS` of them in a window."""
    rpm = next(s.rpm for s in inputs.capture.streams if s.matches(lidar))
    turn_ns = 60e9 / rpm if rpm else inputs.period_ns
    return max(1, round(WINDOW_NS / SWEEPS / turn_ns))


def _seconds(inputs: Inputs, span_ns: tuple[int, int]) -> tuple[float, float]:
    first = inputs.capture.first_time_ns
    return (span_ns[0] - first) * 1e-9, (span_ns[1] - first) * 1e-9


def _moves(inputs: Inputs, lidar: str, standing: Standing) -> list[Move]:
    """Tell when a lidar came to each of its stays, from all its sweeps around that."""
    moves = []
    for old, new in zip(standing.stays, standing.stays[1:], strict=False):
        move = _move(inputs, lidar, standing.cells, old, new)
        if move is not None:
            moves.append(move)
    return moves


def _move(inputs: Inputs, lidar: str, cells: Cells, old: Stay, new: Stay) -> Move | None:
    start_s, stop_s = _seconds(inputs, new.search_ns)
    echoes = Kept.read(inputs.capture.sweeps(lidar, start_s=start_s, stop_s=stop_s), cells)
    if echoes is None or not len(echoes.time_ns):
        return None
    left_ns, from_ns = instant_ns(cells, echoes, old.pose, new.pose)
    pose, covariance = new.pose, new.covariance
    if not new.is_sure:  # its only window may hold echoes from before the knock
        for _ in range(2):
            if new.search_ns[1] - from_ns < REST_NS:
                return None
            found = found_again(cells, echoes.since(from_ns), pose)
            if found is None:
                return None
            pose, covariance, _ = found
            left_ns, from_ns = instant_ns(cells, echoes, old.pose, pose)
    return Move(lidar, left_ns, from_ns, pose, covariance)
