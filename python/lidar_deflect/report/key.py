"""The key table: every load step and section, measured, predicted, judged."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import polars as pl

from lidar_deflect import behaviour, words
from lidar_deflect.comparison.methods import largest_step
from lidar_deflect.report import digits
from lidar_deflect.report.document import Block, Cell, Column, Fold, Row, Table, Text
from lidar_deflect.report.document import words as said
from lidar_deflect.report.verdict import judged

if TYPE_CHECKING:
    from collections.abc import Mapping

    from lidar_deflect.comparison.judgement import Judged
    from lidar_deflect.folder import Folder

_MOST_ROWS = 60
_MARKS = {"within": "good", "outside": "bad", "open": "open", "none": ""}
_STATUS_MARKS = {"ok": "", "degraded": "open", "interpolated": "open", "extrapolated": "open"}


def blocks(folder: Folder) -> tuple[Block, ...]:
    """Return the key table; with many sections first its largest step alone."""
    if folder.steps.is_empty():
        return (Text((words.NO_STEPS,)),)
    table = key_table(folder)
    note = _predicted_note(folder)
    if len(table.rows) <= _MOST_ROWS or len(table.groups) < 2:
        return (table, *note)
    step = largest_step(folder.steps)
    first = key_table(folder, step=step)
    return (Text((words.KEY_LARGEST,)), first, *note, Fold(words.KEY_EVERY, (table,)))


def _predicted_note(folder: Folder) -> tuple[Block, ...]:
    kinds = list(dict.fromkeys(each.quantity for each in judged(folder).values()))
    sentences = tuple(words.PREDICTED[kind] for kind in kinds)
    return (Text((*sentences, words.UNITS), quiet=True),)


def key_table(folder: Folder, *, step: str | None = None) -> Table:
    """Return the key table, of one step or of all."""
    steps = folder.steps if step is None else folder.steps.filter(pl.col("step") == step)
    unit = behaviour.direction(folder.config, folder.steps)
    if unit is not None:
        steps = behaviour.along(steps, unit)
    shape = _Shape(folder, has_along=unit is not None)
    rows = [(row["step"], shape.row(row)) for row in steps.iter_rows(named=True)]
    names = dict.fromkeys(name for name, _ in rows)
    groups = tuple(tuple(cells for own, cells in rows if own == name) for name in names)
    certain = folder.steps["ud_m"].null_count() < folder.steps.height
    note = words.KEY_UNCERTAIN if certain else words.KEY_SILENT
    caption = words.KEY_CAPTION.format(uncertainty=note)
    name = "key" if step is None else "key_largest"
    return Table(name, caption, shape.columns(), groups, head_columns=3)


class _Shape:
    """Which columns the table has, by what there is to show."""

    def __init__(self, folder: Folder, *, has_along: bool) -> None:
        steps = folder.steps
        self._judged = judged(folder)
        self._has_along = has_along
        self._has_load = steps["load"].null_count() < steps.height
        self._has_twist = steps["twist_deg"].null_count() < steps.height
        self._has_root = steps["dr_m"].null_count() < steps.height
        self._has_verdict = any(each.judgement != "none" for each in self._judged.values())

    def columns(self) -> tuple[Column, ...]:
        label = words.COLUMNS
        found = [Column(label["step"], numeric=False)]
        found += [Column(label["load"], "%")] if self._has_load else []
        found += [Column(label["section"], numeric=False), Column(label["s"], "m")]
        found += [Column(label[name], "mm") for name in ("dx", "dy", "dz")]
        found += [Column(label["along"], "mm")] if self._has_along else []
        found += [Column(label["total"], "mm")]
        found += [Column(label["root"], "mm")] if self._has_root else []
        found += [Column(label["twist"], "°")] if self._has_twist else []
        if self._judged:
            found += [Column(label["prediction"], "mm"), Column(label["difference"], "mm")]
            found += [Column(label["difference"], "%")]
        found += [Column(label["verdict"], numeric=False)] if self._has_verdict else []
        return (*found, Column(label["status"], numeric=False))

    def row(self, row: Mapping[str, Any]) -> Row:
        cells = [said(row["step"])]
        cells += [digits.number(row["load"], 1)] if self._has_load else []
        cells += [said(row["section"]), Cell(digits.place(row["s_m"]), row["s_m"])]
        cells += [digits.millimetres(row[f"d{a}_m"], row[f"ud{a}_m"]) for a in "xyz"]
        cells += [digits.millimetres(row["along_m"], row["ualong_m"])] if self._has_along else []
        cells += [digits.millimetres(row["d_m"], row["ud_m"])]
        cells += [digits.millimetres(row["dr_m"], row["ud_m"])] if self._has_root else []
        cells += [digits.degrees(row["twist_deg"], row["utwist_deg"])] if self._has_twist else []
        cells += self._predicted(self._judged.get((row["step"], row["section"])))
        return (*cells, status(row))

    def _predicted(self, found: Judged | None) -> list[Cell]:
        if not self._judged:
            return []
        empty = Cell(digits.NONE)
        if found is None:
            return [empty] * (4 if self._has_verdict else 3)
        cells = [
            digits.millimetres(found.reference_m),
            digits.millimetres(found.difference_m, found.u_m),
            Cell(digits.fixed(found.percent, 2), found.percent),
        ]
        word = words.JUDGED[found.judgement] or digits.NONE
        return cells + ([said(word, _MARKS[found.judgement])] if self._has_verdict else [])


def status(row: Mapping[str, Any]) -> Cell:
    """Return status and reason of a row."""
    name, reason = str(row["status"]), row["reason"]
    return said(f"{name}: {reason}" if reason else name, _STATUS_MARKS.get(name, "bad"))
