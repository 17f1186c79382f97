"""Columns out of files as laboratories write them: CSV with commas, semicolons or tabs, parquet."""

import io
import re
from pathlib import Path

import numpy as np
import numpy.typing as npt
import polars as pl

from lidar_deflect.errors import ConfigError, ConfigNotFoundError
from lidar_deflect.tables import nearest_hint

_MISSING = ("", "nan", "null", "none", "n/a", "na", "-")
_DECIMAL_COMMA = r"^\s*[+-]?\d*,\d+([eE][+-]?\d+)?\s*$"
_UTC_SECONDS = (1e8, 1e11)  # 1973 to 5138: neither seconds since a start nor milliseconds


def read(path: str | Path) -> pl.DataFrame:
    """Read a CSV file (all columns as text) or a parquet file.

    Lines that begin with ``#`` are skipped; the separator is the most frequent of semicolon, tab
    and comma in the header.

    Raises
    ------
    ConfigNotFoundError
        If there is no such file.
    ConfigError
        If it can be read as neither.
    """
    path = Path(path)
    if not path.is_file():
        raise ConfigNotFoundError(f"there is no file {path}")
    try:
        content = path.read_bytes()
        if content[:4] == b"PAR1":
            return pl.read_parquet(io.BytesIO(content))
        return _read_text(_decode(content))
    except (OSError, pl.exceptions.PolarsError) as error:
        raise ConfigError(
            f"{path} can be read neither as CSV nor as parquet",
            code="config.channel",
            facts=[("because", str(error).splitlines()[0])],
        ) from error


def _decode(content: bytes) -> str:
    try:
        return content.decode("utf-8-sig")
    except UnicodeDecodeError:
        return content.decode("latin-1")  # what is left in laboratories; numbers are the same


def _read_text(text: str) -> pl.DataFrame:
    lines = [line for line in text.splitlines() if line.strip() and not line.startswith("#")]
    header = lines[0] if lines else ""
    separator = max(";\t,", key=header.count)
    source = "\n".join(lines).encode()
    frame = pl.read_csv(io.BytesIO(source), separator=separator, infer_schema=False)
    return frame.rename({name: name.strip() for name in frame.columns})


def column(frame: pl.DataFrame, name: str, path: str | Path) -> pl.Series:
    """Return the column `name`; `ConfigError` names the nearest when there is none."""
    if name in frame.columns:
        return frame[name]
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


def instants(frame: pl.DataFrame, name: str, path: str | Path) -> npt.NDArray[np.int64]:
    """Return a column of instants as nanoseconds since 1970 UTC, shape (n,).

    Seconds since 1970 (to the digit as written), ISO 8601 text or datetimes; without a zone UTC.

    Raises
    ------
    ConfigError
        If the column is missing, a value is no instant, or the instants do not rise.
    """
    series = column(frame, name, path)
    times = _instants(series, frame, name, path)
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


def _instants(series: pl.Series, frame: pl.DataFrame, name: str, path: str | Path) -> pl.Series:
    if isinstance(series.dtype, pl.Datetime):
        return series.dt.cast_time_unit("ns").cast(pl.Int64)
    if series.dtype == pl.String and series.str.contains(r"\d-\d\d?-\d").any():
        return _iso(series)
    seconds = numbers(frame, name, path)
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
    text = series.str.strip_chars().str.replace(" ", "T", literal=True)
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
