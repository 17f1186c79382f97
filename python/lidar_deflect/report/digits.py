"""Numbers as people read them: as many digits as their uncertainty bears, a dash for none."""

import math
from datetime import datetime

from lidar_deflect.report.document import Cell

NONE = "–"  # noqa: RUF001  # a dash in a table cell
THIN = "\u2009"
MINUS = "\u2212"
COVERAGE = 2.0
"""Factor k of an expanded uncertainty: about 95 % of a normal distribution."""


def fixed(value: float | None, decimals: int) -> str:
    """Return a number with so many decimals, thousands apart, with a true minus sign."""
    if value is None or not math.isfinite(value):
        return NONE
    return f"{value:z,.{max(decimals, 0)}f}".replace(",", THIN).replace("-", MINUS)


def decimals_for(uncertainty: float) -> int:
    """Return the decimals that leave two significant digits of an uncertainty (GUM 7.2.6)."""
    if not uncertainty > 0.0:
        return 0
    return max(0, 1 - math.floor(math.log10(uncertainty)))


def measured(
    value: float | None, u: float | None, *, scale: float, decimals: int, mark: str = ""
) -> Cell:
    """Return a cell with its expanded uncertainty, both to two digits of the latter.

    Parameters
    ----------
    value, u
        Value and standard uncertainty in the unit of the tables.
    scale
        Turns them into the unit of the column.
    decimals
        Decimals where there is no uncertainty; with one, never more than two beyond these.
    """
    if value is None:
        return Cell(NONE, None, mark=mark)
    own = value * scale
    if u is None:
        return Cell(fixed(own, decimals), own, mark=mark)
    expanded = COVERAGE * u * scale
    shown = min(decimals_for(expanded), decimals + 2) if expanded > 0.0 else decimals
    return Cell(fixed(own, shown), own, f"±{THIN}{fixed(expanded, shown)}", mark, expanded)


def millimetres(value_m: float | None, u_m: float | None = None, mark: str = "") -> Cell:
    """Return metres as millimetres with the expanded uncertainty."""
    return measured(value_m, u_m, scale=1e3, decimals=0, mark=mark)


def degrees(value: float | None, u: float | None = None) -> Cell:
    """Return degrees with the expanded uncertainty."""
    return measured(value, u, scale=1.0, decimals=2)


def number(value: float | int | None, decimals: int = 0, mark: str = "") -> Cell:
    """Return a number with so many decimals."""
    return Cell(fixed(value, decimals), value, mark=mark)


def metres(value: float | None, decimals: int = 3) -> str:
    """Return metres to the millimetre."""
    return fixed(value, decimals)


def percent(value: float | None, decimals: int = 2) -> str:
    """Return percent with its sign of unit."""
    shown = fixed(value, decimals)
    return shown if shown == NONE else f"{shown}{THIN}%"


def place(s_m: float) -> str:
    """Return an arc length as short as it is."""
    return f"{s_m:g}"


def count(value: int | float | None) -> str:
    """Return a count, thousands apart."""
    return fixed(value, 0)


def size(value: int | float | None) -> str:
    """Return bytes in the unit that leaves two or three digits."""
    if value is None:
        return NONE
    for unit in ("B", "kB", "MB", "GB"):
        if value < 1000.0:
            return f"{value:.3g}{THIN}{unit}"
        value /= 1000.0
    return f"{value:.3g}{THIN}TB"


def instant(value: datetime | None) -> str:
    """Return an instant to the second, UTC."""
    return NONE if value is None else f"{value:%Y-%m-%d %H:%M:%S} UTC"


def duration(seconds: float | None) -> str:
    """Return a length of time in the unit that people would choose."""
    if seconds is None:
        return NONE
    if seconds < 120.0:
        return f"{seconds:.1f} s"
    whole = round(seconds)
    hours, rest = divmod(whole, 3600)
    return f"{hours} h {rest // 60} min" if hours else f"{rest // 60} min {rest % 60} s"
