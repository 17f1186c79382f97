"""A whole test: both methods against its own length, a script on scikit-learn beside them."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import captures
import numpy as np
import velodyne_decoder
from rounds import Row, ratio, rounds, table
from sklearn.cluster import DBSCAN

import lidar_deflect as ld

if TYPE_CHECKING:
    from collections.abc import Callable
    from pathlib import Path

    from numpy.typing import NDArray

PAPER, BEAM, SCRIPT = "the paper's method", "the beam method", "script on scikit-learn"
LOW_M, HIGH_M = np.array([-5.0, -4.0, 60.0]), np.array([12.0, 6.0, 111.0])


def script(path: Path, poses: dict[str, NDArray[np.float64]]) -> int:
    """Steps 5 to 9 as one would write them with today's libraries, lidar by lidar.

    Sweeps by velodyne-decoder, whose reader takes one sensor: every lidar's packets are given to it
    by their source address.
    """
    curves = 0
    for address, pose in poses.items():
        decoder = velodyne_decoder.StreamDecoder(
            velodyne_decoder.Config(model=velodyne_decoder.Model.VLP16)
        )
        for time_s, payload in _packets(path, address):
            scan = decoder.decode(time_s, payload, as_pcl_structs=True)
            if scan is not None:
                curves += _frame(scan[1], pose)
    return curves


def _packets(path: Path, address: str) -> Any:
    """Host time and payload of one sender's packets in a little-endian pcap."""
    data, place, wanted = path.read_bytes(), 24, bytes(map(int, address.split(".")))
    while place < len(data):
        head = np.frombuffer(data, "<u4", 4, place)
        if head[2] == 1248 and data[place + 42 : place + 46] == wanted:
            yield float(head[0]) + 1e-9 * float(head[1]), data[place + 58 : place + 1264]
        place += 16 + int(head[2])


def _frame(points: Any, pose: NDArray[np.float64]) -> int:
    xyz = np.column_stack([points["x"], points["y"], points["z"]]) @ pose[:3, :3].T + pose[:3, 3]
    inside = ((xyz >= LOW_M) & (xyz <= HIGH_M)).all(axis=1)
    xyz, ring = xyz[inside], points["ring"][inside]
    if len(xyz) < 8:
        return 0
    distance_m = np.linalg.norm(xyz.mean(axis=0) - pose[:3, 3])
    radius_m = 1.5 * np.tan(np.radians(0.2)) * 4 * distance_m + 0.05
    kept = DBSCAN(eps=radius_m, min_samples=4).fit(xyz).labels_ >= 0
    xyz, ring = xyz[kept], ring[kept]
    ends = [(line[line[:, 0].argmin()], line[line[:, 0].argmax()]) for line in _lines(xyz, ring)]
    for edge in zip(*ends, strict=True):
        samples = np.array(edge)
        agree = DBSCAN(eps=1.0, min_samples=3).fit(samples).labels_ >= 0
        if agree.sum() > 2:
            np.polyfit(samples[agree, 2], samples[agree, :2], 2)
    return 1


def _lines(xyz: NDArray[np.float64], ring: NDArray[Any]) -> list[NDArray[np.float64]]:
    return [xyz[ring == number] for number in np.unique(ring)]


def measure(repeats: int, *, large: bool) -> list[Row]:  # noqa: ARG001
    """Print one table; return what was asked."""
    folder = captures.yard()
    capture = folder / "capture.pcap"
    test = ld.Test.load(folder / "test.toml")
    calibration = test.calibrate(capture)
    poses = {pose.source: np.asarray(pose.world_from_sensor) for pose in calibration.poses}
    jobs: dict[str, Callable[[], Any]] = {
        SCRIPT: lambda: script(capture, poses),
        PAPER: lambda: test.measure(capture, calibration=calibration, method="paper"),
        BEAM: lambda: test.measure(capture, calibration=calibration, method="beam"),
    }
    timed = rounds(jobs, min(repeats, 3))
    seen = ld.open(capture)
    seen.scan()
    length_s = (max(lidar.last_ns for lidar in seen.streams) - seen.first_time_ns) * 1e-9
    print(f"\n{length_s:.1f} s of a test\n{table(timed, length_s, 's of test', PAPER)}")
    real = {name: length_s / job.median_s for name, job in timed.items()}
    return [
        Row("paper's method, four VLP-16", "150 x real time", f"{real[PAPER]:.0f}"),
        Row("the same", f"60 x {SCRIPT}", f"{ratio(timed, SCRIPT, PAPER):.0f}"),
        Row("beam method, four VLP-16", "40 x real time", f"{real[BEAM]:.1f}"),
    ]
