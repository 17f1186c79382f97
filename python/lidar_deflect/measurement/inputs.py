"""What every method starts from."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping

    from numpy.typing import NDArray

    from lidar_deflect import _native
    from lidar_deflect.calibration import Calibration
    from lidar_deflect.capture import Capture
    from lidar_deflect.channels import Channel
    from lidar_deflect.config import Config
    from lidar_deflect.drift.move import Move
    from lidar_deflect.measurement.plan import Plan
    from lidar_deflect.measurement.unloaded import HoldCloud

    Progress = Callable[[str, int, int], None]


@dataclass(frozen=True)
class Inputs:
    """What every method starts from.

    Attributes
    ----------
    lidars
        Ids of the lidars that are in the capture, in the order of the configuration.
    clouds
        What each of them saw in the unloaded hold; empty where this capture has none.
    unloaded_ns
        When that hold is, nanoseconds since 1970 UTC; None where this capture has none.
    start_ns, stop_ns
        Limits of the measurement.
    rate_hz
        States per second.
    load
        Load in percent by the clock of the lidars; None without a channel.
    progress
        Told the stage, what is done and what there is to do.
    moves
        Tripods that were moved and stand elsewhere from then on, in order of time.
    plan
        What the paper's method needs to know beforehand, where that was settled already.
    survey
        First pass over the frames, where it was made while the tripods were watched.
    """

    config: Config
    capture: Capture
    calibration: Calibration
    lidars: tuple[str, ...]
    clouds: Mapping[str, HoldCloud]
    unloaded_ns: tuple[int, int] | None
    start_ns: int
    stop_ns: int
    rate_hz: float
    load: Channel | None = None
    progress: Progress | None = None
    threads: int | None = None
    moves: tuple[Move, ...] = ()
    plan: Plan | None = None
    survey: _native.DistancePass | None = None

    @property
    def period_ns(self) -> int:
        """From state to state."""
        return round(1e9 / self.rate_hz)

    @property
    def first_ns(self) -> int:
        """The first state: the first multiple of the period after the start."""
        return (self.start_ns // self.period_ns + 1) * self.period_ns

    @property
    def poses(self) -> NDArray[np.float64]:
        """World from sensor of every lidar at first, shape (lidars, 4, 4)."""
        return np.array([self.calibration.pose(id).world_from_sensor for id in self.lidars])

    @property
    def stands(self) -> NDArray[np.intp]:
        """Place of the lidar of every stand: the lidars as calibrated, then where each moved to."""
        moved = [self.lidars.index(move.lidar) for move in self.moves]
        return np.array([*range(len(self.lidars)), *moved], dtype=np.intp)

    @property
    def native_moves(self) -> list[tuple[int, int, int, list[list[float]]]]:
        """The moves as the core takes them."""
        return [
            (self.lidars.index(m.lidar), m.left_ns, m.from_ns, m.world_from_sensor.tolist())
            for m in self.moves
        ]

    def listener(self, stage: str) -> Callable[[int, int], None] | None:
        """Return who is told the progress of one stage, or None where nobody listens."""
        return stage_listener(self.progress, stage)


def stage_listener(progress: Progress | None, stage: str) -> Callable[[int, int], None] | None:
    """Return who is told the progress of one stage, or None where nobody listens."""
    return None if progress is None else lambda done, total: progress(stage, done, total)
