"""Columns into a checked table: names, types and nulls as declared, nothing added silently."""

from collections.abc import Mapping, Sequence
from typing import TypeAlias

import numpy as np
import numpy.typing as npt
import polars as pl

from lidar_deflect.errors import InvalidValueError
from lidar_deflect.tables.catalogue import SCHEMAS
from lidar_deflect.tables.schema import Column, Table, nearest_hint

Values: TypeAlias = npt.ArrayLike | Sequence[object] | pl.Series | None
"""Values of one column; ``None`` stands for a column whose values are all missing."""


def build(name: str, columns: Mapping[str, Values] | pl.DataFrame) -> pl.DataFrame:
    """Make the table `name` from its columns.

    Parameters
    ----------
    name
        Key of `SCHEMAS`.
    columns
        Every declared column, in any order: arrays, lists or series of one length, or ``None`` for
        a column whose values are all missing. Instants may be integers (nanoseconds since 1970
        UTC) or datetimes. NaN becomes null.

    Returns
    -------
    polars.DataFrame
        Columns in the declared order and types.

    Raises
    ------
    InvalidValueError
        If the table or a column is unknown, a column was left out, lengths differ, a value does
        not fit the declared type, or a value is missing where none may be.
    """
    table = schema_of(name)
    given = columns.to_dict() if isinstance(columns, pl.DataFrame) else dict(columns)
    for key in given:
        table.column(key)
    _check_complete(table, given)
    length = _common_length(table, given)
    return pl.DataFrame([_series(table, c, given[c.name], length) for c in table.columns])


def check(name: str, frame: pl.DataFrame) -> None:
    """Raise `InvalidValueError` unless `frame` is exactly the declared table `name`."""
    table = schema_of(name)
    if frame.schema == table.schema:
        for column in table.columns:
            _check_nulls(table, column, frame[column.name])
        return
    for key in frame.columns:
        table.column(key)
    _check_complete(table, dict.fromkeys(frame.columns))
    wrong = [
        (column.name, f"{frame.schema[column.name]}, declared {column.dtype}")
        for column in table.columns
        if frame.schema[column.name] != column.dtype
    ]
    raise InvalidValueError(
        f"table {name} is not as declared",
        code="table.schema",
        facts=wrong or [("order", ", ".join(frame.columns))],
        hint="make it with tables.build",
    )


def empty(name: str) -> pl.DataFrame:
    """Return the table `name` without rows."""
    return pl.DataFrame(schema=schema_of(name).schema)


def schema_of(name: str) -> Table:
    """Return the declaration of table `name`."""
    if name not in SCHEMAS:
        raise InvalidValueError(
            f"there is no table {name!r}",
            code="table.unknown",
            facts=[("tables", ", ".join(SCHEMAS))],
            hint=nearest_hint(name, tuple(SCHEMAS)),
        )
    return SCHEMAS[name]


def _check_complete(table: Table, given: Mapping[str, object]) -> None:
    left_out = [name for name in table.names if name not in given]
    if left_out:
        raise InvalidValueError(
            f"table {table.name} lacks {', '.join(left_out)}",
            code="table.missing_column",
            hint="give None for a column whose values are all missing",
        )


def _common_length(table: Table, given: Mapping[str, Values]) -> int:
    lengths = {key: len(_listed(values)) for key, values in given.items() if values is not None}
    if len(set(lengths.values())) > 1:
        raise InvalidValueError(
            f"columns of table {table.name} differ in length",
            code="table.length",
            facts=[(key, f"{length} values") for key, length in lengths.items()],
        )
    return next(iter(lengths.values()), 0)


def _listed(values: Values) -> pl.Series | npt.NDArray[np.generic] | list[object]:
    if isinstance(values, pl.Series | np.ndarray | list):
        return values
    return list(values)  # type: ignore[arg-type]  # tuples, ranges and the like


def _series(table: Table, column: Column, values: Values, length: int) -> pl.Series:
    if values is None:
        series = pl.Series(column.name, [None] * length, dtype=column.dtype)
    else:
        series = _cast(table, column, _plain(column.name, _listed(values)))
    _check_nulls(table, column, series)
    return series


def _plain(name: str, values: pl.Series | npt.NDArray[np.generic] | list[object]) -> pl.Series:
    """Return a series without NaN; an array is looked through as it is taken over."""
    if isinstance(values, np.ndarray):
        return pl.Series(name, values, strict=False, nan_to_null=True)
    series = pl.Series(name, values, strict=False)
    return series.fill_nan(None) if series.dtype.is_float() else series


def _cast(table: Table, column: Column, series: pl.Series) -> pl.Series:
    if series.dtype == column.dtype:
        return series
    try:
        if isinstance(column.dtype, pl.Datetime):
            return _instants(series)
        return series.cast(column.dtype, strict=True)
    except pl.exceptions.PolarsError as error:
        raise InvalidValueError(
            f"column {column.name} of table {table.name} does not fit {column.dtype}",
            code="table.type",
            facts=[("found", str(series.dtype)), ("because", str(error).splitlines()[0])],
        ) from error


def _instants(series: pl.Series) -> pl.Series:
    """Integers are nanoseconds, naive datetimes are UTC."""
    if isinstance(series.dtype, pl.Datetime) and series.dtype.time_zone is not None:
        return series.dt.convert_time_zone("UTC").dt.cast_time_unit("ns")
    if series.dtype.is_float():
        raise pl.exceptions.InvalidOperationError("seconds as floats lose nanoseconds")
    return series.cast(pl.Datetime("ns"), strict=True).dt.replace_time_zone("UTC")


def _check_nulls(table: Table, column: Column, series: pl.Series) -> None:
    if column.nullable or not series.null_count():
        return
    row = series.is_null().arg_max()
    raise InvalidValueError(
        f"column {column.name} of table {table.name} has no value in row {row}",
        code="table.null",
        facts=[("missing", f"{series.null_count()} of {len(series)} values")],
    )
