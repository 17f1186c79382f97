"""Calibration of a whole yard: every lidar of a configuration, from one unloaded hold."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING, Any

import numpy as np

from lidar_deflect import judgement, network
from lidar_deflect.calibration import Calibration, Pose
from lidar_deflect.errors import CalibrationError
from lidar_deflect.mounting import mounted, optical_centre_m
from lidar_deflect.registration import Registered, Wall, register, surveyed_plane

if TYPE_CHECKING:
    from collections.abc import Mapping

    from lidar_deflect.config import Config, Lidar
    from lidar_deflect.measurement.unloaded import HoldCloud

NO_WALL = (
    "no surveyed wall: the turn of every lidar about the vertical is that of its mounting; "
    'survey three or more points of a wall and list them as [[control]] with on = "wall"'
)


NO_DATUM = (
    "fewer than three surveyed points on the ground, so the lidars are registered one by one "
    '(closed_form): list [[control]] points with on = "ground" for the network adjustment'
)

TARGETS_UNUSED = (
    "{count} surveyed targets are not used: lidars that are registered one by one "
    "(closed_form) know ground and wall alone"
)


def calibrate(config: Config, clouds: Mapping[str, HoldCloud]) -> Calibration:
    """Register every lidar that is in the clouds, as `[calibrate] method` says.

    Raises
    ------
    ConfigError
        If a lidar has neither a surveyed position nor a pose from elsewhere.
    CalibrationError
        If ground or wall of a lidar cannot be found, or a direction of a pose is left free; the
        error names it.
    """
    if config.calibrate.method == "closed_form":
        return closed_form(config, clouds)
    if not network.can_solve(config):
        alone = closed_form(config, clouds)
        return replace(alone, warnings=(NO_DATUM, *alone.warnings))
    return judgement.calibration(config, network.solve(config, clouds))


def closed_form(config: Config, clouds: Mapping[str, HoldCloud]) -> Calibration:
    """Register every lidar by itself, steps 1 to 4 of the paper."""
    wall = _surveyed_wall(config)
    poses = tuple(_pose(config, config.lidar(id), cloud, wall) for id, cloud in clouds.items())
    warnings = () if wall is not None else (NO_WALL,)
    unused = (TARGETS_UNUSED.format(count=len(config.targets)),) if config.targets else ()
    return Calibration(poses, "closed_form", unused + warnings + _slope_warning(config))


def _pose(config: Config, lidar: Lidar, cloud: HoldCloud, wall: Wall | None) -> Pose:
    mounting = mounted(
        lidar, hint="give position_m and axes of every lidar: the ground fixes only its tilt"
    )
    try:
        found = register(
            cloud.xyz,
            position_m=optical_centre_m(lidar, mounting),
            mounting=mounting,
            mounting_u_deg=lidar.axes_u_deg,
            wall=wall,
            ground_range_m=lidar.ground_range_m or config.paper.ground_range_m,
        )
    except CalibrationError as error:
        raise CalibrationError(
            f"lidar {lidar.id}: {error.message}", code=error.code, hint=error.hint
        ) from error
    return Pose(lidar.id, lidar.source or "", found.world_from_sensor, _evidence(lidar, found))


def _surveyed_wall(config: Config) -> Wall | None:
    points = [point.xyz_m for point in config.control if point.on == "wall"]
    return surveyed_plane(np.array(points, dtype=np.float64)) if len(points) >= 3 else None


def _slope_warning(config: Config) -> tuple[str, ...]:
    """Say how far the surveyed ground is from level, which the method takes it for."""
    ground = [point.xyz_m for point in config.control if point.on == "ground"]
    if len(ground) < 3:
        return ()
    normal = surveyed_plane(np.array(ground, dtype=np.float64)).normal
    slope_deg = float(np.degrees(np.arccos(min(1.0, abs(normal[1])))))
    return (
        f"the surveyed ground slopes by {slope_deg:.2f} degrees, and this method takes its normal "
        f"for the vertical: a deflection of 10 m is turned by {1e4 * np.radians(slope_deg):.0f} mm",
    )


def _evidence(lidar: Lidar, found: Registered) -> Mapping[str, Any]:
    centroid = found.world_from_sensor[:3, :3] @ found.ground.centroid_m
    evidence: dict[str, Any] = {
        "position_u_m": lidar.position_u_m,
        "ground_range_m": list(found.ground_range_m),
        "ground_points": found.ground.count,
        "ground_rms_m": found.ground.rms_m,
        "ground_height_m": float(found.world_from_sensor[1, 3] + centroid[1]),
        "tilt_deg": found.tilt_deg,
        "yaw_from": "mounting" if found.yaw is None else "wall",
    }
    return evidence | _wall_evidence(found)


def _wall_evidence(found: Registered) -> dict[str, Any]:
    if found.yaw is None:
        return {}
    return {
        "yaw_deg": float(np.degrees(found.yaw.yaw_rad)),
        "wall_points": found.yaw.count,
        "wall_rms_m": found.yaw.rms_m,
    }
