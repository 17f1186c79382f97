"""ASAM's MDF4: one table per channel group, its time from the master channel."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np
import polars as pl

from lidar_deflect.extras import need

if TYPE_CHECKING:
    from pathlib import Path

TIME = "time"


def read(path: Path) -> list[pl.DataFrame]:
    """Read every channel group; its master's seconds since the start become ``time``, UTC.

    Raises
    ------
    MissingExtraError
        If asammdf is not installed.
    """
    asammdf = need("asammdf", "daq", f"{path.name}, an MDF file,")
    with asammdf.MDF(path) as file:
        start_ns = int(np.datetime64(_naive(file.header.start_time), "ns").astype(np.int64))
        return [
            frame
            for index in range(len(file.groups))
            if (frame := _group(file, index, start_ns)) is not None
        ]


def _naive(instant: Any) -> Any:
    """Return the instant in UTC without a zone, as numpy wants it."""
    from datetime import UTC

    return instant.astimezone(UTC).replace(tzinfo=None) if instant.tzinfo else instant


def _group(file: Any, index: int, start_ns: int) -> pl.DataFrame | None:
    master = file.get_master(index)
    if not len(master):
        return None
    times = start_ns + np.round(np.asarray(master, dtype=np.float64) * 1e9).astype(np.int64)
    columns = {TIME: pl.Series(TIME, times.astype("datetime64[ns]"))}
    place = file.masters_db.get(index)
    for number, channel in enumerate(file.groups[index].channels):
        if number == place or channel.name in columns:
            continue
        values = np.asarray(file.get(group=index, index=number).samples)
        if values.ndim == 1 and values.dtype.kind in "iufb":
            columns[channel.name] = pl.Series(channel.name, values.astype(np.float64))
    return pl.DataFrame(list(columns.values()))
