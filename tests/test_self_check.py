"""Does a run whose data contradict its model say where?"""

import dataclasses
import shutil
from pathlib import Path

import numpy as np
import polars as pl
import pytest

import lidar_deflect as ld
from lidar_deflect.calibration import Calibration
from lidar_deflect.measurement.beam import whiteness
from lidar_deflect.measurement.beam.pulls import limit_of, pulls
from lidar_deflect.result import Result

NOISE_M = np.array([0.014, 0.014])
START_NS = 1_000_000_000_000


def told(count: int = 4000, seed: int = 1) -> dict[str, np.ndarray]:
    """Residuals of two lidars that are nothing but noise."""
    random = np.random.default_rng(seed)
    return {
        "s_m": random.uniform(70.0, 110.0, count),
        "time_ns": START_NS + random.integers(0, 4_000_000_000, count),
        "lidar": random.integers(0, 2, count),
        "residual_m": random.normal(0.0, NOISE_M[0], count),
    }


def test_noise_is_white_along_span_and_time() -> None:
    assert whiteness.along_span(told(), NOISE_M, "hold").passed
    assert whiteness.along_time(told(), NOISE_M, (START_NS, START_NS), "hold").passed


def test_a_bulge_of_the_surface_is_not_white_and_has_its_place() -> None:
    bulged = told()
    bulged["residual_m"] = bulged["residual_m"] + 0.012 * (np.abs(bulged["s_m"] - 91.0) < 2.0)
    check = whiteness.along_span(bulged, NOISE_M, "hold 100 %")
    assert not check.passed
    assert "92 m" in check.where or "91 m" in check.where or "90 m" in check.where
    assert whiteness.along_time(bulged, NOISE_M, (START_NS, START_NS), "hold").passed


def test_a_blade_that_moves_on_is_not_white_in_time() -> None:
    moved = told()
    late = moved["time_ns"] > START_NS + 3_000_000_000
    moved["residual_m"] = moved["residual_m"] + 0.02 * late
    check = whiteness.along_time(moved, NOISE_M, (START_NS, START_NS), "hold 100 %")
    assert not check.passed
    assert check.where.startswith("hold 100 %, 3.")


def test_a_pull_warns_beyond_its_limit_and_contradicts_far_beyond_it() -> None:
    # Prior deviation 1, posterior 0.6: the data could move it by 0.8.
    names = ["edge_angle", "edge_angle", "loads", "surface"]
    values = np.array([[0.8, 1.0, 0.6], [-0.4, 1.0, 0.6], [2.4, 1.0, 0.6], [8.0, 1.0, 0.6]])
    edge, loads, surface = pulls(names, values)
    assert (edge.passed, edge.value) == (True, "+1.0")
    assert (loads.passed, loads.only_warns, loads.value) == (False, True, "+3.0")
    assert (surface.passed, surface.only_warns, surface.value) == (False, False, "+10.0")


def test_what_the_data_tell_nothing_of_has_no_pull() -> None:
    assert list(pulls(["loads"], np.array([[0.1, 1.0, 0.99]]))) == []


def test_the_limit_of_many_pulls_is_passed_as_rarely_as_2_by_one() -> None:
    random = np.random.default_rng(5)
    for count in (1, 20, 300):
        largest = np.abs(random.normal(size=(4000, count))).max(axis=1)
        # 4.6 % of single pulls are beyond 2.
        assert (largest > limit_of(count)).mean() < 0.06


@pytest.fixture(scope="module")
def poses(short_test: Path) -> Calibration:
    return ld.Test.load(short_test / "test.toml").calibrate(short_test / "capture.pcap")


def measured(folder: Path, capture: Path, poses: Calibration) -> Result:
    return ld.Test.load(folder / "test.toml").measure(capture, calibration=poses)


def changed(short_test: Path, folder: Path) -> Path:
    """Return a copy of the configuration and drawings of the short test."""
    folder.mkdir()
    for path in short_test.iterdir():
        if path.suffix in (".csv", ".toml"):
            shutil.copy(path, folder)
    return folder


def failed(result: Result) -> set[str]:
    lines = result.run["self_check"]
    assert result.failed_gates
    return {line["name"] for line in lines if not line["passed"] and "only_warns" not in line}


@pytest.mark.slow
def test_a_run_that_is_right_passes_every_line(short_test: Path, poses: Calibration) -> None:
    result = measured(short_test, short_test / "capture.pcap", poses)
    assert result.failed_gates == ()
    names = " ".join(line["name"] for line in result.run["self_check"])
    for asked in ("settled", "chi-square", "white along", "white in time", "edges", "strain"):
        assert asked in names
    assert all(line["passed"] for line in result.run["self_check"] if "only_warns" not in line)


@pytest.mark.slow
def test_a_drawing_too_long_by_a_percent_is_told_by_the_strain(
    short_test: Path, poses: Calibration, tmp_path: Path
) -> None:
    folder = changed(short_test, tmp_path / "long")
    for name in ("blade.csv", "contours.csv"):
        table = pl.read_csv(folder / name)
        table.with_columns(s_m=pl.col("s_m") * 1.01).write_csv(folder / name)
    text = (folder / "test.toml").read_text()
    (folder / "test.toml").write_text(text.replace("length_m = 110.0", "length_m = 111.1"))
    result = measured(folder, short_test / "capture.pcap", poses)
    assert "free axial strain (length of the blade)" in failed(result)


@pytest.mark.slow
def test_contours_too_thick_are_told(short_test: Path, poses: Calibration, tmp_path: Path) -> None:
    folder = changed(short_test, tmp_path / "thick")
    contours = pl.read_csv(folder / "contours.csv")
    contours.with_columns(y_c=pl.col("y_c") * 1.3).write_csv(folder / "contours.csv")
    result = measured(folder, short_test / "capture.pcap", poses)
    assert "largest pull of surface" in failed(result)


@pytest.mark.slow
def test_a_lidar_turned_by_three_milliradians_is_told(short_test: Path, poses: Calibration) -> None:
    own = poses.poses[1]
    turned = own.world_from_sensor.copy()
    cosine, sine = np.cos(3e-3), np.sin(3e-3)
    turned[:3, :3] = np.array([[cosine, -sine, 0], [sine, cosine, 0], [0, 0, 1]]) @ turned[:3, :3]
    others = [*poses.poses]
    others[1] = dataclasses.replace(own, world_from_sensor=turned)
    wrong = dataclasses.replace(poses, poses=tuple(others))
    result = measured(short_test, short_test / "capture.pcap", wrong)
    # What lidars differ by is shared by their poses and what they misread.
    assert failed(result) & {"largest pull of registration", "largest pull of range offsets"}
