"""A result folder as its readers see it: tables, configuration and what the run said of itself."""

import json
import tomllib
from functools import cached_property
from pathlib import Path
from typing import Any

import polars as pl

from lidar_deflect import tables
from lidar_deflect.errors import ResultError, ResultNotFoundError


class Folder:
    """Result folder, read lazily: each table once, when it is asked for.

    Parameters
    ----------
    path
        Folder that `measure` wrote.

    Raises
    ------
    ResultNotFoundError
        If there is no such folder, or it holds no deflection table.
    """

    def __init__(self, path: str | Path) -> None:
        self.path = Path(path)
        if not (self.path / "deflection.parquet").is_file():
            raise ResultNotFoundError(
                f"{self.path} is no result folder",
                facts=[("expected", "deflection.parquet in it")],
                hint="name the folder that `lidar-deflect measure -o` wrote",
            )

    def __repr__(self) -> str:
        return f"Folder({str(self.path)!r})"

    @cached_property
    def deflection(self) -> pl.DataFrame:
        """Table ``deflection``."""
        return tables.read(self.path / "deflection.parquet", name="deflection")

    @cached_property
    def steps(self) -> pl.DataFrame:
        """Table ``steps``."""
        return self._table("steps")

    @cached_property
    def contour(self) -> pl.DataFrame:
        """Table ``contour``."""
        return self._table("contour")

    @cached_property
    def health(self) -> pl.DataFrame:
        """Table ``health``."""
        return self._table("health")

    @cached_property
    def channels(self) -> pl.DataFrame:
        """Table ``channels``."""
        return self._table("channels")

    @cached_property
    def rejected(self) -> pl.DataFrame:
        """Table ``rejected``."""
        return self._table("rejected")

    @cached_property
    def points(self) -> pl.DataFrame:
        """Table ``points``."""
        return self._table("points")

    @cached_property
    def poses(self) -> pl.DataFrame:
        """Table ``poses``."""
        return self._table("poses")

    @cached_property
    def outline(self) -> pl.DataFrame:
        """Table ``outline``."""
        return self._table("outline")

    @cached_property
    def cycles(self) -> pl.DataFrame:
        """Table ``cycles``."""
        return self._table("cycles")

    @cached_property
    def comparison(self) -> pl.DataFrame:
        """Table ``comparison``."""
        return self._table("comparison")

    @cached_property
    def config(self) -> dict[str, Any]:
        """Resolved configuration ``test.toml``; empty where the folder has none."""
        return self._toml("test.toml")

    @cached_property
    def calibration(self) -> dict[str, Any]:
        """Document of ``calibration.toml``; empty where the folder has none."""
        return self._toml("calibration.toml")

    @cached_property
    def run(self) -> dict[str, Any]:
        """What the run said of itself, ``run.json``; empty where the folder has none."""
        path = self.path / "run.json"
        try:
            found = json.loads(path.read_text(encoding="utf-8")) if path.is_file() else {}
        except (OSError, ValueError) as error:
            raise _unreadable(path, error) from error
        if not isinstance(found, dict):
            raise ResultError(f"{path} holds no object", code="result.unreadable")
        return found

    @cached_property
    def metadata(self) -> dict[str, str]:
        """What ``deflection.parquet`` says about itself."""
        return tables.metadata(self.path / "deflection.parquet")

    def _toml(self, name: str) -> dict[str, Any]:
        path = self.path / name
        try:
            return tomllib.loads(path.read_text(encoding="utf-8")) if path.is_file() else {}
        except (OSError, ValueError) as error:
            raise _unreadable(path, error) from error

    def _table(self, name: str) -> pl.DataFrame:
        """Table `name`; without rows where the folder has none."""
        path = self.path / f"{name}.parquet"
        return tables.read(path, name=name) if path.is_file() else tables.empty(name)


def _unreadable(path: Path, error: Exception) -> ResultError:
    return ResultError(
        f"{path} cannot be read",
        code="result.unreadable",
        facts=[("because", str(error).splitlines()[0])],
    )
