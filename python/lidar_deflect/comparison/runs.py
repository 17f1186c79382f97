"""Two runs held against each other, step by step and section by section, with intervals."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

from lidar_deflect.channels import SAME_SECTION_M
from lidar_deflect.comparison.text import aligned
from lidar_deflect.errors import ResultError

if TYPE_CHECKING:
    from collections.abc import Iterator

    from lidar_deflect.folder import Folder

COVERAGE = 2.0
QUANTITIES = {
    "dx": ("dx_m", "udx_m"),
    "dy": ("dy_m", "udy_m"),
    "dz": ("dz_m", "udz_m"),
    "total": ("d_m", "ud_m"),
    "twist": ("twist_deg", "utwist_deg"),
}
"""Columns of value and standard uncertainty; metres, and degrees for the twist."""


@dataclass(frozen=True)
class Difference:
    """First minus second run in one quantity of one step and section.

    Attributes
    ----------
    first, second, difference
        Metres; degrees for the twist.
    u
        Standard uncertainty of the difference, the runs taken as independent; None where one of
        them states none.
    """

    step: str
    section: str
    s_m: float
    quantity: str
    first: float
    second: float
    difference: float
    u: float | None

    @property
    def is_beyond(self) -> bool | None:
        """Whether the difference is beyond its expanded uncertainty; None without one."""
        return None if self.u is None else abs(self.difference) > COVERAGE * self.u


def differences(first: Folder, second: Folder) -> list[Difference]:
    """Return the difference of every step and section that both runs measured.

    Raises
    ------
    ResultError
        If they have no step and section in common.
    """
    found = list(_pairs(first, second))
    if not found:
        raise ResultError(
            f"{first.path} and {second.path} have no load step and section in common",
            code="comparison.nothing_fits",
            facts=[
                (str(f.path), ", ".join(dict.fromkeys(f.steps["step"]))) for f in (first, second)
            ],
        )
    return found


def _pairs(first: Folder, second: Folder) -> Iterator[Difference]:
    others = list(second.steps.iter_rows(named=True))
    for row in first.steps.iter_rows(named=True):
        for twin in others:
            same = twin["step"] == row["step"] and abs(twin["s_m"] - row["s_m"]) <= SAME_SECTION_M
            if same:
                yield from _quantities(row, twin)
                break


def _quantities(row: Mapping[str, Any], twin: Mapping[str, Any]) -> Iterator[Difference]:
    for quantity, (value, u) in QUANTITIES.items():
        own, other = row[value], twin[value]
        if own is None or other is None:
            continue
        both = None if None in (row[u], twin[u]) else math.hypot(row[u], twin[u])
        head = (row["step"], row["section"], row["s_m"], quantity)
        yield Difference(*head, own, other, own - other, both)


def settings(first: Mapping[str, Any], second: Mapping[str, Any]) -> list[tuple[str, str, str]]:
    """Return the keys in which two configurations differ, with both values as text."""
    one, two = dict(_flat(first, "")), dict(_flat(second, ""))
    keys = list(dict.fromkeys([*one, *two]))
    return [(k, one.get(k, ""), two.get(k, "")) for k in keys if one.get(k) != two.get(k)]


def _flat(value: Any, place: str) -> Iterator[tuple[str, str]]:
    if isinstance(value, Mapping):
        for key, each in value.items():
            yield from _flat(each, f"{place}.{key}" if place else str(key))
    elif isinstance(value, list) and value and isinstance(value[0], Mapping):
        for number, each in enumerate(value, start=1):
            yield from _flat(each, f"{place}[{number}]")
    else:
        yield place, str(value)


def text(found: list[Difference], names: tuple[str, str]) -> str:
    """Set differences as a table for people: millimetres, degrees for the twist."""
    head = ["step", "section", "quantity", *names, "difference", "U (k=2)", ""]
    body = [
        [
            each.step,
            f"{each.section} ({each.s_m:g} m)",
            f"{each.quantity} ({'deg' if each.quantity == 'twist' else 'mm'})",
            *(_shown(v, each.quantity) for v in (each.first, each.second, each.difference)),
            "-" if each.u is None else _shown(COVERAGE * each.u, each.quantity),
            "beyond U" if each.is_beyond else "",
        ]
        for each in found
    ]
    return f"{names[0]} minus {names[1]}\n" + aligned(head, body, left=3)


def _shown(value: float, quantity: str) -> str:
    return f"{value:z.2f}" if quantity == "twist" else f"{1e3 * value:z.1f}"
