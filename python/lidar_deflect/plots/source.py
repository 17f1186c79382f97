"""What figures are drawn from: any object that has the tables of a result."""

from collections.abc import Mapping, Sequence
from typing import Any, Protocol

import polars as pl

from lidar_deflect import tables
from lidar_deflect.errors import InvalidValueError


class HasTables(Protocol):
    """A result, a result folder or a stand-in; other tables are used where it has them."""

    @property
    def deflection(self) -> pl.DataFrame:
        """Table ``deflection``."""

    @property
    def steps(self) -> pl.DataFrame:
        """Table ``steps``."""


def table(result: HasTables, name: str) -> pl.DataFrame:
    """Return the table `name` of a result; without rows where it has none."""
    found = getattr(result, name, None)
    if found is None:
        found = getattr(result, "frames", {}).get(name)
    return tables.empty(name) if found is None else found


def configuration(result: HasTables) -> Mapping[str, Any]:
    """Return the configuration of a result as a mapping; empty where it has none."""
    found = getattr(result, "config", None)
    if found is None:
        return {}
    mapping: Mapping[str, Any] = found if isinstance(found, Mapping) else found.model_dump()
    return mapping


def poses_of(result: HasTables) -> list[Mapping[str, Any]]:
    """Return the entries ``[[lidars]]`` of a result's calibration; none where it has none."""
    found = getattr(result, "calibration", None)
    if found is None:
        return []
    document = found if isinstance(found, Mapping) else found.to_dict()
    return [entry for entry in document.get("lidars", ()) if "world_from_sensor" in entry]


def evidence_of(result: HasTables) -> Mapping[str, Any]:
    """Return the evidence of a result's calibration as a whole; empty where it has none."""
    found = getattr(result, "calibration", None)
    if found is None:
        return {}
    document = found if isinstance(found, Mapping) else found.to_dict()
    return document.get("evidence") or {}


def some(things: Sequence[Any], most: int) -> list[Any]:
    """Pick at most `most` things evenly, the last one always among them."""
    if len(things) <= most:
        return list(things)
    places = {round(k * (len(things) - 1) / (most - 1)) for k in range(most)}
    return [things[k] for k in sorted(places)]


def sections(frame: pl.DataFrame) -> list[tuple[str, float]]:
    """Name and arc length of every section, from the root outward."""
    return frame.select("section", "s_m").unique().sort("s_m", "section").rows()


def section_of(frame: pl.DataFrame, section: str | float | None) -> tuple[str, float]:
    """Find a section by name or arc length.

    Parameters
    ----------
    frame
        Table with ``section`` and ``s_m``.
    section
        Name, arc length in metres, or ``tip`` and None for the outermost.

    Raises
    ------
    InvalidValueError
        If there is none; the message says which there are.
    """
    known = sections(frame)
    for name, s_m in known:
        if section == name or (isinstance(section, int | float) and abs(section - s_m) < 1e-6):
            return name, s_m
    if known and section in (None, "tip"):
        return known[-1]
    raise InvalidValueError(
        f"there is no section {section!r}",
        code="value.section",
        facts=[("sections", ", ".join(f"{name} at {s_m:g} m" for name, s_m in known) or "none")],
        hint=tables.nearest_hint(str(section), [name for name, _ in known]),
    )
