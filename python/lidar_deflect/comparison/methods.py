"""Errors by method against one trusted reference: the paper's table 2 and figure 20."""

import polars as pl

from lidar_deflect.comparison.error import error_percent

TRUSTED = ("prediction", "truth")
"""Sources that can stand for T of equation (16) against the lidars and other instruments."""

LIDAR = "lidar"
WIRE = "wire"

_SCHEMA = pl.Schema(
    {
        "section": pl.String(),
        "s_m": pl.Float64(),
        "method": pl.String(),
        "against": pl.String(),
        "value_m": pl.Float64(),
        "reference_m": pl.Float64(),
        "error_percent": pl.Float64(),
        "u_m": pl.Float64(),
    }
)


def largest_step(frame: pl.DataFrame) -> str | None:
    """Return the step with the largest total deflection, the first of equals."""
    name = "d_m" if "d_m" in frame.columns else "measured_m"
    known = frame.filter(pl.col(name).is_not_null())
    if known.is_empty():
        return None
    found: str = known.sort(pl.col(name).abs(), descending=True, maintain_order=True)["step"][0]
    return found


def by_method(frame: pl.DataFrame, *, step: str | None = None) -> pl.DataFrame:
    """Hold wires and lidars against the prediction, or the truth where there is no prediction.

    Parameters
    ----------
    frame
        Table ``comparison``.
    step
        Load step; default: the one with the largest deflection.

    Returns
    -------
    polars.DataFrame
        Columns ``section``, ``s_m``, ``method`` (``wire``, ``lidar``), ``against``, ``value_m``,
        ``reference_m``, ``error_percent``, ``u_m`` (standard uncertainty of the value, null for
        wires), by arc length, wires first as in the paper; without rows
        where there is no trusted total. The wires' readings are taken as they are, the lidars'
        total deflections likewise.
    """
    rows = frame.filter(pl.col("step") == (step or largest_step(frame) or ""))
    trusted = next((source for source in TRUSTED if _totals(rows, source).height), None)
    if trusted is None:
        return pl.DataFrame(schema=_SCHEMA)
    found = []
    for row in _totals(rows, trusted).sort("s_m", maintain_order=True).iter_rows(named=True):
        values = {WIRE: wire_reading(rows, row["section"]), LIDAR: row["measured_m"]}
        found += [_row(row, method, trusted, v) for method, v in values.items() if v is not None]
    return pl.DataFrame(found, schema=_SCHEMA, orient="row")


def _row(row: dict[str, object], method: str, against: str, value_m: float) -> tuple[object, ...]:
    true = row["reference_m"]
    error = float(error_percent(value_m, true)) if isinstance(true, float) and true else None
    u = row["u_m"] if method == LIDAR else None
    return (row["section"], row["s_m"], method, against, value_m, true, error, u)


def _totals(rows: pl.DataFrame, source: str) -> pl.DataFrame:
    return rows.filter(pl.col("source") == source, pl.col("quantity") == "total")


def wire_reading(rows: pl.DataFrame, section: str) -> float | None:
    """Return the reading of the first draw wire at a section."""
    readings = rows.filter(
        pl.col("section") == section,
        pl.col("quantity") == "total",
        pl.col("source").is_in(wire_names(rows)),
    )["reference_m"]
    return None if readings.is_empty() else float(readings[0])


def wire_names(rows: pl.DataFrame) -> list[str]:
    """Name the draw wires: unlike runs they have no components."""
    kinds = rows.group_by("source").agg(pl.col("quantity").unique())
    return [
        source
        for source, quantities in kinds.iter_rows()
        if source not in TRUSTED and set(quantities) <= {"wire", "total"}
    ]
