"""Are files of points what their readers expect, and does memory not grow with the capture?"""

import re
import subprocess
import sys
from pathlib import Path

import laspy
import numpy as np
import polars as pl
import pytest

from lidar_deflect import capture, decode, tables
from lidar_deflect.lasfiles import gps_time_s
from packets import START_US, puck, write_pcap
from test_decode import read_pcd, read_ply

CAPTURES = Path(__file__).parents[2] / "shared" / "captures"
STEP_M = 1e-4


@pytest.fixture(scope="module")
def opened(tmp_path_factory: pytest.TempPathFactory) -> capture.Capture:
    sent = [*puck(0.3), *puck(0.3, source="192.168.1.202", mode=0x39)]
    return capture.open(write_pcap(tmp_path_factory.mktemp("exports") / "run.pcap", sent))


@pytest.fixture(scope="module")
def frame(opened: capture.Capture, tmp_path_factory: pytest.TempPathFactory) -> pl.DataFrame:
    path = tmp_path_factory.mktemp("frame") / "points.parquet"
    decode.decode(opened, path)
    return tables.read(path)


@pytest.mark.parametrize("suffix", [".las", ".laz"])
def test_las_is_read_back(
    suffix: str, opened: capture.Capture, frame: pl.DataFrame, tmp_path: Path
) -> None:
    path = tmp_path / f"points{suffix}"
    decode.decode(opened, path)
    las = laspy.read(path)
    assert len(las.points) == len(frame)
    assert (str(las.header.version), las.header.point_format.id) == ("1.4", 6)
    assert las.header.are_points_compressed == (suffix == ".laz")
    for axis in "xyz":
        own = frame[f"{axis}_m"].to_numpy()
        # Half a step of the grid, and what f64 makes of it.
        assert np.abs(las[axis] - own).max() <= STEP_M / 2 * 1.001
        np.testing.assert_array_equal(las[f"{axis}_m"], own)
    np.testing.assert_array_equal(las.header.mins, [las[axis].min() for axis in "xyz"])
    np.testing.assert_array_equal(las["time"], frame["time"].to_physical())
    for name in ("sweep", "packet", "block", "ring", "azimuth_deg", "range_m", "intensity"):
        np.testing.assert_array_equal(las[name], frame[name].to_numpy())
    np.testing.assert_array_equal(las.return_number, frame["return_index"].to_numpy() + 1)
    assert np.isnan(las["frame_id"]).all()
    record = next(vlr for vlr in las.header.vlrs if vlr.user_id == "lidar-deflect")
    legend = re.findall(rb'"(192[^"]+)"', record.record_data_bytes())
    names = [legend[number].decode() for number in las["lidar"]]
    assert names == frame["lidar"].to_list()


def test_gps_time_is_adjusted_standard_time() -> None:
    # Midnight of 2017-01-01 UTC: GPS week 1930, 18 s into Sunday.
    new_year_ns = 1_483_228_800 * 10**9
    expected_s = 1930 * 604_800 + 18 - 1e9
    assert gps_time_s(np.array([new_year_ns]))[0] == expected_s
    # A second earlier the leap second has still to come.
    assert gps_time_s(np.array([new_year_ns - 10**9]))[0] == expected_s - 2
    assert gps_time_s(np.array([new_year_ns + 250]))[0] == pytest.approx(expected_s, abs=4e-7)


def test_the_frame_count_of_an_ouster_is_in_every_file(tmp_path: Path) -> None:
    path = CAPTURES / "ouster_os0_32_rng19_dual.pcap"
    if not path.is_file():
        pytest.skip("the captures are not beside the project")
    ouster = capture.open(path)
    for suffix in (".parquet", ".csv", ".npz", ".las", ".ply", ".pcd"):
        decode.decode(ouster, tmp_path / f"points{suffix}")
    frame = tables.read(tmp_path / "points.parquet")
    expected = frame["frame_id"].to_numpy()
    assert frame["frame_id"].null_count() == 0
    assert frame.group_by("frame_id").agg(pl.col("sweep").n_unique())["sweep"].max() == 1
    read = pl.read_csv(tmp_path / "points.csv")["frame_id"].to_numpy()
    np.testing.assert_array_equal(read, expected)
    np.testing.assert_array_equal(np.load(tmp_path / "points.npz")["frame_id"], expected)
    np.testing.assert_array_equal(laspy.read(tmp_path / "points.las")["frame_id"], expected)
    np.testing.assert_array_equal(read_ply(tmp_path / "points.ply")["frame_id"], expected)
    np.testing.assert_array_equal(read_pcd(tmp_path / "points.pcd")["frame_id"], expected)


def test_a_cut_of_an_ouster_keeps_its_points(tmp_path: Path) -> None:
    path = CAPTURES / "ouster_os2_128_rng19.pcap"
    if not path.is_file():
        pytest.skip("the captures are not beside the project")
    ouster = capture.open(path)
    counts = decode.decode(ouster, tmp_path / "cut.pcap")
    assert counts["points"] == sum(stream.points for stream in ouster.streams)


PEAK = """
import sys
from pathlib import Path
from lidar_deflect import capture, decode
decode.decode(capture.open(sys.argv[1]), sys.argv[2])
peak = [line for line in Path("/proc/self/status").read_text().splitlines() if "VmHWM" in line]
print(peak[0].split()[1])
"""


POINTS_PER_S = 290_000


def peak_kb(path: Path, out: Path) -> int:
    done = subprocess.run(
        [sys.executable, "-c", PEAK, path, out], capture_output=True, text=True, check=True
    )
    return int(done.stdout)


@pytest.fixture(scope="module")
def lengths(tmp_path_factory: pytest.TempPathFactory) -> dict[int, Path]:
    """Captures by their seconds, of `POINTS_PER_S` points each."""
    folder = tmp_path_factory.mktemp("long")
    sent = [one for number in range(9) for one in puck(10.0, start_us=START_US + number * 10**7)]
    return {
        seconds: write_pcap(folder / f"{seconds}.pcap", sent[: len(sent) * seconds // 90])
        for seconds in (10, 30, 50, 90)
    }


@pytest.mark.slow
@pytest.mark.parametrize("suffix", [".parquet", ".csv", ".npz", ".las", ".ply", ".pcd", ".pcap"])
def test_a_longer_capture_takes_no_more_memory(
    suffix: str, lengths: dict[int, Path], tmp_path: Path
) -> None:
    if not Path("/proc/self/status").is_file():
        pytest.skip("the system does not tell the peak of memory in /proc")
    # The writer of parquet takes some blocks at once: it is full after 30 s.
    short, long = (30, 90) if suffix == ".parquet" else (10, 50)
    short_kb, long_kb = (
        peak_kb(lengths[seconds], tmp_path / f"{seconds}{suffix}") for seconds in (short, long)
    )
    # 40 s more are 11.6e6 points x 60 bytes = 700 MB as a table.
    # A quarter of it is play of the allocator and of threads.
    table_kb = (long - short) * POINTS_PER_S * 60 / 1024
    assert long_kb - short_kb < 0.25 * table_kb, f"{short_kb} kB, then {long_kb} kB"
