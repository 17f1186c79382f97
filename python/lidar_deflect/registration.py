"""Registration in closed form, steps 1 to 4 of the paper: position, ground, wall.

The position of each lidar is surveyed, the ground seen by it gives two of its three rotations and
a surveyed wall the third. Each step is a function of its own; `register` runs them for one lidar.
Equation numbers are those of Hu et al. 2024.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from lidar_deflect import _native
from lidar_deflect.errors import CalibrationError
from lidar_deflect.fitting import fit_plane

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from lidar_deflect.fitting import Plane

UP = np.array([0.0, 1.0, 0.0])
"""World up; the paper's axis a of equations (7) and (8), as the mounting puts it."""

GROUND_DIP = np.sin(np.radians(10.0))
"""Ground points lie at least 10 degrees below the sensor's horizon."""

GROUND_MARGIN = 0.9
"""The default range band ends at this share of the range to the nearest thing overhead."""

GROUND_RANGE_MAX_M = 15.0
"""The default range band ends here where nothing is overhead."""

WALL_HEIGHT_M = 0.5
"""Wall points lie at least this far above the ground beneath the sensor."""

MIN_GROUND_POINTS = 1000

WALL_SAMPLE = 200_000
"""More points than this make the search for the wall slower, not better."""


@dataclass(frozen=True)
class Wall:
    """A surveyed wall: a point on it and its normal, world frame."""

    point_m: NDArray[np.float64]
    normal: NDArray[np.float64]
    rms_m: float


@dataclass(frozen=True)
class WallYaw:
    """Turn about world up that brings a wall where it was surveyed, and what it rests on."""

    yaw_rad: float
    rms_m: float
    count: int


@dataclass(frozen=True)
class Registered:
    """Pose of one lidar in closed form, with what it rests on.

    Attributes
    ----------
    world_from_sensor
        Shape (4, 4).
    ground_range_m
        The range band that was taken for ground.
    ground
        Plane through the ground points, sensor frame.
    tilt_deg
        Angle by which the ground normal was off from where the mounting puts it.
    yaw
        What the wall asked for; None where the mounting's yaw was kept.
    """

    world_from_sensor: NDArray[np.float64]
    ground_range_m: tuple[float, float]
    ground: Plane
    tilt_deg: float
    yaw: WallYaw | None


def ground_band(xyz: NDArray[np.float32], up_in_sensor: NDArray[np.float64]) -> tuple[float, float]:
    """Range band of the ground where none is configured (step 2).

    Everything nearer than the nearest thing overhead, the blade, counts as ground.

    Parameters
    ----------
    xyz
        Points, shape (n, 3), metres, sensor frame.
    up_in_sensor
        World up in the sensor frame as the mounting puts it, shape (3,).
    """
    range_m, height_m = _range_and_height(xyz, up_in_sensor)
    overhead = range_m[height_m > GROUND_DIP * range_m]
    nearest = float(overhead.min()) if overhead.size else GROUND_RANGE_MAX_M
    return 0.0, min(GROUND_MARGIN * nearest, GROUND_RANGE_MAX_M)


def ground_points(
    xyz: NDArray[np.float32],
    up_in_sensor: NDArray[np.float64],
    range_m: tuple[float, float],
) -> NDArray[np.float32]:
    """Points below the horizon within a range band (step 2), shape (m, 3), sensor frame."""
    distance, height_m = _range_and_height(xyz, up_in_sensor)
    in_band = (distance >= range_m[0]) & (distance <= range_m[1])
    below = height_m < -GROUND_DIP * distance
    return np.asarray(xyz.take(np.flatnonzero(in_band & below), axis=0))


def _range_and_height(
    xyz: NDArray[np.float32], up_in_sensor: NDArray[np.float64]
) -> tuple[NDArray[np.float32], NDArray[np.float64]]:
    """Distance from the sensor and height above it, metres, shape (n,) each.

    Column by column: a hold has millions of points, and rows of three are slow in numpy.
    """
    x, y, z = xyz.T
    height_m = x * up_in_sensor[0] + y * up_in_sensor[1] + z * up_in_sensor[2]
    return np.sqrt(x * x + y * y + z * z), height_m


def rotation_onto(
    from_direction: NDArray[np.float64], to_direction: NDArray[np.float64]
) -> NDArray[np.float64]:
    """Return the smallest rotation that carries one direction onto another, shape (3, 3).

    Equations (7) and (8); the printed factor of (8) is a rotation at 90 degrees only, and is
    corrected to (1 - n.a) / |v|^2. Opposite directions are a half turn.

    Raises
    ------
    InvalidValueError
        If a direction has no length.
    """
    return _native.rotation_onto(from_direction, to_direction)


def surveyed_plane(points_m: NDArray[np.float64]) -> Wall:
    """Plane through surveyed points of a wall, shape (n, 3) with n >= 3, world frame."""
    if len(points_m) < 3:
        raise CalibrationError(
            f"a surveyed plane needs 3 points, {len(points_m)} found",
            code="calibration.few_points",
            hint="survey more points on it, well apart",
        )
    plane = fit_plane(points_m)
    return Wall(plane.centroid_m, plane.normal, plane.rms_m)


def register(
    xyz: NDArray[np.float32],
    *,
    position_m: NDArray[np.float64],
    mounting: NDArray[np.float64],
    mounting_u_deg: float,
    wall: Wall | None,
    ground_range_m: tuple[float, float] | None,
) -> Registered:
    """Pose of one lidar from its position, the ground it sees and a surveyed wall.

    Parameters
    ----------
    xyz
        Points of a hold, shape (n, 3), metres, sensor frame.
    position_m
        Surveyed optical centre, world frame (step 1).
    mounting
        Nominal rotation world from sensor, shape (3, 3).
    mounting_u_deg
        How far the mounting may be off; the search for the wall ends there.
    wall
        Surveyed wall; without one the mounting's yaw stays.
    ground_range_m
        Range band of the ground; None for `ground_band`.

    Raises
    ------
    CalibrationError
        Where too little ground is seen, or a surveyed wall is not seen at all.
    """
    band = ground_range_m or ground_band(xyz, mounting.T @ UP)
    seen = ground_points(xyz, mounting.T @ UP, band)
    if len(seen) < MIN_GROUND_POINTS:
        raise CalibrationError(
            f"ground: {len(seen)} points between {band[0]:.1f} and {band[1]:.1f} m, "
            f"{MIN_GROUND_POINTS} needed",
            code="calibration.no_ground",
            hint="set ground_range_m of [paper] or of this lidar, and check its axes",
        )
    ground = fit_plane(seen, towards_m=np.zeros(3))  # steps 2, 3: equations (2)-(6)
    normal = mounting @ ground.normal
    levelling = rotation_onto(normal, UP)  # step 4: equations (7), (8), corrected
    rotation = levelling @ mounting
    yaw = _wall_yaw(xyz @ rotation.T.astype(np.float32), position_m, mounting_u_deg, wall, ground)
    if yaw is not None:
        rotation = _native.rotation_about_up(yaw.yaw_rad) @ rotation
    pose = np.eye(4)
    pose[:3, :3], pose[:3, 3] = rotation, position_m
    return Registered(
        world_from_sensor=pose,
        ground_range_m=band,
        ground=ground,
        tilt_deg=float(np.degrees(np.arccos(np.clip(normal @ UP, -1.0, 1.0)))),
        yaw=yaw,
    )


def _wall_yaw(
    levelled: NDArray[np.float32],
    position_m: NDArray[np.float64],
    range_deg: float,
    wall: Wall | None,
    ground: Plane,
) -> WallYaw | None:
    if wall is None:
        return None
    beneath_m = float(np.linalg.norm(ground.normal @ ground.centroid_m))
    return WallYaw(
        *_native.yaw_from_wall(
            np.ascontiguousarray(levelled[:: max(1, len(levelled) // WALL_SAMPLE)]),
            normal=wall.normal,
            distance_m=float(wall.normal @ (wall.point_m - position_m)),
            yaw_range_rad=float(np.radians(range_deg)),
            min_height_m=WALL_HEIGHT_M - beneath_m,
        )
    )
