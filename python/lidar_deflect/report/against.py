"""The comparison chapter: the paper's table 2 with intervals, and every row."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from lidar_deflect import comparison, words
from lidar_deflect.plots import Plots
from lidar_deflect.report import digits
from lidar_deflect.report.curves import wires
from lidar_deflect.report.document import Block, Cell, Column, Figure, Fold, Row, Table, Text
from lidar_deflect.report.document import words as said

if TYPE_CHECKING:
    from collections.abc import Mapping

    from lidar_deflect.folder import Folder

_NORMAL_95 = 1.96


def blocks(folder: Folder) -> tuple[Block, ...]:
    """Return the chapter."""
    frame = folder.comparison
    if frame.is_empty():
        return (Text((words.NOTHING_COMPARED,)), *wires(folder))
    has_wires = bool((frame["quantity"] == "wire").any())
    found: list[Block] = [Text((words.ERROR, words.WIRE) if has_wires else (words.ERROR,))]
    step = comparison.largest_step(frame) or ""
    methods = comparison.by_method(frame)
    if methods.height:
        found.append(_table2(list(methods.iter_rows(named=True)), step))
    if frame["error_percent"].null_count() < frame.height:
        caption = words.CAPTIONS["comparison"].format(step=step)
        found.append(Figure("comparison", caption, Plots(folder).comparison()))
    found += wires(folder)
    return (*found, Fold(words.EVERY, (_every(folder),)))


def _table2(rows: list[Mapping[str, Any]], step: str) -> Table:
    label = words.AGAINST_COLUMNS
    against = str(rows[0]["against"])
    columns = (
        Column(label["section"], numeric=False),
        Column(label["method"], numeric=False),
        Column(label["measured"], "mm"),
        Column(f"{label['reference']}, {against}", "mm"),
        Column(label["off"], "mm"),
        Column(label["error"], "%"),
        Column(label["interval"], "%", numeric=False),
    )
    names = dict.fromkeys(row["section"] for row in rows)
    groups = tuple(tuple(_method(row) for row in rows if row["section"] == name) for name in names)
    caption = words.TABLE2_CAPTION.format(step=step, against=against)
    return Table("table2", caption, columns, groups, head_columns=2)


def _method(row: Mapping[str, Any]) -> Row:
    return (
        said(f"{row['section']} ({row['s_m']:g} m)"),
        said(row["method"]),
        digits.millimetres(row["value_m"], row["u_m"]),
        digits.millimetres(row["reference_m"]),
        digits.millimetres(row["value_m"] - row["reference_m"]),
        digits.number(row["error_percent"], 2),
        said(_interval(row)),
    )


def _interval(row: Mapping[str, Any]) -> str:
    if row["u_m"] is None or not row["reference_m"] or row["error_percent"] is None:
        return digits.NONE
    half = 100.0 * _NORMAL_95 * row["u_m"] / abs(row["reference_m"])
    low, high = (row["error_percent"] + sign * half for sign in (-1.0, 1.0))
    return f"{digits.fixed(low, 2)} to {digits.fixed(high, 2)}"


def _every(folder: Folder) -> Table:
    label = words.COLUMNS | words.AGAINST_COLUMNS
    columns = (
        Column(label["step"], numeric=False),
        Column(label["section"], numeric=False),
        Column(label["against"], numeric=False),
        Column(label["quantity"], numeric=False),
        Column(label["measured"], "mm"),
        Column(label["reference"], "mm"),
        Column(label["off"], "mm"),
        Column(label["error"], "%"),
        Column(label["ratio"]),
    )
    frame = folder.comparison
    steps = dict.fromkeys(frame["step"])
    rows = [(row["step"], _row(row)) for row in frame.iter_rows(named=True)]
    groups = tuple(tuple(cells for own, cells in rows if own == step) for step in steps)
    return Table("comparison", words.EVERY_CAPTION, columns, groups, head_columns=3)


def _row(row: Mapping[str, Any]) -> Row:
    own, true, u = row["measured_m"], row["reference_m"], row["u_m"]
    off = None if own is None or true is None else own - true
    ratio = None if off is None or not u else abs(off) / (digits.COVERAGE * u)
    reference = digits.millimetres(true)
    if true is None:
        reference = Cell(words.VIRTUAL)
    return (
        said(row["step"]),
        said(f"{row['section']} ({row['s_m']:g} m)"),
        said(row["source"]),
        said(words.QUANTITIES.get(row["quantity"], row["quantity"])),
        digits.millimetres(own, u),
        reference,
        digits.millimetres(off),
        digits.number(row["error_percent"], 2),
        digits.number(ratio, 2, mark="bad" if (ratio or 0.0) > 1.0 else ""),
    )
