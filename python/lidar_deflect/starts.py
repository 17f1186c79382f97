"""First poses: where the adjustment of a yard starts, without hand work."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from lidar_deflect import _native
from lidar_deflect.errors import CalibrationError
from lidar_deflect.mounting import optical_centre_m
from lidar_deflect.registration import UP, rotation_onto

if TYPE_CHECKING:
    from collections.abc import Sequence

    from numpy.typing import NDArray

    from lidar_deflect.config import Lidar, Target
    from lidar_deflect.network import Surface

WALL_HEIGHT_M = 0.5
"""The search for a wall leaves out what lies lower above the ground than this."""

YAW_U = 2.5
"""A wall or target is looked for within so many times the uncertainty of the axes."""

NEEDED = (
    'give it axes = { x = "...", y = "...", z = "..." }, to within 20 degrees; or survey what '
    "tells how it stands: with position_m two of ground, walls and targets, without it three "
    "planes that stand across one another or three targets"
)


def first_pose(
    lidar: Lidar,
    hold: _native.StaticHold,
    surfaces: Sequence[Surface],
    targets: Sequence[Target] = (),
) -> NDArray[np.float64]:
    """Pose of one lidar in closed form, shape (4, 4).

    The given one, else from its axes and ground, wall, targets; without axes or position from the
    surveyed planes and targets alone.

    Raises
    ------
    CalibrationError
        If it sees no ground where its axes put it (``calibration.no_ground``), or nothing tells
        how it stands (``calibration.no_start``).
    """
    if lidar.world_from_sensor:
        return np.array(lidar.world_from_sensor, dtype=np.float64)
    mounting = lidar.nominal_rotation()
    if mounting is None or lidar.position_m is None:
        return _searched(lidar, hold, surfaces, targets)
    rotation = np.array(mounting, dtype=np.float64)
    up = next((surface.normal for surface in surfaces if surface.name == "ground"), UP)
    seen = hold.ground(rotation.T @ up)
    if seen is None:
        raise CalibrationError(
            f"lidar {lidar.id} sees no ground where its axes put it",
            code="calibration.no_ground",
            hint="check the axes of this lidar",
        )
    rotation = rotation_onto(rotation @ np.array(seen[0]), up) @ rotation
    pose = np.eye(4)
    pose[:3, 3] = optical_centre_m(lidar, rotation)
    turned = _turned_to_walls(rotation, pose[:3, 3], lidar, hold, surfaces, abs(seen[1]))
    if turned is None:
        turned = _turned_to_targets(rotation, pose[:3, 3], lidar, hold, targets)
    pose[:3, :3] = rotation if turned is None else turned
    return pose


def _turned_to_walls(
    rotation: NDArray[np.float64],
    position_m: NDArray[np.float64],
    lidar: Lidar,
    hold: _native.StaticHold,
    surfaces: Sequence[Surface],
    beneath_m: float,
) -> NDArray[np.float64] | None:
    """Turn a levelled lidar about the vertical until the first wall it sees is in place."""
    beams = hold.beams()
    points = (beams["direction"] * beams["range_m"][:, None]) @ rotation.T
    for wall in surfaces:
        if abs(wall.normal[1]) > 0.5:
            continue
        try:
            yaw_rad, *_ = _native.yaw_from_wall(
                np.ascontiguousarray(points, dtype=np.float32),
                normal=wall.normal,
                distance_m=float(wall.normal @ (wall.origin_m - position_m)),
                yaw_range_rad=_yaw_range_rad(lidar),
                min_height_m=WALL_HEIGHT_M - beneath_m,
            )
        except CalibrationError:
            continue
        return np.asarray(_native.rotation_about_up(yaw_rad) @ rotation)
    return None


def _turned_to_targets(
    rotation: NDArray[np.float64],
    position_m: NDArray[np.float64],
    lidar: Lidar,
    hold: _native.StaticHold,
    targets: Sequence[Target],
) -> NDArray[np.float64] | None:
    """Turn a levelled lidar about the vertical until what is bright lies on targets."""
    found = hold.turn_to_targets(
        rotation.tolist(),
        [((np.array(t.xyz_m) - position_m).tolist(), t.size_m / 2) for t in targets],
        _yaw_range_rad(lidar),
    )
    if found is None:
        return None
    return np.asarray(_native.rotation_about_up(found[0]) @ rotation)


def _yaw_range_rad(lidar: Lidar) -> float:
    return float(np.radians(min(180.0, YAW_U * lidar.axes_u_deg)))


def given(target: Target) -> tuple[list[float], float | None]:
    """Return a target as the core takes it: middle and, of a sphere, its radius, metres."""
    return list(target.xyz_m), target.size_m / 2 if target.kind == "sphere" else None


def can_start(lidar: Lidar, surfaces: Sequence[Surface], targets: Sequence[Target]) -> bool:
    """Whether enough is given to look for the pose of a lidar."""
    if lidar.world_from_sensor:
        return True
    if lidar.position_m is not None:
        return lidar.axes is not None or len(surfaces) + len(targets) >= 2
    return len(surfaces) >= 3 or len(targets) >= 3


def _searched(
    lidar: Lidar,
    hold: _native.StaticHold,
    surfaces: Sequence[Surface],
    targets: Sequence[Target],
) -> NDArray[np.float64]:
    """Find a lidar by what it sees of surveyed planes and targets, whatever way it is turned."""
    found = hold.stand(
        [surface.given() for surface in surfaces],
        [given(target) for target in targets],
        lidar.position_m,
    )
    if found is None or not found[2]:
        raise _untold(lidar, surfaces, targets, is_ambiguous=found is not None)
    pose = np.eye(4)
    pose[:3, :3] = found[0]
    is_surveyed = lidar.position_m is not None
    pose[:3, 3] = optical_centre_m(lidar, pose[:3, :3]) if is_surveyed else found[1]
    return pose


def _untold(
    lidar: Lidar,
    surfaces: Sequence[Surface],
    targets: Sequence[Target],
    *,
    is_ambiguous: bool,
) -> CalibrationError:
    missing = [key for key in ("axes", "position_m") if getattr(lidar, key) is None]
    surveyed = [surface.name for surface in surfaces] + [f"target {t.name}" for t in targets]
    told = "fits in more than one way" if is_ambiguous else "does not tell how it stands"
    return CalibrationError(
        f"lidar {lidar.id} has no {' and no '.join(missing)}, and what it sees of the surveyed "
        f"planes and targets {told}",
        code="calibration.no_start",
        facts=[("surveyed", ", ".join(surveyed) or "nothing that it could be recognised by")],
        hint=NEEDED,
    )
