"""Are the terms of an interval told without a measurement?"""

from dataclasses import dataclass, field
from typing import Any

import polars as pl
import pytest

import folders
import lidar_deflect as ld
from lidar_deflect import tables

POSITION_M, STATE_M = {"registration": 0.003, "surface": 0.004}, 0.008


@dataclass
class Stored:
    """What an explanation needs of a result."""

    deflection: pl.DataFrame
    steps: pl.DataFrame
    points: pl.DataFrame = field(default_factory=lambda: tables.empty("points"))
    run: dict[str, Any] = field(default_factory=dict)


def swung() -> Stored:
    """Return a state in a swing: of its test only the unloaded hold has a budget."""
    frame = folders.deflection(folders.TIP, u_m=STATE_M)
    still = dict.fromkeys(("dx_m", "dy_m", "dz_m", "d_m"), 0.0)
    terms = {
        name: still | dict.fromkeys(("x_m", "y_m", "z_m"), u) for name, u in POSITION_M.items()
    }
    name = frame["section"][0]
    budget = [{"step": "0 %", "section": name, "s_m": frame["s_m"][0], "terms": terms}]
    return Stored(frame, folders.step_table(frame), run={"budget": budget})


def test_a_swing_counts_its_rest_once_more_and_the_moment_is_what_is_left() -> None:
    told = ld.explain(swung(), time=15.0)  # type: ignore[arg-type]
    found = {term.name: term.u_m for term in told.terms}
    # 3 and 4 mm at rest are 5 mm; once more for the state, and 8^2 - 2 * 5^2 = 14 of the moment.
    assert told.u_m == pytest.approx(STATE_M)
    assert found["reference"] == pytest.approx(0.005)
    assert found["moment"] == pytest.approx((STATE_M**2 - 2 * 0.005**2) ** 0.5)
    assert sum(term.share for term in told.terms) == pytest.approx(1.0)
    assert "none" in told.text()  # no point was kept


def test_a_method_without_uncertainty_says_so() -> None:
    bare = swung()
    bare.run = {}
    told = ld.explain(bare, time=15.0)  # type: ignore[arg-type]
    assert told.terms == ()
    assert "this method states none" in told.text()
