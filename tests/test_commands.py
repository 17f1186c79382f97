"""Do the commands do, through the real command line, what the interface says?"""

import json
import re
from pathlib import Path

import polars as pl
import pytest
import tomlkit

from conftest import command_line
from lidar_deflect import capture as captures
from lidar_deflect import config

ADDRESSES = [f"192.168.1.{last}" for last in (201, 202, 203, 204)]


def test_info_tells_every_lidar_and_agrees_with_its_json(short_test: Path) -> None:
    text = command_line("info", short_test / "capture.pcap")
    assert (text.code, text.err) == (0, "")
    done = command_line("info", short_test / "capture.pcap", "--json")
    streams = json.loads(done.out)["streams"]
    assert [stream["source"] for stream in streams] == ADDRESSES
    for stream in streams:
        line = next(line for line in text.out.splitlines() if line.startswith(stream["source"]))
        packets = f"{stream['packets']:,}".replace(",", " ")
        assert f" vlp16 strongest 600 {packets} " in " ".join(line.split()) + " "


def test_init_writes_a_configuration_that_loads(short_test: Path, tmp_path: Path) -> None:
    out = tmp_path / "new.toml"
    done = command_line("init", short_test / "capture.pcap", "-o", out, "--length", "110")
    assert done.code == 0, done.err
    written = config.load(out)
    assert written.blade.length_m == 110.0
    assert [lidar.source for lidar in written.lidars] == ADDRESSES
    assert {lidar.model for lidar in written.lidars} == {"vlp16"}


def test_every_line_that_init_comments_out_can_be_used(short_test: Path, tmp_path: Path) -> None:
    """Uncomment every optional key: what the text proposes must be what the loader accepts."""
    out = tmp_path / "new.toml"
    command_line("init", short_test / "capture.pcap", "-o", out, "--length", "110")
    text = re.sub(r"^# (?=\[|[a-z_]+ = )", "", out.read_text(encoding="utf-8"), flags=re.M)
    out.write_text(text, encoding="utf-8")
    written = config.load(out, check_files=False)
    assert written.load.value == "load_percent"
    assert written.sections[0].s_m == 84.0
    assert written.control[0].on == "ground"
    assert written.lidars[0].axes is not None


@pytest.mark.parametrize("suffix", ["parquet", "csv", "npz", "ply", "pcd"])
def test_decode_writes_every_format(suffix: str, short_test: Path, tmp_path: Path) -> None:
    out = tmp_path / f"points.{suffix}"
    done = command_line(
        *("decode", short_test / "capture.pcap", "-o", out, "--lidar", ADDRESSES[0]),
        *("--from", "0.5", "--to", "0.7", "--json"),
    )
    assert done.code == 0, done.err
    points = json.loads(done.out)["points"]
    # Two turns of 0.1 s at 16 lasers and 18.08 kHz, fewer by the shots that hit nothing.
    assert 5000 < points <= 60_000
    if suffix == "parquet":
        assert pl.read_parquet(out).height == points


def test_a_cut_capture_is_a_capture_again(short_test: Path, tmp_path: Path) -> None:
    out = tmp_path / "cut.pcap"
    done = command_line(
        "decode", short_test / "capture.pcap", "-o", out, "--from", "0.5", "--to", "1.5"
    )
    assert done.code == 0, done.err
    cut = captures.open(out)
    assert len(cut.lidars) == 4
    assert (cut.last_time_ns - cut.first_time_ns) / 1e9 == pytest.approx(1.0, abs=0.01)


def test_utc_and_seconds_name_the_same_span(short_test: Path, tmp_path: Path) -> None:
    capture = short_test / "capture.pcap"
    first_ns = captures.open(capture).first_time_ns
    utc = captures.utc(first_ns // 1000 * 1000 + 500_000_000)[:26] + "Z"
    counts = []
    for number, start in enumerate(("0.5", utc)):
        out = tmp_path / f"{number}.parquet"
        done = command_line("decode", capture, "-o", out, "--from", start, "--to", "0.6", "--json")
        assert done.code == 0, done.err
        counts.append(json.loads(done.out)["points"])
    assert counts[0] == pytest.approx(counts[1], rel=0.02)


def test_schema_prints_json_schemas() -> None:
    for what in ("config", "tables"):
        done = command_line("schema", what)
        assert (done.code, done.err) == (0, "")
        assert json.loads(done.out)["$schema"].startswith("https://json-schema.org/")


def test_check_accepts_what_simulate_writes(short_test: Path) -> None:
    done = command_line("check", short_test / "capture.pcap", "-c", short_test / "test.toml")
    assert done.code == 0, done.out + done.err


def test_poses_without_a_wall_are_written_and_exit_with_six(
    short_test: Path, tmp_path: Path
) -> None:
    document = tomlkit.parse((short_test / "test.toml").read_text(encoding="utf-8"))
    document["control"] = [p for p in document.unwrap()["control"] if p["on"] == "ground"]
    toml = short_test / "no-wall.toml"  # beside the files that it names
    toml.write_text(tomlkit.dumps(document), encoding="utf-8")
    done = command_line(
        "calibrate", short_test / "capture.pcap", "-c", toml, "-o", tmp_path / "calibration.toml"
    )
    assert done.code == 6, done.err
    assert "verdict: poor" in done.out
    assert "free to turn about the vertical (yaw)" in done.out
    assert (tmp_path / "calibration.toml").exists()


def test_the_road_from_capture_to_report(short_test: Path, tmp_path: Path) -> None:
    """Calibrate, measure, compare and report, each by its command."""
    capture, toml = short_test / "capture.pcap", short_test / "test.toml"
    poses, results = tmp_path / "calibration.toml", tmp_path / "results"
    done = command_line("calibrate", capture, "-c", toml, "-o", poses)
    assert done.code == 0, done.err
    done = command_line(
        "measure", capture, "-c", toml, "--calibration", poses, "-o", results, "--json", "--timings"
    )
    assert done.code == 0, done.err
    document = json.loads(done.out)
    assert document["schema"] == "lidar-deflect.measure/1"
    assert {row["step"] for row in document["steps"]} == {"0 %", "100 %"}
    assert "MB/s" in done.err
    assert "million points/s" in done.err
    for reference in ("truth.parquet", "wire.csv", "theory.csv"):
        done = command_line("compare", results, "--reference", short_test / reference)
        assert done.code == 0, done.err
        assert "100 %" in done.out
    assert command_line("compare", results, results).code == 0
    done = command_line("report", results)
    assert done.code == 0, done.err
    page = (results / "report.html").read_text(encoding="utf-8")
    assert "S110" in page
    assert 'src="http' not in page


def test_a_report_of_nothing_is_refused(tmp_path: Path) -> None:
    done = command_line("report", tmp_path)
    assert done.code == 3
    assert done.err.startswith("error[result.")
