"""Virtual draw wires: what a wire would have read at the positions that were measured.

A wire measures along its line. Held against the total deflection it disagrees even when both are
right; held against what it would have read, it does not.
"""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
import numpy.typing as npt
import polars as pl

from lidar_deflect.channels import Channel
from lidar_deflect.geometry import read_stations

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

Floats = npt.NDArray[np.float64]

SUFFIX = " (by lidar)"
"""Ends the name of the channel that holds what a wire would have read."""

_AXES = ("x", "y", "z")


@dataclass(frozen=True, eq=False)
class Line:
    """A wire's line: its winch end, its section, and where on that section it is tied.

    Attributes
    ----------
    anchor_m
        Winch or sensor end, world frame, shape (3,).
    offset_m
        From the mid-chord point to the tie in the unloaded state, world axes, shape (3,).
    """

    name: str
    section: str
    anchor_m: Floats
    offset_m: Floats


def lines(config: Mapping[str, Any]) -> list[Line]:
    """Return the lines of ``[[wires]]``, real and virtual.

    One that is tied beside the mid-chord point is left out where the drawing does not tell where
    its leading edge points, and for the edges how long the chord is.

    Parameters
    ----------
    config
        Configuration as a mapping.
    """
    found = []
    for wire in config.get("wires") or ():
        offset = _offset(wire, config)
        if offset is not None and wire.get("anchor_m"):
            anchor = np.asarray(wire["anchor_m"], dtype=np.float64)
            found.append(Line(wire["name"], wire["section"], anchor, offset))
    return found


def _offset(wire: Mapping[str, Any], config: Mapping[str, Any]) -> Floats | None:
    attach = wire.get("attach", "mid_chord")
    if attach == "mid_chord":
        return np.zeros(3)
    blade = config.get("blade") or {}
    edge, suction = blade.get("leading_edge"), blade.get("suction_side")
    if edge is None or (suction is None and not isinstance(attach, str)):
        return None
    places = {each["name"]: each["s_m"] for each in config.get("sections") or ()}
    chord_m, twist = _station(blade.get("geometry"), blade, places.get(wire["section"], 0.0))
    chordwise, thickness = (
        {"leading_edge": (-0.5 * chord_m, 0.0), "trailing_edge": (0.5 * chord_m, 0.0)}[attach]
        if isinstance(attach, str)
        else (float(attach[0]), float(attach[1]))
    )
    if not np.isfinite(chordwise):
        return None
    side = np.zeros(3) if suction is None else unit_vector(suction)
    return _turned(unit_vector(edge), side, twist, chordwise, thickness)


def _station(path: str | Path | None, blade: Mapping[str, Any], s_m: float) -> tuple[float, float]:
    """Chord in metres (NaN where no drawing tells) and twist in radians at an arc length."""
    if path is None:
        return float("nan"), 0.0
    stations = read_stations(Path(path), float(blade["length_m"]))
    chord = float(np.interp(s_m, stations.s_m, stations.chord_m))
    return chord, float(np.interp(s_m, stations.s_m, stations.twist_rad))


def _turned(edge: Floats, side: Floats, twist: float, chordwise: float, thickness: float) -> Floats:
    """Offset in the world: chordwise towards the trailing edge, thickness towards suction."""
    trailing = -np.cos(twist) * edge + np.sin(twist) * side
    across = np.cos(twist) * side + np.sin(twist) * edge
    offset: Floats = chordwise * trailing + thickness * across
    return offset


def unit_vector(given: str | Sequence[float]) -> Floats:
    """Turn a world axis such as ``-x``, or a vector, into a unit vector."""
    if isinstance(given, str):
        axis = np.zeros(3)
        axis[_AXES.index(given[-1])] = -1.0 if given.startswith("-") else 1.0
        return axis
    vector = np.asarray(given, dtype=np.float64)
    return vector / max(float(np.linalg.norm(vector)), 1e-300)


def reading(
    line: Line, place_m: Floats, deflection_m: Floats, turn: Floats | None = None
) -> Floats:
    """Return what a wire would have read, positive where it became shorter, shape (n,).

    Parameters
    ----------
    place_m, deflection_m
        Mid-chord point and its deflection, world frame, shape (n, 3).
    turn
        Rotations of the section since the reference, shape (n, 3, 3); needed where the wire is
        tied beside the mid-chord point.
    """
    loaded, unloaded = spans(line, place_m, deflection_m, turn)
    shortening: Floats = np.linalg.norm(unloaded, axis=-1) - np.linalg.norm(loaded, axis=-1)
    return shortening


def spans(
    line: Line, place_m: Floats, deflection_m: Floats, turn: Floats | None = None
) -> tuple[Floats, Floats]:
    """Return the vectors from anchor to tie, loaded and unloaded, shape (n, 3) each."""
    tied = line.offset_m if turn is None else turn @ line.offset_m
    return (
        place_m + tied - line.anchor_m,
        place_m - deflection_m + line.offset_m - line.anchor_m,
    )


def turns(frame: pl.DataFrame, section: str) -> Floats:
    """Return the rotation of a section since the reference at every instant, shape (n, 3, 3).

    The smallest rotation from the unloaded to the loaded tangent, then the twist change about the
    latter. Tangents are differences between neighbouring sections, the clamped root among them.

    Parameters
    ----------
    frame
        Table ``deflection`` or ``steps``.
    """
    order = frame.select("section", "s_m").unique().sort("s_m")
    names = [name for name, s_m in order.rows() if s_m > 0.0]
    arc = np.array([0.0, *(s_m for _, s_m in order.rows() if s_m > 0.0)])
    loaded, moved = (_stack(frame, names, pattern) for pattern in ("{}_m", "d{}_m"))
    index = names.index(section) + 1
    before, after = (_tangents(points, arc)[:, index] for points in (loaded - moved, loaded))
    twist = frame.filter(pl.col("section") == section).sort("time")["twist_deg"]
    angle = np.radians(twist.cast(pl.Float64).fill_null(0.0).to_numpy())
    return _about(after, angle) @ _smallest(before, after)


def _stack(frame: pl.DataFrame, names: Sequence[str], pattern: str) -> Floats:
    """Points of the root and of every section over time, shape (n, sections + 1, 3)."""
    parts = [
        frame.filter(pl.col("section") == name)
        .sort("time")
        .select(pl.col(pattern.format(axis)).cast(pl.Float64) for axis in _AXES)
        .to_numpy()
        for name in names
    ]
    return np.stack([np.zeros_like(parts[0]), *parts], axis=1)


def _tangents(points: Floats, arc: Floats) -> Floats:
    order: Any = 2 if arc.size > 2 else 1
    slope = np.gradient(points, arc, axis=1, edge_order=order)
    tangents: Floats = slope / np.linalg.norm(slope, axis=-1, keepdims=True)
    return tangents


def _smallest(before: Floats, after: Floats) -> Floats:
    """Smallest rotations that take one unit vector onto another, shape (n, 3, 3)."""
    cross = np.cross(before, after)
    cosine = np.sum(before * after, axis=-1)[:, None, None]
    skew = _skew(cross)
    rotation: Floats = np.eye(3) + skew + skew @ skew / (1.0 + cosine)
    return rotation


def _about(axis: Floats, angle: Floats) -> Floats:
    """Rotations about unit vectors, shape (n, 3, 3)."""
    skew, angle = _skew(axis), angle[:, None, None]
    rotation: Floats = np.eye(3) + np.sin(angle) * skew + (1.0 - np.cos(angle)) * skew @ skew
    return rotation


def _skew(vectors: Floats) -> Floats:
    x, y, z = np.moveaxis(vectors, -1, 0)
    zero = np.zeros_like(x)
    rows: Floats = np.stack([zero, -z, y, z, zero, -x, -y, x, zero], axis=-1)
    return rows.reshape(*vectors.shape[:-1], 3, 3)


def predicted(deflection: pl.DataFrame, config: Mapping[str, Any]) -> tuple[Channel, ...]:
    """Return what every wire would have read over the test, as channels in metres."""
    known = set(deflection["section"].unique())
    return tuple(_predicted(deflection, line) for line in lines(config) if line.section in known)


def _predicted(deflection: pl.DataFrame, line: Line) -> Channel:
    own = deflection.filter(pl.col("section") == line.section).sort("time")
    place, moved = (
        own.select(pl.col(p.format(a)).cast(pl.Float64) for a in _AXES).to_numpy()
        for p in ("{}_m", "d{}_m")
    )
    turn = turns(deflection, line.section) if line.offset_m.any() else None
    times = own["time"].cast(pl.Int64).to_numpy()
    return Channel(line.name + SUFFIX, times, reading(line, place, moved, turn), "m")
