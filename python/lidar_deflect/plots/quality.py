"""Figures of how well it went: errors by method (the paper's figure 20), health of the lidars."""

from typing import Any

import plotly.graph_objects as go
import polars as pl

from lidar_deflect import comparison as held_against
from lidar_deflect import words
from lidar_deflect.plots import style
from lidar_deflect.plots.source import HasTables, table

_MOST_SECONDS = 1500
_MOST_POINTS = 4000


def comparison(result: HasTables, step: str | None = None) -> go.Figure:
    """Draw the errors of every method per section, as the paper's figure 20 does."""
    figure = style.plain()
    frame = table(result, "comparison")
    bars = _bars(frame, step or held_against.largest_step(frame))
    if bars.is_empty():
        return style.note(figure, words.PLOT["nothing_was_compared"])
    for k, name in enumerate(bars["name"].unique(maintain_order=True)):
        rows = bars.filter(pl.col("name") == name)
        figure.add_trace(
            go.Bar(
                x=[style.text(section) for section in rows["section"]],
                y=rows["error_percent"],
                name=style.text(name),
                marker={"color": style.colour(k), "pattern": {"shape": ["", "/", ".", "x"][k % 4]}},
                error_y=_intervals(rows["interval_percent"]),
                text=[f"{value:z.2f}" for value in rows["error_percent"]],
                textposition="outside",
                cliponaxis=False,
                hovertemplate="%{y:.2f} %<extra>%{fullData.name}</extra>",
            )
        )
    order = [
        style.text(section) for section in bars.sort("s_m")["section"].unique(maintain_order=True)
    ]
    figure.update_xaxes(title_text=words.PLOT["section"], type="category", showgrid=False)
    figure.update_xaxes(categoryorder="array", categoryarray=order)
    figure.update_yaxes(title_text=words.PLOT["error"])
    figure.update_layout(barmode="group", height=440)
    return figure


def _intervals(half: pl.Series) -> dict[str, Any] | None:
    """Error bars, none where no method states an uncertainty."""
    if half.null_count() == len(half):
        return None
    return {"type": "data", "array": half.fill_null(0.0)}


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
    interval = 100.0 * style.COVERAGE * pl.col("u_m") / pl.col("reference_m").abs()
    return found.select(
        "section", "s_m", "name", "error_percent", interval_percent=interval
    ).drop_nulls("error_percent")


def health(result: HasTables) -> go.Figure:
    """Draw loss, points on the blade, coverage and clock, per lidar and second."""
    figure = style.panels(5, shared_xaxes=True)
    frame = table(result, "health").sort("t_s")
    if frame.is_empty():
        return style.note(figure, words.PLOT["no_health_was_written"])
    counted = frame["blade_points"].null_count() < frame.height
    due = pl.col("packets").cast(pl.Int64) + pl.col("lost").cast(pl.Int64)
    frame = frame.with_columns(
        lost_percent=100.0 * pl.col("lost").cast(pl.Float64) / due.clip(lower_bound=1),
        coverage_percent=100.0 * pl.col("coverage"),
        clock_ms=1e3 * pl.col("clock_offset_s"),
    )
    panels = (
        ("lost_percent", words.PLOT["lost"]),
        ("blade_points", words.PLOT["blade_points"])
        if counted
        else ("points", words.PLOT["points"]),
        ("coverage_percent", words.PLOT["coverage"]),
        ("rpm", words.PLOT["turns"]),
        ("clock_ms", words.PLOT["clock_utc"]),
    )
    for k, lidar in enumerate(frame["lidar"].unique().sort()):
        part = frame.filter(pl.col("lidar") == lidar)
        for row, (name, _) in enumerate(panels, start=1):
            figure.add_trace(_line(part, name, lidar, k, first=row == 1), row=row, col=1)
    for row, (_, label) in enumerate(panels, start=1):
        figure.update_yaxes(title_text=label, row=row, col=1)
    figure.update_yaxes(rangemode="tozero", row=1, col=1)
    figure.update_yaxes(rangemode="tozero", row=2, col=1)
    figure.update_xaxes(title_text=words.PLOT["time"], row=5, col=1)
    figure.update_layout(height=780)
    return figure


def _line(part: pl.DataFrame, name: str, lidar: str, k: int, *, first: bool) -> go.Scatter:
    part = style.thinned(part, [name], _MOST_SECONDS)
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


def residuals(result: HasTables) -> go.Figure:
    """Draw how far the blade's points lie from the model along the span, by lidar."""
    figure = style.plain()
    points = table(result, "points").drop_nulls(["s_m", "residual_m"])
    if points.is_empty():
        return style.note(figure, words.PLOT["this_method_keeps_no_residuals"])
    lidars = points["lidar"].unique().sort()
    for k, lidar in enumerate(lidars):
        part = points.filter(pl.col("lidar") == lidar).sort("s_m")
        part = part.gather_every(-(-part.height // (_MOST_POINTS // len(lidars))))
        figure.add_trace(
            go.Scatter(
                x=part["s_m"],
                y=1e3 * part["residual_m"],
                mode="markers",
                name=style.text(lidar),
                marker={"color": style.colour(k), "symbol": style.symbol(k), "size": 4},
                opacity=0.5,
                hovertemplate="%{x:.1f} m<br>%{y:.1f} mm<extra>%{fullData.name}</extra>",
            )
        )
    figure.update_xaxes(title_text=words.PLOT["arc_length_s"])
    figure.update_yaxes(title_text=words.PLOT["measured_model"])
    figure.update_layout(height=420)
    return figure
