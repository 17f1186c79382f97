"""Columns out of files as laboratories write them: numbers and instants, however spelled."""

import re
from collections.abc import Sequence
from pathlib import Path

import numpy as np
import numpy.typing as npt
import polars as pl

from lidar_deflect import laboratory
from lidar_deflect.errors import ConfigError
from lidar_deflect.laboratory import clock
from lidar_deflect.tables import nearest_hint

Times = npt.NDArray[np.int64]

_MISSING = ("", "nan", "null", "none", "n/a", "na", "-")
_DECIMAL_COMMA = r"^\s*[+-]?\d*,\d+([eE][+-]?\d+)?\s*$"
_UTC_SECONDS = (1e8, 1e11)  # 1973 to 5138: neither seconds since a start nor milliseconds


def read(path: str | Path, holding: Sequence[str] = ()) -> pl.DataFrame:
    """Read one table of a file of any known format, see `lidar_deflect.laboratory`.

    Raises
    ------
    ConfigNotFoundError
        If there is no such file.
    ConfigError
        If it can be read as none.
    MissingExtraError
        If its format needs the extra ``daq``.
    """
    return laboratory.read(path, holding)


def column(frame: pl.DataFrame, name: str, path: str | Path) -> pl.Series:
    """Return the column `name`; `ConfigError` names the nearest when there is none."""
    if name in frame.columns:
        return frame[name]
    parts = [part.strip() for part in name.split("+")]
    if len(parts) == 2 and set(parts) <= set(frame.columns):  # date and time apart
        return frame.select(pl.concat_str(parts, separator=" ").alias(name)).to_series()
    raise ConfigError(
        f"{path} has no column {name!r}",
        code="config.column",
        facts=[("columns", ", ".join(frame.columns))],
        hint=nearest_hint(name, frame.columns),
    )


def numbers(frame: pl.DataFrame, name: str, path: str | Path) -> npt.NDArray[np.float64]:
    """Return a column as f64, shape (n,), NaN where it has no value.

    A decimal comma is read where it is unambiguous: no value of the column has a point.

    Raises
    ------
    ConfigError
        If the column is missing or a value is no number; the message names the row.
    """
    series = column(frame, name, path)
    if series.dtype != pl.String:
        return _as_floats(series, name, path)
    text = series.str.strip_chars()
    text = text.set(text.str.to_lowercase().is_in(_MISSING), None)
    if text.str.contains(_DECIMAL_COMMA).any():
        if text.str.contains(".", literal=True).any():
            raise _bad_value(name, path, text, text.str.contains(",", literal=True), "a number")
        text = text.str.replace(",", ".", literal=True)
    parsed = text.cast(pl.Float64, strict=False)
    wrong = parsed.is_null() & text.is_not_null()
    if wrong.any():
        raise _bad_value(name, path, text, wrong, "a number")
    return parsed.to_numpy()


def _as_floats(series: pl.Series, name: str, path: str | Path) -> npt.NDArray[np.float64]:
    if not series.dtype.is_numeric():
        raise ConfigError(
            f"column {name!r} of {path} holds {series.dtype}, expected numbers",
            code="config.channel",
        )
    return series.cast(pl.Float64).to_numpy()


def _bad_value(
    name: str, path: str | Path, text: pl.Series, wrong: pl.Series, expected: str
) -> ConfigError:
    row = wrong.fill_null(value=False).arg_max() or 0
    return ConfigError(
        f"column {name!r} of {path}: {text[row]!r} in data row {row + 1}, expected {expected}",
        code="config.channel",
    )


def instants(
    frame: pl.DataFrame, name: str, path: str | Path, near_ns: int | None = None
) -> npt.NDArray[np.int64]:
    """Return a column of instants as nanoseconds since 1970 UTC, shape (n,).

    Seconds since 1970 (to the digit as written), ISO 8601 text, ``31.12.2026 14:03:22,5``,
    datetimes; without a zone UTC. A time of day alone gets the date that brings it nearest to
    `near_ns`, and a new one at midnight. ``Date+Time`` names two columns.

    Parameters
    ----------
    near_ns
        Start of the test; a time of day needs it.

    Raises
    ------
    ConfigError
        If the column is missing, a value is no instant, or the instants do not rise.
    """
    series = column(frame, name, path)
    if clock.is_time_of_day(series):
        return clock.dated(series, name, path, near_ns)
    times = _instants(series, name, path)
    if times.null_count():
        raise _bad_value(name, path, series, times.is_null(), "an instant")
    found = times.to_numpy()
    falls = np.diff(found) <= 0
    if falls.any():
        row = int(np.argmax(falls)) + 2
        raise ConfigError(
            f"column {name!r} of {path} does not rise at data row {row}", code="config.channel"
        )
    return found


class Instants:
    """Reads as `instants` does, and a column that it read last only once: wires share a file."""

    def __init__(self) -> None:
        self._last: tuple[pl.Series, tuple[str, str, int | None], Times] | None = None

    def __call__(
        self, frame: pl.DataFrame, name: str, path: str | Path, near_ns: int | None = None
    ) -> Times:
        """Read a column of instants."""
        series, asked = column(frame, name, path), (name, str(path), near_ns)
        if self._last is None or self._last[1] != asked or not series.equals(self._last[0]):
            self._last = series, asked, instants(frame, name, path, near_ns)
        return self._last[2]


def _instants(series: pl.Series, name: str, path: str | Path) -> pl.Series:
    if isinstance(series.dtype, pl.Datetime):
        return series.dt.cast_time_unit("ns").cast(pl.Int64)
    if series.dtype == pl.String:
        series = clock.iso_dates(series)
        if series.str.contains(r"\d-\d\d?-\d").any():
            return _iso(series)
    seconds = numbers(series.to_frame(), name, path)
    outside = ~((seconds > _UTC_SECONDS[0]) & (seconds < _UTC_SECONDS[1]))
    if outside.any():
        row = int(np.argmax(outside))
        raise ConfigError(
            f"column {name!r} of {path}: {seconds[row]:g} in data row {row + 1}, expected seconds "
            "since 1970 (UTC)",
            code="config.channel",
            hint="write UTC seconds or ISO 8601 times",
        )
    return _exact_ns(series, seconds)


def _iso(series: pl.Series) -> pl.Series:
    """ISO 8601 text, with a zone or in UTC, to nanoseconds; null where it is none."""
    text = series.str.strip_chars().str.replace(r"\s+", "T").str.replace(",", ".", literal=True)
    text = text.str.replace(r"(Z|[+-]00:?00)$", "")
    zoned = re.compile(r"[+-]\d\d:?\d\d$")
    if any(zoned.search(value or "") for value in text.head(1)):
        return (
            text.str.to_datetime("%+", time_unit="ns", strict=False, time_zone="UTC")
            .dt.cast_time_unit("ns")
            .cast(pl.Int64)
        )
    return text.str.to_datetime("%Y-%m-%dT%H:%M:%S%.f", time_unit="ns", strict=False).cast(pl.Int64)


def _exact_ns(series: pl.Series, seconds: npt.NDArray[np.float64]) -> pl.Series:
    """Seconds to nanoseconds; from text digit by digit, as f64 is only good to 0.2 us."""
    if series.dtype != pl.String:
        return pl.Series(np.round(seconds * 1e9).astype(np.int64))
    parts = (
        series.str.strip_chars()
        .str.replace(",", ".", literal=True)
        .str.extract_groups(r"^\+?(?<whole>\d+)(?:\.(?<part>\d*))?$")
    )
    fields = parts.struct.unnest()
    if fields["whole"].null_count():
        return pl.Series(np.round(seconds * 1e9).astype(np.int64))
    part = fields["part"].fill_null("").str.slice(0, 9).str.pad_end(9, "0").cast(pl.Int64)
    return fields["whole"].cast(pl.Int64) * 1_000_000_000 + part
