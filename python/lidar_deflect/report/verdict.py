"""The report in one line: measured against predicted by the user's tolerance, gates, self-check."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import polars as pl

from lidar_deflect import words
from lidar_deflect.comparison.judgement import Judged, judge
from lidar_deflect.report import checks, digits
from lidar_deflect.report.document import Headline, Verdict
from lidar_deflect.steps import SEEN

if TYPE_CHECKING:
    from collections.abc import Sequence

    from lidar_deflect.folder import Folder


def judged(folder: Folder) -> dict[tuple[str, str], Judged]:
    """Judge every load step and section that has a prediction, by step and section."""
    return {(j.step, j.section): j for j in judge(folder.comparison, tolerance(folder))}


def tolerance(folder: Folder) -> float | None:
    """Return the user's tolerance in percent, or None."""
    found = (folder.config.get("prediction") or {}).get("tolerance_percent")
    return None if found is None else float(found)


def verdict(folder: Folder) -> Verdict:
    """Return the verdict with the sentences that it needs."""
    limit = tolerance(folder)
    found = [each for each in judged(folder).values() if each.percent is not None]
    if limit is None or not found:
        mark, sentences = "none", [_why_none(folder, limit)]
    else:
        mark, sentences = _decided(found)
        sentences += _reservations(folder, found)
    title = words.VERDICT[mark].format(limit=digits.percent(limit, 1 if (limit or 1) % 1 else 0))
    if checks.has_failed(folder):
        title += words.RESERVED if mark == "good" else ""
        mark = "open" if mark == "good" else mark
        return Verdict(mark, title, tuple(sentences), (words.GATES_FAILED,))
    return Verdict(mark, title, (*sentences, words.GATES_PASSED))


def _why_none(folder: Folder, limit: float | None) -> str:
    if not folder.config.get("prediction"):
        return words.NO_PREDICTION
    return words.NOT_COMPARED if limit is not None else words.NO_TOLERANCE


def _decided(found: Sequence[Judged]) -> tuple[str, list[str]]:
    counts = {mark: sum(each.judgement == mark for each in found) for mark in words.JUDGED}
    count = len(found)
    if counts["outside"]:
        worst = max(found, key=lambda each: abs(each.percent or 0.0))
        where = f"{digits.percent(worst.percent)} ({worst.section}, {worst.step})"
        text = words.SOME_OUTSIDE.format(bad=counts["outside"], count=count, worst=where)
        return "bad", [text]
    if counts["open"]:
        text = words.SOME_OPEN.format(open=counts["open"], within=counts["within"], count=count)
        return "open", [text]
    return "good", [words.ALL_WITHIN.format(count=count)]


def _reservations(folder: Folder, found: Sequence[Judged]) -> list[str]:
    certain = any(each.u_m is not None for each in found)
    sentences = [words.RULE if certain else words.NOT_UNCERTAIN]
    gone = folder.steps.filter(pl.col("d_m").is_null()).height
    return sentences + ([words.UNJUDGED.format(count=gone)] if gone else [])


def headlines(folder: Folder) -> tuple[Headline, ...]:
    """Return the few numbers to see first."""
    found = [_largest(folder), _difference(folder), _uncertainty(folder)]
    found += [_measured(folder), _lost(folder)]
    return tuple(each for each in found if each is not None)


def _largest(folder: Folder) -> Headline | None:
    rows = folder.steps.filter(pl.col("d_m").is_not_null()).sort("d_m", descending=True)
    if rows.is_empty():
        return None
    row = rows.row(0, named=True)
    cell = digits.measured(row["d_m"], row["ud_m"], scale=1.0, decimals=3)
    value = f"{cell.text} {cell.interval}".strip() + " m"
    return Headline(value, words.HEADLINES["deflection"], _place(row))


def _place(row: dict[str, Any]) -> str:
    return f"{row['section']} ({row['s_m']:g} m), {row['step']}"


def _difference(folder: Folder) -> Headline | None:
    found = [each for each in judged(folder).values() if each.percent is not None]
    if not found:
        return None
    worst = max(found, key=lambda each: abs(each.percent or 0.0))
    what = words.HEADLINES["difference"]
    return Headline(digits.percent(worst.percent), what, f"{worst.section}, {worst.step}")


def _uncertainty(folder: Folder) -> Headline | None:
    rows = folder.steps.filter(pl.col("ud_m").is_not_null()).sort("ud_m", descending=True)
    if rows.is_empty():
        return None
    row = rows.row(0, named=True)
    cell = digits.millimetres(row["ud_m"], row["ud_m"])
    return Headline(f"{cell.interval} mm", words.HEADLINES["uncertainty"], _place(row))


def _measured(folder: Folder) -> Headline:
    states = folder.deflection["status"].cast(pl.String)
    share = 100.0 * float(states.is_in(SEEN).mean() or 0.0)  # type: ignore[arg-type]
    where = f"{digits.count(len(states))} states"
    return Headline(digits.percent(share, 1), words.HEADLINES["states"], where)


def _lost(folder: Folder) -> Headline | None:
    health = folder.health
    if health.is_empty():
        return None
    lost, arrived = int(health["lost"].sum()), int(health["packets"].sum())
    where = f"{health['lidar'].n_unique()} lidars"
    share = 100.0 * lost / max(lost + arrived, 1)
    return Headline(digits.percent(share), words.HEADLINES["lost"], where)
