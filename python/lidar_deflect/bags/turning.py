"""How a cloud came about: by a rotor that turns evenly, or by another pattern."""

from dataclasses import dataclass
from math import pi, tau

import numpy as np
from numpy.typing import NDArray

__all__ = ["Rotor", "rotor_of"]

STRAIGHT_RAD = 0.15
"""Spread about an even turn, of averages over all beams."""
LEAST_RAD = 0.5
"""A cloud that turns by less does not tell."""
GATHERED = 0.5
"""Length of the mean direction of a chunk whose points look the same way."""
LEAST_CHUNKS = 4


@dataclass(frozen=True)
class Rotor:
    """An even turn: the azimuth counterclockwise at `start_ns`, and its rate."""

    start_ns: int
    start_rad: float
    rate_rad_per_ns: float

    @property
    def is_clockwise(self) -> bool:
        """Whether it turns clockwise, seen from above."""
        return self.rate_rad_per_ns < 0

    def encoder_rad(self, time_ns: int) -> float:
        """Azimuth in the rotor's own sense, [0, 2 pi)."""
        angle = self.start_rad + self.rate_rad_per_ns * (time_ns - self.start_ns)
        return (-angle if self.is_clockwise else angle) % tau


def rotor_of(
    time_ns: NDArray[np.int64], xyz_m: NDArray[np.float32], starts: NDArray[np.intp]
) -> Rotor | None:
    """Find the rotor behind points in the order of time, `starts` of whose chunks are given."""
    rays = np.exp(1j * np.arctan2(xyz_m[:, 1].astype(float), xyz_m[:, 0].astype(float)))
    counts = np.diff(np.append(starts, len(rays)))
    means = np.add.reduceat(rays, starts) / counts
    since_ns = np.add.reduceat((time_ns - time_ns[0]).astype(float), starts) / counts
    gathered = np.abs(means) > GATHERED
    if gathered.sum() < LEAST_CHUNKS:
        return None
    angles, since_ns = np.unwrap(np.angle(means[gathered])), since_ns[gathered]
    if np.ptp(since_ns) <= 0:
        return None
    rate, start = np.polyfit(since_ns, angles, 1)
    off = np.abs(angles - (start + rate * since_ns))
    is_even = np.median(off) < STRAIGHT_RAD and off.max() < pi / 2
    turned = abs(rate) * np.ptp(since_ns)
    if not is_even or turned < LEAST_RAD:
        return None
    return Rotor(int(time_ns[0]), float(start), float(rate))
