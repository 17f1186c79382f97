"""Are slope, linearity, hysteresis, residual and creep those of the blade that was made up?"""

import numpy as np
import polars as pl
import pytest

import beam_folders
import folders
from lidar_deflect import behaviour
from lidar_deflect.comparison.judgement import judge
from lidar_deflect.folder import Folder

UNIT = np.array([1.0, 0.0, 0.0])


@pytest.fixture(scope="module")
def made() -> tuple[pl.DataFrame, pl.DataFrame]:
    frame = beam_folders.deflection()
    return frame, folders.step_table(frame)


def test_the_slope_is_that_of_the_beam(made: tuple[pl.DataFrame, pl.DataFrame]) -> None:
    frame, steps = made
    found = behaviour.by_section(behaviour.stiffnesses(steps, frame, UNIT))
    points, _, _ = beam_folders.shape(np.array([84.0]), np.ones(1))
    assert found["S84"].slope_m_per_percent == pytest.approx(points[0, 0, 0] / 100.0, rel=2e-3)
    # u of the hold at 100 %, shared by all holds
    u = beam_folders.U_TIP_M * (84.0 / 110.0) ** 2
    assert found["S84"].u_slope == pytest.approx(u / 100.0, rel=1e-6)
    assert found["S84"].linearity_percent is not None
    assert found["S84"].linearity_percent < 0.2


def test_what_crept_at_full_load_stays_as_hysteresis_and_residual(
    made: tuple[pl.DataFrame, pl.DataFrame],
) -> None:
    frame, steps = made
    found = behaviour.by_section(behaviour.stiffnesses(steps, frame, UNIT))["尖端 tip"]
    # 0.2 % of the deflection at 100 %, 4.84 m, crept and stayed
    assert found.residual_m == pytest.approx(0.002 * 4.84, abs=1.5e-3)
    assert found.hysteresis_m == pytest.approx(0.002 * 4.84, abs=1.5e-3)
    assert found.hysteresis_at_percent == pytest.approx(40.0, abs=0.5)
    assert found.u_residual_m is not None


def test_creep_is_seen_in_the_hold_in_which_it_was(
    made: tuple[pl.DataFrame, pl.DataFrame],
) -> None:
    frame, steps = made
    drifts = {(c.step, c.section): c for c in behaviour.creep(steps, frame, UNIT)}
    loaded = drifts["100 %", "尖端 tip"]
    assert loaded.drift_m == pytest.approx(0.002 * 4.84 * loaded.duration_s / 10.0, abs=2.5e-3)
    assert loaded.is_beyond
    assert drifts["0 %", "S84"].is_beyond is False


def test_sway_that_fills_a_hold_is_no_creep() -> None:
    seconds = np.arange(0.0, 1.4, 0.1)
    sway = 0.05 * np.sin(2.0 * np.pi * 0.35 * seconds)  # half a period
    found = behaviour._drift(seconds, sway)
    assert found is not None
    assert not found[3]


def test_without_load_nothing_is_made_up() -> None:
    frame = beam_folders.deflection(load=False)
    steps = folders.step_table(frame)
    for each in behaviour.stiffnesses(steps, frame, UNIT):
        assert each.slope_m_per_percent is None
        assert each.hysteresis_m is None


@pytest.mark.parametrize(
    ("tolerance", "judgement"),
    [(None, "none"), (7.0, "within"), (1.0, "outside"), (1.4, "open")],
)
def test_a_value_is_judged_over_its_whole_interval(
    tmp_path_factory: pytest.TempPathFactory, tolerance: float | None, judgement: str
) -> None:
    # measured 1.48 % below the prediction less 0.1 % of creep; U = 8.6 mm is 0.17 % of 5 m
    folder = Folder(beam_folders.write(tmp_path_factory.mktemp("judged") / "results"))
    found = {(j.step, j.section): j for j in judge(folder.comparison, tolerance)}
    tip = found["100 %", "尖端 tip"]
    assert tip.percent == pytest.approx(-1.38, abs=0.03)
    assert tip.judgement == judgement
    assert found["0 %", "尖端 tip"].judgement == "none"  # of nothing there is no percentage
