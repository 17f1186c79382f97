"""Does a configuration fit its captures? Findings, without running anything."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

from lidar_deflect import instruments, network
from lidar_deflect.geometry import read_geometry
from lidar_deflect.starts import NEEDED, can_start

if TYPE_CHECKING:
    from collections.abc import Iterator, Sequence

    from lidar_deflect.capture import Capture
    from lidar_deflect.channels import Channel
    from lidar_deflect.config import Config

INPUT, CONFIGURATION, NOTE = 3, 4, 0


@dataclass(frozen=True)
class Finding:
    """One thing that a user should know before measuring.

    Attributes
    ----------
    code
        Stable name, such as ``check.silent_lidar``.
    message, hint
        What was found, and a next step.
    exit_code
        0 for a note; 3 input, 4 configuration.
    """

    code: str
    message: str
    hint: str | None = None
    exit_code: int = NOTE


def check(config: Config, capture: Capture) -> tuple[Finding, ...]:
    """Hold a configuration against its captures.

    Raises
    ------
    ConfigError
        If a file that the configuration names cannot be read.
    """
    read_geometry(config.blade)
    return (
        *_lidars(config, capture),
        *_poses(config),
        *_channels(config, capture),
        *_sections(config),
    )


def _lidars(config: Config, capture: Capture) -> Iterator[Finding]:
    for lidar in config.lidars:
        if lidar.id in capture.missing:
            yield Finding(
                "check.silent_lidar",
                f"lidar {lidar.id} ({lidar.source}) never sends",
                "see who does: lidar-deflect info CAPTURE",
                INPUT,
            )
    for stream in capture.streams:
        if stream.lidar not in capture.lidars:
            yield Finding(
                "check.unknown_lidar",
                f"{stream.address} sends lidar packets and is not in the configuration",
                "add it to [[lidars]] if it belongs to the test",
            )


def _poses(config: Config) -> Iterator[Finding]:
    surfaces = network.surveyed_surfaces(config)
    for lidar in config.lidars:
        alone = not network.can_solve(config)
        has_both = lidar.position_m is not None and lidar.nominal_rotation() is not None
        if not has_both and (alone or not can_start(lidar, surfaces, config.targets)):
            yield Finding(
                "check.no_pose",
                f"lidar {lidar.id} has no position_m or no axes, so it cannot be calibrated",
                NEEDED,
                CONFIGURATION,
            )
    if sum(point.on == "wall" for point in config.control) < 3:
        yield Finding(
            "check.no_wall",
            "no surveyed wall: turns about the vertical stay as mounted",
            'survey three or more points of a wall: [[control]] with on = "wall"',
        )


def _channels(config: Config, capture: Capture) -> Iterator[Finding]:
    first, last = capture.first_time_ns, capture.last_time_ns
    load = instruments.load(config, first)
    instruments.prediction(config)
    read: Sequence[Channel] = [*([load] if load else []), *instruments.wires(config, first)]
    for channel in read:
        if channel.time_ns[-1] < first or channel.time_ns[0] > last:
            apart_s = max(first - channel.time_ns[-1], channel.time_ns[0] - last) * 1e-9
            yield Finding(
                "check.channel_time",
                f"channel {channel.name} lies {apart_s:.0f} s outside of the capture",
                "check the clock of the channel, its time zone and its column",
                CONFIGURATION,
            )


def _sections(config: Config) -> Iterator[Finding]:
    if not config.sections:
        yield Finding(
            "check.no_sections",
            "no section to measure",
            "add [[sections]] with name and s_m",
            CONFIGURATION,
        )
