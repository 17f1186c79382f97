"""Hold the way from a VLP-16 capture to sweeps against other libraries and memory itself.

All jobs read the same file, which is in the page cache after the first round. The numpy and numba
jobs are what a script would do: positions only, no sweeps, loss or time.
"""

from __future__ import annotations

import struct
import warnings
from typing import TYPE_CHECKING, Any

import captures
import numba
import numpy as np
import velodyne_decoder
from rounds import Own, Row, ratio, rounds, table

import lidar_deflect as ld

if TYPE_CHECKING:
    from collections.abc import Callable
    from pathlib import Path

    from numpy.typing import NDArray

ELEVATION_RAD = np.radians(
    [-15.0, 1, -13, 3, -11, 5, -9, 7, -7, 9, -5, 11, -3, 13, -1, 15],
)
PACKET_BYTES = 1206
PYTHON, RUST = "capture.sweeps(), all columns", "scan and sweeps in Rust, one thread"
STREAM, TWO = "sweeps in Rust after a look at the head", "the same on two threads"
LIMIT = "memcpy of the file"
DECODER, NUMPY, NUMBA = "velodyne-decoder, read_pcap", "numpy, positions", "numba, positions"


def payloads(path: Path) -> NDArray[np.uint8]:
    """Data packets of a little-endian pcap, shape (n, 1206), as a script would find them."""
    data, place, found = path.read_bytes(), 24, []
    while place < len(data):
        (length,) = struct.unpack_from("<I", data, place + 8)
        if length == PACKET_BYTES + 42:
            found.append(data[place + 58 : place + 16 + length])
        place += 16 + length
    return np.frombuffer(b"".join(found), np.uint8).reshape(-1, PACKET_BYTES)


def by_numpy(path: Path) -> int:
    """Positions of all echoes with vectorised numpy."""
    blocks = payloads(path)[:, :1200].reshape(-1, 100)
    azimuth = np.radians(blocks[:, 2:4].copy().view("<u2")[:, 0] * 0.01)
    echoes = blocks[:, 4:].reshape(-1, 2, 16, 3)
    range_m = echoes[..., :2].copy().view("<u2")[..., 0] * np.float32(0.002)
    firing = (np.arange(2) * 55.296)[:, None] + np.arange(16) * 2.304
    angle = azimuth[:, None, None] + firing * 1e-6 * 20 * np.pi
    level = range_m * np.cos(ELEVATION_RAD)
    xyz = np.stack([level * np.cos(angle), -level * np.sin(angle), range_m * np.sin(ELEVATION_RAD)])
    return int((range_m > 0).sum()) + 0 * xyz.shape[0]


@numba.njit(cache=False)
def _loop(packets: Any, cos_up: Any, sin_up: Any, xyz: Any) -> int:
    count = 0
    for packet in packets:
        for block in range(12):
            start = block * 100
            azimuth = (packet[start + 2] + 256 * packet[start + 3]) * (0.01 * np.pi / 180.0)
            for shot in range(32):
                place = start + 4 + 3 * shot
                raw = packet[place] + 256 * packet[place + 1]
                if raw == 0:
                    continue
                laser = shot % 16
                after = shot // 16 * 55.296 + laser * 2.304
                angle = azimuth + after * 1e-6 * 20 * np.pi
                range_m = raw * 0.002
                level = range_m * cos_up[laser]
                xyz[count, 0] = level * np.cos(angle)
                xyz[count, 1] = -level * np.sin(angle)
                xyz[count, 2] = range_m * sin_up[laser]
                count += 1
    return count


def by_numba(path: Path) -> int:
    """Positions of all echoes by a compiled loop."""
    packets = payloads(path)
    xyz = np.empty((len(packets) * 384, 3), np.float32)
    return int(_loop(packets, np.cos(ELEVATION_RAD), np.sin(ELEVATION_RAD), xyz))


def by_velodyne_decoder(path: Path) -> int:
    """Sweeps by the library whose core is C++."""
    config = velodyne_decoder.Config(model=velodyne_decoder.Model.VLP16)
    scans = velodyne_decoder.read_pcap(path, config)
    return sum(len(points) for _, points in scans)


def by_us(path: Path) -> int:
    """Sweeps with all columns, as a notebook reads them; opening scans the file first."""
    capture = ld.open(path)
    return sum(len(sweep.xyz) for sweep in capture.sweeps(capture.lidars[0]))


def in_rust(job: str, path: Path) -> Own:
    """Sweeps with all columns, streamed, after a scan or a look at the head."""
    seconds, _, points = captures.in_rust(job, path)
    return Own(seconds, points)


def copied(path: Path) -> Callable[[], int]:
    """Move the file's bytes once through memory: the limit."""
    data = np.frombuffer(path.read_bytes(), np.uint8)
    room = np.empty_like(data)

    def copy() -> int:
        np.copyto(room, data)
        return len(room)

    return copy


def measure(repeats: int, *, large: bool) -> list[Row]:  # noqa: ARG001
    """Print one table; return what was asked."""
    path = captures.single()
    warnings.simplefilter("ignore")
    packets = len(payloads(path))
    jobs: dict[str, Callable[[], Any]] = {
        DECODER: lambda: by_velodyne_decoder(path),
        NUMPY: lambda: by_numpy(path),
        NUMBA: lambda: by_numba(path),
        PYTHON: lambda: by_us(path),
        RUST: lambda: in_rust("sweeps", path),
        STREAM: lambda: in_rust("stream", path),
        TWO: lambda: in_rust("two", path),
        LIMIT: copied(path),
    }
    timed = rounds(jobs, repeats)
    print(table(timed, packets, "packets", RUST))
    for name, job in timed.items():
        print(f"  {name}: {job.result}")
    rates = [path.stat().st_size / timed[name].median_s / 1e6 for name in (STREAM, LIMIT)]
    print(f"  {rates[0]:.0f} MB/s of capture in Rust, {rates[1]:.0f} MB/s by memcpy")
    asked = [
        (STREAM, 30, DECODER),
        (STREAM, 2.2, NUMBA),
        (RUST, 30, DECODER),
        (RUST, 2.2, NUMBA),
        (TWO, 1.7, STREAM),
        (PYTHON, 20, DECODER),
        (PYTHON, 5, NUMPY),
    ]
    return [
        Row(f"VLP-16, {name}", f"{times} x {peer}", f"{ratio(timed, peer, name):.2f}")
        for name, times, peer in asked
    ]
