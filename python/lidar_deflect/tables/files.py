"""Tables on disk: parquet with schema version, program version and configuration hash."""

from collections.abc import Mapping
from importlib.metadata import version
from pathlib import Path

import polars as pl

from lidar_deflect.errors import InvalidValueError, ResultError, ResultNotFoundError
from lidar_deflect.files import keep_interrupts_from_polars, whole_file
from lidar_deflect.tables.build import check
from lidar_deflect.tables.catalogue import SCHEMA_VERSION, SCHEMAS

_SCHEMA_KEY = "lidar_deflect.schema_version"
_OWN = (_SCHEMA_KEY, "lidar_deflect.program_version", "lidar_deflect.table")
HASH_KEY = "configuration_hash"
"""Metadata key of the hash of the resolved configuration."""


def own_metadata(name: str) -> dict[str, str]:
    """Metadata that every file of table `name` carries: schema and program version, table."""
    facts = (str(SCHEMA_VERSION), version("lidar-deflect"), name)
    return dict(zip(_OWN, facts, strict=True))


def write(
    frame: pl.DataFrame,
    path: str | Path,
    metadata: Mapping[str, str],
    *,
    name: str | None = None,
) -> Path:
    """Write a table as parquet, under a temporary name that is renamed when complete.

    Parameters
    ----------
    frame
        Table as `build` makes it.
    path
        File to write; one of that name is replaced.
    metadata
        Goes into the file; must hold ``configuration_hash``.
    name
        Key of `SCHEMAS`; default: the file's name without suffix.

    Returns
    -------
    pathlib.Path
        `path`.

    Raises
    ------
    InvalidValueError
        If the frame is not the declared table, or the configuration hash is missing.
    OutputError
        If the file cannot be written; nothing is left behind.
    """
    path = Path(path)
    name = name or path.stem
    check(name, frame)
    if HASH_KEY not in metadata:
        raise InvalidValueError(f"metadata of table {name} lacks {HASH_KEY}", code="table.metadata")
    own = dict(zip(_OWN, (str(SCHEMA_VERSION), version("lidar-deflect"), name), strict=True))
    keep_interrupts_from_polars()
    with whole_file(path, overwrite=True) as temporary:
        try:
            frame.write_parquet(temporary, metadata={**metadata, **own})
        except pl.exceptions.PolarsError as error:
            raise OSError(str(error).splitlines()[0]) from error
    return path


def read(path: str | Path, *, name: str | None = None) -> pl.DataFrame:
    """Read a table that `write` wrote.

    Parameters
    ----------
    path
        Parquet file.
    name
        Key of `SCHEMAS` that the file must hold; default: what the file says.

    Raises
    ------
    ResultNotFoundError
        If there is no such file.
    ResultError
        If it is no table of lidar-deflect, of another schema version, or not the table asked for.
    """
    facts = metadata(path)
    found = facts.get("lidar_deflect.table", "")
    if facts.get(_SCHEMA_KEY) != str(SCHEMA_VERSION) or found not in SCHEMAS:
        raise ResultError(
            f"{path} is not a table of this version",
            code="result.schema_version",
            facts=[
                ("found", f"schema {facts.get(_SCHEMA_KEY, 'none')}, table {found or 'none'}"),
                ("expected", f"schema {SCHEMA_VERSION}"),
            ],
            hint="measure again, or use the version of lidar-deflect that wrote it: "
            + facts.get("lidar_deflect.program_version", "unknown"),
        )
    if name not in (None, found):
        raise ResultError(f"{path} holds the table {found}, not {name}", code="result.table")
    frame = pl.read_parquet(path)
    check(found, frame)
    return frame


def metadata(path: str | Path) -> dict[str, str]:
    """Return what the parquet file says about itself, without reading its rows."""
    path = Path(path)
    if not path.is_file():
        raise ResultNotFoundError(f"there is no table {path}")
    try:
        facts = pl.read_parquet_metadata(path)
    except (OSError, pl.exceptions.PolarsError) as error:
        raise ResultError(
            f"{path} cannot be read as parquet",
            code="result.unreadable",
            facts=[("because", str(error).splitlines()[0])],
        ) from error
    return {key: value for key, value in facts.items() if key != "ARROW:schema"}
