"""Figures of a fatigue test: amplitude, mean and frequency over the cycles."""

import plotly.graph_objects as go
import polars as pl

from lidar_deflect import words
from lidar_deflect.plots import style
from lidar_deflect.plots.source import HasTables, section_of, table

_MOST_CYCLES = 3000


def cycles(result: HasTables, section: str | float | None = None) -> go.Figure:
    """Draw amplitudes and frequency of one section over the cycles."""
    figure = style.panels(2, shared_xaxes=True)
    frame = table(result, "cycles")
    if frame.is_empty():
        return style.note(figure, words.PLOT["no_cycles_were_found"])
    name, s_m = section_of(frame, section)
    part = frame.filter(pl.col("section") == name).sort("cycle")
    part = style.thinned(part, [f"amplitude_{a}_m" for a in "xyz"], _MOST_CYCLES)
    for k, axis in enumerate("xyz"):
        figure.add_trace(_amplitude(part, axis, k), row=1, col=1)
    figure.add_trace(_frequency(part), row=2, col=1)
    figure.update_yaxes(title_text=words.PLOT["amplitude"], rangemode="tozero", row=1, col=1)
    figure.update_yaxes(title_text=words.PLOT["frequency"], row=2, col=1)
    figure.update_xaxes(title_text=words.PLOT["cycle"], row=2, col=1)
    figure.update_layout(height=460, meta={"section": name, "s_m": s_m})
    return figure


def _amplitude(part: pl.DataFrame, axis: str, k: int) -> go.Scatter:
    u = style.COVERAGE * part[f"uamplitude_{axis}_m"]
    return go.Scatter(
        x=part["cycle"],
        y=part[f"amplitude_{axis}_m"],
        error_y={"type": "data", "array": u.fill_null(0.0), "thickness": 1, "width": 0},
        mode="lines+markers",
        name=axis,
        line={"color": style.colour(k), "width": 1.2},
        marker={"symbol": style.symbol(k), "size": 5},
        hovertemplate="cycle %{x}<br>%{y:.4f} m<extra>" + axis + "</extra>",
    )


def _frequency(part: pl.DataFrame) -> go.Scatter:
    return go.Scatter(
        x=part["cycle"],
        y=part["frequency_hz"],
        mode="lines",
        name=words.PLOT["frequency_2"],
        showlegend=False,
        line={"color": style.colour(3), "width": 1.5},
        hovertemplate="cycle %{x}<br>%{y:.4f} Hz<extra></extra>",
    )
