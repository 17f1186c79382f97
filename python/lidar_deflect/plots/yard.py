"""Figures of a registration: what rays leave over the yard, and which lidar saw how much of it."""

from collections.abc import Mapping
from typing import Any

import numpy as np
import plotly.graph_objects as go

from lidar_deflect import words
from lidar_deflect.plots import style
from lidar_deflect.plots.source import HasTables, evidence_of

_ENDS_MM = (-np.inf, -3.0, -1.0, 1.0, 3.0, np.inf)
"""Residuals are told in five classes, so that the figure reads on paper without colour scales."""
_HUES = ("#B2182B", "#EF8A62", "#BBBBBB", "#67A9CF", "#2166AC")
_NAMES = ("below -3 mm", "-3 to -1 mm", "-1 to 1 mm", "1 to 3 mm", "above 3 mm")


def yard_residuals(result: HasTables) -> go.Figure:
    """Draw the mean residual of rays by place, one panel per surface and lidar."""
    surfaces = [cells for cells in _surfaces(result) if cells.get("rays")]
    if not surfaces:
        return style.note(style.plain(), words.PLOT["no_residuals_of_the_yard"])
    wanted = [(cells, lidar) for cells in surfaces for lidar in sorted(set(cells["lidar"]))]
    figure = style.panels(len(wanted), shared_xaxes=True)
    for row, (cells, lidar) in enumerate(wanted, 1):
        for k in range(len(_NAMES)):
            figure.add_trace(_class(cells, lidar, k, row == 1), row=row, col=1)
        across = words.PLOT["x"] if cells["across"] == "x_m" else words.PLOT["y"]
        title = f"{style.text(cells['surface'])} {style.text(lidar)}<br>{across}"
        figure.update_yaxes(title_text=title, row=row, col=1)
    figure.update_xaxes(title_text=words.PLOT["z_along_the_blade"], row=len(wanted), col=1)
    figure.update_layout(height=190 * len(wanted) + 90)
    return figure


def _class(cells: Mapping[str, Any], lidar: str, k: int, first: bool) -> go.Scatter:
    """Squares of one lidar whose mean residual lies in one class."""
    mean_mm = np.array(cells["mean_mm"])
    inside = (mean_mm >= _ENDS_MM[k]) & (mean_mm < _ENDS_MM[k + 1])
    mine = inside & (np.array(cells["lidar"]) == lidar)
    return go.Scatter(
        x=np.array(cells["z_m"])[mine],
        y=np.array(cells["across_m"])[mine],
        mode="markers",
        name=_NAMES[k],
        legendgroup=_NAMES[k],
        showlegend=first,
        marker={"symbol": "square", "size": 8, "color": _HUES[k]},
        customdata=np.stack([mean_mm, np.array(cells["rays"])], axis=-1)[mine],
        hovertemplate="z %{x:.1f} m<br>%{y:.1f} m<br>%{customdata[0]:.2f} mm, %{customdata[1]} "
        + words.PLOT["rays"]
        + "<extra></extra>",
    )


def lidar_shares(result: HasTables) -> go.Figure:
    """Draw how many rays of every lidar hold each surface."""
    surfaces = [cells for cells in _surfaces(result) if cells.get("rays")]
    figure = style.plain()
    if not surfaces:
        return style.note(figure, words.PLOT["no_residuals_of_the_yard"])
    lidars = sorted({lidar for cells in surfaces for lidar in cells["lidar"]})
    for k, cells in enumerate(surfaces):
        of, rays = np.array(cells["lidar"]), np.array(cells["rays"])
        figure.add_trace(
            go.Bar(
                x=[style.text(lidar) for lidar in lidars],
                y=[int(rays[of == lidar].sum()) for lidar in lidars],
                name=style.text(cells["surface"]),
                marker={"color": style.colour(k)},
                hovertemplate="%{x}: %{y}<extra>%{fullData.name}</extra>",
            )
        )
    figure.update_yaxes(title_text=words.PLOT["rays"], type="log")
    figure.update_xaxes(title_text=words.PLOT["lidar"], type="category", showgrid=False)
    figure.update_layout(barmode="group", height=320)
    return figure


def _surfaces(result: HasTables) -> list[Mapping[str, Any]]:
    return list(evidence_of(result).get("cells") or ())
