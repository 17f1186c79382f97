"""The tables of a report as CSV files, for programs that read nothing else."""

from __future__ import annotations

import csv
from pathlib import Path
from typing import TYPE_CHECKING

import polars as pl

from lidar_deflect import tables
from lidar_deflect.files import whole_folder
from lidar_deflect.folder import Folder
from lidar_deflect.report.build import document

if TYPE_CHECKING:
    from lidar_deflect.report.document import Table

_TIME = "%Y-%m-%dT%H:%M:%S%.9fZ"


def write(folder: str | Path, out: str | Path, *, overwrite: bool = True) -> Path:
    """Write one CSV file per table into a folder: those of the result, and those of the report.

    UTF-8, commas, a point in numbers, ISO 8601 instants in UTC, missing values empty. Tables of the
    report begin with ``report_``; their heads carry the unit, and ``U`` columns stand beside the
    values they belong to.

    Raises
    ------
    ResultNotFoundError, ResultError
        If `folder` is no result folder or cannot be read.
    OutputError
        If the files cannot be written.
    """
    found = Folder(folder)
    path = Path(out)
    report = document(found)
    with whole_folder(path, overwrite=overwrite) as temporary:
        for name in tables.SCHEMAS:
            source = found.path / f"{name}.parquet"
            if source.is_file():
                frame = tables.read(source, name=name)
                _spelled(frame).write_csv(temporary / f"{name}.csv")
        for table in report.tables():
            _write_table(table, temporary / f"report_{table.name}.csv")
    return path


def _spelled(frame: pl.DataFrame) -> pl.DataFrame:
    return frame.with_columns(
        pl.col(name).dt.strftime(_TIME)
        for name, dtype in frame.schema.items()
        if isinstance(dtype, pl.Datetime)
    )


def _write_table(table: Table, path: Path) -> None:
    with path.open("w", encoding="utf-8", newline="") as file:
        rows = csv.writer(file, lineterminator="\n")
        certain = [any(row[k].u is not None for row in table.rows) for k in range(_width(table))]
        head: list[str] = []
        for column, has_u in zip(table.columns, certain, strict=True):
            head += [column.head, f"U {column.head}"] if has_u else [column.head]
        rows.writerow(head)
        for row in table.rows:
            line: list[object] = []
            for cell, has_u in zip(row, certain, strict=True):
                line += [cell.value, cell.u] if has_u else [cell.value]
            rows.writerow(["" if value is None else value for value in line])


def _width(table: Table) -> int:
    return len(table.columns)
