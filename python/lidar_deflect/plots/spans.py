"""Figures along the span: rotations and twist of the blade line at every load step."""

import numpy as np
import plotly.graph_objects as go
import polars as pl

from lidar_deflect import words
from lidar_deflect.plots import style
from lidar_deflect.plots.shapes import line_of
from lidar_deflect.plots.source import HasTables, table

_FEWEST = 5
_PANELS = (
    ("rx_rad", words.PLOT["about_x"], 180.0 / np.pi),
    ("ry_rad", words.PLOT["about_y"], 180.0 / np.pi),
    ("twist_deg", words.PLOT["twist"], 1.0),
)


def has_rotations(result: HasTables) -> bool:
    """Tell whether the blade line of a result carries rotations or twist."""
    contour = table(result, "contour")
    return any(contour[name].null_count() < contour.height for name, _, _ in _PANELS)


def rotation(result: HasTables) -> go.Figure:
    """Draw the rotation of the sections about x and y and their twist change along the span."""
    figure = style.panels(3, shared_xaxes=True)
    if not has_rotations(result):
        return style.note(figure, words.PLOT["this_method_gives_no_rotations_alo"])
    contour = sloped(table(result, "contour"), result.steps)
    for k, step in enumerate(result.steps["step"].unique(maintain_order=True)):
        rows = result.steps.filter(pl.col("step") == step)
        line = line_of(contour, rows)
        if line is not None:
            _add_step(figure, line, rows, step, k)
    for row, (_, label, _) in enumerate(_PANELS, start=1):
        figure.update_yaxes(title_text=label, row=row, col=1)
    figure.update_xaxes(title_text=words.PLOT["arc_length_s"], row=3, col=1)
    figure.update_layout(height=620)
    return figure


def sloped(contour: pl.DataFrame, steps: pl.DataFrame) -> pl.DataFrame:
    """Fill in rotations that a method did not write: the turn of the line since the first step.

    About x from the slope of y over z, about y from that of x, both as rotations of the tangent.
    """
    missing = contour["rx_rad"].null_count() == contour["ry_rad"].null_count() == contour.height
    rest = line_of(contour, steps.sort("from").head(1))
    if not missing or rest is None or rest.height < _FEWEST:
        return contour
    zero = dict(zip(rest["s_m"], zip(*_turns(rest), strict=True), strict=True))
    parts = []
    for _, part in contour.drop_nulls("x_m").sort("time", "s_m").group_by("time"):
        known = part.filter(pl.col("s_m").is_in(list(zero)))
        if known.height >= _FEWEST:
            x, y = _turns(known)
            first = np.array([zero[s_m] for s_m in known["s_m"]])
            parts.append(known.with_columns(rx_rad=x - first[:, 0], ry_rad=y - first[:, 1]))
    return pl.concat(parts) if parts else contour


def _turns(line: pl.DataFrame) -> tuple[np.ndarray, np.ndarray]:
    s_m = line["s_m"].to_numpy()
    x, y, z = (np.gradient(line[f"{axis}_m"].to_numpy(), s_m) for axis in "xyz")
    return -np.arctan2(y, z), np.arctan2(x, z)


def _add_step(figure: go.Figure, line: pl.DataFrame, rows: pl.DataFrame, step: str, k: int) -> None:
    label = style.text(step)
    for row, (name, _, factor) in enumerate(_PANELS, start=1):
        if line[f"u{name}"].null_count() == 0:
            figure.add_trace(_band(line, name, factor, k, label), row=row, col=1)
        figure.add_trace(
            go.Scatter(
                x=line["s_m"],
                y=factor * line[name],
                mode="lines",
                name=label,
                legendgroup=label,
                showlegend=row == 1,
                line={"color": style.colour(k), "dash": style.dash(k), "width": 2},
                hovertemplate="%{x:.1f} m<br>%{y:.3f}°<extra>" + label + "</extra>",
            ),
            row=row,
            col=1,
        )
    figure.add_trace(_sections(rows, k, label), row=3, col=1)


def _band(line: pl.DataFrame, name: str, factor: float, k: int, label: str) -> go.Scatter:
    """Draw the 95 % interval of a column along the span."""
    ends = (-style.COVERAGE, style.COVERAGE)
    low, high = (factor * (line[name] + end * line[f"u{name}"]) for end in ends)
    return go.Scatter(
        x=pl.concat([line["s_m"], line["s_m"].reverse()]),
        y=pl.concat([high, low.reverse()]),
        fill="toself",
        fillcolor=style.translucent(style.colour(k), 0.18),
        line={"width": 0},
        hoverinfo="skip",
        legendgroup=label,
        showlegend=False,
    )


def _sections(rows: pl.DataFrame, k: int, label: str) -> go.Scatter:
    known = rows.filter(pl.col("twist_deg").is_not_null())
    return go.Scatter(
        x=known["s_m"],
        y=known["twist_deg"],
        mode="markers",
        legendgroup=label,
        showlegend=False,
        marker={"color": style.colour(k), "size": 7, "symbol": style.symbol(k)},
        text=[style.text(name) for name in known["section"]],
        hovertemplate="%{text}<br>%{y:.3f}°<extra>" + label + "</extra>",
    )
