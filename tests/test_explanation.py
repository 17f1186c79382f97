"""Does a value say what it rests on?"""

from pathlib import Path

import polars as pl
import pytest

import lidar_deflect as ld
from conftest import command_line
from lidar_deflect.result import Result

pytestmark = pytest.mark.slow


@pytest.fixture(scope="module")
def measured(short_test: Path, tmp_path_factory: pytest.TempPathFactory) -> Result:
    folder = tmp_path_factory.mktemp("explained") / "results"
    done = command_line(
        "measure", "-c", short_test / "test.toml", short_test / "capture.pcap", "-o", folder, "-v"
    )
    assert done.code in (0, 6), done.err
    assert "S110 (110 m)" in done.err
    assert "interval" in done.err
    return Result.load(folder)


def test_the_terms_of_an_interval_sum_up_to_it(measured: Result) -> None:
    told = ld.explain(measured, "S110")
    assert told.step == "100 %"
    assert sum(term.share for term in told.terms) == pytest.approx(1.0, abs=1e-6)
    assert told.u_m == pytest.approx(sum(t.u_m**2 for t in told.terms) ** 0.5, rel=0.02)
    assert [t.u_m for t in told.terms] == sorted((t.u_m for t in told.terms), reverse=True)


def test_it_names_points_lidars_and_residuals(measured: Result) -> None:
    told = ld.explain(measured, 100.0)
    assert told.n_points > 500
    assert told.lidars
    for own in told.lidars.values():
        assert own["points"] >= 1
        assert own["rms_m"] < 0.05


def test_between_holds_it_tells_the_nearest_hold_and_the_noise_of_the_moment(
    measured: Result,
) -> None:
    ramp = measured.deflection.filter(pl.col("step").is_null(), pl.col("t_s") > 1.7)["t_s"][0]
    told = ld.explain(measured, "S110", ramp)
    assert told.step is None
    assert told.like_step in ("0 %", "100 %")
    assert "nearest hold" in told.text()


def test_the_budget_of_every_section_is_in_the_run(measured: Result) -> None:
    for entry in measured.run["budget"]:
        row = measured.steps.filter(
            pl.col("step") == entry["step"], pl.col("section") == entry["section"]
        )
        for axis in "xyz":
            whole = sum(of[f"{axis}_m"] ** 2 for of in entry["terms"].values()) ** 0.5
            # A step has the interval of its states, which sway; a budget is that of their mean.
            assert whole == pytest.approx(row[f"u{axis}_m"][0], rel=0.1)


def test_a_section_that_is_not_there_is_refused(measured: Result) -> None:
    with pytest.raises(ld.LidarDeflectError, match="no section"):
        ld.explain(measured, "S111")
