"""How the blade moved, from the echoes of one lidar, each with its own instant.

States stand for the turn of a lidar that is nearest, and are off by up to half a turn. What a clock
is held against should not be.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from collections.abc import Iterator

    from numpy.typing import NDArray

    from lidar_deflect.calibration import Calibration, Pose
    from lidar_deflect.capture import Capture, Sweep
    from lidar_deflect.measurement.states import States

    Floats = NDArray[np.float64]
    Times = NDArray[np.int64]

REACH_M = 3.0
"""Echoes this near to the measured line of the blade count; ground and stand are farther."""

_FEWEST = 3
_MOST_TRIED = 50


def blade_motion(
    capture: Capture, calibration: Calibration, states: States
) -> tuple[Times, Floats]:
    """Follow the blade through the echoes of the lidar that sees most of it.

    On every turn, of one laser: the mean of its echoes on the blade along the direction in which
    the blade moves most, and the mean of their instants.

    Returns
    -------
    tuple
        Instants, shape (n,), nanoseconds; place along the motion, shape (n,), metres. Empty where
        no laser follows the blade.
    """
    pose = _busiest(calibration, states)
    known = np.isfinite(states.position_m).all(axis=(1, 2))
    if pose is None or known.sum() < _FEWEST:
        return np.empty(0, dtype=np.int64), np.empty(0)
    line = _Line(states.time_ns[known], states.position_m[known], states.s_m)
    cut_deg = _away_from_blade_deg(capture, pose, line)
    sweeps = capture.sweeps(pose.id, cut_azimuth_deg=cut_deg)
    rows = [row for sweep in sweeps for row in _lasers(sweep, pose, line)]
    if not rows:
        return np.empty(0, dtype=np.int64), np.empty(0)
    ring, time_ns, place = (np.array(column) for column in zip(*rows, strict=True))
    commonest = np.bincount(ring).argmax()
    own = ring == commonest
    order = np.argsort(time_ns[own], kind="stable")
    return time_ns[own][order].astype(np.int64), place[own][order]


def _away_from_blade_deg(capture: Capture, pose: Pose, line: _Line) -> float:
    """Return the azimuth opposite of the blade, so that no turn is cut within it."""
    for count, sweep in enumerate(capture.sweeps(pose.id)):
        near = line.near(_world(sweep, pose), sweep.start_ns)
        if near.any():
            azimuth = np.radians(sweep.azimuth_deg[near].astype(np.float64))
            middle = np.degrees(np.arctan2(np.sin(azimuth).mean(), np.cos(azimuth).mean()))
            return float((middle + 180.0) % 360.0)
        if count > _MOST_TRIED:
            break
    return 0.0


def _world(sweep: Sweep, pose: Pose) -> Floats:
    turn = pose.world_from_sensor[:3, :3]
    return np.asarray(np.asarray(sweep.xyz, dtype=np.float64) @ turn.T + pose.position_m)


def _busiest(calibration: Calibration, states: States) -> Pose | None:
    if not states.blade_points.size:
        return None
    return calibration.poses[int(np.argmax(states.blade_points.sum(axis=0)))]


class _Line:
    """The measured line through the sections, and the direction in which it moves most."""

    def __init__(self, time_ns: Times, position_m: Floats, s_m: Floats) -> None:
        order = np.argsort(s_m)
        self._time_ns, self._points = time_ns, position_m[:, order]
        outer = self._points[:, -1] - self._points[:, -1].mean(axis=0)
        self.direction: Floats = np.linalg.svd(outer, full_matrices=False)[2][0]

    def near(self, xyz: Floats, time_ns: int) -> NDArray[np.bool_]:
        """Tell which points are on or near the blade at a moment, shape (n,)."""
        line = self._points[int(np.argmin(np.abs(self._time_ns - time_ns)))]
        z = line[:, 2]
        if len(z) == 1:
            return np.asarray(np.linalg.norm(xyz - line[0], axis=1) <= REACH_M)
        order = np.argsort(z)
        at = [np.interp(xyz[:, 2], z[order], line[order, axis]) for axis in (0, 1)]
        off = np.hypot(xyz[:, 0] - at[0], xyz[:, 1] - at[1])
        inside = (xyz[:, 2] >= z.min() - REACH_M) & (xyz[:, 2] <= z.max() + REACH_M)
        return np.asarray(inside & (off <= REACH_M))


def _lasers(sweep: Sweep, pose: Pose, line: _Line) -> Iterator[tuple[int, int, float]]:
    """Yield laser, mean instant and mean place of each laser's echoes on the blade."""
    xyz = _world(sweep, pose)
    if not len(xyz):
        return
    middle = (sweep.start_ns + sweep.end_ns) // 2
    near = line.near(xyz, middle)
    ring, along, time_ns = sweep.ring[near], xyz[near] @ line.direction, sweep.time_ns[near]
    for laser in np.unique(ring):
        own = ring == laser
        if own.sum() >= _FEWEST:
            first = int(time_ns[own][0])
            mean_ns = first + round(float(np.mean(time_ns[own] - first)))
            yield int(laser), mean_ns, float(along[own].mean())
