"""Figures of the blade in space: its line at every step, and the test seen from above."""

from typing import Any

import plotly.graph_objects as go
import polars as pl

from lidar_deflect.plots import style
from lidar_deflect.plots.source import HasTables, configuration, sections, table

_NEAR_S = 0.51  # the contour table has states once a second


def deflected_shapes(result: HasTables) -> go.Figure:
    """Draw the blade's line at every load step, across the span and seen from the side."""
    figure = style.panels(2, shared_xaxes=True)
    steps = result.steps.filter(pl.col("x_m").is_not_null())
    if steps.is_empty():
        return style.note(figure, "no load step was measured")
    contour = table(result, "contour")
    for k, step in enumerate(steps["step"].unique(maintain_order=True)):
        rows = steps.filter(pl.col("step") == step).sort("s_m")
        line = _line_of(contour, rows)
        for row, axis in enumerate("xy", start=1):
            _add_line(figure, line, rows, axis, row, step, k)
    figure.update_xaxes(title_text="z (m)", row=2, col=1)
    figure.update_yaxes(title_text="x (m)", row=1, col=1)
    figure.update_yaxes(title_text="y (m)", row=2, col=1)
    figure.update_layout(height=560)
    return figure


def _line_of(contour: pl.DataFrame, rows: pl.DataFrame) -> pl.DataFrame:
    """Blade line nearest to the middle of a step; its sections where no line was written."""
    known = contour.filter(pl.col("x_m").is_not_null())
    if known.height:
        off = (known["t_s"] - rows["t_s"][0]).abs()
        if float(off.min() or 0.0) < _NEAR_S:
            return known.filter(off == off.min()).sort("s_m")
    return rows


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
            marker={"color": hue, "size": 8},
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


def plan(result: HasTables) -> go.Figure:
    """Draw the test seen from above: sections, lidars, anchors of the wires."""
    figure = style.plain()
    steps = result.steps.filter(pl.col("x_m").is_not_null())
    for k, (name, s_m) in enumerate(sections(steps)):
        rows = steps.filter(pl.col("section") == name).sort("time")
        figure.add_trace(
            go.Scatter(
                x=rows["z_m"],
                y=rows["x_m"],
                mode="lines+markers",
                name=f"{style.text(name)} ({s_m:g} m)",
                line={"color": style.colour(k), "dash": "dot", "width": 1.5},
                marker={"size": 8},
                text=[style.text(step) for step in rows["step"]],
                hovertemplate="%{text}<br>z %{x:.2f} m<br>x %{y:.2f} m",
            )
        )
    config = configuration(result)
    _add_places(figure, "lidar", "square", _places(config.get("lidars"), "id", "position_m"))
    _add_places(figure, "wire anchor", "x", _places(config.get("wires"), "name", "anchor_m"))
    if not figure.data:
        return style.note(figure, "nothing has a place")
    figure.update_xaxes(title_text="z, along the blade (m)")
    figure.update_yaxes(title_text="x (m)", scaleanchor="x", scaleratio=1)
    figure.update_layout(height=460)
    return figure


def _places(entries: Any, name: str, place: str) -> list[tuple[str, float, float]]:
    """Name, z and x of the configured things that have a place."""
    return [
        (str(entry.get(name, "")), float(entry[place][2]), float(entry[place][0]))
        for entry in entries or ()
        if entry.get(place)
    ]


def _add_places(
    figure: go.Figure, kind: str, symbol: str, places: list[tuple[str, float, float]]
) -> None:
    if not places:
        return
    names, z, x = zip(*places, strict=True)
    figure.add_trace(
        go.Scatter(
            x=z,
            y=x,
            mode="markers+text",
            name=kind,
            marker={"symbol": symbol, "size": 11, "color": style.GREY},
            text=[style.text(name) for name in names],
            textposition="bottom center",
            hovertemplate="%{text}<br>z %{x:.2f} m<br>x %{y:.2f} m<extra></extra>",
        )
    )
