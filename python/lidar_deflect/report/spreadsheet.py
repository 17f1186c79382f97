"""The report as a workbook: verdict, one sheet per table with units and formats, charts."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any

import polars as pl

from lidar_deflect import tables, words
from lidar_deflect.extras import need
from lidar_deflect.files import whole_file
from lidar_deflect.folder import Folder
from lidar_deflect.plots import style
from lidar_deflect.plots.source import sections, some
from lidar_deflect.report.build import document

if TYPE_CHECKING:
    from collections.abc import Iterable, Sequence

    from lidar_deflect.report.document import Column, Document, Table

MOST_ROWS = 200_000
"""Rows of one sheet; longer tables are thinned evenly, and the first sheet says so."""

_MOST_CHARTS = 12
_FORMATS = {
    "m": "0.0000",
    "mm": "0.0",
    "deg": "0.000",
    "°": "0.000",
    "percent": "0.00",
    "%": "0.00",
    "s": "0.000",
    "UTC": "yyyy-mm-dd hh:mm:ss.000",
    "count": "#,##0",
    "index": "0",
    "ratio": "0.0000",
    "Hz": "0.0000",
    "mrad": "0.000",
    "rad": "0.000000",
    "ms": "0.00",
    "1/min": "0.0",
}
_GENERAL = "0.0000"
_WIDEST = 48


def write(folder: str | Path, out: str | Path, *, overwrite: bool = True) -> Path:
    """Write the workbook of a result folder.

    The tables of the folder stand in sheets of their names: a row of units, a row of names, then
    the rows of the table, sorted by section where there are sections. Instants are UTC without a
    zone, which spreadsheets do not know.

    Raises
    ------
    MissingExtraError
        If xlsxwriter is not installed.
    ResultNotFoundError, ResultError
        If `folder` is no result folder or cannot be read.
    OutputError
        If the workbook cannot be written.
    """
    xlsxwriter = need("xlsxwriter", "xlsx", "a spreadsheet")
    found = Folder(folder)
    path = Path(out)
    with whole_file(path, overwrite=overwrite) as temporary:
        book = xlsxwriter.Workbook(str(temporary), {"strings_to_formulas": False})
        _Book(book).fill(found)
        book.close()
    return path


class _Book:
    def __init__(self, book: Any) -> None:
        self._book = book
        self._bold = book.add_format({"bold": True, "bottom": 1})
        self._unit = book.add_format({"italic": True, "font_color": "#5a6570"})
        self._title = book.add_format({"bold": True, "font_size": 16})
        self._wrapped = book.add_format({"text_wrap": True, "valign": "top"})
        self._formats: dict[str, Any] = {}

    def fill(self, folder: Folder) -> None:
        report = document(folder)
        frames = {name: _sorted(frame) for name, frame in _frames(folder)}
        self._front(report, frames)
        for table in report.tables():
            if table.name in ("key", "load_response", "creep", "self_check", "drops", "table2"):
                self._document_table(table)
        for name, frame in frames.items():
            self._frame(name, frame.gather_every(_every(frame)))
        self._charts(folder, frames)

    def _format(self, unit: str) -> Any:
        text = _FORMATS.get(unit, _GENERAL)
        if text not in self._formats:
            self._formats[text] = self._book.add_format({"num_format": text})
        return self._formats[text]

    def _front(self, report: Document, frames: dict[str, pl.DataFrame]) -> None:
        sheet = self._book.add_worksheet("report")
        sheet.set_column(0, 0, 26)
        sheet.set_column(1, 1, 90, self._wrapped)
        sheet.write_string(0, 0, report.title, self._title)
        verdict = report.verdict
        rows = [(report.kicker, ""), (words.HEADINGS["result"], verdict.title)]
        rows += [("", each) for each in (*verdict.alarms, *verdict.sentences)]
        rows += [(each.what, f"{each.value}, {each.where}") for each in report.headlines]
        rows += [*report.cover, *report.facts.items(), ("", words.UNITS)]
        rows += [
            (name, words.SHEET_THINNED.format(every=_every(frame), rows=frame.height))
            for name, frame in frames.items()
            if _every(frame) > 1
        ]
        for row, (name, value) in enumerate(rows, start=2):
            sheet.write_string(row, 0, name)
            sheet.write_string(row, 1, value)

    def _document_table(self, table: Table) -> None:
        """Add a table of the report: values in the unit of their column, U beside its value."""
        sheet = self._book.add_worksheet(table.name)
        sheet.freeze_panes(2, table.head_columns)
        place = 0
        for index, column in enumerate(table.columns):
            cells = [row[index] for row in table.rows]
            values = [cell.value if cell.value is not None else None for cell in cells]
            self._column(sheet, place, column.label, _unit_of(column), values)
            place += 1
            if any(cell.u is not None for cell in cells):
                name = f"U({column.label})"
                self._column(sheet, place, name, _unit_of(column), [cell.u for cell in cells])
                place += 1
        sheet.autofilter(1, 0, 1 + len(table.rows), place - 1)

    def _frame(self, name: str, frame: pl.DataFrame) -> None:
        """Add a table of the folder, as declared."""
        sheet = self._book.add_worksheet(name)
        sheet.freeze_panes(2, 0)
        declared = tables.SCHEMAS[name]
        for place, column in enumerate(declared.columns):
            values = _plain(frame[column.name]).to_list()
            self._column(sheet, place, column.name, column.unit, values)
        sheet.autofilter(1, 0, 1 + frame.height, len(declared.columns) - 1)

    def _column(self, sheet: Any, place: int, name: str, unit: str, values: Sequence[Any]) -> None:
        sheet.write_string(0, place, "" if unit == "name" else unit, self._unit)
        sheet.write_string(1, place, name, self._bold)
        style_ = self._format(unit)
        for row, value in enumerate(values, start=2):
            if value is None:
                continue
            if isinstance(value, str):
                sheet.write_string(row, place, value)
            elif isinstance(value, bool):
                sheet.write_boolean(row, place, value)
            elif isinstance(value, int | float):
                sheet.write_number(row, place, value, style_)
            else:
                sheet.write_datetime(row, place, value, style_)
        widest = max([len(name), *(len(v) for v in values if isinstance(v, str))], default=8)
        sheet.set_column(place, place, 22 if unit == "UTC" else min(max(9, widest + 2), _WIDEST))

    def _charts(self, folder: Folder, frames: dict[str, pl.DataFrame]) -> None:
        frame = frames["deflection"].gather_every(_every(frames["deflection"]))
        sheet = self._book.add_worksheet("charts")
        spots = _blocks(frame)
        shown = some(sections(folder.deflection), _MOST_CHARTS)
        for k, (name, s_m) in enumerate(shown):
            chart = self._chart(f"{name} ({s_m:g} m)", "time (s)", "deflection (m)")
            for n, axis in enumerate("xyz"):
                _series(chart, spots[name], ("t_s", f"d{axis}_m"), f"d{axis}", style.colour(n))
            sheet.insert_chart(24 * (k // 2), 10 * (k % 2), chart)
        if frame["load"].null_count() < frame.height:
            chart = self._chart(words.HEADINGS["load"], "load (%)", "total deflection (m)")
            for n, (name, _) in enumerate(shown):
                _series(chart, spots[name], ("load", "d_m"), name, style.colour(n))
            rows = len(shown)
            sheet.insert_chart(24 * (rows // 2), 10 * (rows % 2), chart)

    def _chart(self, title: str, x: str, y: str) -> Any:
        chart = self._book.add_chart({"type": "scatter", "subtype": "straight"})
        chart.set_title({"name": title, "name_font": {"size": 12}})
        chart.set_x_axis({"name": x, "major_gridlines": {"visible": True}})
        chart.set_y_axis({"name": y, "label_position": "low"})
        chart.set_size({"width": 620, "height": 440})
        chart.show_blanks_as("gap")
        return chart


def _series(
    chart: Any, rows: tuple[int, int], columns: tuple[str, str], name: str, colour: str
) -> None:
    names = tables.SCHEMAS["deflection"].names
    x, y = (names.index(column) for column in columns)
    first, last = rows
    chart.add_series(
        {
            "name": name,
            "categories": ["deflection", first, x, last, x],
            "values": ["deflection", first, y, last, y],
            "line": {"color": colour, "width": 1.25},
        }
    )


def _blocks(frame: pl.DataFrame) -> dict[str, tuple[int, int]]:
    """First and last row of every section in the sheet; two rows stand above the table."""
    spots: dict[str, tuple[int, int]] = {}
    for row, name in enumerate(frame["section"], start=2):
        spots[name] = (spots.get(name, (row, row))[0], row)
    return spots


def _unit_of(column: Column) -> str:
    return column.unit if column.numeric else "name"


def _frames(folder: Folder) -> Iterable[tuple[str, pl.DataFrame]]:
    for name in tables.SCHEMAS:
        path = folder.path / f"{name}.parquet"
        if path.is_file():
            yield name, tables.read(path, name=name)


def _sorted(frame: pl.DataFrame) -> pl.DataFrame:
    if {"section", "s_m", "time"} <= set(frame.columns) and "source" not in frame.columns:
        return frame.sort("s_m", "section", "time", maintain_order=True)
    return frame


def _every(frame: pl.DataFrame) -> int:
    return max(1, -(-frame.height // MOST_ROWS))


def _plain(series: pl.Series) -> pl.Series:
    if isinstance(series.dtype, pl.Datetime):
        return series.dt.replace_time_zone(None).dt.cast_time_unit("us")
    return series.cast(pl.String) if isinstance(series.dtype, pl.Enum) else series
