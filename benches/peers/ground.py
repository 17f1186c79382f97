"""The plane of the ground of a yard: least distances beside Open3D's random samples."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import captures
import numpy as np
import open3d
from rounds import Row, ratio, rounds, table

import lidar_deflect as ld
from lidar_deflect import scene as scenes
from lidar_deflect.fitting import fit_plane
from lidar_deflect.registration import UP, ground_band, ground_points

if TYPE_CHECKING:
    from collections.abc import Callable

OURS, PEER = "ours", "Open3D, segment_plane"


def measure(repeats: int, *, large: bool) -> list[Row]:  # noqa: ARG001
    """Print one table; return what was asked."""
    capture = ld.open(captures.single())
    sweeps = [sweep.xyz for sweep in capture.sweeps(capture.lidars[0])]
    xyz = np.concatenate(sweeps[:40])
    axes = scenes.demo().lidars[0].axes
    up = np.array([axis @ UP for axis in (axes.x, axes.y, axes.z)])
    wide = xyz.astype(np.float64)
    cloud = open3d.geometry.PointCloud(open3d.utility.Vector3dVector(wide))
    jobs: dict[str, Callable[[], Any]] = {
        PEER: lambda: cloud.segment_plane(0.05, 3, 1000)[0],
        OURS: lambda: fit_plane(ground_points(xyz, up, ground_band(xyz, up)), threads=1),
    }
    timed = rounds(jobs, repeats)
    print(table(timed, len(xyz), "points", OURS))
    print(timed[PEER].result, timed[OURS].result)
    return [Row("ground plane of a yard", "10 x Open3D", f"{ratio(timed, PEER, OURS):.0f}")]
