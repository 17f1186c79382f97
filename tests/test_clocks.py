"""Are clocks of other instruments found, told, and left alone where they agree?"""

import re
from pathlib import Path

import numpy as np
import polars as pl
import pytest

from lidar_deflect import clock_screen, clocks
from lidar_deflect.channels import Channel
from lidar_deflect.pipeline import Test
from scenes import SCENES, configuration, needs_scenes

EPOCH_NS = 1_718_000_000_000_000_000


def record(seconds: np.ndarray) -> np.ndarray:
    """Load over time, percent: steps with holds."""
    return np.interp(seconds, [4.0, 7.0, 9.0, 12.0, 14.0, 18.0], [0.0, 40.0, 40.0, 70.0, 70.0, 100])


def ns(seconds: np.ndarray) -> np.ndarray:
    return EPOCH_NS + np.round(seconds * 1e9).astype(np.int64)


@pytest.mark.parametrize("shift_s", [0.0, 0.31, 3.2, -7.7, 95.0, 2 * 3600.0, -7 * 3600 + 1.5])
def test_a_shift_is_found_to_some_milliseconds(shift_s: float) -> None:
    rng = np.random.default_rng(11)
    t = np.arange(0.0, 22.0, 0.1)
    moved = 0.06 * record(t) + 3e-5 * record(t) ** 2 + rng.normal(0.0, 0.004, t.size)
    vector = np.column_stack([moved, 0.1 * moved, rng.normal(0.0, 0.02, t.size)])
    vector[60:66] = np.nan  # nothing was measured
    vector[:, 2] += 9.0 * (rng.random(t.size) < 0.05)  # a component that fails now and then
    at = np.arange(0.0, 22.0, 0.05)
    load = Channel("load", ns(at - shift_s), record(at) + rng.normal(0.0, 0.3, at.size), "percent")
    found = clocks.estimate(load, ns(t), vector)
    assert found is not None
    # sigma of one sample over the slope of 13 percent a second, over the root of a hundred samples
    # on ramps: about 4 ms
    assert abs(found.seconds - shift_s) < 0.02
    assert abs(found.seconds - shift_s) < 5.0 * found.u_s + 0.002
    assert found.differs == (shift_s != 0.0)


def test_nothing_is_said_where_nothing_moves_or_nothing_follows() -> None:
    rng = np.random.default_rng(5)
    t = np.arange(0.0, 20.0, 0.1)
    noise = Channel("load", ns(t), rng.normal(0.0, 1.0, t.size), "percent")
    assert clocks.estimate(noise, ns(t), 0.06 * record(t)) is None
    still = Channel("load", ns(t), np.zeros(t.size), "percent")
    assert clocks.estimate(still, ns(t), 0.06 * record(t)) is None
    assert clocks.estimate(still, ns(t), np.zeros(t.size)) is None
    assert clocks.estimate(still, ns(t), np.full(t.size, np.nan)) is None


def shifted_test(folder: Path, seconds: float) -> Test:
    """The edgewise scene with the clocks of load and wires behind by so many seconds."""
    settings = configuration("edge")
    for name in ("load", "wire"):
        frame = pl.read_csv(SCENES / "edge" / f"{name}.csv")
        frame = frame.with_columns(time_utc_s=(pl.col("time_utc_s") - seconds).round(3))
        frame.write_csv(folder / f"{name}.csv")
        settings = re.sub(rf'"[^"]*/{name}\.csv"', f'"{name}.csv"', settings)
    (folder / "test.toml").write_text(settings)
    return Test.load(folder / "test.toml")


@needs_scenes
def test_a_clock_3_2_s_behind_is_found_to_20_ms_and_the_steps_are_right(tmp_path: Path) -> None:
    test = shifted_test(tmp_path, 3.2)
    result = test.measure(SCENES / "edge" / "capture.pcap.gz", method="paper")
    found = {each["file"]: each for each in result.run["channel_clocks"]}
    for name in ("load.csv", "wire.csv"):
        assert abs(found[name]["applied_s"] - 3.2) < 0.02
    assert any("behind that of the lidars" in warning for warning in result.run["warnings"])
    # the steps are those of the test as it was, to some frames at their ends
    steps = result.steps.filter(pl.col("section") == "S110").sort("from")
    assert steps["step"].to_list() == ["0 %", "40 %", "70 %", "100 %"]
    assert steps["d_m"][-1] == pytest.approx(6.13, abs=0.05)
    # and a wire is held against what it read then
    wires = result.frames["comparison"].filter(
        pl.col("source") == "W110", pl.col("quantity") == "wire", pl.col("step") == "100 %"
    )
    assert abs(wires["error_percent"][0]) < 2.0


@needs_scenes
def test_a_configured_shift_is_taken_and_not_estimated(tmp_path: Path) -> None:
    test = shifted_test(tmp_path, 3.2)
    text = (tmp_path / "test.toml").read_text()
    text = text.replace("[load]\n", "[load]\nshift_s = 3.2\n")
    text = text.replace("[[wires]]\n", "[[wires]]\nshift_s = 3.2\n")
    (tmp_path / "test.toml").write_text(text)
    test = Test.load(tmp_path / "test.toml")
    result = test.measure(SCENES / "edge" / "capture.pcap.gz", method="paper", stop_s=8.0)
    assert result.run["channel_clocks"] == []
    load = result.channels.filter(pl.col("channel") == "load")
    assert load["t_s"][0] == pytest.approx(0.005, abs=1e-6)


@pytest.mark.parametrize("seed", range(4))
def test_no_shift_is_left_out_that_an_exact_fit_finds_best(seed: int) -> None:
    rng = np.random.default_rng(seed)
    t, at = np.arange(0.0, 22.0, 0.1), np.arange(-3.0, 30.0, 0.07)
    moved = record(t - 1.3) + rng.normal(0.0, 0.5, t.size)
    pair = clocks._Pair(t, moved, at, record(at) + rng.normal(0.0, 0.3, at.size))
    grid = np.arange(-15.0, 15.0, 0.1)
    fits = [pair._fit(float(shift)) for shift in grid]
    share = np.array([np.inf if fit is None else fit[1] for fit in fits])
    screened = pair._screen(grid)
    kept = screened.near_lowest_share()
    assert kept[np.argmin(share)]
    assert kept.sum() < 5
    both = np.isfinite(share) & np.isfinite(screened.share)
    assert both.sum() == np.isfinite(share).sum()  # what is not refused there is not refused here
    assert np.abs(share[both] - screened.share[both]).max() < clock_screen.ROUNDING / 1000
    square = np.array([np.inf if fit is None else fit[0] for fit in fits])
    assert screened.about_lowest_square(10.0)[np.argmin(square)]
