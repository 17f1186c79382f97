"""What a table is: declared columns with type, unit and meaning."""

import difflib
from dataclasses import dataclass

import polars as pl

from lidar_deflect.errors import InvalidValueError

UTC_NS = pl.Datetime("ns", "UTC")
"""The one type of an instant in every table."""


@dataclass(frozen=True)
class Column:
    """One declared column of a table.

    Parameters
    ----------
    name
        Name in the file, with its unit where it has one.
    dtype
        Polars type.
    unit
        Unit, or ``count``, ``index``, ``name`` for what has none.
    meaning
        One line for people.
    nullable
        Whether a value may be missing (null).
    """

    name: str
    dtype: pl.DataType
    unit: str
    meaning: str
    nullable: bool = False


@dataclass(frozen=True)
class Table:
    """Declared table: its name, what one row stands for, and its columns in order."""

    name: str
    row: str
    columns: tuple[Column, ...]

    @property
    def schema(self) -> pl.Schema:
        """Names and polars types, in the order of the file."""
        return pl.Schema({column.name: column.dtype for column in self.columns})

    @property
    def names(self) -> tuple[str, ...]:
        """Column names in the order of the file."""
        return tuple(column.name for column in self.columns)

    def column(self, name: str) -> Column:
        """Return the column `name`; `InvalidValueError` names the nearest when there is none."""
        for column in self.columns:
            if column.name == name:
                return column
        raise InvalidValueError(
            f"table {self.name} has no column {name!r}",
            code="table.unknown_column",
            facts=[("columns", ", ".join(self.names))],
            hint=nearest_hint(name, self.names),
        )


def nearest_hint(name: str, known: tuple[str, ...] | list[str]) -> str | None:
    """Suggest the known name that looks most like `name`, or nothing."""
    lower = {each.lower(): each for each in known}
    close = difflib.get_close_matches(name.lower(), list(lower), n=1, cutoff=0.5)
    return f"did you mean {lower[close[0]]!r}?" if close else None
