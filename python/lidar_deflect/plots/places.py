"""Figures of the yard: the test from above, and how well the lidars are placed in it."""

from collections.abc import Mapping
from typing import Any

import numpy as np
import plotly.graph_objects as go
import polars as pl

from lidar_deflect import words
from lidar_deflect.plots import style
from lidar_deflect.plots.source import HasTables, configuration, poses_of, sections, some, table

_MOST_SECTIONS = 12
_INSIDE_95 = 5.991**0.5
"""Semi-axes of the 95 % ellipse over standard deviations: chi-square of two degrees of freedom."""
_ELLIPSE_PART = 0.4
"""The largest ellipse is about as large as this part of the way between the outer lidars."""


def plan(result: HasTables) -> go.Figure:
    """Draw the test seen from above: sections, lidars, anchors of the wires."""
    figure = style.plain()
    steps = result.steps.filter(pl.col("x_m").is_not_null())
    for k, (name, s_m) in enumerate(some(sections(steps), _MOST_SECTIONS)):
        rows = steps.filter(pl.col("section") == name).sort("time")
        figure.add_trace(
            go.Scatter(
                x=rows["z_m"],
                y=rows["x_m"],
                mode="lines+markers",
                name=f"{style.text(name)} ({s_m:g} m)",
                line={"color": style.colour(k), "dash": "dot", "width": 1.5},
                marker={"size": 8, "symbol": style.symbol(k)},
                text=[style.text(step) for step in rows["step"]],
                hovertemplate="%{text}<br>z %{x:.2f} m<br>x %{y:.2f} m",
            )
        )
    config = configuration(result)
    lidars = [(name, at[2], at[0]) for name, at in lidar_places(result).items()]
    _add_places(figure, words.PLOT["lidar"], "square", lidars)
    _add_places(
        figure, words.PLOT["wire_anchor"], "x", _places(config.get("wires"), "name", "anchor_m")
    )
    _add_control(figure, config)
    _add_ellipses(figure, result)
    if not figure.data:
        return style.note(figure, words.PLOT["nothing_has_a_place"])
    figure.update_xaxes(title_text=words.PLOT["z_along_the_blade"], constrain="domain")
    figure.update_yaxes(
        title_text=words.PLOT["x"], scaleanchor="x", scaleratio=1, constrain="domain"
    )
    figure.update_layout(height=560)
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


def lidar_places(result: HasTables) -> dict[str, list[float]]:
    """Return x, y, z of every lidar: calibrated, else as surveyed."""
    config = configuration(result)
    places = {
        str(entry.get("id", "")): [float(value) for value in entry["position_m"]]
        for entry in config.get("lidars") or ()
        if entry.get("position_m")
    }
    for entry in poses_of(result):
        pose = np.asarray(entry["world_from_sensor"], dtype=np.float64)
        places[str(entry["id"])] = [float(value) for value in pose[:3, 3]]
    return places


def _add_control(figure: go.Figure, config: Mapping[str, Any]) -> None:
    points = [point["xyz_m"] for point in config.get("control") or () if point.get("xyz_m")]
    if points:
        x, _, z = np.asarray(points, dtype=np.float64).T
        figure.add_trace(
            go.Scatter(
                x=z,
                y=x,
                mode="markers",
                name=words.PLOT["surveyed_point"],
                marker={"symbol": "cross-thin-open", "size": 7, "color": style.GREY},
                hovertemplate="z %{x:.2f} m<br>x %{y:.2f} m<extra>%{fullData.name}</extra>",
            )
        )


def _add_ellipses(figure: go.Figure, result: HasTables) -> None:
    """Draw where each lidar stands with 95 % probability, enlarged so that it can be seen."""
    known = [entry for entry in poses_of(result) if entry.get("covariance")]
    if not known:
        return
    places = np.array([_matrix(entry["world_from_sensor"])[[2, 0], 3] for entry in known])
    rings = [_ellipse(entry["covariance"]) for entry in known]
    largest_m = max(float(np.abs(ring).max()) for ring in rings)
    times = _round(_ELLIPSE_PART * max(float(np.ptp(places, axis=0).max()), 10.0) / largest_m)
    for k, (place, ring) in enumerate(zip(places, rings, strict=True)):
        z, x = (place[:, None] + times * ring).tolist()
        figure.add_trace(
            go.Scatter(
                x=z,
                y=x,
                mode="lines",
                name=words.PLOT["ellipse_enlarged"].format(times=times),
                legendgroup="ellipse",
                showlegend=k == 0,
                line={"color": style.colour(1), "width": 1.2},
                hoverinfo="skip",
            )
        )


def _matrix(pose: Any) -> Any:
    return np.asarray(pose, dtype=np.float64)


def _ellipse(covariance: Any) -> Any:
    """Return the 95 % ellipse in z and x about its middle, shape (2, 73), metres."""
    square = np.asarray(covariance, dtype=np.float64).reshape(6, 6)[np.ix_([5, 3], [5, 3])]
    values, axes = np.linalg.eigh(square)
    turn = np.linspace(0.0, 2.0 * np.pi, 73)
    circle = np.array([np.cos(turn), np.sin(turn)])
    return axes @ (_INSIDE_95 * np.sqrt(np.maximum(values, 0.0))[:, None] * circle)


def _round(times: float) -> int:
    """Round down to 1, 2 or 5 times a power of ten, at least 1."""
    power = 10.0 ** np.floor(np.log10(max(times, 1.0)))
    return int(power * max(step for step in (1, 2, 5) if step * power <= max(times, 1.0)))


_TURNS = (words.PLOT["turn_about_x"], words.PLOT["turn_about_y"], words.PLOT["turn_about_z"])
_SHIFTS = (words.PLOT["shift_along_x"], words.PLOT["shift_along_y"], words.PLOT["shift_along_z"])


def pose_uncertainty(result: HasTables) -> go.Figure:
    """Draw the expanded uncertainty (k = 2) of every lidar's pose, from the calibration."""
    figure = style.panels(2)
    known = [entry for entry in poses_of(result) if entry.get("covariance")]
    if not known:
        return style.note(figure, words.PLOT["this_calibration_states_no_covaria"])
    names = [style.text(entry["id"]) for entry in known]
    sigma = np.array([_sigmas(entry["covariance"]) for entry in known])
    for row, labels in enumerate((_TURNS, _SHIFTS)):
        for k, word in enumerate(labels):
            figure.add_trace(
                go.Bar(
                    x=names,
                    y=2e3 * sigma[:, 3 * row + k],
                    name=word,
                    marker={"color": style.colour(3 * row + k)},
                    hovertemplate="%{y:.3f}<extra>" + word + "</extra>",
                ),
                row=row + 1,
                col=1,
            )
    figure.update_yaxes(title_text=words.PLOT["turn_k_2"], rangemode="tozero", row=1, col=1)
    figure.update_yaxes(title_text=words.PLOT["shift_k_2"], rangemode="tozero", row=2, col=1)
    figure.update_xaxes(title_text=words.PLOT["lidar"], type="category", showgrid=False)
    figure.update_layout(barmode="group", height=480)
    return figure


def _sigmas(covariance: Any) -> list[float]:
    diagonal = np.diag(np.asarray(covariance, dtype=np.float64).reshape(6, 6))
    return [float(value) for value in np.sqrt(np.maximum(diagonal, 0.0))]


def drift(result: HasTables) -> go.Figure:
    """Draw how every lidar moved during the test, table ``poses``."""
    figure = style.panels(2, shared_xaxes=True)
    poses = table(result, "poses").sort("time")
    if poses.is_empty():
        return style.note(figure, words.PLOT["no_pose_was_watched"])
    for k, lidar in enumerate(poses["lidar"].unique().sort()):
        part = poses.filter(pl.col("lidar") == lidar)
        for row, (kind, unit) in enumerate((("r", "mrad"), ("t", "mm")), start=1):
            figure.add_trace(_drift_line(part, kind, unit, k, first=row == 1), row=row, col=1)
    figure.update_yaxes(title_text=words.PLOT["turn"], row=1, col=1)
    figure.update_yaxes(title_text=words.PLOT["shift"], row=2, col=1)
    figure.update_xaxes(title_text=words.PLOT["time"], row=2, col=1)
    figure.update_layout(height=440)
    return figure


def _drift_line(part: pl.DataFrame, kind: str, unit: str, k: int, *, first: bool) -> go.Scatter:
    columns = [f"{kind}{axis}_{unit}" for axis in "xyz"]
    norm = part.select(sum((pl.col(c) ** 2 for c in columns), start=pl.lit(0.0)).sqrt())
    label = style.text(part["lidar"][0])
    return go.Scatter(
        x=part["t_s"],
        y=norm.to_series(),
        mode="lines+markers",
        name=label,
        legendgroup=label,
        showlegend=first,
        line={"color": style.colour(k), "dash": style.dash(k), "width": 1.5},
        marker={"symbol": style.symbol(k), "size": 5},
        hovertemplate="%{x:.1f} s<br>%{y:.3f} " + unit + "<extra>" + label + "</extra>",
    )
