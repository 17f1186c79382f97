"""Clouds as packets of points, which the compiled core reads as those of a sensor.

The layout stands in ``rust/core/src/packet/points.rs``.
"""

import struct
from collections.abc import Iterator
from math import tau

import numpy as np
from numpy.typing import NDArray

from lidar_deflect.bags.clouds import Cloud
from lidar_deflect.bags.turning import Rotor, rotor_of

__all__ = ["PointPacker"]

MAGIC = b"LDPOINTS"
HEAD = struct.Struct("<8sqIIffHBB")
POINT = np.dtype(
    [("offset", "<u4"), *((axis, "<f4") for axis in "xyz"), ("intensity", "<u2"), ("ring", "<u2")]
)
PACKET_NS = 2_000_000
"""Packets hold points of so much time."""
PACKET_POINTS = 3_000
"""And so many at most: a datagram has no room for more."""
LONGEST_NS = 1_000_000_000


class PointPacker:
    """Makes packets of the clouds of one topic.

    A cloud waits for the next one, whose start tells where the rotor has gone meanwhile. Where the
    azimuth does not turn evenly with time, as that of Livox patterns, one cloud counts as one turn.
    """

    def __init__(self) -> None:
        self._waiting: Cloud | None = None
        self._is_clockwise: bool | None = None
        self._sequence = 0

    def push(self, cloud: Cloud) -> Iterator[tuple[int, bytes]]:
        """Give the packets of the cloud before, each with the time of its end."""
        if len(cloud):
            yield from self._flush(int(cloud.time_ns[0]))
            self._waiting = cloud

    def finish(self) -> Iterator[tuple[int, bytes]]:
        """Give the packets of the last cloud."""
        if self._waiting is not None:
            times = self._waiting.time_ns
            yield from self._flush(int(times[-1]) + _step_ns(times))

    def _flush(self, next_ns: int) -> Iterator[tuple[int, bytes]]:
        cloud, self._waiting = self._waiting, None
        if cloud is None:
            return
        times, first_ns = cloud.time_ns, int(cloud.time_ns[0])
        end_ns = int(times[-1]) + _step_ns(times)
        if not end_ns - LONGEST_NS // 2 < next_ns < end_ns + LONGEST_NS // 2:
            next_ns = end_ns  # overlaps, or a pause of the recording
        next_ns = max(next_ns, end_ns, first_ns + 1)
        starts = _starts(times)
        rotor = self._rotor(cloud, starts)
        stops = [int(times[start]) for start in starts[1:]] + [next_ns]
        for number, stop_ns in enumerate(stops):
            piece = slice(starts[number], starts[number + 1] if number + 1 < len(starts) else None)
            start_ns = int(times[piece][0])
            encoder_rad, turned_rad = _turn(rotor, (first_ns, next_ns), (start_ns, stop_ns))
            yield stop_ns, self._packet(cloud, piece, stop_ns, encoder_rad, turned_rad)

    def _rotor(self, cloud: Cloud, starts: NDArray[np.intp]) -> Rotor | None:
        rotor = rotor_of(cloud.time_ns, cloud.xyz_m, starts)
        if rotor is not None and self._is_clockwise is None:
            self._is_clockwise = rotor.is_clockwise
        is_other = rotor is not None and rotor.is_clockwise != self._is_clockwise
        return None if is_other else rotor

    def _packet(
        self, cloud: Cloud, piece: slice, stop_ns: int, encoder_rad: float, turned_rad: float
    ) -> bytes:
        times = cloud.time_ns[piece]
        start_ns = int(times[0])
        points = np.empty(len(times), POINT)
        points["offset"] = times - start_ns
        for place, axis in enumerate("xyz"):
            points[axis] = cloud.xyz_m[piece, place]
        points["intensity"], points["ring"] = cloud.intensity[piece], cloud.ring[piece]
        head = HEAD.pack(
            *(MAGIC, start_ns, self._sequence, min(stop_ns - start_ns, LONGEST_NS)),
            *(encoder_rad, turned_rad, len(points), bool(self._is_clockwise), 0),
        )
        self._sequence = (self._sequence + 1) % (1 << 32)
        return head + points.tobytes()


def _turn(
    rotor: Rotor | None, cloud_ns: tuple[int, int], packet_ns: tuple[int, int]
) -> tuple[float, float]:
    """Give the encoder azimuth at the start of a packet, and the angle turned until its end."""
    span_ns = packet_ns[1] - packet_ns[0]
    if rotor is not None:
        turned = min(abs(rotor.rate_rad_per_ns) * span_ns, tau - 1e-3)
        return _float32(rotor.encoder_rad(packet_ns[0])), turned
    rate = tau / (cloud_ns[1] - cloud_ns[0])
    turned = min(rate * span_ns, tau - 1e-3)
    return _float32(rate * (packet_ns[0] - cloud_ns[0]) % tau), turned


def _float32(angle_rad: float) -> float:
    """Round without reaching the full turn."""
    return 0.0 if np.float32(angle_rad) >= np.float32(tau) else angle_rad


def _starts(time_ns: NDArray[np.int64]) -> NDArray[np.intp]:
    """Where the packets begin: by time, and where one would be too large."""
    number = (time_ns - time_ns[0]) // PACKET_NS
    starts = np.flatnonzero(np.diff(number, prepend=-1))
    stops = np.append(starts[1:], len(time_ns))
    pieces = [
        np.arange(start, stop, PACKET_POINTS) for start, stop in zip(starts, stops, strict=True)
    ]
    return np.concatenate(pieces).astype(np.intp)


def _step_ns(time_ns: NDArray[np.int64]) -> int:
    """Time from shot to shot."""
    steps = np.diff(time_ns)
    steps = steps[steps > 0]
    return int(np.median(steps)) if len(steps) else 1
