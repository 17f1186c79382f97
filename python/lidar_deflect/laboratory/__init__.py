"""Files of data acquisition as laboratories write them: one table of columns out of each.

`text` reads CSV of any dialect, `workbook` Excel, and with the extra ``daq`` `tdms` reads National
Instruments' TDMS, `mdf` ASAM's MDF4 and `hdf5` HDF5. The format is told by the content.
"""

from __future__ import annotations

import io
import zipfile
from pathlib import Path
from typing import TYPE_CHECKING

import polars as pl

from lidar_deflect.errors import ConfigError, ConfigNotFoundError

if TYPE_CHECKING:
    from collections.abc import Sequence

_HEAD_BYTES = 16


def read(path: str | Path, holding: Sequence[str] = ()) -> pl.DataFrame:
    """Read one table of a file: CSV (all columns as text), parquet, Excel, TDMS, MDF4 or HDF5.

    Parameters
    ----------
    path
        File; its format is told by its content.
    holding
        Columns that are wanted. A file may hold several tables (sheets, groups, rates): the one
        with most of these columns is taken, else the longest.

    Raises
    ------
    ConfigNotFoundError
        If there is no such file.
    ConfigError
        If it can be read as none of them.
    MissingExtraError
        If its format needs the extra ``daq``.
    """
    path = Path(path)
    if not path.is_file():
        raise ConfigNotFoundError(f"there is no file {path}")
    try:
        with path.open("rb") as file:
            head = file.read(_HEAD_BYTES)
        return _best(_tables(path, head, holding), holding)
    except (OSError, pl.exceptions.PolarsError, zipfile.BadZipFile, KeyError) as error:
        raise ConfigError(
            f"{path} can be read neither as CSV nor as parquet nor as another known format",
            code="config.channel",
            facts=[("because", (str(error).splitlines() or [type(error).__name__])[0])],
        ) from error


def _tables(path: Path, head: bytes, holding: Sequence[str]) -> list[pl.DataFrame]:
    if head[:4] == b"PAR1":
        return [pl.read_parquet(io.BytesIO(path.read_bytes()))]
    if head[:4] == b"PK\x03\x04":
        from lidar_deflect.laboratory import workbook

        return workbook.read(path)
    if head[:4] == b"TDSm":
        from lidar_deflect.laboratory import tdms

        return tdms.read(path)
    if head[:8] in (b"MDF     ", b"UnFinMF "):
        from lidar_deflect.laboratory import mdf

        return mdf.read(path)
    if head[:8] == b"\x89HDF\r\n\x1a\n":
        from lidar_deflect.laboratory import hdf5

        return hdf5.read(path)
    from lidar_deflect.laboratory import text

    return [text.read(path.read_bytes(), holding)]


def _best(found: Sequence[pl.DataFrame], holding: Sequence[str]) -> pl.DataFrame:
    if not found:
        raise KeyError("it holds no table")
    return max(found, key=lambda f: (len(set(holding) & set(f.columns)), f.height))
