"""Figures of how well it went: errors by method (the paper's figure 20), health of the lidars."""

import plotly.graph_objects as go
import polars as pl

from lidar_deflect import comparison as held_against
from lidar_deflect.plots import style
from lidar_deflect.plots.source import HasTables, table


def comparison(result: HasTables, step: str | None = None) -> go.Figure:
    """Draw the errors of every method per section, as the paper's figure 20 does."""
    figure = style.plain()
    frame = table(result, "comparison")
    bars = _bars(frame, step or held_against.largest_step(frame))
    if bars.is_empty():
        return style.note(figure, "nothing was compared")
    for k, name in enumerate(bars["name"].unique(maintain_order=True)):
        rows = bars.filter(pl.col("name") == name)
        figure.add_trace(
            go.Bar(
                x=[style.text(section) for section in rows["section"]],
                y=rows["error_percent"],
                name=style.text(name),
                marker={"color": style.colour(k), "pattern": {"shape": ["", "/", ".", "x"][k % 4]}},
                text=[f"{value:z.2f}" for value in rows["error_percent"]],
                textposition="outside",
                cliponaxis=False,
                hovertemplate="%{y:.2f} %<extra>%{fullData.name}</extra>",
            )
        )
    order = [
        style.text(section) for section in bars.sort("s_m")["section"].unique(maintain_order=True)
    ]
    figure.update_xaxes(title_text="section", type="category", showgrid=False)
    figure.update_xaxes(categoryorder="array", categoryarray=order)
    figure.update_yaxes(title_text="error (%)")
    figure.update_layout(barmode="group", height=440)
    return figure


def _bars(frame: pl.DataFrame, step: str | None) -> pl.DataFrame:
    """Errors by section and name: of each method, else of the lidars against each source."""
    methods = held_against.by_method(frame, step=step)
    if methods.height:
        name = pl.col("method") + " against " + pl.col("against")
        lidars_last = pl.col("method") == held_against.LIDAR
        found = methods.with_columns(name=name).sort(lidars_last, maintain_order=True)
    else:
        name = "lidar against " + pl.col("source") + ", " + pl.col("quantity")
        found = frame.filter(pl.col("step") == (step or "")).sort("s_m").with_columns(name=name)
    return found.select("section", "s_m", "name", "error_percent").drop_nulls()


def health(result: HasTables) -> go.Figure:
    """Draw lost packets, and points on the blade, per lidar and second."""
    figure = style.panels(2, shared_xaxes=True)
    frame = table(result, "health").sort("t_s")
    if frame.is_empty():
        return style.note(figure, "no health was written")
    counted = frame["blade_points"].null_count() < frame.height
    points = "blade_points" if counted else "points"
    due = pl.col("packets").cast(pl.Int64) + pl.col("lost").cast(pl.Int64)
    lost = 100.0 * pl.col("lost").cast(pl.Float64) / due.clip(lower_bound=1)
    frame = frame.with_columns(lost_percent=lost)
    for k, lidar in enumerate(frame["lidar"].unique().sort()):
        part = frame.filter(pl.col("lidar") == lidar)
        for row, name in enumerate(("lost_percent", points), start=1):
            figure.add_trace(_line(part, name, lidar, k, first=row == 1), row=row, col=1)
    figure.update_yaxes(title_text="lost (%)", rangemode="tozero", row=1, col=1)
    label = "blade points (1/s)" if counted else "points (1/s)"
    figure.update_yaxes(title_text=label, rangemode="tozero", row=2, col=1)
    figure.update_xaxes(title_text="time (s)", row=2, col=1)
    figure.update_layout(height=460)
    return figure


def _line(part: pl.DataFrame, name: str, lidar: str, k: int, *, first: bool) -> go.Scatter:
    return go.Scatter(
        x=part["t_s"],
        y=part[name],
        mode="lines",
        line={"shape": "hv", "color": style.colour(k), "dash": style.dash(k), "width": 1.6},
        name=style.text(lidar),
        legendgroup=lidar,
        showlegend=first,
        hovertemplate="%{x:.0f} s<br>%{y:.6g}<extra>%{fullData.name}</extra>",
    )
