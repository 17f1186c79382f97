"""Measured against predicted, judged by the user's own tolerance and the measured uncertainty."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Literal

from lidar_deflect.comparison.error import NEGLIGIBLE

if TYPE_CHECKING:
    from collections.abc import Iterator, Mapping, Sequence

    import polars as pl

Judgement = Literal["within", "outside", "open", "none"]
SOURCE = "prediction"
COVERAGE = 2.0
_VECTOR = ("dx", "dy", "dz")


@dataclass(frozen=True)
class Judged:
    """One load step and section held against its prediction.

    Attributes
    ----------
    quantity
        ``total``, ``direction`` or ``vector``.
    measured_m, reference_m, difference_m
        Metres; of a vector their norms, and the norm of the difference.
    u_m
        Standard uncertainty of the measured value; None where the method states none.
    percent
        Difference in percent of the reference; None where that is next to nothing.
    judgement
        ``within`` or ``outside`` where that holds over the whole expanded uncertainty (k = 2),
        ``open`` where the tolerance lies inside it, ``none`` without a tolerance.
    """

    step: str
    section: str
    quantity: str
    measured_m: float
    reference_m: float
    difference_m: float
    u_m: float | None
    percent: float | None
    judgement: Judgement


def judge(comparison: pl.DataFrame, tolerance_percent: float | None) -> list[Judged]:
    """Judge every row of the table ``comparison`` that holds against the prediction.

    Parameters
    ----------
    comparison
        Table ``comparison``.
    tolerance_percent
        Of the predicted value; None: nothing is judged.
    """
    rows = [row for row in comparison.iter_rows(named=True) if row["source"] == SOURCE]
    rows = [row for row in rows if None not in (row["measured_m"], row["reference_m"])]
    values = [*_scalars(rows), *_vectors(rows)]
    largest = max((abs(each[4]) for each in values), default=0.0)
    return [_judged(each, NEGLIGIBLE * largest, tolerance_percent) for each in values]


_Values = tuple[str, str, str, float, float, float, float | None]


def _scalars(rows: Sequence[Mapping[str, Any]]) -> Iterator[_Values]:
    for row in rows:
        if row["quantity"] in ("total", "direction"):
            own, true = row["measured_m"], row["reference_m"]
            head = (row["step"], row["section"], row["quantity"])
            yield (*head, own, true, own - true, row["u_m"])


def _vectors(rows: Sequence[Mapping[str, Any]]) -> Iterator[_Values]:
    found: dict[tuple[str, str], dict[str, Mapping[str, Any]]] = {}
    for row in rows:
        if row["quantity"] in _VECTOR:
            found.setdefault((row["step"], row["section"]), {})[row["quantity"]] = row
    for (step, section), parts in found.items():
        if len(parts) == len(_VECTOR):
            yield step, section, "vector", *_norms([parts[name] for name in _VECTOR])


def _norms(parts: Sequence[Mapping[str, Any]]) -> tuple[float, float, float, float | None]:
    own = math.hypot(*(part["measured_m"] for part in parts))
    true = math.hypot(*(part["reference_m"] for part in parts))
    off = [part["measured_m"] - part["reference_m"] for part in parts]
    norm = math.hypot(*off)
    us = [part["u_m"] for part in parts]
    if None in us:
        return own, true, norm, None
    if norm == 0.0:
        return own, true, norm, max(us)
    return own, true, norm, math.hypot(*(d / norm * u for d, u in zip(off, us, strict=True)))


def _judged(each: _Values, small_m: float, tolerance_percent: float | None) -> Judged:
    step, section, quantity, own, true, off, u = each
    percent = None if abs(true) <= small_m else 100.0 * off / abs(true)
    judgement: Judgement = "none"
    if tolerance_percent is not None and percent is not None:
        expanded = COVERAGE * (u or 0.0)
        limit = tolerance_percent / 100.0 * abs(true)
        judgement = _within(abs(off), expanded, limit)
    return Judged(step, section, quantity, own, true, off, u, percent, judgement)


def _within(off_m: float, expanded_m: float, limit_m: float) -> Judgement:
    """Decide as ISO 14253-1 does: only what holds over the whole interval counts."""
    if off_m + expanded_m <= limit_m:
        return "within"
    return "outside" if off_m - expanded_m > limit_m else "open"
