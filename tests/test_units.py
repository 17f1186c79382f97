"""Calibration files of single units: named, found beside the capture, wrong, missing."""

import shutil
from pathlib import Path

import numpy as np
import pytest

from lidar_deflect import capture
from lidar_deflect.cli.info import describe
from lidar_deflect.errors import InvalidValueError

SAMPLES = Path(__file__).parent / "data" / "packets"
XT32 = SAMPLES / "hesai_xt32_dual.pcap"
ANGLES = SAMPLES / "hesai_xt32_dual.angle.csv"
SOURCE = "192.168.1.201"


@pytest.fixture
def alone(tmp_path: Path) -> Path:
    """A capture without its files beside it."""
    return Path(shutil.copy(XT32, tmp_path / "tower.pcap"))


def points(opened: capture.Capture) -> np.ndarray:
    return np.concatenate([sweep.xyz for sweep in opened.sweeps()])


def test_without_a_file_the_table_is_nominal_and_info_says_how_to_get_one(alone: Path) -> None:
    (stream,) = capture.open(alone).streams
    assert stream.beams.startswith("nominal table, unit calibration missing: fetch")
    assert "--beams" in stream.beams
    assert capture.open(alone).info()["streams"][0]["beams"] == stream.beams


def test_a_named_file_is_the_same_as_one_beside_the_capture(alone: Path) -> None:
    named = points(capture.open(alone, beams={SOURCE: ANGLES}))
    nominal = points(capture.open(alone))
    shutil.copy(ANGLES, alone.with_name("tower.angle.csv"))
    beside = capture.open(alone)
    assert beside.streams[0].beams == "tower.angle.csv"
    np.testing.assert_array_equal(points(beside), named)
    assert np.abs(named - nominal).max() > 1e-3


def test_a_named_file_counts_more_than_one_beside_the_capture(alone: Path) -> None:
    shutil.copy(ANGLES, alone.with_name("tower.angle.csv"))
    lines = ANGLES.read_text().splitlines()
    turned = [lines[0]]
    for line in lines[1:]:
        channel, elevation, azimuth = line.split(",")
        turned.append(f"{channel},{elevation},{float(azimuth) + 90}")
    other = alone.with_name("other.csv")
    other.write_text("\n".join(turned))
    beside, named = capture.open(alone), capture.open(alone, beams={"": [other]})
    assert named.streams[0].beams == "other.csv"
    x, y, z = points(beside).T
    np.testing.assert_allclose(points(named), np.column_stack([y, -x, z]), atol=1e-4)


def test_a_file_of_another_model_is_refused(alone: Path) -> None:
    opened = capture.open(alone, beams={SOURCE: SAMPLES / "hesai_qt128_dual.angle.csv"})
    with pytest.raises(InvalidValueError, match=r"qt128.*PandarXT-32.*Laser id") as caught:
        opened.scan()
    assert caught.value.code == "beams.not_taken"


def test_the_channel_file_of_a_qt128_may_be_named() -> None:
    files = [SAMPLES / f"hesai_qt128_dual.{kind}.csv" for kind in ("angle", "channel_config")]
    opened = capture.open(SAMPLES / "hesai_qt128_dual.pcap", beams={SOURCE: files})
    assert opened.streams[0].beams.startswith("hesai_qt128_dual.angle.csv")


def test_a_broken_file_is_told_with_its_line(alone: Path) -> None:
    broken = alone.with_name("tower.angle.csv")
    broken.write_text(ANGLES.read_text().replace("12,3.924965", "12,up"))
    opened = capture.open(alone)
    assert opened.streams[0].beams.startswith(
        "missing: tower.angle.csv, line 13: expected a number"
    )
    with pytest.raises(InvalidValueError, match="line 13") as caught:
        opened.sweeps()
    assert caught.value.code == "beams.malformed"


def test_a_file_that_cannot_be_read_is_told_at_once(alone: Path) -> None:
    with pytest.raises(InvalidValueError, match="gone") as caught:
        capture.open(alone, beams={SOURCE: "gone.csv"})
    assert caught.value.code == "beams.unreadable"
    with alone.with_name("huge.csv").open("wb") as huge:
        huge.truncate(5_000_000)
    with pytest.raises(InvalidValueError, match="5000000 bytes"):
        capture.open(alone, beams={SOURCE: alone.with_name("huge.csv")})


def test_a_file_whose_name_ends_early_or_with_a_number_is_found(alone: Path) -> None:
    calm = Path(shutil.copy(alone, alone.with_name("tower_calm.pcap")))
    shutil.copy(ANGLES, alone.with_name("tower.angle.csv"))
    # The shorter name is that of another capture, whose file this is.
    assert capture.open(calm).streams[0].beams.startswith("nominal")
    alone.unlink()
    assert capture.open(calm).streams[0].beams == "tower.angle.csv"
    shutil.copy(ANGLES, alone.with_name("tower_calm_0.csv"))
    assert capture.open(calm).streams[0].beams == "tower_calm_0.csv"
    shutil.copy(ANGLES, alone.with_name("tower_calm.csv"))
    assert capture.open(calm).streams[0].beams == "tower_calm.csv"


def test_a_file_of_another_model_beside_the_capture_is_told_and_left_alone(alone: Path) -> None:
    shutil.copy(SAMPLES / "hesai_qt128_dual.angle.csv", alone.with_name("tower.angle.csv"))
    opened = capture.open(alone)
    assert opened.streams[0].beams.startswith("nominal")
    (unused,) = opened.info()["unused_files"]
    assert unused["file"] == "tower.angle.csv"
    assert "tower.angle.csv lies beside the capture and is of no lidar in it" in describe(
        opened.info()
    )


def test_angles_of_a_model_with_as_many_channels_are_not_taken(alone: Path) -> None:
    lines = ["Channel,Elevation,Azimuth", *(f"{n},{20 - 1.3 * n:.3f},0" for n in range(1, 33))]
    alone.with_name("tower.angle.csv").write_text("\n".join(lines))
    opened = capture.open(alone)
    assert opened.streams[0].beams.startswith("nominal")
    assert len(opened.info()["unused_files"]) == 1


def test_one_column_of_firing_times_is_not_half_taken_by_a_qt128(tmp_path: Path) -> None:
    path = Path(shutil.copy(SAMPLES / "hesai_qt128_dual.pcap", tmp_path / "tower.pcap"))
    lines = ["Channel,fire time(us)", *(f"{n},{0.5 * n}" for n in range(1, 129))]
    times = tmp_path / "tower.firetime.csv"
    times.write_text("\n".join(lines))
    with pytest.raises(InvalidValueError) as caught:
        capture.open(path, beams={"": [times]}).scan()
    assert caught.value.code == "beams.not_taken"
    assert [entry["file"] for entry in capture.open(path).info()["unused_files"]] == [times.name]


def test_a_capture_named_after_another_model_is_told_by_its_content(tmp_path: Path) -> None:
    sample = SAMPLES / "velodyne_hdl32e_gps.pcap"
    path = Path(shutil.copy(sample, tmp_path / "velodyne_vlp32c_tower.pcap"))
    # As many lasers as an HDL-32E has, with elevations of a VLP-32C.
    elevations_deg = [-25.0, -1.0, -1.667, -15.639, -11.31, 0.0, -0.667, -8.843] * 4
    lasers = "".join(
        f"  - laser_id: {number}\n    vert_correction: {np.radians(elevation_deg)}\n"
        for number, elevation_deg in enumerate(elevations_deg)
    )
    (tmp_path / "velodyne_vlp32c.calib.yml").write_text(f"num_lasers: 32\nlasers:\n{lasers}")
    opened, plain = capture.open(path), capture.open(sample)
    (stream,) = opened.streams
    assert (stream.model, stream.beams) == ("hdl32e", "factory table")
    assert [entry["file"] for entry in opened.info()["unused_files"]] == [
        "velodyne_vlp32c.calib.yml"
    ]
    np.testing.assert_array_equal(points(opened), points(plain))
