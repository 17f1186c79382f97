"""Are two runs held against each other with the interval of their difference?"""

import json
import math
from pathlib import Path

import numpy as np
import polars as pl
import pytest

import beam_folders
import folders
from conftest import command_line
from lidar_deflect.comparison import runs
from lidar_deflect.errors import ResultError
from lidar_deflect.folder import Folder
from lidar_deflect.report import two_runs


def moved(folder: Path, by_m: float) -> Path:
    """The same test, with the tip farther out along x by so much under load."""
    frame = beam_folders.deflection(seed=6)
    share = frame["load"] / 100.0
    at_tip = (frame["s_m"] == 110.0).cast(pl.Float64)
    frame = frame.with_columns(dx_m=pl.col("dx_m") + by_m * share * at_tip)
    total = np.linalg.norm(frame.select("dx_m", "dy_m", "dz_m").to_numpy(), axis=1)
    config = beam_folders.CONFIG.replace('id = "edge-110"', 'id = "edge-111"')
    return folders.write(
        folder, frame.with_columns(d_m=total), config=config, run=beam_folders.run_facts()
    )


def test_differences_carry_the_uncertainty_of_both(tmp_path: Path) -> None:
    first = Folder(beam_folders.write(tmp_path / "a"))
    second = Folder(moved(tmp_path / "b", 0.05))
    found = {(d.step, d.section, d.quantity): d for d in runs.differences(first, second)}
    tip = found["100 %", "尖端 tip", "dx"]
    assert tip.difference == pytest.approx(-0.05, abs=1e-3)
    assert tip.u == pytest.approx(math.sqrt(2.0) * beam_folders.U_TIP_M)
    assert tip.is_beyond  # 50 mm against 12 mm
    inner = found["100 %", "S84", "dx"]
    assert abs(inner.difference) < 2e-3
    assert inner.is_beyond is False


def test_the_page_says_where_and_what_was_set_differently(tmp_path: Path) -> None:
    first, second = beam_folders.write(tmp_path / "a"), moved(tmp_path / "b", 0.05)
    page = two_runs.write(first, second, tmp_path / "page.html").read_text(encoding="utf-8")
    assert "differences are beyond their uncertainty" in page
    assert "test.id" in page
    assert "edge-111" in page
    same = two_runs.document(Folder(first), Folder(first))
    assert same.verdict.mark == "good"
    assert "Both runs have the same configuration." in str(same)


def test_without_uncertainty_nothing_is_claimed(tmp_path: Path) -> None:
    first, second = folders.write(tmp_path / "a"), folders.write(tmp_path / "b")
    found = runs.differences(Folder(first), Folder(second))
    assert all(each.is_beyond is None for each in found)
    assert two_runs.document(Folder(first), Folder(second)).verdict.mark == "none"


def test_runs_without_a_common_step_are_refused(tmp_path: Path) -> None:
    first = Folder(beam_folders.write(tmp_path / "a"))
    second = Folder(folders.write(tmp_path / "b", folders.deflection(folders.TIP).head(1)))
    with pytest.raises(ResultError, match="no load step and section in common"):
        runs.differences(first, second)


def test_the_command_prints_and_writes_them(tmp_path: Path) -> None:
    first, second = beam_folders.write(tmp_path / "a"), moved(tmp_path / "b", 0.05)
    done = command_line("compare", first, second, "--json")
    assert done.code == 0, done.err
    document = json.loads(done.out)
    assert Path(document["page"]) == first / "compare-b.html"
    assert (first / "compare-b.html").is_file()
    tip = [r for r in document["rows"] if r["s_m"] == 110.0 and r["step"] == "100 %"]
    assert {row["quantity"]: row["beyond"] for row in tip} == {
        "dx": True,
        "dy": False,
        "dz": False,
        "total": True,
        "twist": False,
    }
    assert "beyond U" in command_line("compare", first, second).out
