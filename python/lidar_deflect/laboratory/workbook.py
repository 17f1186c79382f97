"""Excel workbooks (.xlsx): cells of every sheet, read from the parts of the archive."""

from __future__ import annotations

import re
import zipfile
from datetime import datetime, timedelta
from typing import TYPE_CHECKING, TypeAlias
from xml.etree import ElementTree

import polars as pl

from lidar_deflect.errors import ConfigError

if TYPE_CHECKING:
    from collections.abc import Iterator, Sequence
    from pathlib import Path
    from xml.etree.ElementTree import Element

Value: TypeAlias = float | str | bool | datetime | None

_MAIN = "{http://schemas.openxmlformats.org/spreadsheetml/2006/main}"
_REL = "{http://schemas.openxmlformats.org/officeDocument/2006/relationships}"
_PACKAGE = "{http://schemas.openxmlformats.org/package/2006/relationships}"
_BUILT_IN_DATES = {*range(14, 23), *range(27, 37), *range(45, 48), *range(50, 59)}
_DATE_CODE = re.compile(r"[ymdhs]", re.IGNORECASE)
_QUOTED = re.compile(r'"[^"]*"|\[[^\]]*\]|\\.')
_MOST_BYTES = 1 << 30
_HEADER_ROWS = 60


def read(path: Path) -> list[pl.DataFrame]:
    """Read every sheet that holds a table.

    Numbers are f64, dates naive datetimes (UTC by this project's rule), everything else text. The
    header of a sheet is its first row with at least two texts and a row with a number below it.

    Raises
    ------
    ConfigError
        If a part of the archive is larger than a gibibyte.
    """
    with zipfile.ZipFile(path) as archive:
        if any(part.file_size > _MOST_BYTES for part in archive.infolist()):
            raise ConfigError(f"{path} unpacks to more than a gibibyte", code="config.channel")
        book = _Book(archive)
        sheets = [list(book.rows(name)) for name in book.sheets()]
    found = [_table(rows) for rows in sheets]
    return [frame for frame in found if frame is not None]


class _Book:
    def __init__(self, archive: zipfile.ZipFile) -> None:
        self._archive = archive
        self._texts = self._shared()
        self._dates = self._date_styles()
        workbook = self._xml("xl/workbook.xml")
        properties = workbook.find(f"{_MAIN}workbookPr")
        is_1904 = properties is not None and properties.get("date1904") in ("1", "true")
        self._epoch = datetime(1904, 1, 1) if is_1904 else datetime(1899, 12, 30)
        self._sheets = [each.get(f"{_REL}id") for each in workbook.iter(f"{_MAIN}sheet")]

    def _xml(self, name: str) -> Element:
        content = self._archive.read(name)
        if b"<!DOCTYPE" in content[:4096]:  # entities can grow without bound
            raise KeyError(f"{name} declares a document type")
        return ElementTree.fromstring(content)

    def sheets(self) -> list[str]:
        """Names of the parts of all sheets, in the order of the workbook."""
        relations = self._xml("xl/_rels/workbook.xml.rels").iter(f"{_PACKAGE}Relationship")
        targets = {each.get("Id"): each.get("Target", "") for each in relations}
        names = [targets[id] for id in self._sheets if id in targets]
        return [n.lstrip("/") if n.startswith("/") else f"xl/{n}" for n in names]

    def _shared(self) -> list[str]:
        if "xl/sharedStrings.xml" not in self._archive.namelist():
            return []
        return [_text(each) for each in self._xml("xl/sharedStrings.xml").iter(f"{_MAIN}si")]

    def _date_styles(self) -> list[bool]:
        """Whether each style of a cell shows a date or time."""
        if "xl/styles.xml" not in self._archive.namelist():
            return []
        styles = self._xml("xl/styles.xml")
        own = {
            int(each.get("numFmtId", "0")): each.get("formatCode", "")
            for each in styles.iter(f"{_MAIN}numFmt")
        }
        formats = styles.find(f"{_MAIN}cellXfs")
        ids = [] if formats is None else [int(xf.get("numFmtId", "0")) for xf in formats]
        return [
            id in _BUILT_IN_DATES or bool(_DATE_CODE.search(_QUOTED.sub("", own.get(id, ""))))
            for id in ids
        ]

    def rows(self, name: str) -> Iterator[list[Value]]:
        """Cells of one sheet, row by row."""
        if not name.startswith("xl/worksheets/"):
            return  # a sheet of charts
        for row in self._xml(name).iter(f"{_MAIN}row"):
            cells: list[Value] = []
            for cell in row.iter(f"{_MAIN}c"):
                place = _column(cell.get("r", ""), len(cells))
                cells += [None] * (place - len(cells))
                cells.append(self._value(cell))
            yield cells

    def _value(self, cell: Element) -> Value:
        kind = cell.get("t", "n")
        if kind == "inlineStr":
            return _text(cell)
        found = cell.find(f"{_MAIN}v")
        if found is None or found.text is None or kind == "e":
            return None
        if kind == "s":
            return self._texts[int(found.text)]
        if kind == "b":
            return found.text == "1"
        if kind in ("str", "d"):
            return found.text
        number = float(found.text)
        style = int(cell.get("s", "0"))
        if style < len(self._dates) and self._dates[style]:
            return self._epoch + timedelta(microseconds=round(number * 86_400e6))
        return number


def _text(element: Element) -> str:
    return "".join(each.text or "" for each in element.iter(f"{_MAIN}t"))


def _column(reference: str, default: int) -> int:
    letters = re.match(r"[A-Z]+", reference)
    if letters is None:
        return default
    number = 0
    for letter in letters[0]:
        number = 26 * number + ord(letter) - 64
    return number - 1


def _table(rows: Sequence[Sequence[Value]]) -> pl.DataFrame | None:
    for place, row in enumerate(rows[:_HEADER_ROWS]):
        texts = [cell for cell in row if isinstance(cell, str) and cell.strip()]
        below = rows[place + 1 : place + 3]
        if len(texts) >= 2 and any(isinstance(c, float | datetime) for r in below for c in r):
            return _frame([str(cell or "").strip() for cell in row], rows[place + 1 :])
    return None


def _frame(names: Sequence[str], rows: Sequence[Sequence[Value]]) -> pl.DataFrame:
    if rows and not any(isinstance(cell, float | datetime) for cell in rows[0]):
        rows = rows[1:]  # a row of units
    rows = [row for row in rows if any(cell is not None for cell in row)]
    columns = {}
    for place, name in enumerate(names):
        if name and name not in columns:
            columns[name] = _series(name, [r[place] if place < len(r) else None for r in rows])
    return pl.DataFrame(list(columns.values()))


def _series(name: str, values: Sequence[Value]) -> pl.Series:
    known = [value for value in values if value is not None and value != ""]
    if known and all(isinstance(value, datetime) for value in known):
        return pl.Series(name, [v or None for v in values], dtype=pl.Datetime("us"))
    if all(isinstance(value, float | bool) for value in known):
        numbers = [None if v is None or isinstance(v, str) else float(v) for v in values]  # type: ignore[arg-type]
        return pl.Series(name, numbers, dtype=pl.Float64)
    return pl.Series(name, [None if v is None else str(v) for v in values], dtype=pl.String)
