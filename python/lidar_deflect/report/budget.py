"""What the uncertainty is made of, as the run states it."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any

from lidar_deflect import words
from lidar_deflect.comparison import largest_step
from lidar_deflect.report import digits
from lidar_deflect.report.checks import flat, label
from lidar_deflect.report.document import Cell, Column, Table
from lidar_deflect.report.document import words as said

if TYPE_CHECKING:
    from lidar_deflect.folder import Folder

_EXPANDED_MM = 2e3
_TOTAL = "d_m"
_POSITION = ("x_m", "y_m", "z_m")


def table(folder: Folder) -> Table | None:
    """Return the contributions at the largest load step; what else a run wrote, as it is."""
    given = folder.run.get("budget") or ()
    entries = [e for e in given if isinstance(e, Mapping) and isinstance(e.get("terms"), Mapping)]
    return _of_step(folder, entries) if entries else _as_given(folder)


def _of_step(folder: Folder, entries: Sequence[Mapping[str, Any]]) -> Table | None:
    """One row per source, one column per section."""
    step = largest_step(folder.steps)
    at = [e for e in entries if e.get("step") == step] or list(entries)
    names = list(dict.fromkeys(name for entry in at for name in entry["terms"]))
    columns = [Column(words.HEADS["what"], numeric=False)]
    columns += [Column(str(entry.get("section", "")), "mm") for entry in at]
    rows = [
        (
            said(words.BUDGET_TERMS.get(name, label(name))),
            *(digits.number(_EXPANDED_MM * _u(entry["terms"].get(name, {})), 1) for entry in at),
        )
        for name in names
    ]
    caption = words.BUDGET_STEP_CAPTION.format(step=step or at[0].get("step"))
    return Table("budget", caption, tuple(columns), (tuple(rows),))


def _u(of: Mapping[str, float]) -> float:
    """Of the deflection; of the position where that is the reference itself."""
    total = float(of.get(_TOTAL) or 0.0)
    return total or float(sum(float(of.get(name) or 0.0) ** 2 for name in _POSITION) ** 0.5)


def _as_given(folder: Folder) -> Table | None:
    """Return ``budget`` of run.json: a list of contributions with the columns that they have."""
    given = folder.run.get("budget") or folder.run.get("uncertainty_budget") or ()
    if isinstance(given, Mapping):
        given = [
            {"contribution": k, **(v if isinstance(v, Mapping) else {"u": v})}
            for k, v in given.items()
        ]
    rows = [each for each in given if isinstance(each, Mapping)]
    if not rows:
        return None
    names = list(dict.fromkeys(str(name) for row in rows for name in row))
    cells = tuple(tuple(_cell(row.get(name)) for name in names) for row in rows)
    columns = tuple(
        Column(label(name), numeric=isinstance(rows[0].get(name), int | float)) for name in names
    )
    return Table("budget", words.BUDGET_CAPTION, columns, (cells,))


def _cell(value: Any) -> Cell:
    if isinstance(value, float):
        return Cell(f"{value:.3g}", value)
    return Cell(digits.NONE if value is None else flat(value), flat(value))
