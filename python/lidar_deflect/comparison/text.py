"""The paper's tables 1 and 2 as text for people."""

from collections.abc import Sequence

import polars as pl

from lidar_deflect.comparison.methods import LIDAR, by_method, largest_step

NONE = "-"
"""Stands where there is no value."""


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
    methods = by_method(frame, step=step)
    if methods.height:
        parts.append(_like_the_paper(methods))
    parts.append(_every_row(rows))
    return "\n\n".join(parts)


def _like_the_paper(methods: pl.DataFrame) -> str:
    """One line per section: each method's value, then the errors against T."""
    names = methods["method"].unique(maintain_order=True).to_list()
    trusted = methods["against"][0]
    order = [*(name for name in names if name != LIDAR), trusted, LIDAR]
    head = ["s (m)", *(f"{name} (mm)" for name in order), *(f"{name} error" for name in names)]
    body = []
    for (s_m,), rows in methods.group_by("s_m", maintain_order=True):
        found = {row["method"]: row for row in rows.iter_rows(named=True)}
        values = {name: row["value_m"] for name, row in found.items()}
        values[trusted] = rows["reference_m"][0]
        errors = [_percent(found[n]["error_percent"]) if n in found else NONE for n in names]
        body.append([f"{s_m:g}", *(_millimetres(values.get(n)) for n in order), *errors])
    return aligned(head, body)


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
            _percent(row["error_percent"]),
        ]
        for row in rows.iter_rows(named=True)
    ]
    return aligned(head, body, left=3)


def _difference(own: float | None, true: float | None) -> float | None:
    return None if own is None or true is None else own - true


def _percent(value: float | None) -> str:
    return NONE if value is None else f"{value:z.2f} %"


def _metres(value: float | None) -> str:
    return NONE if value is None else f"{value:z.3f}"


def _millimetres(value: float | None) -> str:
    return NONE if value is None else f"{1e3 * value:z.0f}"


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
