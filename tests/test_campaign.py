"""Does the accuracy campaign run, resume, count failures, and judge as arithmetic says?"""

from __future__ import annotations

import json
import sys
from typing import TYPE_CHECKING, Any

import numpy as np
import polars as pl
import pytest
from benches.accuracy import campaign, judge, kinds, one, page, summary
from benches.accuracy.registration import one as yard
from benches.accuracy.registration import table

if TYPE_CHECKING:
    from pathlib import Path

METHODS = one.known_methods()

# An edgewise and a flapwise test with four VLP-16: what a test of every change can afford.
PART = 2


def test_seeds_are_fixed_and_never_shared() -> None:
    development, verification = (
        kinds.cases(split, 2000) for split in ("development", "verification")
    )  # type: ignore[arg-type]
    seeds = [case.seed for case in (*development, *verification)]
    assert len(set(seeds)) == 4000
    assert kinds.cases("development", 10) == development[:10]
    assert kinds.named(verification[77].id) == verification[77]


def test_every_kind_meets_every_level_yard_and_blade() -> None:
    for name in {kind.name for kind in kinds.KINDS}:
        mine = [case for case in kinds.cases("verification", 200) if case.kind.name == name]
        assert len(mine) == 25
        assert {case.level for case in mine} == set(kinds.LEVELS)
        assert {case.yard for case in mine} == set(kinds.YARDS)
        assert len({case.blade for case in mine}) == len(
            set(kinds.SHORT if name.startswith("small") else kinds.LONG)
        )


@pytest.fixture(scope="module")
def records() -> list[dict[str, Any]]:
    return [one.run(case, METHODS) for case in kinds.cases("development", PART)]


@pytest.mark.slow
def test_its_first_tests_end_with_a_number_or_a_named_failure(
    records: list[dict[str, Any]],
) -> None:
    for record in records:
        assert "failed" not in record.get("calibration", {}), record
        for method, found in record["methods"].items():
            assert not str(found.get("failed", "")).startswith("bug"), (record["id"], method, found)
    assert any(summary.hold_mm(record, "paper") is not None for record in records)


@pytest.mark.slow
@pytest.mark.skipif("beam" not in METHODS, reason="there is no method beside the paper's")
def test_the_beam_is_better_than_the_paper_by_far(records: list[dict[str, Any]]) -> None:
    row = summary.row("all", records, "beam")
    assert row.hold_mm is not None
    assert row.hold_mm[0] < 15.0
    assert row.ratio is not None
    assert row.ratio > 10.0


@pytest.mark.slow
def test_the_page_says_that_it_is_simulated_and_when(records: list[dict[str, Any]]) -> None:
    text = page.markdown(records, "development", "a command", None)
    assert "comes from simulation" in text
    assert "Written on 20" in text
    assert f"| all | {PART} |" in text


def truth() -> judge.Truth:
    """Return the truth of a section that moves by 1 m along x within the second second."""
    time_s = np.arange(0.0, 3.0, 0.01)
    x = np.clip(time_s - 1.0, 0.0, 1.0)
    still = np.zeros_like(x)
    columns: dict[str, Any] = {"x_m": x, "y_m": still, "z_m": still, "twist_deg": still}
    columns |= {f"le_{a}_m": still for a in "xyz"} | {f"te_{a}_m": still + 1.0 for a in "xyz"}
    stamps = pl.Series((time_s * 1e9).round().astype(np.int64)).cast(pl.Datetime("ns", "UTC"))
    return judge.Truth(pl.DataFrame({"time": stamps, "s_m": still + 84.0, **columns}))


def stamp(second: float) -> Any:
    return pl.Series([round(second * 1e9)]).cast(pl.Datetime("ns", "UTC"))


def test_truth_is_read_between_its_samples() -> None:
    at = truth().at(84.0, stamp(1.255))
    assert np.allclose(at, [[0.255, 0.0, 0.0]], atol=1e-9)
    assert abs(truth().chord_m(84.0) - 3**0.5) < 1e-12
    mean, _ = truth().mean(84.0, stamp(2.0)[0], stamp(2.9)[0])
    assert np.allclose(mean, [1.0, 0.0, 0.0])


def record(error_m: list[float] | None, z: list[float], kind: str = "edge") -> dict[str, Any]:
    run = {
        "sections": [{"s_m": 84.0, "true_m": [1.0, 0.0, 0.0], "error_m": error_m}],
        "z_hold": z,
        "width_m": [0.01],
        "twist_error_deg": [],
        "state_p95_m": 0.002,
        "held_state_p95_m": 0.001,
        "within": [100, 68, 95],
    }
    return {"id": "a", "kind": kind, "level": "usual", "yard": "wall", "methods": {"own": run}}


def test_failures_count_and_coverage_is_a_share() -> None:
    rows = [record([0.001, -0.004, 0.002], [0.5, 1.5, 3.0]), record(None, []), {"id": "b"}]
    rows[2] |= {"kind": "edge", "failed": "timeout"}
    row = summary.row("edge", rows, "own")
    assert (row.tests, row.failed) == (3, 2)
    assert row.hold_mm == (4.0, 4.0, 4.0)
    assert row.hold_within == (1 / 3, 2 / 3)
    assert row.state_within == (0.68, 0.95)
    assert summary.failures(rows, "own") == {"section missing": 1, "timeout": 1}
    (worst,) = summary.worst(rows, "own")
    assert worst[2] == "y at 84 m"


def test_the_ratio_takes_tests_that_both_measured() -> None:
    both = record([0.002, 0.0, 0.0], [])
    both["methods"]["paper"] = record([0.05, 0.0, 0.0], [])["methods"]["own"]
    assert summary.ratio([both, record([0.5, 0.0, 0.0], [])], "own") == pytest.approx(25.0)


def test_a_run_goes_on_where_it_stopped(tmp_path: Path) -> None:
    path = tmp_path / "runs.jsonl"
    code = "import json, sys; sys.exit(3) if sys.argv[1] == 'b' else print(json.dumps({'v': 1}))"
    asked: list[str] = []

    def command(i: str) -> list[str]:
        asked.append(i)
        return [sys.executable, "-c", code, i]

    for wanted in (["a", "b"], ["a", "b", "c"]):
        ids = campaign.missing(wanted, campaign.done(path), ["m"])
        campaign.run(ids, command, path, asked=["m"], jobs=2, timeout_s=60.0)
        path.write_text(path.read_text() + '{"id": "cut')  # as a killed run leaves it
        path.write_text(path.read_text() + "\n")
    found = campaign.done(path)
    assert sorted(asked) == ["a", "b", "c"]
    assert found["a"]["v"] == 1
    assert found["b"]["failed"] == "exit 3"
    assert campaign.missing(["a"], found, ["m", "other"]) == ["a"]


def test_a_test_that_hangs_is_a_failure(tmp_path: Path) -> None:
    path = tmp_path / "runs.jsonl"
    hang = [sys.executable, "-c", "import time; time.sleep(60)"]
    campaign.run(["a"], lambda _: hang, path, asked=["m"], jobs=1, timeout_s=0.5)
    assert json.loads(path.read_text())["failed"] == "timeout"


def test_regions_are_judged_by_chi_square() -> None:
    # Quantiles as tables have them.
    for freedom, expected in ((6, 12.592), (12, 21.026), (24, 36.415)):
        assert table.chi2_95(freedom) == pytest.approx(expected, rel=3e-3)
    random = np.random.default_rng(3)
    mix = random.normal(size=(12, 12)) * np.repeat([1e-4, 5e-3], 6)[:, None]
    draws = random.normal(size=(4000, 12)) @ mix.T
    inside = [yard.distance(draw, mix @ mix.T) for draw in draws]
    share = np.mean([d < table.chi2_95(n) for d, n in inside])
    assert abs(share - 0.95) < 0.012  # 3.5 standard errors


def test_pose_errors_are_the_interface_s() -> None:
    found, true = np.eye(4), np.eye(4)
    true[:3, :3] = [[1.0, -1e-3, 0.0], [1e-3, 1.0, 0.0], [0.0, 0.0, 1.0]]
    true[:3, 3] = [0.0, 0.002, 0.0]
    assert np.allclose(one.pose_error(true, found), [0, 0, 1e-3, 0, 0.002, 0], atol=1e-9)
