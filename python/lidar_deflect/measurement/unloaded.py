"""The unloaded hold: when it is, and what every lidar sees in it."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

from lidar_deflect import _native
from lidar_deflect.errors import MeasurementError

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    import numpy as np
    from numpy.typing import NDArray

    from lidar_deflect.capture import Capture
    from lidar_deflect.config import Config
    from lidar_deflect.holds import Hold

UNLOADED_PERCENT = 2.0
"""A hold below this load counts as unloaded."""

DEFAULT_S = 4.0
"""Without load channel and [reference], the yard is learned from so many first seconds."""

MAX_S = 10.0
"""More of a hold than this adds memory, not accuracy."""


@dataclass(frozen=True)
class HoldCloud:
    """All echoes of one lidar in a hold, sensor frame.

    Attributes
    ----------
    xyz, ring, azimuth_deg, intensity
        Shapes (n, 3), (n,), (n,), (n,), in the order of the shots; without intensities no target
        is found.
    """

    xyz: NDArray[np.float32]
    ring: NDArray[np.uint16]
    azimuth_deg: NDArray[np.float32]
    intensity: NDArray[np.float32] | None = None


def unloaded_hold(candidates: Sequence[Hold], span_ns: tuple[int, int]) -> Hold | None:
    """Return the first hold without load that overlaps a span of time, or None.

    Parameters
    ----------
    candidates
        Holds of a load channel.
    span_ns
        First and last instant of the capture.
    """
    for hold in candidates:
        overlaps = hold.to_ns > span_ns[0] and hold.from_ns < span_ns[1]
        if overlaps and abs(hold.load_percent or 0.0) < UNLOADED_PERCENT:
            return hold
    return None


def window_ns(config: Config, capture: Capture, known: Sequence[Hold] | None) -> tuple[int, int]:
    """Return the interval of the unloaded hold: configured, from the load channel, or the start."""
    first, last = capture.first_time_ns, capture.last_time_ns
    given = config.reference
    if given.from_s is not None or given.to_s is not None:
        start = first + _ns(given.from_s or 0.0)
        stop = last if given.to_s is None else first + _ns(given.to_s)
    elif (hold := unloaded_hold(known or (), (first, last))) is not None:
        start, stop = max(hold.from_ns, first), min(hold.to_ns, last)
    else:
        start, stop = first, min(last, first + _ns(DEFAULT_S))
    if start >= stop:
        raise MeasurementError(
            "the reference hold lies outside of the capture",
            code="measurement.no_reference",
            facts=[
                ("hold", f"{(start - first) * 1e-9:.3f} s to {(stop - first) * 1e-9:.3f} s"),
                ("capture", f"0 s to {(last - first) * 1e-9:.3f} s"),
            ],
            hint="correct from_s and to_s of [reference]",
        )
    return start, min(stop, start + _ns(MAX_S))


def collect(capture: Capture, lidar: str, window: tuple[int, int]) -> HoldCloud:
    """Gather all echoes of one lidar in an interval.

    Raises
    ------
    MeasurementError
        If the lidar sent nothing in it.
    """
    return collect_all(capture, [lidar], window)[lidar]


def collect_all(
    capture: Capture,
    lidars: Sequence[str],
    window: tuple[int, int],
    threads: int | None = None,
    *,
    with_intensity: bool = True,
) -> Mapping[str, HoldCloud]:
    """Gather the hold of every lidar, in one reading.

    Parameters
    ----------
    with_intensity
        Without, no target is found, and less memory taken.

    Raises
    ------
    MeasurementError
        If one of them sent nothing in it.
    """
    numbers, (start_ns, stop_ns) = capture.numbers(lidars), window
    columns = _native.hold_echoes(
        capture.native,
        lidars=numbers,
        start_ns=start_ns,
        stop_ns=stop_ns,
        with_intensity=with_intensity,
        threads=threads,
    )
    clouds = {
        lidar: HoldCloud(xyz, ring, azimuth_deg, intensity if with_intensity else None)
        for lidar, (xyz, ring, azimuth_deg, intensity) in zip(lidars, columns, strict=True)
    }
    for lidar, cloud in clouds.items():
        if not len(cloud.xyz):
            raise _without_echo(capture, lidar, window)
    return clouds


def _without_echo(capture: Capture, lidar: str, window: tuple[int, int]) -> MeasurementError:
    start_s, stop_s = ((edge - capture.first_time_ns) * 1e-9 for edge in window)
    return MeasurementError(
        f"lidar {lidar} sent no echo in the reference hold",
        code="measurement.no_echo",
        facts=[("hold", f"{start_s:.3f} s to {stop_s:.3f} s")],
        hint="see what it sent: lidar-deflect info CAPTURE",
    )


def _ns(seconds: float) -> int:
    return round(seconds * 1e9)
