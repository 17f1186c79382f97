"""The paper's tables 1 and 2 as text for people."""

from collections.abc import Sequence

import polars as pl

from lidar_deflect.comparison.error import error_percent

NONE = "-"
"""Stands where there is no value."""

_TRUSTED = ("prediction", "truth")
"""Sources that can stand for T of equation (16) against other instruments."""


def table1(steps: pl.DataFrame, *, step: str | None = None) -> str:
    """Set changes of the coordinates like the paper's table 1.

    Parameters
    ----------
    steps
        Table ``steps``.
    step
        Load step; default: the one with the largest deflection.

    Returns
    -------
    str
        One line per section: x, y, z and total in metres, with the uncertainty (k = 1) of the total
        where there is one, and the status where it is not ``ok``.
    """
    step = step or largest_step(steps)
    rows = steps.filter(pl.col("step") == step).sort("s_m")
    head = ["section", "s (m)", "x (m)", "y (m)", "z (m)", "total (m)", "u (m)", "status"]
    body = [
        [
            row["section"],
            f"{row['s_m']:g}",
            *(_metres(row[name]) for name in ("dx_m", "dy_m", "dz_m", "d_m", "ud_m")),
            row["status"] + (f" ({row['reason']})" if row["reason"] else ""),
        ]
        for row in rows.iter_rows(named=True)
    ]
    return f"change from the unloaded hold at {step or 'no step'}\n" + aligned(head, body)


def table2(frame: pl.DataFrame, *, step: str | None = None) -> str:
    """Set a comparison like the paper's table 2, and every row of its step below.

    Parameters
    ----------
    frame
        Table ``comparison``, of one or several references.
    step
        Load step; default: the one with the largest deflection.

    Returns
    -------
    str
        Where there is a prediction or truth, first the paper's layout: wire, reference and lidar,
        and the errors of wire and lidar. Then lidar against each source in each quantity. All in
        millimetres; errors after equation (16).
    """
    step = step or largest_step(frame)
    rows = frame.filter(pl.col("step") == step).sort("s_m", "source", maintain_order=True)
    parts = [f"at {step or 'no step'}; error = (M - T) / T"]
    trusted = next((s for s in _TRUSTED if _totals(rows, s).height), None)
    if trusted is not None:
        parts.append(_like_the_paper(rows, trusted))
    parts.append(_every_row(rows))
    return "\n\n".join(parts)


def largest_step(frame: pl.DataFrame) -> str | None:
    """Return the step with the largest total deflection, the first of equals."""
    name = "d_m" if "d_m" in frame.columns else "measured_m"
    known = frame.filter(pl.col(name).is_not_null())
    if known.is_empty():
        return None
    found: str = known.sort(pl.col(name).abs(), descending=True, maintain_order=True)["step"][0]
    return found


def _totals(rows: pl.DataFrame, source: str) -> pl.DataFrame:
    return rows.filter(pl.col("source") == source, pl.col("quantity") == "total")


def _like_the_paper(rows: pl.DataFrame, trusted: str) -> str:
    head = ["s (m)", "wire (mm)", f"{trusted} (mm)", "lidar (mm)", "error of wire", "of lidar"]
    body = []
    for row in _totals(rows, trusted).iter_rows(named=True):
        wire, true, own = _wire(rows, row["section"]), row["reference_m"], row["measured_m"]
        errors = [_percent_of(wire, true), _percent_of(own, true)]
        body.append([f"{row['s_m']:g}", *(_millimetres(v) for v in (wire, true, own)), *errors])
    return aligned(head, body)


def _wire(rows: pl.DataFrame, section: str) -> float | None:
    """Return the reading of the first draw wire at a section."""
    readings = rows.filter(
        pl.col("section") == section,
        pl.col("quantity") == "total",
        pl.col("source").is_in(_wire_names(rows)),
    )["reference_m"]
    return None if readings.is_empty() else float(readings[0])


def _wire_names(rows: pl.DataFrame) -> list[str]:
    """Name the draw wires: unlike runs they have no components."""
    kinds = rows.group_by("source").agg(pl.col("quantity").unique())
    return [
        source
        for source, quantities in kinds.iter_rows()
        if source not in _TRUSTED and set(quantities) <= {"wire", "total"}
    ]


def _every_row(rows: pl.DataFrame) -> str:
    head = ["section", "against", "quantity", "lidar (mm)", "T (mm)", "M - T (mm)", "error"]
    body = [
        [
            row["section"],
            row["source"],
            row["quantity"],
            _millimetres(row["measured_m"]),
            _millimetres(row["reference_m"]),
            _millimetres(_difference(row["measured_m"], row["reference_m"])),
            NONE if row["error_percent"] is None else f"{row['error_percent']:.2f} %",
        ]
        for row in rows.iter_rows(named=True)
    ]
    return aligned(head, body, left=3)


def _difference(own: float | None, true: float | None) -> float | None:
    return None if own is None or true is None else own - true


def _percent_of(own: float | None, true: float | None) -> str:
    if own is None or not true:
        return NONE
    return f"{float(error_percent(own, true)):.2f} %"


def _metres(value: float | None) -> str:
    return NONE if value is None else f"{value:.3f}"


def _millimetres(value: float | None) -> str:
    return NONE if value is None else f"{1e3 * value:.0f}"


def aligned(head: Sequence[str], body: Sequence[Sequence[str]], *, left: int = 1) -> str:
    """Set columns under their heads; the first `left` to the left, the others to the right."""
    widths = [max(map(len, column)) for column in zip(head, *body, strict=True)]
    return "\n".join(
        "  ".join(
            cell.ljust(width) if k < left else cell.rjust(width)
            for k, (cell, width) in enumerate(zip(line, widths, strict=True))
        ).rstrip()
        for line in [head, *body]
    )
