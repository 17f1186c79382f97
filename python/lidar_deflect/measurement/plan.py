"""What the paper's method needs to know beforehand: configured, else from the unloaded hold."""

from __future__ import annotations

from dataclasses import asdict, dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from lidar_deflect import _native, instruments
from lidar_deflect.errors import MeasurementError
from lidar_deflect.registration import UP

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    from numpy.typing import NDArray

    from lidar_deflect.calibration import Calibration, Pose
    from lidar_deflect.config import Config
    from lidar_deflect.measurement.unloaded import HoldCloud

    Floats = NDArray[np.float64]

NEAR_AXIS = 0.06
"""Unloaded, the blade lies within this share of its length of the z axis ..."""
NEAR_AXIS_MIN_M = 3.0
"""... or this far, where that is more."""
CLEARANCE_M = 1.5
"""The blade is at least this far above the ground beneath the lidars."""
MARGIN_M = 1.0
"""Added to the box on all sides."""
SIDE_SHARE = 0.03
"""Added across the load, as a share of the length: a blade also moves sideways."""
INBOARD_SHARE = 0.12
"""Added towards the root: a bent blade draws nearer, and a lidar sees more of one far away."""
LOADED_SHARE = 0.4
"""Room along the load where no prediction says how far, as a share of the length."""
SWING_SHARE = 0.06
"""Room on all sides for the swing of a fatigue test, as a share of the length."""
PREDICTION_MARGIN = 1.25
WALL_MARGIN_M = 1.0
MIN_BLADE_POINTS = 100
OUTLIERS_PERCENT = 0.5

_COUNTED = 1 << 18
_ROWS = 16_384
"""Points that are turned at a time: beyond, OpenBLAS shares the product out to threads, which may
take fifty times as long for rows of three."""


@dataclass(frozen=True)
class Plan:
    """Parameters of steps 5 to 12, none of them open any more.

    Attributes
    ----------
    box_m
        Pass-through, shape (2, 3): low and high corner.
    alpha_deg
        Angular step between two shots of a beam.
    leading_edge
        Unit vector along the chord towards the leading edge, world frame.
    cut_azimuth_deg
        Azimuth, per lidar, at which its sweeps are cut: towards the ground, away from the blade.
    edge_on_above
        Whether a blade straight above a lidar shows it an edge instead of a face (step 12).
    """

    box_m: Floats
    alpha_deg: float
    leading_edge: Floats
    cut_azimuth_deg: Mapping[str, float]
    edge_on_above: bool
    warnings: tuple[str, ...]

    def cuts_deg(self, lidars: Sequence[str]) -> list[float]:
        """Return where the sweeps of these lidars are cut, in their order."""
        return [self.cut_azimuth_deg[lidar] for lidar in lidars]

    def to_dict(self) -> dict[str, Any]:
        """Plain document for files."""
        return asdict(self) | {
            "box_m": self.box_m.tolist(),
            "leading_edge": self.leading_edge.tolist(),
            "warnings": list(self.warnings),
        }

    @classmethod
    def from_dict(cls, document: Mapping[str, Any]) -> Plan:
        """Read what `to_dict` wrote."""
        return cls(
            box_m=np.array(document["box_m"], dtype=np.float64),
            alpha_deg=float(document["alpha_deg"]),
            leading_edge=np.array(document["leading_edge"], dtype=np.float64),
            cut_azimuth_deg=dict(document["cut_azimuth_deg"]),
            edge_on_above=bool(document["edge_on_above"]),
            warnings=tuple(document["warnings"]),
        )


@dataclass(frozen=True)
class HoldView:
    """What the plan takes of one lidar's hold, so that the hold itself need not be kept.

    Attributes
    ----------
    blade_m
        Points near the z axis and well above the ground, world frame, shape (n, 3).
    step_deg
        Azimuth steps between neighbouring shots of its busiest beam, shape (k,).
    below_deg
        Azimuth of the echo nearest to straight below.
    """

    blade_m: NDArray[np.float32]
    step_deg: Floats
    below_deg: float

    @classmethod
    def of(cls, config: Config, pose: Pose, cloud: HoldCloud) -> HoldView:
        """Look at one lidar's hold."""
        return cls(
            _near_blade(config, pose, cloud),
            _angular_steps(cloud),
            _azimuth_below(cloud, pose.world_from_sensor),
        )


def make_plan(config: Config, calibration: Calibration, clouds: Mapping[str, HoldCloud]) -> Plan:
    """Settle what the configuration leaves open, from the unloaded hold."""
    poses = {lidar: calibration.pose(lidar) for lidar in clouds}
    return plan_of_views(
        config, {lidar: HoldView.of(config, poses[lidar], own) for lidar, own in clouds.items()}
    )


def plan_of_views(config: Config, views: Mapping[str, HoldView]) -> Plan:
    """Settle what the configuration leaves open, from what each lidar's hold showed."""
    blade = _blade(config, list(views.values()))
    leading_edge, warnings = _chord_direction(config, blade)
    steps = np.concatenate([view.step_deg for view in views.values()])
    return Plan(
        box_m=_box(config, blade),
        alpha_deg=config.paper.alpha_deg or float(np.median(steps)),
        leading_edge=leading_edge,
        cut_azimuth_deg={lidar: view.below_deg for lidar, view in views.items()},
        edge_on_above=bool(abs(leading_edge @ UP) > np.sqrt(0.5)),
        warnings=warnings,
    )


def _to_world(xyz: NDArray[np.float32], pose: Floats) -> NDArray[np.float32]:
    turn, moved = pose[:3, :3].T.astype(np.float32), np.empty_like(xyz)
    for first in range(0, len(xyz), _ROWS):
        np.matmul(xyz[first : first + _ROWS], turn, out=moved[first : first + _ROWS])
    for axis, step_m in enumerate(pose[:3, 3].astype(np.float32)):
        moved[:, axis] += step_m  # column by column: rows of three are slow in numpy
    return np.asarray(moved, dtype=np.float32)


def _reach_of_axis_m(config: Config) -> float:
    return max(NEAR_AXIS_MIN_M, NEAR_AXIS * config.blade.length_m)


def _near_blade(config: Config, pose: Pose, cloud: HoldCloud) -> NDArray[np.float32]:
    """Points of the unloaded hold that lie near the z axis and well above the ground."""
    reach = _reach_of_axis_m(config)
    ground = pose.evidence.get("ground_height_m")
    floor = -reach if ground is None else max(-reach, float(ground) + CLEARANCE_M)
    far = config.blade.length_m + MARGIN_M
    box = np.array([[-reach, floor, 0.0], [reach, max(reach, floor + MARGIN_M), far]])
    matrix = np.ascontiguousarray(pose.world_from_sensor, dtype=np.float64)
    xyz = _to_world(_native.points_near_box(cloud.xyz, matrix, box), matrix)
    near = (
        (np.abs(xyz[:, 0]) < reach)
        & (xyz[:, 1] > floor)
        & (xyz[:, 1] < reach)
        & (xyz[:, 2] > 0.0)
        & (xyz[:, 2] < far)
    )
    return np.asarray(xyz[near])


def _blade(config: Config, views: Sequence[HoldView]) -> Floats:
    """Points of the unloaded blade of all lidars."""
    blade = np.concatenate([view.blade_m for view in views]).astype(np.float64)
    if len(blade) < MIN_BLADE_POINTS:
        raise MeasurementError(
            f"no blade within {_reach_of_axis_m(config):.1f} m of the z axis in the reference "
            f"hold: {len(blade)} points, {MIN_BLADE_POINTS} needed",
            code="measurement.no_blade",
            hint="check position_m and axes of the lidars, or set box_m of [paper]",
        )
    return blade


def _box(config: Config, blade: Floats) -> Floats:
    if config.paper.box_m is not None:
        box = config.paper.box_m
        return np.array([box.x, box.y, box.z], dtype=np.float64).T
    low, high = np.percentile(blade, [OUTLIERS_PERCENT, 100.0 - OUTLIERS_PERCENT], axis=0)
    low, high = low - MARGIN_M, high + MARGIN_M
    length = config.blade.length_m
    low[:2] -= SIDE_SHARE * length
    high[:2] += SIDE_SHARE * length
    low[2] -= INBOARD_SHARE * length
    high[2] = length + MARGIN_M
    if config.test.kind == "fatigue":  # it swings to both sides, across and up
        low[:2] -= SWING_SHARE * length
        high[:2] += SWING_SHARE * length
        return _before_walls(config, np.stack([low, high]))
    reach = _reach_m(config)
    if config.load.direction is None:  # x is the horizontal load direction, its sense is open
        low[0], high[0] = low[0] - reach, high[0] + reach
    else:
        along = reach * np.array(config.load.direction)
        low, high = low + np.minimum(along, 0.0), high + np.maximum(along, 0.0)
    return _before_walls(config, np.stack([low, high]))


def _before_walls(config: Config, box: Floats) -> Floats:
    """Keep surveyed walls and the ground out of the box, where that leaves the blade in it."""
    ground = [point.xyz_m[1] for point in config.control if point.on == "ground"]
    if ground:
        box[0, 1] = max(box[0, 1], max(ground) + CLEARANCE_M / 2)
    walls = [point.xyz_m[0] for point in config.control if point.on == "wall"]
    if walls and max(walls) < 0.0:
        box[0, 0] = max(box[0, 0], max(walls) + WALL_MARGIN_M)
    if walls and min(walls) > 0.0:
        box[1, 0] = min(box[1, 0], min(walls) - WALL_MARGIN_M)
    return box


def _reach_m(config: Config) -> float:
    """How far the blade may move along the load."""
    predicted = instruments.largest_predicted_m(config)
    if predicted is None:
        return LOADED_SHARE * config.blade.length_m
    return PREDICTION_MARGIN * predicted


def _chord_direction(config: Config, blade: Floats) -> tuple[Floats, tuple[str, ...]]:
    if config.blade.leading_edge is not None:
        return np.array(config.blade.leading_edge, dtype=np.float64), ()
    across = blade[:, :2] - blade[:, :2].mean(axis=0)
    _, _, axes = np.linalg.svd(across[:: max(1, len(across) // 10_000)], full_matrices=False)
    chord = np.array([axes[0, 0], axes[0, 1], 0.0])
    chord *= -np.sign(chord[np.argmax(np.abs(chord))])
    return chord, (
        "blade.leading_edge is not given: the chord is taken along the widest direction of the "
        "unloaded blade, and which side is the leading edge is a guess",
    )


def _angular_steps(cloud: HoldCloud) -> Floats:
    """Azimuths between neighbouring shots of one beam, degrees."""
    beams = int(cloud.ring.max(initial=0)) + 1
    count = np.zeros(beams, dtype=np.intp)
    for first in range(0, len(cloud.ring), _COUNTED):  # a count widens what it counts
        count += np.bincount(cloud.ring[first : first + _COUNTED], minlength=beams)
    of_beam = cloud.azimuth_deg[cloud.ring == count.argmax()]
    step = np.abs(np.diff(of_beam.astype(np.float64)))
    return np.asarray(step[step > 0.0])


def _azimuth_below(cloud: HoldCloud, world_from_sensor: Floats) -> float:
    """Azimuth of the echo nearest to straight below, whatever the sensor's sense of turn."""
    down = np.ascontiguousarray(world_from_sensor[:3, :3].T @ -UP)
    near = _native.points_nearest_to(cloud.xyz, down)
    xyz = cloud.xyz[near]
    x, y, z = xyz.T  # column by column: rows of three are slow in numpy
    range_m = np.sqrt((x * x + y * y) + z * z)
    cosine = (xyz @ down.astype(np.float32)) / np.maximum(range_m, 1e-6)
    return float(cloud.azimuth_deg[near[np.argmax(cosine)]])
