"""National Instruments' TDMS: one table per group and length, its time from the waveform."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np
import polars as pl

from lidar_deflect.extras import need

if TYPE_CHECKING:
    from pathlib import Path

TIME = "time"


def read(path: Path) -> list[pl.DataFrame]:
    """Read every group; channels of one length are one table.

    Columns are named like the channels. A waveform's instants (``wf_start_time``, ``wf_increment``)
    become the column ``time``, UTC; a channel of timestamps keeps its name.

    Raises
    ------
    MissingExtraError
        If nptdms is not installed.
    """
    nptdms = need("nptdms", "daq", f"{path.name}, a TDMS file,")
    found: dict[tuple[str, int], dict[str, pl.Series]] = {}
    for group in nptdms.TdmsFile.read(path).groups():
        for channel in group.channels():
            values = channel[:]
            table = found.setdefault((group.name, len(values)), {})
            table[channel.name] = _series(channel.name, values)
            if TIME not in table and (times := _waveform(channel, len(values))) is not None:
                table[TIME] = times
    return [pl.DataFrame(list(table.values())) for table in found.values() if table]


def _series(name: str, values: Any) -> pl.Series:
    array = np.asarray(values)
    if array.dtype.kind == "M":
        return pl.Series(name, array.astype("datetime64[ns]"))
    if array.dtype.kind in "iufb":
        return pl.Series(name, array.astype(np.float64))
    return pl.Series(name, [str(value) for value in array])


def _waveform(channel: Any, count: int) -> pl.Series | None:
    start, step = (channel.properties.get(f"wf_{k}") for k in ("start_time", "increment"))
    if start is None or not step:
        return None
    offset_s = float(channel.properties.get("wf_start_offset", 0.0) or 0.0)
    first = np.datetime64(start, "ns").astype(np.int64)
    passed = np.round((offset_s + np.arange(count) * float(step)) * 1e9).astype(np.int64)
    return pl.Series(TIME, (first + passed).astype("datetime64[ns]"))
