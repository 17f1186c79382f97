"""Numbers as people read them: a fixed number of digits, a dash where there is none."""

from datetime import datetime

NONE = "–"  # noqa: RUF001  # a dash in a table cell
THIN = "\u2009"


def metres(value: float | None) -> str:
    """Return metres to the millimetre."""
    return NONE if value is None else f"{value:z.3f}"


def expanded(u_m: float | None) -> str:
    """Return ± twice a standard uncertainty, to the tenth of a millimetre below a centimetre."""
    if u_m is None:
        return ""
    return f"±{2.0 * u_m:.4f}" if 2.0 * u_m < 0.01 else f"±{2.0 * u_m:.3f}"


def millimetres(value_m: float | None) -> str:
    """Return metres as whole millimetres, thousands apart."""
    return NONE if value_m is None else f"{1e3 * value_m:z,.0f}".replace(",", THIN)


def percent(value: float | None, digits: int = 2) -> str:
    """Return percent with its sign of unit."""
    return NONE if value is None else f"{value:z.{digits}f}{THIN}%"


def degrees(value: float | None) -> str:
    """Return degrees to the hundredth."""
    return NONE if value is None else f"{value:z.2f}"


def count(value: int | float | None) -> str:
    """Return a count, thousands apart."""
    return NONE if value is None else f"{value:,.0f}".replace(",", THIN)


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
