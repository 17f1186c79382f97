"""CSV as loggers write it: any separator, text above the header, units below it, decimal commas."""

from __future__ import annotations

import csv
import io
import re
from collections import Counter
from typing import TYPE_CHECKING

import polars as pl

if TYPE_CHECKING:
    from collections.abc import Sequence

_SEPARATORS = (";", "\t", ",", "|")
_LOOKED_AT = 400
_QUOTE = '"'
_NUMBER = re.compile(r"^\s*[+-]?[\d.,]*\d[\d.,]*([eE][+-]?\d+)?\s*$")
_TIME = re.compile(r"\d{1,4}[-./:]\d{1,2}[-./:]\d{1,4}")


def read(content: bytes, holding: Sequence[str] = ()) -> pl.DataFrame:
    """Read CSV text; all columns are text, stripped.

    Lines that begin with ``#`` are skipped. The separator is the one by which most lines have the
    same number of fields; the header is the first such line, or the first with a wanted column; a
    row of units below it is left out.

    Parameters
    ----------
    content
        Bytes of the file, UTF-8, UTF-16 or Latin-1.
    holding
        Columns that are wanted.
    """
    lines = [each for each in decoded(content).splitlines() if each.strip()]
    lines = [each for each in lines if not each.startswith("#")]
    if not lines:
        raise pl.exceptions.NoDataError("it is empty")
    separator, count = _dialect(lines[:_LOOKED_AT])
    lines = lines[_header(lines, separator, count, holding) :]
    if len(lines) > 2 and _is_units(lines, separator):
        del lines[1]
    lines = _without_tails(lines, separator)
    frame = pl.read_csv(
        io.BytesIO("\n".join(lines).encode()),
        separator=separator,
        infer_schema=False,
    )
    names = [name.strip() for name in frame.columns]
    kept = [k for k, name in enumerate(names) if not _is_nothing(name, frame[:, k])]
    return frame[:, kept].rename(
        {frame.columns[k]: names[k] for k in kept if frame.columns[k] != names[k]}
    )


def decoded(content: bytes) -> str:
    """Return text of the encodings that are found in laboratories."""
    if content[:2] in (b"\xff\xfe", b"\xfe\xff"):
        return content.decode("utf-16", errors="replace")
    try:
        return content.decode("utf-8-sig")
    except UnicodeDecodeError:
        return content.decode("latin-1")  # numbers are the same


def _fields(line: str, separator: str) -> list[str]:
    if _QUOTE not in line:
        return [each.strip() for each in line.split(separator)]
    return [each.strip() for each in next(csv.reader([line], delimiter=separator), [])]


def _count(line: str, separator: str) -> int:
    if _QUOTE not in line:
        return line.count(separator) + 1
    return len(_fields(line, separator))


def _dialect(lines: Sequence[str]) -> tuple[str, int]:
    """Separator and number of fields that most lines agree on."""
    best = (0.0, ",", 1)
    for separator in _SEPARATORS:
        counts = Counter(_count(line, separator) for line in lines)
        count, agreed = max(counts.items(), key=lambda item: (item[1] * (item[0] > 1), item[0]))
        if count > 1 and agreed / len(lines) > best[0] + 1e-9:
            best = (agreed / len(lines), separator, count)
    return best[1], best[2]


def _header(lines: Sequence[str], separator: str, count: int, holding: Sequence[str]) -> int:
    """Return which line is the header."""
    fields = [_fields(line, separator) for line in lines[:_LOOKED_AT]]
    wanted = [k for k, each in enumerate(fields) if set(each) & set(holding)]
    full = [k for k, each in enumerate(fields) if len(each) == count]
    return next(iter(wanted or full), 0)


def _is_units(lines: Sequence[str], separator: str) -> bool:
    """Tell whether the second line holds units: nothing in it is a number, unlike in the third."""
    second, third = (_fields(line, separator) for line in lines[1:3])
    return (
        not any(_NUMBER.match(each) or _TIME.search(each) for each in second)
        and any(_NUMBER.match(each) for each in third)
        and any(each for each in second)
    )


def _without_tails(lines: Sequence[str], separator: str) -> list[str]:
    """Take off the separator that some loggers write at the end of every line but the header."""
    if lines[0].endswith(separator) or not all(each.endswith(separator) for each in lines[1:]):
        return list(lines)
    if len(lines) < 2 or lines[1].count(separator) <= lines[0].count(separator):
        return list(lines)
    return [lines[0], *(each.removesuffix(separator) for each in lines[1:])]


def _is_nothing(name: str, values: pl.Series) -> bool:
    """Tell the column that a separator at the end of each line makes."""
    return (not name or name.startswith("_duplicated")) and values.null_count() == len(values)
