"""HDF5: one table per group and length; tables of records as well."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np
import polars as pl

from lidar_deflect.extras import need

if TYPE_CHECKING:
    from pathlib import Path


def read(path: Path) -> list[pl.DataFrame]:
    """Read every group: its one-dimensional datasets of one length are one table.

    Columns are named like the datasets; a dataset of records is a table of its fields. Integers
    with the attribute ``units = "ns"`` are instants since 1970 UTC.

    Raises
    ------
    MissingExtraError
        If h5py is not installed.
    """
    h5py = need("h5py", "daq", f"{path.name}, an HDF5 file,")
    found: dict[tuple[str, int], dict[str, pl.Series]] = {}
    with h5py.File(path, "r") as file:
        file.visititems(lambda name, item: _take(found, name, item, h5py))
    return [pl.DataFrame(list(table.values())) for table in found.values()]


def _take(
    found: dict[tuple[str, int], dict[str, pl.Series]], name: str, item: Any, h5py: Any
) -> None:
    if not isinstance(item, h5py.Dataset) or len(item.shape) != 1 or not item.shape[0]:
        return
    values = item[()]
    group, _, own = name.rpartition("/")
    if values.dtype.names:
        found[name, len(values)] = {
            field: _series(field, values[field], None) for field in values.dtype.names
        }
    else:
        table = found.setdefault((group, len(values)), {})
        table[own] = _series(own, values, item.attrs.get("units"))


def _series(name: str, values: Any, units: Any) -> pl.Series:
    if values.dtype.kind in "iu" and units in ("ns", b"ns"):
        return pl.Series(name, values.astype("datetime64[ns]"))
    if values.dtype.kind in "iufb":
        return pl.Series(name, values.astype(np.float64))
    return pl.Series(name, [v.decode() if isinstance(v, bytes) else str(v) for v in values])
