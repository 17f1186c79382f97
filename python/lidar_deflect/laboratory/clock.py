"""Instants as clocks on walls show them: dates in the order of a country, times without a date."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
import numpy.typing as npt
import polars as pl

from lidar_deflect.errors import ConfigError

if TYPE_CHECKING:
    from pathlib import Path

_OF_DAY = r"^\s*(\d{1,2}):(\d\d):(\d\d)(?:[.,](\d{1,9}))?\s*$"
_DAY_FIRST = r"^\s*(\d{1,2})\.(\d{1,2})\.(\d{4})"
_SLASHED = r"^\s*(\d{4})/(\d{1,2})/(\d{1,2})"
_DAY_NS = 86_400 * 10**9


def is_time_of_day(series: pl.Series) -> bool:
    """Tell whether a column holds times without a date."""
    if series.dtype == pl.Time:
        return True
    if series.dtype != pl.String or series.is_empty():
        return False
    return bool(series.str.contains(_OF_DAY).fill_null(value=False).all())


def dated(
    series: pl.Series, name: str, path: str | Path, near_ns: int | None
) -> npt.NDArray[np.int64]:
    """Return times of day as instants: the day nearest to `near_ns`, a new one at each midnight.

    Raises
    ------
    ConfigError
        If there is nothing to date them by.
    """
    if near_ns is None:
        raise ConfigError(
            f"column {name!r} of {path} holds times of day without a date",
            code="config.channel",
            hint="write dates with the times, or name two columns as Date+Time",
        )
    of_day = _nanoseconds(series).to_numpy()
    turned = np.concatenate([[0], np.cumsum(np.diff(of_day) < -_DAY_NS // 2)])
    rising = of_day + turned * _DAY_NS
    days = np.round((near_ns - rising[0]) / _DAY_NS)
    return np.asarray(rising + np.int64(days) * _DAY_NS, dtype=np.int64)


def _nanoseconds(series: pl.Series) -> pl.Series:
    if series.dtype == pl.Time:
        return series.cast(pl.Int64)
    parts = series.str.extract_groups(_OF_DAY).struct.unnest()
    hours, minutes, seconds = (parts[str(k)].cast(pl.Int64) for k in (1, 2, 3))
    part = parts["4"].fill_null("").str.pad_end(9, "0").cast(pl.Int64)
    return ((hours * 60 + minutes) * 60 + seconds) * 10**9 + part


def iso_dates(series: pl.Series) -> pl.Series:
    """Return text with ``31.12.2026`` and ``2026/12/31`` turned into ``2026-12-31``."""
    for pattern, order in ((_DAY_FIRST, (3, 2, 1)), (_SLASHED, (1, 2, 3))):
        if not series.str.contains(pattern).fill_null(value=False).any():
            continue
        parts = series.str.extract_groups(pattern).struct.unnest()
        year, month, day = (parts[str(k)].str.pad_start(2, "0") for k in order)
        rest = series.str.replace(pattern, "")
        found = pl.DataFrame([year.alias("y"), month.alias("m"), day.alias("d"), rest.alias("r")])
        joined = found.select(pl.concat_str([pl.concat_str(["y", "m", "d"], separator="-"), "r"]))
        series = joined.to_series().alias(series.name)
    return series
