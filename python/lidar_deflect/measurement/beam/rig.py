"""What the calibration knows of the lidars, as prior of the adjustment."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

if TYPE_CHECKING:
    from collections.abc import Sequence

    from numpy.typing import NDArray

    from lidar_deflect.measurement.inputs import Inputs

    Floats = NDArray[np.float64]

FIXED = 8
"""Unknowns of a lidar before its channels: rotation, translation, elevation, range scale."""

UNKNOWN_RAD, UNKNOWN_M = 2e-3, 0.02
"""Standard deviation of a pose for which the calibration gives none."""

UNIT_U_M = 0.01
"""Standard deviation of what all channels of a unit have in common in their range offsets."""


@dataclass(frozen=True)
class RigPrior:
    """Poses and errors of all lidars before the blade is looked at.

    Attributes
    ----------
    poses
        Shape (n, 4, 4).
    channels
        Channels of each lidar.
    clocks
        What holds each lidar's clock: ``locked``, ``utc`` or ``free_running``.
    values, covariance
        Per lidar rotation (rad), translation (m), elevation (rad), range scale, offsets (m).
    """

    poses: Floats
    channels: list[int]
    clocks: list[str]
    values: Floats
    covariance: Floats


def rig_prior(inputs: Inputs) -> RigPrior:
    """Take poses and covariance from the calibration, the rest from the configuration."""
    poses = [inputs.calibration.pose(lidar) for lidar in inputs.lidars]
    channels = [_channels(inputs, lidar) for lidar in inputs.lidars]
    values = np.zeros(sum(channels) + FIXED * len(channels))
    covariance = _independent(inputs, channels)
    joint: Any = getattr(inputs.calibration, "joint", None)
    if joint is not None:
        _take_joint(joint, inputs.lidars, channels, values, covariance)
    clocks = clock_kinds(inputs)
    placed = np.array([pose.world_from_sensor for pose in poses])
    known = RigPrior(placed, channels, clocks, values, covariance)
    return _with_moves(known, inputs) if inputs.moves else known


def clock_kinds(inputs: Inputs) -> list[str]:
    """Tell what holds the clock of each lidar."""
    numbers = inputs.capture.numbers(inputs.lidars)
    return [inputs.capture.streams[number].clock_kind for number in numbers]


def _with_moves(known: RigPrior, inputs: Inputs) -> RigPrior:
    """Add a stand for every move: the same lidar, its pose less well known by the move's."""
    starts = _starts(known.channels)
    channels = [known.channels[lidar] for lidar in inputs.stands]
    places = [range(starts[lidar], starts[lidar + 1]) for lidar in inputs.stands]
    same = np.concatenate([np.array(own) for own in places])
    covariance = known.covariance[np.ix_(same, same)]
    for move, start in zip(inputs.moves, _starts(channels)[len(known.channels) :], strict=False):
        own = slice(start, start + 6)
        covariance[own, own] += move.covariance
    poses = [*known.poses, *(move.world_from_sensor for move in inputs.moves)]
    clocks = [known.clocks[lidar] for lidar in inputs.stands]
    return RigPrior(np.array(poses), channels, clocks, known.values[same], covariance)


def _channels(inputs: Inputs, lidar: str) -> int:
    """Channels of a lidar, from the rings of its hold where there is one."""
    joint: Any = getattr(inputs.calibration, "joint", None)
    if joint is not None and lidar in joint.lidars:
        return len(joint.nuisances[joint.lidars.index(lidar)].channel_offset_m)
    cloud = inputs.clouds.get(lidar)
    return int(cloud.ring.max()) + 1 if cloud is not None and len(cloud.ring) else 128


def _starts(channels: Sequence[int]) -> list[int]:
    return [int(start) for start in np.cumsum([0, *(count + FIXED for count in channels)])]


def _independent(inputs: Inputs, channels: Sequence[int]) -> Floats:
    given = inputs.config.calibrate
    size = sum(channels) + FIXED * len(channels)
    covariance = np.zeros((size, size))
    for lidar, start, count in zip(inputs.lidars, _starts(channels), channels, strict=False):
        pose = inputs.calibration.pose(lidar).covariance
        block = np.diag([UNKNOWN_RAD**2] * 3 + [UNKNOWN_M**2] * 3) if pose is None else pose
        covariance[start : start + 6, start : start + 6] = block
        covariance[start + 6, start + 6] = np.radians(given.elevation_u_deg) ** 2
        covariance[start + 7, start + 7] = given.range_scale_u**2
        own = slice(start + FIXED, start + FIXED + count)
        covariance[own, own] = np.eye(count) * given.channel_offset_u_m**2 + UNIT_U_M**2
    return covariance


def _take_joint(
    joint: Any,
    lidars: Sequence[str],
    channels: Sequence[int],
    values: Floats,
    covariance: Floats,
) -> None:
    """Put in what the network adjustment found, in its own order of lidars."""
    counts = [len(nuisances.channel_offset_m) for nuisances in joint.nuisances]
    theirs = dict(zip(joint.lidars, _starts(counts), strict=False))
    places: list[int] = []
    sources: list[int] = []
    for lidar, start, count in zip(lidars, _starts(channels), channels, strict=False):
        if lidar not in theirs:
            continue
        found = joint.nuisances[joint.lidars.index(lidar)]
        values[start + 6] = found.elevation_offset_rad
        values[start + 7] = found.range_scale
        values[start + FIXED : start + FIXED + count] = found.channel_offset_m
        places += range(start, start + FIXED + count)
        sources += range(theirs[lidar], theirs[lidar] + FIXED + count)
    covariance[np.ix_(places, places)] = joint.full_covariance[np.ix_(sources, sources)]
