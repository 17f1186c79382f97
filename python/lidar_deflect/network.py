"""Registration as one adjustment of everything that is known.

Poses of all lidars, the range offset of every channel, the ground and the walls with their bend and
roughness follow together from the scans of a static hold, the survey and the mounting; the joint
covariance of all of it comes out of the same equations. `solve` runs it; `calibrate` makes a
calibration of it.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from lidar_deflect import _native
from lidar_deflect.registration import UP, surveyed_plane
from lidar_deflect.starts import first_pose, given

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    from numpy.typing import NDArray

    from lidar_deflect.config import Config, Lidar, Target
    from lidar_deflect.measurement.unloaded import HoldCloud

STEP_DEG = 0.1
"""Sweeps are added up in azimuth cells of this size."""

MIN_COUNT = 3
"""Fewer echoes than this make no mean ray."""

MARGIN_M: Mapping[str, float] = {"ground": 15.0}
"""A surface is believed this far beyond its outermost control points."""

WALL_MARGIN_M = 5.0

SHEET_NEAR_M, SHEET_NEAR_RAD = 0.3, 0.03
"""A sheet is looked for this near to its place, and this much more per metre of range."""

KINDS = ("control", "position", "mounting", "gravity", "distance", "target", "sight")


@dataclass(frozen=True)
class Surface:
    """A surveyed surface: its plane and what it reaches over."""

    name: str
    origin_m: NDArray[np.float64]
    normal: NDArray[np.float64]
    points_m: NDArray[np.float64]
    margin_m: float

    def half_m(self) -> list[float]:
        """Half of the extent along the surface's own u and v, metres."""
        along = np.array([0.0, 0.0, 1.0]) if abs(self.normal[2]) < 0.9 else np.array([1.0, 0, 0])
        along = along - self.normal * (self.normal @ along)
        along /= np.linalg.norm(along)
        across = np.cross(self.normal, along)
        away = self.points_m - self.origin_m
        return [float(np.abs(away @ axis).max()) + self.margin_m for axis in (along, across)]

    def given(self) -> dict[str, Any]:
        """Return it as the core takes it."""
        return {
            "origin_m": self.origin_m.tolist(),
            "normal": self.normal.tolist(),
            "half_m": self.half_m(),
        }


@dataclass(frozen=True, repr=False)
class Solution:
    """What the adjustment found.

    Attributes
    ----------
    lidars
        Ids, in the order of the covariance.
    raw
        Everything as the core gives it.
    surfaces
        The surveyed surfaces, in the order of the core.
    known
        Everything that was surveyed, by kind, as the core was given it.
    """

    lidars: tuple[str, ...]
    raw: Mapping[str, Any]
    surfaces: tuple[Surface, ...]
    known: Mapping[str, Sequence[tuple[Any, ...]]]

    def __repr__(self) -> str:
        return f"Solution({', '.join(self.lidars)}; {len(self.raw['met_lidar'])} rays)"

    @property
    def covariance(self) -> NDArray[np.float64]:
        """Joint covariance of the poses, (6 n, 6 n), each wx wy wz tx ty tz."""
        return self._block([range(6)] * len(self.lidars))

    @property
    def full_covariance(self) -> NDArray[np.float64]:
        """Joint covariance of pose, elevation offset, range scale, channel offsets per lidar."""
        return self._block([range(8 + len(lidar["offsets_m"])) for lidar in self.raw["lidars"]])

    def _block(self, terms: Sequence[range]) -> NDArray[np.float64]:
        starts = [lidar["at"] for lidar in self.raw["lidars"]]
        places = np.concatenate(
            [start + np.array(own) for start, own in zip(starts, terms, strict=True)]
        )
        return np.asarray(self.raw["covariance"][np.ix_(places, places)])

    def world_from_sensor(self, index: int) -> NDArray[np.float64]:
        """Pose of one lidar, shape (4, 4)."""
        lidar = self.raw["lidars"][index]
        pose = np.eye(4)
        pose[:3, :3], pose[:3, 3] = lidar["rotation"], lidar["position_m"]
        return pose


def can_solve(config: Config) -> bool:
    """Whether the survey holds a datum: the ground, three other surfaces, or three targets."""
    surfaces = surveyed_surfaces(config)
    has_ground = any(surface.name == "ground" for surface in surfaces)
    return has_ground or len(surfaces) >= 3 or len(config.targets) >= 3


def solve(config: Config, clouds: Mapping[str, HoldCloud | _native.StaticHold]) -> Solution:
    """Adjust the poses of all lidars that are in the clouds.

    Parameters
    ----------
    config
        Survey, mountings and priors.
    clouds
        What each lidar saw in a static hold: its echoes, or mean rays made by
        `_native.StaticHold.of_rays`, which need no capture.

    Raises
    ------
    ConfigError
        If a lidar has neither position nor mounting.
    CalibrationError
        If no ground is seen, or the equations have no solution.
    """
    surfaces = surveyed_surfaces(config)
    ids = tuple(clouds)
    holds = [_hold(cloud) for cloud in clouds.values()]
    lidars = [config.lidar(id) for id in ids]
    starts = [
        first_pose(lidar, hold, surfaces, config.targets)
        for lidar, hold in zip(lidars, holds, strict=True)
    ]
    known = _known(config, lidars, surfaces) | _sights(config.targets, holds, starts)
    raw = _native.adjust_network(
        holds,
        [
            {"rotation": pose[:3, :3].tolist(), "position_m": pose[:3, 3].tolist(), "channels": n}
            for pose, n in zip(starts, map(_channels, holds), strict=True)
        ],
        [surface.given() for surface in surfaces],
        [given(target) for target in config.targets],
        known,
        priors=[
            config.calibrate.channel_offset_u_m,
            float(np.radians(config.calibrate.elevation_u_deg)),
            config.calibrate.range_scale_u,
        ],
    )
    return Solution(ids, raw, surfaces, known)


def surveyed_surfaces(config: Config) -> tuple[Surface, ...]:
    """Return the surfaces that three or more control points lie on, the ground first."""
    names = sorted(
        {point.on for point in config.control}, key=lambda name: (name != "ground", name)
    )
    surfaces = []
    for name in names:
        points = np.array([point.xyz_m for point in config.control if point.on == name])
        if len(points) >= 3:
            plane = surveyed_plane(points)
            normal = plane.normal * np.sign(plane.normal[np.argmax(np.abs(plane.normal))])
            margin = MARGIN_M.get(name, WALL_MARGIN_M)
            surfaces.append(Surface(name, plane.point_m, normal, points, margin))
    return tuple(surfaces)


def _hold(cloud: HoldCloud | _native.StaticHold) -> _native.StaticHold:
    if isinstance(cloud, _native.StaticHold):
        return cloud
    return _native.StaticHold.add_up(
        cloud.xyz,
        cloud.ring,
        cloud.azimuth_deg,
        cloud.intensity,
        step_deg=STEP_DEG,
        min_count=MIN_COUNT,
    )


def _channels(hold: _native.StaticHold) -> int:
    ring = hold.beams()["ring"]
    return int(ring.max()) + 1 if len(ring) else 1


def _sights(
    targets: Sequence[Target],
    holds: Sequence[_native.StaticHold],
    starts: Sequence[NDArray[np.float64]],
) -> dict[str, list[tuple[Any, ...]]]:
    """Survey of all targets, and the sheets as each lidar sees them; spheres are met by rays."""
    surveyed = [(k, list(t.xyz_m), t.u_m) for k, t in enumerate(targets)]
    sheets = [(k, target) for k, target in enumerate(targets) if target.kind == "sheet"]
    sights: list[tuple[Any, ...]] = []
    echoes: list[tuple[Any, ...]] = []
    for number, (hold, pose) in enumerate(zip(holds, starts, strict=True)):
        for k, target in sheets:
            expected = pose[:3, :3].T @ (np.array(target.xyz_m) - pose[:3, 3])
            within_m = SHEET_NEAR_M + SHEET_NEAR_RAD * float(np.linalg.norm(expected))
            up = pose[:3, :3].T @ UP
            found = hold.sheet(expected.tolist(), up.tolist(), target.size_m, within_m)
            if found is not None:
                sights.append((number, k, found[0]))
                echoes.append((found[1],))
    return {"target": surveyed, "sight": sights, "sheet_echoes": echoes}


def _known(
    config: Config, lidars: Sequence[Lidar], surfaces: Sequence[Surface]
) -> dict[str, list[tuple[Any, ...]]]:
    """Everything that was surveyed, taped or mounted, by kind."""
    known: dict[str, list[tuple[Any, ...]]] = {kind: [] for kind in KINDS}
    names = [surface.name for surface in surfaces]
    known["control"] = [
        (names.index(point.on), list(point.xyz_m), point.u_m)
        for point in config.control
        if point.on in names
    ]
    for number, lidar in enumerate(lidars):
        if lidar.position_m is not None:
            at = (number, list(lidar.position_m), list(lidar.lever_arm_m), lidar.position_u_m)
            known["position"].append(at)
        if lidar.axes is not None:
            rows = [list(row) for row in lidar.axes.world_from_sensor()]
            known["mounting"].append((number, rows, float(np.radians(lidar.axes_u_deg))))
    ids = [lidar.id for lidar in lidars]
    known["distance"] = [
        ([ids.index(tape.between[0]), ids.index(tape.between[1])], tape.m, tape.u_m)
        for tape in config.distance
        if set(tape.between) <= set(ids)
    ]
    return known
