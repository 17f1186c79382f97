import struct
from pathlib import Path

import numpy as np
import polars as pl
import pytest

from lidar_deflect import capture, decode, tables
from lidar_deflect.errors import CaptureError, InvalidValueError, OutputError
from packets import puck, write_pcap

COLUMNS = (
    *("time", "lidar", "sweep", "packet", "block", "frame_id", "ring", "azimuth_deg", "range_m"),
    *("x_m", "y_m", "z_m", "intensity", "return_index", "return_kind"),
)


@pytest.fixture(scope="module")
def opened(tmp_path_factory: pytest.TempPathFactory) -> capture.Capture:
    sent = [*puck(0.5), *puck(0.5, source="192.168.1.202", mode=0x39)]
    path = write_pcap(tmp_path_factory.mktemp("decode") / "run.pcap", sent)
    return capture.open(path)


@pytest.fixture(scope="module")
def frame(opened: capture.Capture, tmp_path_factory: pytest.TempPathFactory) -> pl.DataFrame:
    path = tmp_path_factory.mktemp("out") / "points.parquet"
    decode.decode(opened, path)
    return tables.read(path)


def test_parquet_holds_the_declared_table(opened: capture.Capture, frame: pl.DataFrame) -> None:
    tables.check("decoded", frame)
    # The second lidar repeats its single wall: half of its returns are merged.
    assert len(frame) == 376 * 384 + 753 * 192
    assert frame["frame_id"].null_count() == len(frame)
    assert set(frame["lidar"]) == set(opened.lidars)
    kinds = frame.group_by("lidar").agg(pl.col("return_kind").unique()).sort("lidar")
    assert kinds["return_kind"].to_list() == [["strongest"], ["merged"]]
    own = frame.filter(pl.col("lidar") == opened.lidars[0])
    sweeps = list(opened.sweeps(opened.lidars[0]))
    xyz = np.concatenate([sweep.xyz for sweep in sweeps])
    np.testing.assert_array_equal(own.select("x_m", "y_m", "z_m").to_numpy(), xyz)
    index = np.concatenate([np.full(len(sweep), sweep.index) for sweep in sweeps])
    np.testing.assert_array_equal(own["sweep"].to_numpy(), index)
    # In the order of arrival the lidars are interleaved.
    assert frame["lidar"].head(100_000).n_unique() == 2


def test_counts_tell_points_and_merged(opened: capture.Capture, tmp_path: Path) -> None:
    counts = decode.decode(opened, tmp_path / "points.ply")
    assert (counts["points"], counts["merged"]) == (376 * 384 + 753 * 192, 753 * 192)
    assert counts["drops"] == []


def test_csv_has_the_same_columns(
    opened: capture.Capture, frame: pl.DataFrame, tmp_path: Path
) -> None:
    path = tmp_path / "points.csv"
    decode.decode(opened, path, stop_s=0.1)
    read = pl.read_csv(path, try_parse_dates=True)
    assert read.columns == frame.columns
    assert (
        path.read_text().splitlines()[1].startswith("2024-06-10T06:13:20.000000000Z,192.168.1.20")
    )
    np.testing.assert_allclose(read["x_m"], frame["x_m"].head(len(read)), rtol=1e-6, atol=1e-9)


def test_npz_has_the_same_columns(
    opened: capture.Capture, frame: pl.DataFrame, tmp_path: Path
) -> None:
    decode.decode(opened, tmp_path / "points.npz")
    with np.load(tmp_path / "points.npz") as pack:
        assert set(pack.files) == set(COLUMNS)
        for name in COLUMNS:
            expected = frame[name].cast(pl.String) if name == "return_kind" else frame[name]
            if name == "time":
                np.testing.assert_array_equal(pack[name].astype(int), expected.to_physical())
            elif name == "frame_id":
                assert np.isnan(pack[name]).all()
            else:
                np.testing.assert_array_equal(pack[name], expected.to_numpy())


def test_ply_and_pcd_hold_the_same_records(
    opened: capture.Capture, frame: pl.DataFrame, tmp_path: Path
) -> None:
    ply, pcd = tmp_path / "points.ply", tmp_path / "points.pcd"
    decode.decode(opened, ply)
    decode.decode(opened, pcd)
    for points in (read_ply(ply), read_pcd(pcd)):
        assert len(points) == len(frame)
        assert set(COLUMNS) <= set(points.dtype.names or ())
        for axis in "xyz":
            np.testing.assert_array_equal(points[axis], frame[f"{axis}_m"].to_numpy())
            np.testing.assert_array_equal(points[f"{axis}_m"], points[axis])
        for name in ("sweep", "packet", "block", "ring", "intensity", "return_index"):
            np.testing.assert_array_equal(points[name], frame[name].to_numpy())
    np.testing.assert_array_equal(read_pcd(pcd)["time"], frame["time"].to_physical())
    seconds = frame["time"].to_physical().to_numpy() / 1e9
    np.testing.assert_array_equal(read_ply(ply)["time"], seconds)


def read_ply(path: Path) -> np.ndarray:
    """Read binary PLY as its definition says."""
    types = {"float": "<f4", "double": "<f8", "uchar": "u1", "ushort": "<u2", "uint": "<u4"}
    header, _, body = path.read_bytes().partition(b"end_header\n")
    words = [line.split() for line in header.decode().splitlines()]
    count = next(int(line[2]) for line in words if line[:2] == ["element", "vertex"])
    fields = [(line[2], types[line[1]]) for line in words if line[0] == "property"]
    return np.frombuffer(body, np.dtype(fields), count)


def read_pcd(path: Path) -> np.ndarray:
    """Read binary PCD as its definition says."""
    header, _, body = path.read_bytes().partition(b"DATA binary\n")
    lines = (line.split() for line in header.decode().splitlines() if not line.startswith("#"))
    facts = {key: values for key, *values in lines}
    kinds = {"F": "<f", "U": "<u", "I": "<i"}
    pairs = zip(facts["TYPE"], facts["SIZE"], strict=True)
    types = [kinds[kind] + size for kind, size in pairs]
    fields = list(zip(facts["FIELDS"], types, strict=True))
    return np.frombuffer(body, np.dtype(fields), int(facts["POINTS"][0]))


def test_a_cut_capture_holds_the_same_points(
    opened: capture.Capture, frame: pl.DataFrame, tmp_path: Path
) -> None:
    counts = decode.decode(
        opened, tmp_path / "cut.pcap", lidars=[opened.lidars[1]], start_s=0.1, stop_s=0.3
    )
    cut = capture.open(tmp_path / "cut.pcap")
    assert cut.lidars == (opened.lidars[1],)
    decode.decode(cut, tmp_path / "cut.parquet")
    part = frame.filter(
        (pl.col("lidar") == opened.lidars[1])
        & pl.col("packet").is_between(int(0.1 / 0.000663552) + 1, int(0.3 / 0.000663552))
    )
    found = tables.read(tmp_path / "cut.parquet")
    assert counts["points"] == len(found) == len(part)
    np.testing.assert_array_equal(found["x_m"], part["x_m"])
    assert (found["time"] == part["time"]).all()


def test_an_output_is_whole_or_not_there(opened: capture.Capture, tmp_path: Path) -> None:
    for suffix in (".parquet", ".csv", ".npz", ".ply", ".pcd", ".pcap"):
        out = tmp_path / f"points{suffix}"

        def stop(done: int, total: int) -> None:
            raise KeyboardInterrupt(done, total)

        with pytest.raises(KeyboardInterrupt):
            decode.decode(opened, out, progress=stop)
        assert list(tmp_path.iterdir()) == []
        with pytest.raises(CaptureError, match="no point") as caught:
            decode.decode(opened, out, start_s=100.0)
        assert caught.value.code == "capture.no_points"
        assert list(tmp_path.iterdir()) == []


def test_what_is_there_stays_unless_told(opened: capture.Capture, tmp_path: Path) -> None:
    out = tmp_path / "points.ply"
    out.write_text("mine")
    with pytest.raises(OutputError, match="exists already"):
        decode.decode(opened, out)
    assert out.read_text() == "mine"
    decode.decode(opened, out, overwrite=True)
    assert out.read_bytes().startswith(b"ply\n")


def test_unknown_suffixes_and_lidars_are_refused(opened: capture.Capture, tmp_path: Path) -> None:
    with pytest.raises(InvalidValueError, match=r"\.parquet, \.csv"):
        decode.decode(opened, tmp_path / "points.xyz")
    with pytest.raises(InvalidValueError, match="lidar"):
        decode.decode(opened, tmp_path / "points.ply", lidars=["L9"])


def test_a_cut_capture_is_a_plain_pcap(opened: capture.Capture, tmp_path: Path) -> None:
    decode.decode(opened, tmp_path / "cut.pcap")
    magic, major, minor = struct.unpack("<IHH", (tmp_path / "cut.pcap").read_bytes()[:8])
    assert (magic, major, minor) == (0xA1B23C4D, 2, 4)
