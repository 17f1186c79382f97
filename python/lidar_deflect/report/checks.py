"""Self-check: what the run found of itself, and what the tables say of each other."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
import polars as pl

from lidar_deflect import tables, words
from lidar_deflect.report import digits
from lidar_deflect.report.document import Cell, Column, Table
from lidar_deflect.report.document import words as said

if TYPE_CHECKING:
    from lidar_deflect.folder import Folder

LENGTH_SHARE = 5e-4
"""Share of the blade's length by which neighbouring sections may be too far apart."""

_SUM_M = 1e-6
_STILL_M = 0.005
_TURN_BACK_RAD, _TURN_BACK_SHARE = 2e-3, 0.02


@dataclass(frozen=True)
class Check:
    """One check: what was found, its limit, and whether it passed; None where nobody can tell."""

    name: str
    found: str
    limit: str
    passed: bool | None
    only_warns: bool = False


def all_checks(folder: Folder) -> list[Check]:
    """Return the checks of the run itself, then those of the tables."""
    own = [_hashes(folder), _totals(folder), _lengths(folder), _reference(folder), _turns(folder)]
    return [*_of_run(folder), _gates(folder), *(each for each in own if each is not None)]


def has_failed(folder: Folder) -> bool:
    """Tell whether any check failed."""
    return any(each.passed is False and not each.only_warns for each in all_checks(folder))


def check_table(folder: Folder) -> Table:
    """Return the checks as a table."""
    rows = tuple(
        (said(each.name), said(each.found), said(each.limit), _result(each))
        for each in all_checks(folder)
    )
    columns = tuple(Column(label, numeric=False) for label in words.CHECKS_COLUMNS.values())
    return Table("self_check", words.CHECKS_CAPTION, columns, (rows,))


def _result(check: Check) -> Cell:
    if check.passed is None:
        return said(words.UNKNOWN)
    if check.only_warns and not check.passed:
        return said(words.WARNS, "warn")
    return said(words.PASSED, "good") if check.passed else said(words.FAILED, "bad")


def _of_run(folder: Folder) -> Iterator[Check]:
    """Read ``self_check`` of run.json: a list, or a mapping by name, of facts with a judgement."""
    given = folder.run.get("self_check") or folder.run.get("self-check") or ()
    entries = given.items() if isinstance(given, Mapping) else enumerate(given)
    for key, entry in entries:
        yield _one_of_run(str(key), entry)


def _one_of_run(key: str, entry: Any) -> Check:
    if not isinstance(entry, Mapping):
        return Check(key.replace("_", " "), flat(entry), digits.NONE, _truth(entry))
    name = str(entry.get("name") or entry.get("check") or key).replace("_", " ")
    passed = next((entry[k] for k in ("passed", "ok", "pass") if k in entry), None)
    skipped = {"name", "check", "passed", "ok", "pass", "limit", "where", "only_warns"}
    facts = {k: v for k, v in entry.items() if k not in skipped}
    shown = flat(facts["value"]) if set(facts) == {"value"} else flat(facts)
    if entry.get("where"):
        shown = f"{shown} ({flat(entry['where'])})"
    only_warns = entry.get("only_warns") is True
    return Check(name, shown, flat(entry.get("limit")), _truth(passed), only_warns)


def _truth(value: Any) -> bool | None:
    return value if isinstance(value, bool) else None


def _gates(folder: Folder) -> Check:
    gates = folder.run.get("gates")
    failed = gates.get("failed") if isinstance(gates, Mapping) else None
    if failed is None:
        return Check(words.CHECKS["gates"], digits.NONE, digits.NONE, None)
    found = "; ".join(map(str, failed)) or words.PASSED
    return Check(words.CHECKS["gates"], found, digits.NONE, not failed)


def _hashes(folder: Folder) -> Check:
    files = sorted(folder.path.glob("*.parquet"))
    hashes = {tables.metadata(path).get(tables.HASH_KEY) for path in files}
    found = f"{len(files)} tables, {len(hashes)} configuration" + ("s" * (len(hashes) > 1))
    return Check(words.CHECKS["hashes"], found, "1", len(hashes) == 1)


def _totals(folder: Folder) -> Check | None:
    known = folder.steps.drop_nulls(["dx_m", "dy_m", "dz_m", "d_m"])
    if known.is_empty():
        return None
    vectors = known.select("dx_m", "dy_m", "dz_m").to_numpy()
    off = float(np.max(np.abs(np.linalg.norm(vectors, axis=1) - known["d_m"].to_numpy())))
    return Check(words.CHECKS["totals"], f"{1e3 * off:.4f} mm", "0.001 mm", off <= _SUM_M)


def _lengths(folder: Folder) -> Check | None:
    """Neighbouring sections, the clamped root among them, against the blade between them."""
    length_m = (folder.config.get("blade") or {}).get("length_m")
    known = folder.steps.drop_nulls(["x_m", "y_m", "z_m"]).sort("step", "s_m")
    if not length_m or known.is_empty():
        return None
    worst, where = -math.inf, ""
    for (step,), part in known.group_by("step", maintain_order=True):
        points = np.vstack([np.zeros(3), part.select("x_m", "y_m", "z_m").to_numpy()])
        arc = np.diff(np.concatenate([[0.0], part["s_m"].to_numpy()]))
        excess = np.linalg.norm(np.diff(points, axis=0), axis=1) - arc
        at = int(np.argmax(excess))
        if excess[at] > worst:
            worst, where = float(excess[at]), f"{part['section'][at]}, {step}"
    limit = LENGTH_SHARE * float(length_m)
    found = f"{digits.fixed(1e3 * worst, 0)} mm ({where})"
    return Check(words.CHECKS["length"], found, f"{1e3 * limit:.0f} mm", worst <= limit)


def _reference(folder: Folder) -> Check | None:
    known = folder.steps.filter(pl.col("d_m").is_not_null()).sort("from")
    idle = known.filter(pl.col("step") == "0 %")
    if idle.is_empty():
        return None
    row = idle.sort("d_m", descending=True).row(0, named=True)
    limit = max(_STILL_M, digits.COVERAGE * (row["ud_m"] or 0.0))
    found = f"{digits.fixed(1e3 * row['d_m'], 1)} mm ({row['section']})"
    return Check(
        words.CHECKS["reference"], found, f"{1e3 * limit:.1f} mm", bool(row["d_m"] <= limit)
    )


def _turns(folder: Folder) -> Check | None:
    """Outward of the last saddle nothing bends the blade back."""
    saddles = (folder.config.get("load") or {}).get("saddles_s_m") or ()
    known = folder.contour.drop_nulls(["rx_rad", "ry_rad"])
    known = known.filter(pl.col("s_m") >= max(saddles, default=math.inf))
    if known.is_empty():
        return None
    turn = known.sort("time", "s_m").with_columns(
        turn=(pl.col("rx_rad") ** 2 + pl.col("ry_rad") ** 2).sqrt()
    )
    back = turn.select((pl.col("turn").cum_max() - pl.col("turn")).over("time").alias("back"))[
        "back"
    ]
    worst = float(back.max() or 0.0)  # type: ignore[arg-type]
    whole = float(turn["turn"].max() or 0.0)  # type: ignore[arg-type]
    limit_rad = max(_TURN_BACK_RAD, _TURN_BACK_SHARE * whole)
    found, limit = f"{1e3 * worst:.2f} mrad", f"{1e3 * limit_rad:.1f} mrad"
    return Check(words.CHECKS["monotone"], found, limit, worst <= limit_rad)


def flat(value: Any) -> str:
    """Set nested facts in one line, numbers to five digits."""
    if value is None:
        return digits.NONE
    if isinstance(value, Mapping):
        return ", ".join(f"{label(str(key))} {flat(each)}" for key, each in value.items())
    if isinstance(value, list | tuple):
        return "[" + ", ".join(flat(each) for each in value) + "]"
    return f"{value:.5g}" if isinstance(value, float) else str(value)


_UNITS = ("mrad", "rad", "deg", "mm", "m", "ms", "s", "hz", "ppm", "percent")


def label(key: str) -> str:
    """Return a key of a file as words, its unit in brackets: ``wall_rms_m`` is wall rms (m)."""
    stem, _, unit = key.rpartition("_")
    if stem and unit in _UNITS:
        return f"{stem.replace('_', ' ')} ({unit})"
    return key.replace("_", " ")
