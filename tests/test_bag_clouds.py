"""Do clouds of a bag give the points that were recorded, in turns, with their own times?"""

from pathlib import Path
from typing import Any

import numpy as np
import polars as pl
import pytest
from numpy.typing import NDArray

from bag_files import KINDS, Bags, Entry
from lidar_deflect import capture, decode, tables
from lidar_deflect.capture import Sweep
from lidar_deflect.errors import CaptureError
from packets import puck, write_pcap

CLOUD = "sensor_msgs/msg/PointCloud2"
CUSTOM = "livox_ros_driver2/msg/CustomMsg"
TOPIC = "/tower/points"
NUMBERS = {"u1": 2, "u2": 4, "u4": 6, "f4": 7, "f8": 8}
LATENCY_NS = 3_000_000


def point_cloud(writer: Bags, header_ns: int, points: NDArray[Any], height: int = 1) -> Any:
    """A PointCloud2 of records; `height` rows are padded by five bytes each."""
    fields = [
        writer.message(
            "sensor_msgs/msg/PointField",
            name=name,
            offset=points.dtype.fields[name][1],
            datatype=NUMBERS[points.dtype[name].str[1:]],
            count=1,
        )
        for name in points.dtype.names or ()
    ]
    width = len(points) // height
    rows = np.frombuffer(points.tobytes(), np.uint8).reshape(height, -1)
    if height > 1:
        rows = np.pad(rows, ((0, 0), (0, 5)))
    return writer.message(
        CLOUD,
        header=writer.header(header_ns),
        height=height,
        width=width,
        fields=fields,
        is_bigendian=False,
        point_step=points.itemsize,
        row_step=rows.shape[1],
        data=rows.reshape(-1),
        is_dense=False,
    )


def records(sweep: Sweep, time_field: tuple[str, str]) -> tuple[int, NDArray[Any]]:
    """Points as drivers publish them, the first of another beam than the earliest, and a gap."""
    name, kind = time_field
    layout = [("x", "<f4"), ("y", "<f4"), ("z", "<f4"), ("intensity", "<f4"), ("ring", "<u2")]
    points = np.zeros(len(sweep) + 1, np.dtype([*layout, (name, "<" + kind)], align=True))
    header_ns = int(sweep.time_ns.min())
    order = np.argsort(sweep.ring, kind="stable")  # organised by beams, as many are
    for place, axis in enumerate("xyz"):
        points[axis][:-1] = sweep.xyz[order, place]
    points["intensity"][:-1], points["ring"][:-1] = sweep.intensity[order], sweep.ring[order]
    since_ns = sweep.time_ns[order] - header_ns
    stamps = {
        "time": since_ns * 1e-9,
        "t": since_ns,
        "timestamp": sweep.time_ns[order] * (1.0 if kind == "f8" else 1e-9),
    }[name]
    points[name][:-1] = stamps
    points["x"][-1] = np.nan
    return header_ns, points


@pytest.fixture(scope="module")
def sweeps(tmp_path_factory: pytest.TempPathFactory) -> list[Sweep]:
    path = tmp_path_factory.mktemp("clouds") / "run.pcap"
    return list(capture.open(write_pcap(path, puck(1.05))).sweeps())


def clouds(writer: Bags, sweeps: list[Sweep], time_field: tuple[str, str]) -> list[Entry]:
    entries: list[Entry] = []
    for sweep in sweeps:
        header_ns, points = records(sweep, time_field)
        message = point_cloud(writer, header_ns, points, height=1)
        entries.append((TOPIC, CLOUD, int(sweep.time_ns.max()) + LATENCY_NS, message))
    return entries


@pytest.mark.parametrize("time_field", [("time", "f4"), ("t", "u4"), ("timestamp", "f8")])
@pytest.mark.parametrize("kind", KINDS)
def test_clouds_give_points_turns_and_times(
    kind: str, time_field: tuple[str, str], sweeps: list[Sweep], tmp_path: Path
) -> None:
    writer = Bags(kind)
    bag = writer.write(tmp_path / "run", clouds(writer, sweeps, time_field))
    opened = capture.open(bag)
    stream = opened.streams[0]
    assert (stream.model, stream.source, stream.clock_kind) == ("points", TOPIC, "utc")
    assert stream.points == sum(len(sweep) for sweep in sweeps)
    assert stream.rpm == pytest.approx(600, rel=0.01)
    assert stream.lost == 0
    frame = decoded(bag, tmp_path)
    # f32 seconds up to 0.1 s are good to 4 ns, f64 nanoseconds since 1970 to 128 ns.
    tolerance_ns = {"time": 8, "t": 0, "timestamp": 256}[time_field[0]]
    expected = {name: np.concatenate([getattr(s, name) for s in sweeps]) for name in COLUMNS}
    one, other = in_order(as_columns(frame)), in_order(expected)
    for name in ("xyz", "ring", "intensity"):
        np.testing.assert_array_equal(one[name], other[name])
    assert np.abs(one["time_ns"] - other["time_ns"]).max() <= tolerance_ns
    # From the origin; the sensor measures from its lenses, up to 11 mm above it.
    np.testing.assert_allclose(one["range_m"], np.linalg.norm(one["xyz"], axis=1), rtol=1e-6)
    assert np.abs(one["range_m"] - other["range_m"]).max() < 0.012
    # Turns are cut at the sensor's azimuth 0, as from its packets.
    turns = frame.group_by("sweep").len().sort("sweep")["len"].to_numpy()
    counted = np.array([len(sweep) for sweep in sweeps])
    assert len(turns) == len(counted)
    assert np.abs(turns - counted).max() <= 0.01 * counted.max()
    azimuth_deg = np.concatenate([sweep.azimuth_deg for sweep in sweeps])
    off_deg = in_order({**expected, "azimuth": azimuth_deg})["azimuth"] - one["azimuth"]
    assert np.abs((off_deg + 180) % 360 - 180).max() < 1e-3


COLUMNS = ("xyz", "ring", "intensity", "time_ns", "range_m")


def decoded(bag: Path, folder: Path) -> pl.DataFrame:
    decode.decode(capture.open(bag), folder / "points.parquet")
    return tables.read(folder / "points.parquet")


def as_columns(frame: pl.DataFrame) -> dict[str, NDArray[Any]]:
    return {
        "xyz": frame.select("x_m", "y_m", "z_m").to_numpy(),
        "ring": frame["ring"].to_numpy(),
        "intensity": frame["intensity"].to_numpy(),
        "time_ns": frame["time"].to_physical().to_numpy(),
        "range_m": frame["range_m"].to_numpy(),
        "azimuth": frame["azimuth_deg"].to_numpy(),
    }


def in_order(columns: dict[str, NDArray[Any]]) -> dict[str, NDArray[Any]]:
    """Sort by beam, then by time: neighbours of a beam are 55 us apart."""
    order = np.lexsort((columns["time_ns"], columns["ring"]))
    return {name: values[order] for name, values in columns.items()}


def test_rows_with_padding_are_read(sweeps: list[Sweep], tmp_path: Path) -> None:
    writer = Bags("mcap")
    entries: list[Entry] = []
    for sweep in sweeps[1:4]:
        header_ns, points = records(sweep, ("t", "u4"))
        even = points[: len(points) // 16 * 16]
        message = point_cloud(writer, header_ns, even, height=16)
        entries.append((TOPIC, CLOUD, int(sweep.time_ns.max()), message))
    bag = writer.write(tmp_path / "run", entries)
    range_m = decoded(bag, tmp_path)["range_m"].to_numpy()
    assert len(range_m) == sum(len(sweep) // 16 * 16 for sweep in sweeps[1:4])
    assert np.abs(range_m - 10.0).max() < 0.012


@pytest.mark.parametrize("kind", KINDS)
def test_livox_clouds_are_one_turn_each(kind: str, tmp_path: Path) -> None:
    writer, random = Bags(kind), np.random.default_rng(3)
    start_ns, count = 1_718_000_000_000_000_000, 5_000
    entries: list[Entry] = []
    expected = []
    for number in range(8):
        base_ns = start_ns + number * 100_000_000
        offset = np.sort(random.integers(0, 99_000_000, count)).astype(np.uint32)
        xyz = random.uniform(1, 20, (count, 3)).astype(np.float32)
        bright, line = random.integers(0, 255, count), random.integers(0, 4, count)
        points = [
            writer.message(
                "livox_ros_driver2/msg/CustomPoint",
                offset_time=int(offset[n]),
                **{axis: float(xyz[n, k]) for k, axis in enumerate("xyz")},
                reflectivity=int(bright[n]),
                tag=0,
                line=int(line[n]),
            )
            for n in range(count)
        ]
        message = writer.message(
            CUSTOM,
            header=writer.header(base_ns, "livox_frame"),
            timebase=base_ns,
            point_num=count,
            lidar_id=1,
            rsvd=np.zeros(3, np.uint8),
            points=points,
        )
        entries.append(("/livox/lidar", CUSTOM, base_ns + 102_000_000, message))
        expected.append((base_ns + offset.astype(np.int64), xyz, bright, line))
    frame = decoded(writer.write(tmp_path / "run", entries), tmp_path)
    times, xyz, bright, line = (np.concatenate(column) for column in zip(*expected, strict=True))
    np.testing.assert_array_equal(frame["time"].to_physical(), times)
    np.testing.assert_array_equal(frame.select("x_m", "y_m", "z_m").to_numpy(), xyz)
    np.testing.assert_array_equal(frame["intensity"], bright)
    np.testing.assert_array_equal(frame["ring"], line)
    np.testing.assert_array_equal(frame["sweep"], np.repeat(np.arange(8), count))


def test_where_packets_are_their_clouds_are_left_out(sweeps: list[Sweep], tmp_path: Path) -> None:
    from test_bags import scans

    writer, sent = Bags("db3"), [*puck(0.3)]
    both = scans(writer, sent) + clouds(writer, sweeps[:3], ("t", "u4"))
    bag = writer.write(tmp_path / "run", sorted(both, key=lambda entry: entry[2]))
    assert [stream.model for stream in capture.open(bag).streams] == ["vlp16"]


def test_clouds_without_times_are_refused_and_counted(sweeps: list[Sweep], tmp_path: Path) -> None:
    writer = Bags("mcap")
    header_ns, points = records(sweeps[1], ("t", "u4"))
    bare = np.zeros(len(points), [("x", "<f4"), ("y", "<f4"), ("z", "<f4")])
    entry = (TOPIC, CLOUD, header_ns, point_cloud(writer, header_ns, bare))
    with pytest.raises(CaptureError) as caught:
        capture.open(writer.write(tmp_path / "run", [entry])).info()
    assert caught.value.code == "capture.no_lidar"
    assert ("cloud_without_times", "1") in caught.value.facts
