"""Figures of the blade in space: its line at every load step."""

import plotly.graph_objects as go
import polars as pl

from lidar_deflect import words
from lidar_deflect.plots import style
from lidar_deflect.plots.source import HasTables, table

_NEAR_S = 0.51  # the contour table has states once a second


def deflected_shapes(result: HasTables) -> go.Figure:
    """Draw the blade's line at every load step, across the span and seen from the side."""
    figure = style.panels(2, shared_xaxes=True)
    steps = result.steps.filter(pl.col("x_m").is_not_null())
    if steps.is_empty():
        return style.note(figure, words.PLOT["no_load_step_was_measured"])
    contour = table(result, "contour")
    for k, step in enumerate(steps["step"].unique(maintain_order=True)):
        rows = steps.filter(pl.col("step") == step).sort("s_m")
        found = line_of(contour, rows)
        line = rows if found is None else found
        for row, axis in enumerate("xy", start=1):
            _add_line(figure, line, rows, axis, row, step, k)
    figure.update_xaxes(title_text=words.PLOT["z"], row=2, col=1)
    figure.update_yaxes(title_text=words.PLOT["x"], row=1, col=1)
    figure.update_yaxes(title_text=words.PLOT["y"], row=2, col=1)
    figure.update_layout(height=560)
    return figure


def line_of(contour: pl.DataFrame, rows: pl.DataFrame) -> pl.DataFrame | None:
    """Return the blade line nearest to the middle of a step; None where none was written."""
    known = contour.filter(pl.col("x_m").is_not_null())
    if known.height and rows.height:
        off = (known["t_s"] - rows["t_s"][0]).abs()
        if float(off.min() or 0.0) < _NEAR_S:
            return known.filter(off == off.min()).sort("s_m")
    return None


def _add_line(
    figure: go.Figure,
    line: pl.DataFrame,
    rows: pl.DataFrame,
    axis: str,
    row: int,
    step: str,
    k: int,
) -> None:
    label = style.text(step)
    hue = style.colour(k)
    figure.add_trace(
        go.Scatter(
            x=line["z_m"],
            y=line[f"{axis}_m"],
            mode="lines",
            name=label,
            legendgroup=label,
            showlegend=row == 1,
            line={"color": hue, "width": 2, "dash": style.dash(k)},
            hoverinfo="skip",
        ),
        row=row,
        col=1,
    )
    figure.add_trace(
        go.Scatter(
            x=rows["z_m"],
            y=rows[f"{axis}_m"],
            mode="markers",
            name=label,
            legendgroup=label,
            showlegend=False,
            marker={"color": hue, "size": 8, "symbol": style.symbol(k)},
            text=[style.text(name) for name in rows["section"]],
            hovertemplate="%{text}<br>z %{x:.3f} m<br>"
            + axis
            + " %{y:.3f} m<extra>"
            + label
            + "</extra>",
        ),
        row=row,
        col=1,
    )
