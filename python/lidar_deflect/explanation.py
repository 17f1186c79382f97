"""What a value rests on: points, lidars, residuals, and the largest terms of its interval."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import polars as pl

from lidar_deflect import words
from lidar_deflect.errors import InvalidValueError
from lidar_deflect.plots.source import section_of

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence
    from datetime import datetime

    from lidar_deflect.result import Result

NEAR_M = 3.0
"""Kept points within this distance along the span are told of ..."""
NEAR_S = 1.0
"""... if they are no farther away in time."""
TERMS = 3
"""Terms of the interval that are named."""
VALUES = ("dx_m", "dy_m", "dz_m", "d_m")


@dataclass(frozen=True)
class Term:
    """One source of uncertainty.

    Attributes
    ----------
    name, words
        Stable name, as in the budget of run.json, and what it is.
    u_m
        Standard uncertainty that it alone would leave, metres.
    share
        Of the variance.
    """

    name: str
    words: str
    u_m: float
    share: float


@dataclass(frozen=True, repr=False)
class Explanation:
    """What a state of a section rests on.

    Attributes
    ----------
    section, s_m, time, t_s
        The state.
    value_m, u_m
        Total deflection and its standard uncertainty, metres; None where there is none.
    step, like_step
        Hold that it lies in; hold whose budget is told, the nearest one where it lies in none.
    status, reason
        As in the table.
    n_points
        Points of all the blade that the state was made of.
    lidars
        By lidar: kept points near the section and moment, mean and rms of their residuals, metres.
    terms
        All sources of uncertainty of the total deflection, largest first.
    """

    section: str
    s_m: float
    time: datetime
    t_s: float
    value_m: float | None
    u_m: float | None
    step: str | None
    like_step: str | None
    status: str
    reason: str | None
    n_points: int
    lidars: Mapping[str, Mapping[str, float]]
    terms: Sequence[Term]

    def __repr__(self) -> str:
        return self.text()

    def text(self) -> str:
        """Lines for people."""
        u = "" if self.u_m is None else f" (u {1e3 * self.u_m:.1f} mm)"
        value = "nothing" if self.value_m is None else f"{self.value_m:.4f} m{u}"
        why = f", {self.status}" + (f" ({self.reason})" if self.reason else "")
        step = f" in {self.step}" if self.step else " between holds"
        lines = [f"{self.section} ({self.s_m:g} m) at {self.t_s:.1f} s{step}: {value}{why}"]
        lines.append(f"  points   {self.n_points} on the blade; kept near this section:")
        lines += [
            f"           {lidar}: {own['points']:.0f}, residuals {1e3 * own['mean_m']:+.1f} mm, "
            f"rms {1e3 * own['rms_m']:.1f} mm"
            for lidar, own in self.lidars.items()
        ] or ["           none"]
        lines += [
            f"  interval {1e3 * term.u_m:.1f} mm, {100.0 * term.share:.0f} %: {term.words}"
            for term in self.terms[:TERMS]
        ] or ["  interval this method states none"]
        if self.terms and self.like_step != self.step:
            lines.append(f"  budget   that of the nearest hold, {self.like_step}")
        return "\n".join(lines)


def explain(
    result: Result, section: str | float | None = None, time: float | None = None
) -> Explanation:
    """Tell what a value of a result rests on.

    Parameters
    ----------
    section
        Name, arc length in metres, or None for the outermost.
    time
        Seconds since the first accepted lidar packet; default: middle of the hold with most load.

    Raises
    ------
    InvalidValueError
        If there is no such section or no state.
    """
    name, s_m = section_of(result.deflection, section)
    own = result.deflection.filter(pl.col("section") == name)
    if own.is_empty():
        raise InvalidValueError("this result has no state", code="value.time")
    at_s = _middle_s(result) if time is None else time
    row = own.sort((pl.col("t_s") - at_s).abs()).row(0, named=True)
    like, terms = _terms(result, name, row)
    return Explanation(
        section=name,
        s_m=s_m,
        time=row["time"],
        t_s=row["t_s"],
        value_m=row["d_m"],
        u_m=row["ud_m"],
        step=row["step"],
        like_step=like,
        status=row["status"],
        reason=row["reason"],
        n_points=row["n_points"],
        lidars=_near(result.points, s_m, row["t_s"]),
        terms=terms,
    )


def largest(result: Result) -> list[Explanation]:
    """Explain every section in the middle of the hold with most load."""
    sections = result.deflection.select("section", "s_m").unique().sort("s_m")
    return [explain(result, name) for name in sections["section"]]


def _middle_s(result: Result) -> float:
    """Middle of the hold in which the blade is bent most; without holds of the whole test."""
    known = result.steps.filter(pl.col("d_m").is_not_null()).sort("d_m")
    if known.height:
        return float(known["t_s"][-1])
    return 0.5 * float(result.deflection["t_s"][0] + result.deflection["t_s"][-1])


def _near(points: pl.DataFrame, s_m: float, t_s: float) -> dict[str, dict[str, float]]:
    near = points.filter(
        (pl.col("s_m") - s_m).abs() <= NEAR_M,
        (pl.col("t_s") - t_s).abs() <= NEAR_S,
        pl.col("residual_m").is_not_null(),
    )
    residual = pl.col("residual_m")
    told = near.group_by("lidar").agg(
        points=pl.len().cast(pl.Float64),
        mean_m=residual.mean(),
        rms_m=(residual**2).mean().sqrt(),
    )
    return {row.pop("lidar"): row for row in told.sort("lidar").to_dicts()}


def _terms(
    result: Result, section: str, row: Mapping[str, Any]
) -> tuple[str | None, tuple[Term, ...]]:
    """Find the sources of the total deflection's interval, largest first, and their hold."""
    entries = [e for e in result.run.get("budget") or () if e["section"] == section]
    if not entries or row["d_m"] is None:
        return None, ()
    entry = _nearest(result, section, entries, row)
    squares = {name: _square(of, row) for name, of in entry["terms"].items()}
    whole = sum(squares.values())
    beyond = (row["ud_m"] or 0.0) ** 2 - whole
    if beyond > whole * 1e-6:
        # The budget of the unloaded hold is of its position: a swing counts from it once more.
        again = 0.0 if _has_moved(entry) else min(beyond, whole)
        squares |= {"reference": again} if again else {}
        squares["moment"] = beyond - again
        whole += beyond
    terms = [
        Term(
            name, words.BUDGET_TERMS.get(name, name), square**0.5, square / whole if whole else 0.0
        )
        for name, square in squares.items()
    ]
    return entry["step"], tuple(sorted(terms, key=lambda term: -term.u_m))


def _has_moved(entry: Mapping[str, Any]) -> bool:
    return any(of[name] for of in entry["terms"].values() for name in VALUES)


def _square(of: Mapping[str, float], row: Mapping[str, Any]) -> float:
    """Variance of the total deflection; of the position where nothing has moved."""
    if any(of[name] for name in VALUES):
        return of["d_m"] ** 2
    moved = [row["dx_m"], row["dy_m"], row["dz_m"]]
    size = sum(part**2 for part in moved) ** 0.5
    unit = [part / size for part in moved] if size else [1.0, 0.0, 0.0]
    return sum((u * of[f"{axis}_m"]) ** 2 for u, axis in zip(unit, "xyz", strict=True))


def _nearest(
    result: Result, section: str, entries: Sequence[Mapping[str, Any]], row: Mapping[str, Any]
) -> Mapping[str, Any]:
    """Return the budget of the hold in which the blade is bent most nearly as in a state."""
    steps = result.steps.filter(pl.col("section") == section, pl.col("d_m").is_not_null())
    bent = dict(steps.select("step", "d_m").iter_rows())

    def off(entry: Mapping[str, Any]) -> float:
        here = entry["step"] == row["step"]
        return -1.0 if here else abs(bent.get(entry["step"], 0.0) - row["d_m"])

    return min(entries, key=off)
