"""Hold the way from a VLP-16 capture to sweeps against velodyne-decoder, numpy and memory itself.

python benches/peers/decode.py CAPTURE [--repeats 7]

All jobs read the same file, which is in the page cache after the first round. The numpy job is what
a script would do: one array of packets, vectorised, positions only, no sweeps, loss or time.
"""

from __future__ import annotations

import argparse
import struct
import warnings
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
import velodyne_decoder
from rounds import rounds, table

import lidar_deflect as ld

if TYPE_CHECKING:
    from collections.abc import Callable

    from numpy.typing import NDArray

ELEVATION_RAD = np.radians(
    [-15.0, 1, -13, 3, -11, 5, -9, 7, -7, 9, -5, 11, -3, 13, -1, 15],
)
PACKET_BYTES = 1206


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
    firing = (np.arange(2) * 55.296 + 0.0)[:, None] + np.arange(16) * 2.304
    angle = azimuth[:, None, None] + firing * 1e-6 * 20 * np.pi
    level = range_m * np.cos(ELEVATION_RAD)
    xyz = np.stack([level * np.cos(angle), -level * np.sin(angle), range_m * np.sin(ELEVATION_RAD)])
    return int((range_m > 0).sum()) + 0 * xyz.shape[0]


def by_velodyne_decoder(path: Path) -> int:
    """Sweeps by the library whose core is C++."""
    config = velodyne_decoder.Config(model=velodyne_decoder.Model.VLP16)
    scans = velodyne_decoder.read_pcap(path, config)
    return sum(len(points) for _, points in scans)


def by_us(path: Path) -> int:
    """Sweeps with all columns, as a notebook reads them; opening scans the file first."""
    capture = ld.open(path)
    return sum(len(sweep.xyz) for sweep in capture.sweeps(capture.lidars[0]))


def copied(path: Path) -> Callable[[], int]:
    """Read the file's bytes once through memory: the limit."""
    data = np.frombuffer(path.read_bytes(), np.uint8)
    room = np.empty_like(data)

    def copy() -> int:
        np.copyto(room, data)
        return len(room)

    return copy


def main() -> None:
    """Print one table."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("capture", type=Path)
    parser.add_argument("--repeats", type=int, default=7)
    options = parser.parse_args()
    warnings.simplefilter("ignore")
    packets = len(payloads(options.capture))
    jobs: dict[str, Callable[[], Any]] = {
        "velodyne-decoder, read_pcap": lambda: by_velodyne_decoder(options.capture),
        "numpy, positions only": lambda: by_numpy(options.capture),
        "capture.sweeps(), all columns": lambda: by_us(options.capture),
        "memcpy of the file": copied(options.capture),
    }
    timed = rounds(jobs, options.repeats)
    print(f"{packets} packets")
    print(table(timed, packets, "packets", "capture.sweeps(), all columns"))
    for name, job in timed.items():
        print(f"{name}: {job.result}")


if __name__ == "__main__":
    main()
