"""Figures of the surface: section cuts with band and points, residuals over span and chord."""

import numpy as np
import numpy.typing as npt
import plotly.graph_objects as go
import polars as pl

from lidar_deflect import words
from lidar_deflect.plots import style
from lidar_deflect.plots.source import HasTables, section_of, table

Floats = npt.NDArray[np.float64]

_NEAR_M = 0.3
"""Points nearer to the section along the span than this are drawn in its cut."""
_SPAN_CELLS, _CHORD_CELLS = 60, 12
_FEWEST = 3
_WORST_MM = 20.0
"""Colours of the map end here, or nothing but outliers would be seen."""


def section_cut(
    result: HasTables, section: str | float | None = None, step: str | None = None
) -> go.Figure:
    """Draw one section across its axis at one step: outline, its 95 % band, points near it."""
    figure = style.plain()
    outline = table(result, "outline")
    if outline.is_empty():
        return style.note(figure, words.PLOT["no_outline"])
    name, s_m = section_of(outline, section)
    outline = outline.filter(pl.col("section") == name)
    step = step or str(outline.sort("time")["step"][-1])
    outline = outline.filter(pl.col("step") == step).sort("place")
    if outline.is_empty():
        return style.note(figure, words.PLOT["no_outline"])
    xyz = outline.select("x_m", "y_m", "z_m").to_numpy()
    plane = _plane(xyz)
    cut = (xyz - xyz.mean(axis=0)) @ plane.T
    _add_outline(figure, cut, outline["u_m"].to_numpy())
    _add_points(figure, result, step, s_m, xyz.mean(axis=0), plane)
    figure.update_xaxes(title_text=words.PLOT["along_the_chord"])
    figure.update_yaxes(title_text=words.PLOT["across_the_chord"], scaleanchor="x", scaleratio=1)
    figure.update_layout(height=420, meta={"section": name, "s_m": s_m, "step": step})
    return figure


def _plane(outline: Floats) -> Floats:
    """Return unit vectors along the chord, to the trailing edge, and across it, shape (2, 3)."""
    along = outline[len(outline) // 2] - outline[0]
    along /= np.linalg.norm(along)
    across = outline - outline.mean(axis=0)
    across -= np.outer(across @ along, along)
    _, _, axes = np.linalg.svd(across, full_matrices=False)
    first = axes[0] * np.sign(across[len(outline) // 4] @ axes[0] or 1.0)
    return np.stack([along, first])


def _add_outline(figure: go.Figure, cut: Floats, u_m: Floats) -> None:
    closed = np.vstack([cut, cut[:1]])
    step = np.roll(cut, -1, axis=0) - np.roll(cut, 1, axis=0)
    normal = np.stack([step[:, 1], -step[:, 0]], axis=1)
    normal /= np.maximum(np.linalg.norm(normal, axis=1, keepdims=True), 1e-12)
    outward = np.sign(np.sum(normal * (cut - cut.mean(axis=0)), axis=1, keepdims=True))
    off = style.COVERAGE * u_m[:, None] * normal * outward
    band = [np.vstack([ring, ring[:1]]) for ring in (cut + off, (cut - off)[::-1])]
    ring = np.vstack(band)
    figure.add_trace(
        go.Scatter(
            x=ring[:, 0],
            y=ring[:, 1],
            fill="toself",
            fillcolor=style.translucent(style.colour(0), 0.3),
            line={"width": 0},
            hoverinfo="skip",
            name=words.PLOT["band"],
        )
    )
    figure.add_trace(
        go.Scatter(
            x=closed[:, 0],
            y=closed[:, 1],
            mode="lines",
            name=words.PLOT["surface"],
            line={"color": style.colour(0), "width": 1.5},
            hoverinfo="skip",
        )
    )


def _add_points(
    figure: go.Figure, result: HasTables, step: str, s_m: float, middle: Floats, plane: Floats
) -> None:
    rows = result.steps.filter(pl.col("step") == step)
    near = table(result, "points").filter((pl.col("s_m") - s_m).abs() < _NEAR_M)
    if rows.height:
        near = near.filter(pl.col("time").is_between(rows["from"][0], rows["to"][0]))
    for k, lidar in enumerate(near["lidar"].unique().sort()):
        part = near.filter(pl.col("lidar") == lidar)
        at = (part.select("x_m", "y_m", "z_m").to_numpy() - middle) @ plane.T
        residual = part["residual_m"].cast(pl.Float64).to_numpy()
        figure.add_trace(
            go.Scatter(
                x=at[:, 0],
                y=at[:, 1],
                mode="markers",
                name=style.text(lidar),
                marker={"color": style.colour(k + 1), "symbol": style.symbol(k), "size": 5},
                opacity=0.7,
                customdata=1e3 * residual,
                hovertemplate="%{customdata:.1f} mm<extra>%{fullData.name}</extra>",
            )
        )


def residual_map(result: HasTables) -> go.Figure:
    """Draw the mean residual over span and chord, suction side above, pressure side below."""
    figure = style.panels(2, shared_xaxes=True)
    points = table(result, "points").drop_nulls(["s_m", "residual_m", "chord"])
    if points.is_empty():
        return style.note(figure, words.PLOT["this_method_keeps_no_residuals"])
    low, high = float(points["s_m"].min()), float(points["s_m"].max())  # type: ignore[arg-type]
    width = max((high - low) / _SPAN_CELLS, 0.25)
    for row, is_suction in ((1, True), (2, False)):
        part = points.filter((pl.col("chord") >= 0.0) == is_suction)
        figure.add_trace(_cells(part, low, width), row=row, col=1)
    figure.update_yaxes(title_text=words.PLOT["chord_suction"], range=[0, 1], row=1, col=1)
    figure.update_yaxes(title_text=words.PLOT["chord_pressure"], range=[1, 0], row=2, col=1)
    figure.update_xaxes(title_text=words.PLOT["arc_length_s"], row=2, col=1)
    bar = {"title": {"text": "mm"}, "len": 0.9}
    ends = {"cmin": -_WORST_MM, "cmax": _WORST_MM}
    figure.update_layout(height=460, coloraxis={"colorscale": "RdBu", "colorbar": bar, **ends})
    return figure


def _cells(part: pl.DataFrame, low: float, width: float) -> go.Heatmap:
    counted = (
        part.with_columns(
            s=((pl.col("s_m") - low) / width).floor().cast(pl.Int64),
            c=(pl.col("chord").abs() * _CHORD_CELLS).floor().clip(0, _CHORD_CELLS - 1),
        )
        .group_by("s", "c")
        .agg(pl.col("residual_m").mean(), pl.len().alias("count"))
        .filter(pl.col("count") >= _FEWEST)
        .sort("s", "c")
    )
    return go.Heatmap(
        x=low + width * (counted["s"] + 0.5),
        y=(counted["c"] + 0.5) / _CHORD_CELLS,
        z=1e3 * counted["residual_m"],
        customdata=counted["count"],
        coloraxis="coloraxis",
        hovertemplate="%{x:.1f} m, chord %{y:.2f}<br>%{z:.1f} mm of %{customdata}<extra></extra>",
    )
