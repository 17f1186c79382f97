"""Figures over time: the paper's figures 19 and 21, and draw wires beside the lidars."""

from collections.abc import Sequence
from typing import Literal

import plotly.graph_objects as go
import polars as pl

from lidar_deflect import wires as virtual
from lidar_deflect import words
from lidar_deflect.channels import from_table
from lidar_deflect.plots import style
from lidar_deflect.plots.source import HasTables, configuration, section_of, table

Quantity = Literal["deflection", "position"]

MOST_STATES = 6000
"""More states than this are thinned: a screen has fewer columns."""

_COVERAGE = style.COVERAGE
_MOST_GAPS = 300
_NAMES: dict[Quantity, tuple[str, str, str]] = {
    "deflection": ("d{}_m", "ud{}_m", "d{}"),
    "position": ("{}_m", "u{}_m", "{}"),
}


def time_series(
    result: HasTables,
    section: str | float | None = None,
    quantity: Quantity = "deflection",
    most_states: int = MOST_STATES,
) -> go.Figure:
    """Draw x, y and z of one section over time, as the paper's figures 19 and 21 do."""
    name, s_m = section_of(result.deflection, section)
    frame = result.deflection.filter(pl.col("section") == name).sort("time")
    frame = style.thinned(frame, ["dx_m", "dy_m", "dz_m"], most_states)
    figure = style.panels(3, shared_xaxes=True)
    for row, axis in enumerate("xyz", start=1):
        _component(figure, frame, axis, row, quantity)
        _marks(figure, frame, axis, row, quantity)
    _shade_holds(figure, result.steps)
    _shade_missing(figure, frame)
    figure.update_xaxes(title_text=words.PLOT["time"], row=3, col=1)
    figure.update_layout(height=560, margin_t=64, meta={"section": name, "s_m": s_m})
    figure.update_layout(legend_y=1.04)  # above the labels of the holds
    return figure


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
                name=words.PLOT["95"],
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
    spans = _hold_seconds(steps)
    _shade(figure, [(start, stop) for _, start, stop in spans], style.FAINT)
    labels = [
        {
            "x": (start + stop) / 2.0,
            "y": 1.0,
            "xref": "x",
            "yref": "y domain",
            "yanchor": "bottom",
            "text": style.text(label),
            "showarrow": False,
            "font": {"size": 11, "color": style.GREY},
        }
        for label, start, stop in spans
    ]
    figure.update_layout(annotations=[*figure.layout.annotations, *labels])


def _shade(figure: go.Figure, spans: Sequence[tuple[float, float]], hue: str) -> None:
    """Fill stretches of time on every panel; one update, as single ones are slow."""
    shapes = [
        {
            "type": "rect",
            "x0": start,
            "x1": stop,
            "y0": 0,
            "y1": 1,
            "xref": f"x{row or ''}",
            "yref": f"y{row or ''} domain",
            "fillcolor": hue,
            "line": {"width": 0},
            "layer": "below",
        }
        for start, stop in spans
        for row in (None, 2, 3)
    ]
    figure.update_layout(shapes=[*figure.layout.shapes, *shapes])


def _hold_seconds(steps: pl.DataFrame) -> list[tuple[str, float, float]]:
    """Label, first and last second of every hold, on the clock of ``t_s``."""
    seconds = {
        name: pl.col("t_s") + (pl.col(name) - pl.col("time")).cast(pl.Int64) * 1e-9
        for name in ("from", "to")
    }
    return steps.select("step", **seconds).unique("step", maintain_order=True).rows()


def _shade_missing(figure: go.Figure, frame: pl.DataFrame) -> None:
    """Tint the stretches without a state, and say so in the legend."""
    gone = (frame["status"].cast(pl.String) == "missing").to_list()
    seconds = frame["t_s"].to_list()
    spans = [
        (seconds[max(a - 1, 0)], seconds[min(b + 1, len(seconds) - 1)])
        for a, b in style.stretches(gone)
    ]
    if not spans:
        return
    _shade(figure, spans[:_MOST_GAPS], style.translucent("#D55E00", 0.13))
    mark = {"symbol": "square", "size": 12, "color": style.translucent("#D55E00", 0.3)}
    figure.add_trace(
        go.Scatter(x=[None], y=[None], mode="markers", name=words.PLOT["missing"], marker=mark),
        row=1,
        col=1,
    )


def wires(result: HasTables) -> go.Figure:
    """Draw every wire: what it read, what it would have read by the lidars, and the difference."""
    channels = table(result, "channels")
    names = wire_names(channels)
    real = [name for name in names if name in set(channels["channel"])]
    rows = len(names) + bool(real)
    figure = style.panels(max(rows, 1), shared_xaxes=True)
    if not names:
        return style.note(figure, words.PLOT["no_draw_wire_real_or_virtual_is_in"])
    for row, name in enumerate(names, start=1):
        for k, (channel, label) in enumerate(
            ((name, words.PLOT["wire"]), (name + virtual.SUFFIX, words.PLOT["by_the_lidars"]))
        ):
            part = channels.filter(pl.col("channel") == channel).sort("time")
            if part.height:
                figure.add_trace(_wire_line(part, label, k, first=row == 1), row=row, col=1)
        figure.update_yaxes(title_text=f"{style.text(name)} (m)", row=row, col=1)
    for k, name in enumerate(real):
        figure.add_trace(_difference(channels, name, k), row=rows, col=1)
    if real:
        figure.update_yaxes(title_text=words.PLOT["lidar_wire"], row=rows, col=1)
    figure.update_xaxes(title_text=words.PLOT["time"], row=rows, col=1)
    figure.update_layout(height=130 + 160 * rows)
    return figure


def _difference(channels: pl.DataFrame, name: str, k: int) -> go.Scatter:
    wire = from_table(channels, name)
    own = channels.filter(pl.col("channel") == name + virtual.SUFFIX).sort("time")
    read = own["value"] if wire is None else pl.Series(wire.at(own["time"].cast(pl.Int64)))
    part = own.with_columns(value=1e3 * (own["value"] - read.fill_nan(None)))
    part = style.thinned(part, ["value"], MOST_STATES)
    label = f"{style.text(name)}, {words.PLOT['difference']}"
    return go.Scatter(
        x=part["t_s"],
        y=part["value"],
        mode="lines",
        name=label,
        line={"color": style.colour(k + 2), "dash": style.dash(k), "width": 1.4},
        connectgaps=False,
        hovertemplate="%{x:.2f} s<br>%{y:.1f} mm<extra>" + label + "</extra>",
    )


def wire_names(channels: pl.DataFrame) -> list[str]:
    """Name the wires of the table ``channels`` that the lidars can speak of."""
    found = [
        name.removesuffix(virtual.SUFFIX)
        for name in channels["channel"].unique(maintain_order=True)
        if name.endswith(virtual.SUFFIX)
    ]
    return list(dict.fromkeys(found))


def _wire_line(part: pl.DataFrame, label: str, k: int, *, first: bool) -> go.Scatter:
    part = style.thinned(part, ["value"], MOST_STATES)
    return go.Scatter(
        x=part["t_s"],
        y=part["value"],
        mode="lines",
        line={"color": style.colour(k), "dash": "solid" if k else "dot", "width": 1.8},
        name=label,
        legendgroup=label,
        showlegend=first,
        connectgaps=False,
        hovertemplate="%{x:.2f} s<br>%{y:.4f} m<extra>" + label + "</extra>",
    )


def other_names(result: HasTables) -> list[str]:
    """Name the channels that are neither load nor wire: root, strain, inclinometers."""
    channels = table(result, "channels")
    wired = set(wire_names(channels))
    names = channels["channel"].unique(maintain_order=True).to_list()
    drawn = {"load", *wired, *(name + virtual.SUFFIX for name in wired)}
    config = configuration(result)
    drawn |= {str(wire.get("name")) for wire in config.get("wires") or ()}
    return [name for name in names if name not in drawn]


def channels(result: HasTables) -> go.Figure:
    """Draw every other channel, one panel per unit."""
    frame = table(result, "channels")
    names = other_names(result)
    shown = frame.filter(pl.col("channel").is_in(names))
    units = shown["unit"].unique(maintain_order=True).to_list()
    figure = style.panels(max(len(units), 1), shared_xaxes=True)
    if not names:
        return style.note(figure, words.PLOT["no_other_channel_was_read"])
    for row, unit in enumerate(units, start=1):
        own = shown.filter(pl.col("unit") == unit)
        for name in own["channel"].unique(maintain_order=True):
            part = own.filter(pl.col("channel") == name).sort("time")
            figure.add_trace(_channel_line(part, name, names.index(name)), row=row, col=1)
        figure.update_yaxes(
            title_text=f"{words.PLOT['reading']} ({style.text(unit)})", row=row, col=1
        )
    figure.update_xaxes(title_text=words.PLOT["time"], row=len(units), col=1)
    figure.update_layout(height=160 + 180 * len(units))
    return figure


def _channel_line(part: pl.DataFrame, name: str, k: int) -> go.Scatter:
    part = style.thinned(part, ["value"], MOST_STATES)
    return go.Scatter(
        x=part["t_s"],
        y=part["value"],
        mode="lines",
        showlegend=True,
        name=style.text(name),
        line={"color": style.colour(k), "dash": style.dash(k), "width": 1.5},
        connectgaps=False,
        hovertemplate="%{x:.2f} s<br>%{y:.5g}<extra>%{fullData.name}</extra>",
    )
