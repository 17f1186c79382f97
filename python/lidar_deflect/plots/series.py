"""Figures over time and over load: the paper's figures 19 and 21, and load against deflection."""

from typing import Literal

import plotly.graph_objects as go
import polars as pl

from lidar_deflect.plots import style
from lidar_deflect.plots.source import HasTables, section_of, sections

Quantity = Literal["deflection", "position"]

MOST_STATES = 6000
"""More states than this are thinned evenly: a screen has fewer columns."""

_COVERAGE = 1.96  # 95 % of a normal distribution
_NAMES: dict[Quantity, tuple[str, str, str]] = {
    "deflection": ("d{}_m", "ud{}_m", "d{}"),
    "position": ("{}_m", "u{}_m", "{}"),
}


def time_series(
    result: HasTables, section: str | float | None = None, quantity: Quantity = "deflection"
) -> go.Figure:
    """Draw x, y and z of one section over time, as the paper's figures 19 and 21 do."""
    name, s_m = section_of(result.deflection, section)
    frame = _thinned(result.deflection.filter(pl.col("section") == name).sort("time"))
    figure = style.panels(3, shared_xaxes=True)
    for row, axis in enumerate("xyz", start=1):
        _component(figure, frame, axis, row, quantity)
        _marks(figure, frame, axis, row, quantity)
    _shade_holds(figure, result.steps)
    _shade_missing(figure, frame)
    figure.update_xaxes(title_text="time (s)", row=3, col=1)
    figure.update_layout(height=620, margin_t=64, meta={"section": name, "s_m": s_m})
    figure.update_layout(legend_y=1.04)  # above the labels of the holds
    return figure


def _thinned(frame: pl.DataFrame) -> pl.DataFrame:
    every = -(-frame.height // MOST_STATES)
    return frame.gather_every(every) if every > 1 else frame


def _component(
    figure: go.Figure, frame: pl.DataFrame, axis: str, row: int, quantity: Quantity
) -> None:
    value, u, label = (pattern.format(axis) for pattern in _NAMES[quantity])
    hue = style.colour(row - 1)
    if frame[u].null_count() < frame.height:
        _band(figure, frame, value, u, row, hue)
    figure.add_trace(
        go.Scatter(
            x=frame["t_s"],
            y=frame[value],
            mode="lines",
            name=axis,
            line={"color": hue, "width": 1.6},
            connectgaps=False,
            showlegend=False,
            hovertemplate="%{x:.2f} s<br>%{y:.4f} m<extra>" + label + "</extra>",
        ),
        row=row,
        col=1,
    )
    figure.update_yaxes(title_text=f"{label} (m)", row=row, col=1)


def _band(figure: go.Figure, frame: pl.DataFrame, value: str, u: str, row: int, hue: str) -> None:
    """Shade the 95 % interval over every stretch that has one."""
    known = (frame[value].is_not_null() & frame[u].is_not_null()).to_list()
    for k, (a, b) in enumerate(style.stretches(known)):
        part = frame.slice(a, b - a + 1)
        low, high = (part[value] + sign * _COVERAGE * part[u] for sign in (-1.0, 1.0))
        figure.add_trace(
            go.Scatter(
                x=pl.concat([part["t_s"], part["t_s"].reverse()]),
                y=pl.concat([high, low.reverse()]),
                fill="toself",
                fillcolor=style.translucent(hue, 0.2),
                line={"width": 0},
                hoverinfo="skip",
                name="95 %",
                legendgroup="95 %",
                showlegend=row == 1 and k == 0,
            ),
            row=row,
            col=1,
        )


def _marks(figure: go.Figure, frame: pl.DataFrame, axis: str, row: int, quantity: Quantity) -> None:
    """Mark the states that carry a number but are not ``ok``."""
    value = _NAMES[quantity][0].format(axis)
    for status, (hue, symbol) in style.STATUS_MARKS.items():
        part = frame.filter(pl.col("status").cast(pl.String) == status)
        if part.is_empty():
            continue
        figure.add_trace(
            go.Scatter(
                x=part["t_s"],
                y=part[value],
                mode="markers",
                name=status,
                legendgroup=status,
                showlegend=row == 1,
                marker={"color": hue, "symbol": symbol, "size": 6},
                text=[style.text(reason or "") for reason in part["reason"]],
                hovertemplate="%{x:.2f} s<br>%{y:.4f} m<br>%{text}<extra>" + status + "</extra>",
            ),
            row=row,
            col=1,
        )


def _shade_holds(figure: go.Figure, steps: pl.DataFrame) -> None:
    """Shade the holds of the test, with their labels."""
    for label, start, stop in _hold_seconds(steps):
        figure.add_vrect(
            x0=start,
            x1=stop,
            fillcolor=style.FAINT,
            line_width=0,
            layer="below",
            row="all",
            col=1,
        )
        figure.add_annotation(
            x=(start + stop) / 2.0,
            y=1.0,
            xref="x",
            yref="y domain",
            yanchor="bottom",
            text=style.text(label),
            showarrow=False,
            font={"size": 11, "color": style.GREY},
        )


def _hold_seconds(steps: pl.DataFrame) -> list[tuple[str, float, float]]:
    """Label, first and last second of every hold, on the clock of ``t_s``."""
    seconds = {
        name: pl.col("t_s") + (pl.col(name) - pl.col("time")).cast(pl.Int64) * 1e-9
        for name in ("from", "to")
    }
    return steps.select("step", **seconds).unique("step", maintain_order=True).rows()


def _shade_missing(figure: go.Figure, frame: pl.DataFrame) -> None:
    """Hatch the stretches without a state, and say so in the legend."""
    gone = (frame["status"].cast(pl.String) == "missing").to_list()
    seconds = frame["t_s"].to_list()
    for k, (a, b) in enumerate(style.stretches(gone)):
        start, stop = seconds[max(a - 1, 0)], seconds[min(b + 1, len(seconds) - 1)]
        figure.add_vrect(
            x0=start,
            x1=stop,
            fillcolor=style.translucent("#D55E00", 0.13),
            line_width=0,
            layer="below",
            row="all",
            col=1,
        )
        if k == 0:
            figure.add_trace(
                go.Scatter(
                    x=[None],
                    y=[None],
                    mode="markers",
                    name="missing",
                    marker={
                        "symbol": "square",
                        "size": 12,
                        "color": style.translucent("#D55E00", 0.3),
                    },
                ),
                row=1,
                col=1,
            )


def load_deflection(result: HasTables) -> go.Figure:
    """Draw the total deflection of every section over the load, holds marked."""
    frame = result.deflection.filter(pl.col("load").is_not_null(), pl.col("d_m").is_not_null())
    figure = style.plain()
    if frame.is_empty():
        return style.note(figure, "no load channel was read")
    for k, (name, s_m) in enumerate(sections(frame)):
        part = _thinned(frame.filter(pl.col("section") == name).sort("time"))
        hue, label = style.colour(k), f"{style.text(name)} ({s_m:g} m)"
        figure.add_trace(
            go.Scatter(
                x=part["load"],
                y=part["d_m"],
                mode="lines",
                name=label,
                legendgroup=label,
                line={"color": hue, "width": 1, "dash": style.dash(k)},
                opacity=0.6,
                hoverinfo="skip",
            )
        )
        figure.add_trace(_hold_marks(result.steps, name, hue, label))
    figure.update_xaxes(title_text="load (%)")
    figure.update_yaxes(title_text="total deflection (m)")
    figure.update_layout(height=460)
    return figure


def _hold_marks(steps: pl.DataFrame, section: str, hue: str, label: str) -> go.Scatter:
    part = steps.filter(pl.col("section") == section, pl.col("d_m").is_not_null())
    return go.Scatter(
        x=part["load"],
        y=part["d_m"],
        mode="markers",
        name=label,
        legendgroup=label,
        showlegend=False,
        marker={"color": hue, "size": 9},
        error_y={"type": "data", "array": (_COVERAGE * part["ud_m"]).fill_null(0.0)},
        text=[style.text(step) for step in part["step"]],
        hovertemplate="%{text}<br>%{x:.1f} %<br>%{y:.4f} m<extra>" + label + "</extra>",
    )
