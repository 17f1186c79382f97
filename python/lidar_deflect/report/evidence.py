"""Where the lidars stand and what that rests on; how they fared second by second."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

import numpy as np
import polars as pl

from lidar_deflect import words
from lidar_deflect.plots import Plots
from lidar_deflect.report import digits
from lidar_deflect.report.checks import flat, label
from lidar_deflect.report.document import (
    Block,
    Bullets,
    Column,
    Facts,
    Figure,
    Fold,
    Heading,
    Row,
    Table,
    Text,
)
from lidar_deflect.report.document import words as said

if TYPE_CHECKING:
    from lidar_deflect.folder import Folder


def calibration(folder: Folder) -> tuple[Block, ...]:
    """Plan, poses with their uncertainty, residuals, drift."""
    plots = Plots(folder)
    found: list[Block] = [Figure("plan", words.CAPTIONS["plan"], plots.plan())]
    document = folder.calibration
    lidars = [each for each in document.get("lidars", ()) if "world_from_sensor" in each]
    if not lidars:
        return (*found, Text((words.NO_CALIBRATION,)))
    method = str(document.get("method", "unknown")).replace("_", " ")
    found.append(Text((words.CALIBRATED.format(method=method),)))
    found.append(_poses(lidars))
    certain = any(each.get("covariance") for each in lidars)
    if certain:
        caption = words.CAPTIONS["pose_uncertainty"]
        found.append(Figure("pose_uncertainty", caption, plots.pose_uncertainty()))
    else:
        found.append(Text((words.NO_COVARIANCE,)))
    if (document.get("evidence") or {}).get("cells"):
        found += [
            Figure("yard_residuals", words.CAPTIONS["yard_residuals"], plots.yard_residuals()),
            Figure("lidar_shares", words.CAPTIONS["lidar_shares"], plots.lidar_shares()),
        ]
    found += _rest(document, lidars)
    if folder.poses.height:
        found.append(Figure("drift", words.CAPTIONS["drift"], plots.drift(), link="time"))
    if folder.points["residual_m"].null_count() < folder.points.height:
        found.append(Figure("residuals", words.CAPTIONS["residuals"], plots.residuals()))
    if folder.points["chord"].null_count() < folder.points.height:
        found.append(Figure("residual_map", words.CAPTIONS["residual_map"], plots.residual_map()))
    return tuple(found)


def _rest(document: Mapping[str, Any], lidars: list[Mapping[str, Any]]) -> list[Block]:
    found: list[Block] = []
    table = _evidence(lidars)
    if table is not None:
        found.append(table)
    more = document.get("evidence")
    if isinstance(more, Mapping) and more:
        said_whole = ((key, value) for key, value in more.items() if key != "cells")
        pairs = tuple((label(str(key)), flat(value)) for key, value in said_whole)
        found.append(Facts(pairs))
    warnings = tuple(str(each) for each in document.get("warnings") or ())
    return found + ([Bullets(warnings, "warn")] if warnings else [])


def _poses(lidars: list[Mapping[str, Any]]) -> Table:
    columns = [Column(words.HEADS["lidar"], numeric=False)]
    columns += [Column(axis, "m") for axis in "xyz"]
    columns += [Column(f"{words.HEADS['turn']} {axis}", "mrad") for axis in "xyz"]
    rows = tuple(_pose(each) for each in lidars)
    return Table("poses", words.POSES_CAPTION, tuple(columns), (rows,))


def _pose(entry: Mapping[str, Any]) -> Row:
    place = np.asarray(entry["world_from_sensor"], dtype=np.float64)[:3, 3]
    u: list[float | None] = [None] * 6
    if entry.get("covariance"):
        square = np.diag(np.asarray(entry["covariance"], dtype=np.float64).reshape(6, 6))
        u = [float(value) for value in np.sqrt(np.maximum(square, 0.0))]
    cells = [
        digits.measured(float(p), own, scale=1.0, decimals=3)
        for p, own in zip(place, u[3:], strict=True)
    ]
    turns = [digits.number(None if own is None else 2e3 * own, 3) for own in u[:3]]
    return (said(str(entry.get("id", ""))), *cells, *turns)


def _evidence(lidars: list[Mapping[str, Any]]) -> Table | None:
    names = list(dict.fromkeys(name for each in lidars for name in each.get("evidence") or {}))
    if not names:
        return None
    columns = [Column(words.HEADS["what"], numeric=False)]
    columns += [Column(str(each.get("id", "")), numeric=False) for each in lidars]
    rows = tuple(
        (
            said(label(name)),
            *(said(flat((each.get("evidence") or {}).get(name))) for each in lidars),
        )
        for name in names
    )
    return Table("evidence", words.EVIDENCE_CAPTION, tuple(columns), (rows,))


def health(folder: Folder) -> tuple[Block, ...]:
    """Totals and seconds of every lidar, states that were not measured."""
    found: list[Block] = []
    if folder.health.is_empty():
        found.append(Text((words.NO_HEALTH,)))
    else:
        figure = Plots(folder).health()
        found += [_totals(folder), Figure("health", words.CAPTIONS["health"], figure, "time")]
    table = _statuses(folder)
    many = table is not None and len(table.rows) > 24
    if table is None:
        found.append(Text((words.ALL_OK,)))
    else:
        found.append(Fold(words.STATUS_CAPTION, (table,)) if many else table)
    return tuple(found)


def _totals(folder: Folder) -> Table:
    sums = ("packets", "lost", "duplicated", "late", "points", "blade_points")
    due = (pl.col("packets").cast(pl.Int64) + pl.col("lost")).clip(lower_bound=1)
    frame = folder.health.with_columns(share=100.0 * pl.col("lost") / due)
    counted = frame.group_by("lidar").agg(
        *(pl.col(name).cast(pl.Int64).sum() for name in sums),
        pl.col("share").max().alias("worst"),
        pl.col("blade_points").is_not_null().any().alias("counted"),
        pl.col("rpm", "clock_offset_s", "coverage").mean(),
    )
    rows = tuple(_lidar(row) for row in counted.sort("lidar").iter_rows(named=True))
    heads = words.HEALTH_COLUMNS
    units = {"lost_percent": "%", "worst": "% lost", "rpm": "1/min", "clock": "ms"}
    units |= {"coverage": "%"}
    columns = tuple(
        Column(text, units.get(name, ""), numeric=name != "lidar") for name, text in heads.items()
    )
    return Table("health", words.HEALTH_CAPTION, columns, (rows,))


def _lidar(row: Mapping[str, Any]) -> Row:
    lost = 100.0 * row["lost"] / max(row["packets"] + row["lost"], 1)
    offset, coverage = row["clock_offset_s"], row["coverage"]
    cells = [said(row["lidar"]), digits.number(row["packets"]), digits.number(row["lost"])]
    cells += [digits.number(lost, 2), digits.number(row["worst"], 1)]
    cells += [digits.number(row[name]) for name in ("duplicated", "late", "points")]
    cells += [digits.number(row["blade_points"] if row["counted"] else None)]
    cells += [digits.number(row["rpm"], 1)]
    cells += [digits.number(None if offset is None else 1e3 * offset, 2)]
    return (*cells, digits.number(None if coverage is None else 100.0 * coverage, 1))


def _statuses(folder: Folder) -> Table | None:
    not_ok = folder.deflection.filter(pl.col("status").cast(pl.String) != "ok")
    if not_ok.is_empty():
        return None
    counted = not_ok.group_by("status", "reason", "section", "s_m").len()
    counted = counted.sort("status", "reason", "s_m", nulls_last=True)
    total = dict(folder.deflection.group_by("section").len().iter_rows())
    rows = tuple(
        (
            said(row["section"]),
            said(row["status"]),
            said(words.STATUS.get(row["status"], "")),
            said(_reason(row["reason"])),
            digits.number(row["len"]),
            digits.number(100.0 * row["len"] / total[row["section"]], 1),
        )
        for row in counted.iter_rows(named=True)
    )
    heads = ("section", "status", "meaning", "reason")
    columns = [Column(words.HEADS[head], numeric=False) for head in heads]
    columns += [Column(words.HEADS["states"]), Column(words.HEADS["share"], "%")]
    return Table("statuses", words.STATUS_CAPTION, tuple(columns), (rows,))


def _reason(reason: str | None) -> str:
    if reason is None:
        return digits.NONE
    meaning = words.REASONS.get(reason)
    return f"{reason}: {meaning}" if meaning else reason


def left_out(folder: Folder) -> tuple[Block, ...]:
    """Every warning, and every drop with reason and count."""
    warnings = all_warnings(folder)
    tone = "bad" if _failed(folder) else "warn"
    found: list[Block] = [
        Bullets(warnings, tone) if warnings else Text((words.NO_WARNINGS,)),
        *_clocks(folder),
    ]
    rows = tuple(
        (said(place), said(reason), digits.number(count)) for place, reason, count in drops(folder)
    )
    if not rows:
        return (*found, Text((words.NOTHING_DROPPED,)))
    columns = (
        Column(words.HEADS["where"], numeric=False),
        Column(words.HEADS["reason"], numeric=False),
        Column(words.HEADS["count"]),
    )
    return (*found, Table("drops", words.DROPS_CAPTION, columns, (rows,)))


def _clocks(folder: Folder) -> list[Block]:
    """Say what was found of the clocks of other instruments."""
    shifts = folder.run.get("channel_clocks") or ()
    sentences = tuple(str(each.get("text", "")) for each in shifts if isinstance(each, Mapping))
    return [Heading(words.SHIFTED), Bullets(sentences)] if sentences else []


def _failed(folder: Folder) -> list[str]:
    gates = folder.run.get("gates") or {}
    return [str(each) for each in gates.get("failed", ())] if isinstance(gates, Mapping) else []


def all_warnings(folder: Folder) -> tuple[str, ...]:
    """Return failed gates first, then what the run warned of."""
    given = [*_failed(folder), *(str(each) for each in folder.run.get("warnings") or ())]
    return tuple(dict.fromkeys(given))


def drops(folder: Folder) -> list[tuple[str, str, int | None]]:
    """Return where, why and how often something was left out."""
    capture = folder.run.get("capture") or {}
    given = capture.get("drops") if isinstance(capture, Mapping) else None
    place = words.DROPS_PLACES
    found = [(place["capture"], *pair) for pair in _counts(given)]
    found += [(place["run"], *pair) for pair in _counts(folder.run.get("drops"))]
    rejected = folder.rejected.group_by("reason").agg(pl.col("count").sum()).sort("reason")
    return found + [(place["blade"], reason, int(n)) for reason, n in rejected.iter_rows()]


def _counts(given: Any) -> list[tuple[str, int | None]]:
    """Pairs of reason and count, from a list of objects or from a mapping."""
    if isinstance(given, Mapping):
        given = [{"reason": reason, "count": number} for reason, number in given.items()]
    return [
        (str(each["reason"]), each["count"] if isinstance(each.get("count"), int) else None)
        for each in given or ()
        if isinstance(each, Mapping) and "reason" in each
    ]
