from pathlib import Path

import numpy as np
import numpy.typing as npt
import polars as pl
import pytest

from lidar_deflect import holds
from lidar_deflect.errors import InvalidValueError
from lidar_deflect.holds import HoldParams
from scenes import SCENES

EPOCH_NS = 1_718_000_000_000_000_000
Floats = npt.NDArray[np.float64]


def course(
    levels: list[float], *, hold_s: float, ramp_s: float, rate_hz: float = 10.0
) -> tuple[npt.NDArray[np.int64], Floats, list[tuple[float, float]]]:
    """Levels held for `hold_s` with ramps between, and the true spans of the holds in seconds."""
    corners = np.cumsum([0.0, *([hold_s, ramp_s] * len(levels))])[:-1]
    time_s = np.arange(0.0, corners[-1], 1.0 / rate_hz)
    values = np.interp(time_s, corners, np.repeat(levels, 2))
    spans = list(zip(corners[::2].tolist(), corners[1::2].tolist(), strict=True))
    return EPOCH_NS + np.round(time_s * 1e9).astype(np.int64), values, spans


def seconds(found: tuple[holds.Hold, ...]) -> list[tuple[float, float]]:
    return [((h.from_ns - EPOCH_NS) * 1e-9, (h.to_ns - EPOCH_NS) * 1e-9) for h in found]


def assert_inside(found: tuple[holds.Hold, ...], spans: list[tuple[float, float]], at_most: float):
    """Every hold lies within the true one and misses at most `at_most` seconds at an end."""
    assert len(found) == len(spans)
    for (start, stop), (true_start, true_stop) in zip(seconds(found), spans, strict=True):
        assert true_start <= start <= true_start + at_most
        assert true_stop - at_most <= stop <= true_stop


def test_holds_of_a_stepped_load_lie_inside_the_true_ones() -> None:
    time_ns, load, spans = course([0, 40, 70, 100], hold_s=3.0, ramp_s=3.0)
    load = load + np.random.default_rng(1).normal(0.0, 0.1, load.size)
    found = holds.from_load(time_ns, load)
    assert [h.label for h in found] == ["0 %", "40 %", "70 %", "100 %"]
    # The margin of 0.25 s, what noise hides of the corner, and two samples.
    assert_inside(found, spans, at_most=0.25 + 0.1 + 0.2)
    assert [h.load_percent for h in found] == pytest.approx([0, 40, 70, 100], abs=0.1)


def test_no_margin_is_taken_at_the_ends_of_the_record() -> None:
    time_ns, load, _ = course([0, 100], hold_s=4.0, ramp_s=10.0)
    found = holds.from_load(time_ns, load)
    assert found[0].from_ns == time_ns[0]
    assert found[-1].to_ns == time_ns[-1]


def test_a_level_that_comes_again_is_counted() -> None:
    time_ns, load, _ = course([0, 50, 100, 60, 100.3, 0.4, 99.8], hold_s=3.0, ramp_s=2.0)
    labels = [h.label for h in holds.from_load(time_ns, load)]
    assert labels == ["0 %", "50 %", "100 %", "60 %", "100 % (2)", "0 % (2)", "100 % (3)"]


@pytest.mark.parametrize("slower", [1.0, 10.0, 100.0])
def test_a_slow_test_is_found_like_a_fast_one_in_spite_of_noise(slower: float) -> None:
    # The noise of 0.3 percent exceeds what the slowest ramp moves in a second many times.
    time_ns, load, spans = course([0, 60, 100], hold_s=4.0 * slower, ramp_s=6.0 * slower)
    load = load + np.random.default_rng(2).normal(0.0, 0.3, load.size)
    found = holds.from_load(time_ns, load)
    assert [h.label for h in found] == ["0 %", "60 %", "100 %"]
    assert_inside(found, spans, at_most=0.35 * 4.0 * slower)


def test_one_bad_sample_does_not_split_a_hold() -> None:
    time_ns, load, _ = course([0, 100], hold_s=5.0, ramp_s=5.0)
    load[25] = 37.0
    found = holds.from_load(time_ns, load)
    assert [h.label for h in found] == ["0 %", "100 %"]
    assert seconds(found)[0][1] > 4.0


def test_missing_samples_are_passed_over() -> None:
    time_ns, load, spans = course([0, 100], hold_s=5.0, ramp_s=5.0)
    load[::7] = np.nan
    assert_inside(holds.from_load(time_ns, load), spans, at_most=0.6)


def test_a_load_that_never_moves_is_one_hold_and_one_that_never_rests_is_none() -> None:
    time_ns, load, _ = course([0, 0], hold_s=5.0, ramp_s=5.0)
    assert [h.label for h in holds.from_load(time_ns, load)] == ["0 %"]
    assert holds.from_load(time_ns, np.linspace(0.0, 100.0, time_ns.size)) == ()
    assert holds.from_load([], []) == ()


def test_a_hold_shorter_than_asked_for_is_left_out() -> None:
    time_ns, load, _ = course([0, 40, 100], hold_s=3.0, ramp_s=4.0)
    params = HoldParams(min_hold_s=2.55)  # the one in the middle keeps 3.0 - 2 x 0.25 s
    assert [h.label for h in holds.from_load(time_ns, load, params)] == ["0 %", "100 %"]


def test_holds_of_a_swaying_deflection_are_found_without_a_load() -> None:
    time_ns, share, spans = course([0, 40, 100, 40], hold_s=6.0, ramp_s=4.0)
    time_s = (time_ns - EPOCH_NS) * 1e-9
    rng = np.random.default_rng(3)
    sway = 0.02 * np.sin(2 * np.pi * 0.4 * time_s) + rng.normal(0.0, 0.02, time_s.size)
    xyz = np.column_stack([-0.06 * share + sway, 0.007 * share, 110.0 - 0.002 * share])
    xyz[40:44] = np.nan
    found = holds.from_deflection(time_ns, xyz)
    assert [h.label for h in found] == ["0 %", "~40 %", "~100 %", "~40 % (2)"]
    assert all(h.load_percent is None for h in found)
    assert_inside(found, spans, at_most=1.5)


def test_steps_are_named_at_instants_and_null_between() -> None:
    time_ns, load, _ = course([0, 100], hold_s=4.0, ramp_s=4.0)
    found = holds.from_load(time_ns, load)
    at = EPOCH_NS + np.array([1.0, 6.0, 10.0]) * 1e9
    assert holds.steps_at(found, at) == ["0 %", None, "100 %"]


def test_a_force_becomes_percent_of_its_highest_hold() -> None:
    time_ns, load, _ = course([0, 40, 100], hold_s=3.0, ramp_s=3.0)
    assert holds.percent_of_highest_hold(time_ns, -3.5 * load) == pytest.approx(load)
    with pytest.raises(InvalidValueError, match="no hold away from zero"):
        holds.percent_of_highest_hold(time_ns, 0.0 * load)


@pytest.mark.parametrize(
    "wrong", [{"min_hold_s": 0.0}, {"margin_s": -0.1}, {"still_rate": 1.0}, {"window_s": np.nan}]
)
def test_parameters_are_checked_when_made(wrong: dict[str, float]) -> None:
    with pytest.raises(InvalidValueError, match=next(iter(wrong))):
        HoldParams(**wrong)


def test_times_that_do_not_rise_and_other_shapes_are_refused() -> None:
    with pytest.raises(InvalidValueError, match="does not rise at row 2"):
        holds.from_load([0, 10, 10], [1.0, 2.0, 3.0])
    with pytest.raises(InvalidValueError, match="shape"):
        holds.from_load([0, 10], [1.0, 2.0, 3.0])


TRUE_HOLDS = {
    "edge": {"0 %": (0.0, 3.99), "40 %": (7.0, 8.99), "70 %": (12.0, 13.99), "100 %": (18.0, 22.0)},
    "flap": {"0 %": (0.0, 3.99), "100 %": (16.0, 20.0)},
}
"""Seconds from the first row of truth.parquet between which its column `load` stands still."""


def scene(name: str) -> Path:
    if not SCENES.is_dir():
        pytest.skip("the simulated scenes are not beside the project")
    return SCENES / name


@pytest.mark.parametrize("name", ["edge", "flap"])
def test_holds_of_the_scenes_are_their_own_from_load_and_from_deflection(name: str) -> None:
    spans = list(TRUE_HOLDS[name].values())
    channel = pl.read_csv(scene(name) / "load.csv")
    time_ns = (channel["time_utc_s"] * 1e9).round().cast(pl.Int64).to_numpy()
    start_ns = int(time_ns[0])
    shifted = [(start_ns + a * 1e9 - EPOCH_NS, start_ns + b * 1e9 - EPOCH_NS) for a, b in spans]
    true = [(a * 1e-9, b * 1e-9) for a, b in shifted]
    found = holds.from_load(time_ns, channel["load_percent"].to_numpy())
    assert [h.label for h in found] == list(TRUE_HOLDS[name])
    assert_inside(found, true, at_most=0.45)

    tip = pl.read_parquet(scene(name) / "truth.parquet").filter(pl.col("s_m") == 110.0)
    xyz = tip.select("x_m", "y_m", "z_m").to_numpy()
    from_data = holds.from_deflection(tip["time"].cast(pl.Int64).to_numpy(), xyz)
    assert_inside(from_data, true, at_most=0.5)
