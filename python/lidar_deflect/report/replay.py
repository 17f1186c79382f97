"""What the replay shows: sections, blade line and echoes over time, packed small."""

from __future__ import annotations

import base64
from typing import TYPE_CHECKING, Any

import numpy as np
import numpy.typing as npt
import polars as pl

from lidar_deflect.plots import style
from lidar_deflect.plots.places import lidar_places
from lidar_deflect.plots.source import sections, some

if TYPE_CHECKING:
    from lidar_deflect.folder import Folder

Floats = npt.NDArray[np.float64]

_MOST_FRAMES = 600
_MOST_SECTIONS = 40
_MOST_STATIONS = 60
_MOST_POINTS = 80_000
_FEWEST_ECHOES = 250
_SHORTEST_S = 0.1


def data(folder: Folder) -> dict[str, Any] | None:
    """Return everything that the replay needs, or None where no state has a position."""
    states = folder.deflection.drop_nulls(["x_m", "y_m", "z_m"])
    if states.is_empty():
        return None
    shown = some(sections(states), _MOST_SECTIONS)
    frames = _frames(folder.deflection)
    marks = _marks(folder.deflection, frames, shown)
    rest = _rest(folder, shown)
    moved = np.nan_to_num(np.linalg.norm(marks - rest, axis=-1), nan=-1.0).max(axis=1)
    held = frames["step"].is_not_null().to_numpy()
    return {
        "first": int(np.argmax(moved >= 0.0)),
        "largest": int(np.argmax(np.where(held, moved, -2.0) if held.any() else moved)),
        "time": _packed(frames["t_s"].to_numpy()),
        "steps": _labels(frames),
        "sections": [{"name": name, "s_m": s_m} for name, s_m in shown],
        "marks": _packed(marks),
        "rest": _packed(rest),
        "lines": _lines(folder),
        "clouds": _clouds(folder.points),
        "lidars": [{"name": n, "at": at} for n, at in lidar_places(folder).items()],
        "wires": [
            {"name": each["name"], "section": each.get("section"), "at": list(each["anchor_m"])}
            for each in folder.config.get("wires") or ()
            if each.get("anchor_m")
        ],
        "colours": list(style.COLOURS),
    }


def _frames(deflection: pl.DataFrame) -> pl.DataFrame:
    """Return the instants to show: evenly spread, at most so many."""
    frames = deflection.select("time", "t_s", "step").unique("time").sort("time")
    every = -(-frames.height // _MOST_FRAMES)
    return frames.gather_every(every)


def _labels(frames: pl.DataFrame) -> dict[str, Any]:
    """Return names of steps and which of them each frame belongs to; -1 between holds."""
    names = frames["step"].drop_nulls().unique(maintain_order=True).to_list()
    index = {name: k for k, name in enumerate(names)}
    return {"names": names, "of": [index.get(step, -1) for step in frames["step"]]}


def _marks(
    deflection: pl.DataFrame, frames: pl.DataFrame, shown: list[tuple[str, float]]
) -> Floats:
    """Positions of the sections in every frame, shape (frames, sections, 3), NaN: not measured."""
    parts = []
    for name, _ in shown:
        own = deflection.filter(pl.col("section") == name).select("time", "x_m", "y_m", "z_m")
        joined = frames.select("time").join(own, on="time", how="left", maintain_order="left")
        parts.append(joined.select("x_m", "y_m", "z_m").cast(pl.Float64).to_numpy())
    return np.stack(parts, axis=1)


def _rest(folder: Folder, shown: list[tuple[str, float]]) -> Floats:
    """Unloaded positions of the sections, shape (sections, 3)."""
    known = folder.deflection.drop_nulls(["x_m", "dx_m"])
    parts = []
    for name, _ in shown:
        own = known.filter(pl.col("section") == name)
        at = own.select(pl.col(f"{a}_m") - pl.col(f"d{a}_m") for a in "xyz").median()
        parts.append(at.cast(pl.Float64).to_numpy()[0] if own.height else np.full(3, np.nan))
    return np.stack(parts)


def _lines(folder: Folder) -> dict[str, Any] | None:
    """Blade lines: seconds, points of shape (lines, stations, 3), and which is the unloaded one."""
    known = folder.contour.drop_nulls(["x_m", "y_m", "z_m"]).sort("time", "s_m")
    if known.is_empty():
        return None
    kept = some(known["t_s"].unique().sort().to_list(), _MOST_FRAMES)
    found = np.full((len(kept), _MOST_STATIONS, 3), np.nan)
    parts = {t[0]: part for t, part in known.group_by("t_s")}
    for k, t_s in enumerate(kept):
        points = parts[t_s].select("x_m", "y_m", "z_m").to_numpy()
        picks = some(range(len(points)), _MOST_STATIONS)
        found[k, : len(picks)] = points[picks]
    idle = folder.steps.sort("from")["t_s"]
    at = float(idle[0]) if len(idle) else kept[0]
    rest = int(np.argmin(np.abs(np.array(kept) - at)))
    times = _packed(np.array(kept))
    return {"time": times, "points": _packed(found), "count": _MOST_STATIONS, "rest": rest}


def _clouds(points: pl.DataFrame) -> dict[str, Any] | None:
    """Echoes by frame: seconds, first index of each, points, lidar, residual in millimetres."""
    if points.is_empty():
        return None
    points = points.sort("time", maintain_order=True)
    points = points.gather_every(-(-points.height // _MOST_POINTS))
    times, first = np.unique(_framed(points["t_s"].to_numpy()), return_index=True)
    lidars = points["lidar"].unique().sort().to_list()
    index = {name: k for k, name in enumerate(lidars)}
    residual = 1e3 * points["residual_m"].cast(pl.Float64).fill_null(float("nan")).to_numpy()
    return {
        "time": _packed(times),
        "first": [int(value) for value in first] + [points.height],
        "points": _packed(points.select("x_m", "y_m", "z_m").to_numpy()),
        "lidar": _packed(np.array([index[name] for name in points["lidar"]])),
        "residual": _packed(residual) if np.isfinite(residual).any() else None,
        "lidars": lidars,
    }


def _framed(t_s: Floats) -> Floats:
    """Return the frame of each echo: its own time, or a stretch of time where each has its own."""
    if np.unique(t_s).size <= max(_MOST_FRAMES, t_s.size // _FEWEST_ECHOES):
        return t_s
    width = max(_SHORTEST_S, float(np.ptp(t_s)) * _FEWEST_ECHOES / t_s.size)
    framed: Floats = (np.floor(t_s / width) + 0.5) * width
    return framed


def _packed(values: npt.NDArray[Any]) -> str:
    """Numbers as base64 of little-endian f32, in the order of rows."""
    return base64.b64encode(np.ascontiguousarray(values, dtype="<f4").tobytes()).decode("ascii")
