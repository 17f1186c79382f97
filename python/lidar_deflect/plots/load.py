"""Figures over the load: deflection against load, and creep in the holds."""

import plotly.graph_objects as go
import polars as pl

from lidar_deflect import behaviour, words
from lidar_deflect.plots import style
from lidar_deflect.plots.source import HasTables, configuration, sections, some

_MOST_STATES = 3000
_MOST_SECTIONS = 12


def load_deflection(result: HasTables) -> go.Figure:
    """Draw the deflection along the load over the load, and how far it is from a straight line."""
    figure = style.panels(2, shared_xaxes=True, row_heights=[0.62, 0.38])
    unit = behaviour.direction(configuration(result), result.steps)
    frame = result.deflection.filter(pl.col("load").is_not_null(), pl.col("d_m").is_not_null())
    if unit is None or frame.is_empty():
        return style.note(figure, words.PLOT["no_load_channel_was_read"])
    frame, steps = behaviour.along(frame, unit), behaviour.along(result.steps, unit)
    lines = behaviour.by_section(behaviour.stiffnesses(result.steps, result.deflection, unit))
    for k, (name, s_m) in enumerate(some(sections(frame), _MOST_SECTIONS)):
        _add_section(figure, frame, steps, lines.get(name), (name, s_m, k))
    figure.update_yaxes(title_text=words.PLOT["deflection_along_the_load"], row=1, col=1)
    figure.update_yaxes(title_text=words.PLOT["from_the_line"], row=2, col=1)
    figure.update_xaxes(title_text=words.PLOT["load"], row=2, col=1)
    figure.update_layout(height=620)
    return figure


def _add_section(
    figure: go.Figure,
    frame: pl.DataFrame,
    steps: pl.DataFrame,
    line: behaviour.Stiffness | None,
    section: tuple[str, float, int],
) -> None:
    name, s_m, k = section
    label = f"{style.text(name)} ({s_m:g} m)"
    path = frame.filter(pl.col("section") == name).sort("time")
    path = style.thinned(path, ["along_m"], _MOST_STATES)
    holds = steps.filter(pl.col("section") == name, pl.col("along_m").is_not_null())
    figure.add_trace(_path(path, "along_m", label, k), row=1, col=1)
    if line is not None and line.slope_m_per_percent is not None:
        slope, offset = line.slope_m_per_percent, line.offset_m or 0.0
        off = (1e3 * (pl.col("along_m") - offset - slope * pl.col("load"))).alias("off_mm")
        off_u = (1e3 * pl.col("ualong_m")).alias("uoff_mm")
        path, holds = path.with_columns(off), holds.with_columns(off, off_u)
        figure.add_trace(_straight(path, slope, offset, label, k), row=1, col=1)
        figure.add_trace(_path(path, "off_mm", label, k), row=2, col=1)
        figure.add_trace(_holds(holds, ("off_mm", "uoff_mm"), label, k, shown=False), row=2, col=1)
    figure.add_trace(_holds(holds, ("along_m", "ualong_m"), label, k, shown=True), row=1, col=1)


def _path(part: pl.DataFrame, column: str, label: str, k: int) -> go.Scatter:
    return go.Scatter(
        x=part["load"],
        y=part[column],
        mode="lines",
        name=label,
        legendgroup=label,
        showlegend=False,
        line={"color": style.colour(k), "width": 1},
        opacity=0.55,
        hoverinfo="skip",
    )


def _straight(part: pl.DataFrame, slope: float, offset: float, label: str, k: int) -> go.Scatter:
    low, high = float(part["load"].min() or 0.0), float(part["load"].max() or 0.0)  # type: ignore[arg-type]
    return go.Scatter(
        x=[low, high],
        y=[offset + slope * low, offset + slope * high],
        mode="lines",
        name=f"line {label}",
        legendgroup=label,
        showlegend=False,
        line={"color": style.colour(k), "width": 1.2, "dash": "dash"},
        hoverinfo="skip",
    )


def _holds(
    part: pl.DataFrame, columns: tuple[str, str], label: str, k: int, *, shown: bool
) -> go.Scatter:
    value, u = columns
    return go.Scatter(
        x=part["load"],
        y=part[value],
        mode="markers",
        name=label,
        legendgroup=label,
        showlegend=shown,
        marker={"color": style.colour(k), "size": 9, "symbol": style.symbol(k)},
        error_y={"type": "data", "array": (style.COVERAGE * part[u]).fill_null(0.0)},
        text=[style.text(step) for step in part["step"]],
        hovertemplate="%{text}<br>%{x:.1f} %<br>%{y:.4f}<extra>" + label + "</extra>",
    )


def creep(result: HasTables, section: str | None = None) -> go.Figure:
    """Draw how one section drifts along the load from the start of every hold."""
    figure = style.plain()
    unit = behaviour.direction(configuration(result), result.steps)
    known = sections(result.steps.filter(pl.col("d_m").is_not_null()))
    if unit is None or not known:
        return style.note(figure, words.PLOT["no_hold_was_measured"])
    name = section if section is not None else known[-1][0]
    states = behaviour.along(result.deflection, unit).filter(
        pl.col("section") == name, pl.col("along_m").is_not_null()
    )
    rows = result.steps.filter(pl.col("section") == name).sort("from")
    for k, row in enumerate(rows.iter_rows(named=True)):
        part = states.filter(pl.col("time").is_between(row["from"], row["to"])).sort("time")
        if part.height:
            figure.add_trace(_drift(part, row["step"], k))
    if not figure.data:
        return style.note(figure, words.PLOT["no_hold_was_measured"])
    figure.update_xaxes(title_text=words.PLOT["time_in_the_hold"])
    figure.update_yaxes(title_text=words.PLOT["along_the_load_from_the_hold_s_mea"])
    figure.update_layout(height=380, meta={"section": name})
    return figure


def _drift(part: pl.DataFrame, step: str, k: int) -> go.Scatter:
    part = style.thinned(part, ["along_m"], _MOST_STATES)
    mean = float(part["along_m"].mean() or 0.0)  # type: ignore[arg-type]
    return go.Scatter(
        x=part["t_s"] - part["t_s"][0],
        y=1e3 * (part["along_m"] - mean),
        mode="lines",
        name=style.text(step),
        line={"color": style.colour(k), "dash": style.dash(k), "width": 1.5},
        hovertemplate="%{x:.2f} s<br>%{y:.1f} mm<extra>" + style.text(step) + "</extra>",
    )
