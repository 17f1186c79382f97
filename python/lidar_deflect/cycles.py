"""Cycles of a fatigue test: amplitude, mean, phase and frequency, of each and of all; damping.

All of it from the table `deflection`. Cycles are counted by the phase of the section that moves
most, along the direction in which it does; every section and axis is then fitted cycle by cycle.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from itertools import pairwise
from typing import TYPE_CHECKING, Any

import numpy as np
import numpy.typing as npt
import polars as pl

from lidar_deflect import swing, tables

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    Floats = npt.NDArray[np.float64]

LEAST_SHARE = 0.02
"""A cycle counts from this share of the largest amplitude on ..."""
LEAST_M = 0.012
"""... if it is at least so large."""
STEADY_WITHIN = 0.05
"""Cycles within this share of the usual amplitude make up the steady part ..."""
LONG_RUN = 5
"""... without its first and last one where there are so many."""
CLEAN_TURNS = 1.5
"""So long after it begins, the phase of a swing is no longer mixed with rest."""
FEWEST_STATES = 6
"""States in a cycle below which it cannot be told."""
DECAY_CYCLES = 4
"""A decay lasts at least so many cycles ..."""
DECAY_SHARE = 0.8
"""... and falls below this share of its first one."""


@dataclass(frozen=True)
class Found:
    """Cycles of a test.

    Attributes
    ----------
    table
        Table ``cycles``.
    facts
        Of the whole, for run.json: direction, count, turns, frequency, sections, decays.
    warnings
        Sentences for the user.
    """

    table: pl.DataFrame
    facts: Mapping[str, Any]
    warnings: tuple[str, ...]


@dataclass(frozen=True)
class _Series:
    """States of all sections at moments of which every one is known."""

    time_ns: npt.NDArray[np.int64]
    t_s: Floats
    names: Sequence[str]
    s_m: Floats
    xyz_m: Floats
    u_m: Floats


def find(deflection: pl.DataFrame) -> Found:
    """Find the cycles in a table of states.

    Parameters
    ----------
    deflection
        Table ``deflection``.
    """
    series = _series(deflection)
    if series is None or len(series.t_s) < 3 * FEWEST_STATES:
        return _nothing("too few states were measured to find cycles")
    outer = int(np.argmax(np.ptp(series.xyz_m, axis=0).max(axis=1)))
    moving = series.xyz_m[:, outer]
    along = swing.main_direction(moving)
    value = moving @ along
    coarse = swing.coarse_hz(series.t_s, value - value.mean())
    rate = 1.0 / float(np.median(np.diff(series.t_s)))
    if coarse is None or float(np.std(value)) < np.sqrt(0.5) * LEAST_M:
        return _nothing("the blade does not swing")
    if rate < FEWEST_STATES * coarse:
        return _nothing(
            f"{rate:g} states per second are too few for a swing of {coarse:.2f} Hz: "
            f"set rate_hz under [measure] to {FEWEST_STATES * coarse:.0f} or more"
        )
    phase, amplitude = swing.phase_rad(series.t_s, value, coarse)
    spans = _spans(series.t_s, value, phase, amplitude)
    if not spans:
        return _nothing("no whole cycle was found")
    return _found(series, outer, along, phase, spans)


def text(facts: Mapping[str, Any]) -> str:
    """Give the whole of a fatigue test as lines for people."""
    if not facts.get("sections"):
        return "no cycles"
    lines = [
        f"{facts['count']} cycles, {facts['steady']} of them steady, at "
        f"{facts['frequency_hz']:.5f} Hz (u {facts['ufrequency_hz']:.5f} Hz)",
        "section   s (m)  amplitude x, y, z (m)        u (m)  mean x, y, z (m)",
    ]
    for own in facts["sections"]:
        size, mean = ("".join(f"{v:9.4f}" for v in own[k]) for k in ("amplitude_m", "mean_m"))
        u = max(own["uamplitude_m"])
        lines.append(f"{own['section']:8} {own['s_m']:6g} {size}  {u:7.4f} {mean}")
    lines += [
        f"decay from {decay['from_s']:.1f} s to {decay['to_s']:.1f} s: damping ratio "
        f"{100.0 * decay['damping_ratio']:.3f} % (u {100.0 * decay['udamping_ratio']:.3f} %)"
        for decay in facts["decays"]
    ]
    return "\n".join(lines)


def _nothing(why: str) -> Found:
    return Found(tables.empty("cycles"), {"count": 0}, (f"no cycles: {why}",))


def _series(deflection: pl.DataFrame) -> _Series | None:
    """Put states into arrays; moments at which a section is missing are left out."""
    wide = deflection.filter(pl.col("x_m").is_not_null())
    sections = deflection.select("section", "s_m").unique(maintain_order=True).rows()
    whole = wide.group_by("time").len().filter(pl.col("len") == len(sections))["time"]
    wide = wide.filter(pl.col("time").is_in(whole.implode())).sort("time", maintain_order=True)
    if wide.is_empty():
        return None
    shape = (-1, len(sections), 3)
    first = wide.filter(pl.col("section") == sections[0][0])
    return _Series(
        first["time"].cast(pl.Int64).to_numpy(),
        first["t_s"].to_numpy(),
        [str(name) for name, _ in sections],
        np.array([s_m for _, s_m in sections], dtype=np.float64),
        wide.select("x_m", "y_m", "z_m").to_numpy().reshape(shape),
        wide.select("ux_m", "uy_m", "uz_m").fill_null(0.0).to_numpy().reshape(shape),
    )


def _spans(
    t_s: Floats, value: Floats, phase: Floats, amplitude: Floats
) -> list[tuple[float, float]]:
    """Start and end of every whole cycle that is large enough, seconds."""
    least = max(LEAST_SHARE * float(np.nanpercentile(amplitude, 95.0)), LEAST_M)
    swings = np.flatnonzero(np.nan_to_num(amplitude) >= least)
    if swings.size < FEWEST_STATES:
        return []
    own = slice(swings[0], swings[-1] + 1)
    known = ~np.isnan(phase[own])
    time, turns = t_s[own][known], phase[own][known] / (2.0 * np.pi)
    time, turns = _from_its_start(time, np.maximum.accumulate(turns), t_s)
    whole = np.arange(np.ceil(turns[0] - 1e-3), np.floor(turns[-1] + 1e-6) + 0.5)
    at = np.interp(whole, turns, time)
    spans = [(float(a), float(b)) for a, b in pairwise(at) if b > a]
    return [span for span in spans if _ptp(t_s, value, span) >= 2.0 * least]


def _from_its_start(time: Floats, turns: Floats, t_s: Floats) -> tuple[Floats, Floats]:
    """Carry the turns back to the first state, at the pace of the first cycles that are clean.

    Within a period of where a swing begins, its phase is mixed with rest.
    """
    pace = (turns[-1] - turns[0]) / (time[-1] - time[0])
    clean = time >= time[0] + CLEAN_TURNS / pace
    if clean.sum() < FEWEST_STATES or time[0] <= t_s[0] + 1.0 / pace:
        return time, turns
    time, turns = time[clean], turns[clean]
    pace = float(np.interp(time[0] + 2.0 / pace, time, turns) - turns[0]) / (2.0 / pace)
    back = turns[0] - pace * (time[0] - t_s[0])
    return np.concatenate([[t_s[0]], time]), np.concatenate([[back], turns])


def _ptp(t_s: Floats, value: Floats, span: tuple[float, float]) -> float:
    inside = (t_s >= span[0]) & (t_s <= span[1])
    return float(np.ptp(value[inside])) if inside.any() else 0.0


def _found(
    series: _Series,
    outer: int,
    along: Floats,
    phase: Floats,
    spans: list[tuple[float, float]],
) -> Found:
    rows, cycles = [], []
    for number, (start, stop) in enumerate(spans):
        fitted = _cycle(series, phase, start, stop)
        if fitted is not None:
            cycles.append((number, start, stop, fitted))
            rows.append(_rows(series, number, start, stop, fitted))
    if not rows:
        return _nothing("no cycle has enough states")
    size = np.array([_along(each[3], outer, along) for each in cycles])
    steady = _steady(size)
    facts = _whole(series, outer, along, phase, cycles, steady)
    facts |= {"decays": _decays(cycles, size)}
    left = len(spans) - len(cycles)
    warnings = (f"{left} cycles have too few states and were left out",) if left else ()
    facts |= {"count": len(spans), "left_out": left}
    return Found(pl.concat(rows), facts, warnings)


def _steady(size: Floats) -> npt.NDArray[np.bool_]:
    """Mark the longest run of cycles near the usual amplitude, less its ends where it is long.

    Those border on growth, decay or the end of the capture.
    """
    usual = np.median(size[size >= np.median(size)])
    near = np.abs(size / usual - 1.0) <= STEADY_WITHIN
    ends = np.flatnonzero(np.diff(np.concatenate([[0], near.astype(int), [0]])))
    start, stop = max(zip(ends[::2], ends[1::2], strict=True), key=lambda run: run[1] - run[0])
    trim = 1 if stop - start >= LONG_RUN else 0
    found = np.zeros(len(size), dtype=bool)
    found[start + trim : stop - trim] = True
    return found


def _cycle(series: _Series, phase: Floats, start: float, stop: float) -> swing.Wave | None:
    """Fit one cycle of all sections and axes."""
    inside = (series.t_s >= start - 1e-9) & (series.t_s < stop - 1e-9) & ~np.isnan(phase)
    if inside.sum() < FEWEST_STATES:
        return None
    angle = 2.0 * np.pi * (series.t_s[inside] - start) / (stop - start)
    fitted = swing.wave(angle, series.xyz_m[inside].reshape(inside.sum(), -1))
    return _with_shared(fitted, series.u_m[inside].mean(axis=0).ravel())


def _with_shared(fitted: swing.Wave, u_state_m: Floats) -> swing.Wave:
    """Add what all states of a cycle share.

    The mean errs as a state does. The amplitude is half of crest minus trough: as if both erred
    independently, which is an upper bound, as much of it cancels.
    """
    return replace(
        fitted,
        u_mean=np.hypot(fitted.u_mean, u_state_m),
        u_amplitude=np.hypot(fitted.u_amplitude, u_state_m / np.sqrt(2.0)),
    )


def _along(fitted: swing.Wave, outer: int, along: Floats) -> float:
    """Amplitude of the outermost section along the main direction."""
    own = slice(3 * outer, 3 * outer + 3)
    part = fitted.amplitude[own] * np.exp(1j * fitted.phase_rad[own])
    return float(abs(part @ along))


def _rows(
    series: _Series, number: int, start: float, stop: float, fitted: swing.Wave
) -> pl.DataFrame:
    count = len(series.names)
    middle_ns = series.time_ns[0] + round((0.5 * (start + stop) - series.t_s[0]) * 1e9)
    frequency = 1.0 / (stop - start)
    u_turn = float(np.min(fitted.u_phase_rad)) / (2.0 * np.pi)
    columns: dict[str, tables.Values] = {
        "time": [middle_ns] * count,
        "t_s": [0.5 * (start + stop)] * count,
        "section": list(series.names),
        "s_m": series.s_m,
        "cycle": [number] * count,
        "frequency_hz": [frequency] * count,
        "ufrequency_hz": [frequency * np.sqrt(2.0) * u_turn] * count,
    }
    named = {
        "amplitude_{}_m": fitted.amplitude,
        "uamplitude_{}_m": fitted.u_amplitude,
        "mean_{}_m": fitted.mean,
        "umean_{}_m": fitted.u_mean,
        "phase_{}_deg": np.degrees(fitted.phase_rad),
        "uphase_{}_deg": np.degrees(fitted.u_phase_rad),
    }
    for name, values in named.items():
        parts = values.reshape(count, 3)
        columns |= {name.format(axis): parts[:, i] for i, axis in enumerate("xyz")}
    return tables.build("cycles", columns)


def _whole(
    series: _Series,
    outer: int,
    along: Floats,
    phase: Floats,
    cycles: list[tuple[int, float, float, swing.Wave]],
    steady: npt.NDArray[np.bool_],
) -> dict[str, Any]:
    """Fit the steady part at once: one frequency, and amplitude, mean and phase of all sections."""
    places = np.flatnonzero(steady)
    start, stop = cycles[places[0]][1], cycles[places[-1]][2]
    inside = (series.t_s >= start) & (series.t_s <= stop)
    t_s, xyz = series.t_s[inside], series.xyz_m[inside]
    mean_hz = (places[-1] - places[0] + 1) / (stop - start)
    frequency, u_frequency = swing.refined_hz(t_s, xyz[:, outer] @ along, mean_hz)
    angle = 2.0 * np.pi * frequency * (t_s - start)
    fitted = _with_shared(
        swing.wave(angle, xyz.reshape(len(t_s), -1)),
        series.u_m[inside].mean(axis=0).ravel(),
    )
    main = swing.wave(angle, (xyz[:, outer] @ along)[:, None]).phase_rad[0]
    turned = np.angle(np.exp(1j * (fitted.phase_rad - main)))
    known = ~np.isnan(phase)
    ends = np.interp([start, stop], series.t_s[known], phase[known]) / (2.0 * np.pi)

    def of(values: Floats, section: int) -> list[float]:
        return [float(value) for value in values.reshape(-1, 3)[section]]

    return {
        "direction": along.tolist(),
        "section": series.names[outer],
        "steady": len(places),
        "steady_from_s": start,
        "steady_to_s": stop,
        "steady_turns": float(ends[1] - ends[0]),
        "frequency_hz": frequency,
        "ufrequency_hz": u_frequency,
        "sections": [
            {
                "section": name,
                "s_m": float(series.s_m[k]),
                "amplitude_m": of(fitted.amplitude, k),
                "uamplitude_m": of(fitted.u_amplitude, k),
                "mean_m": of(fitted.mean, k),
                "umean_m": of(fitted.u_mean, k),
                "phase_deg": of(np.degrees(turned), k),
                "uphase_deg": of(np.degrees(fitted.u_phase_rad), k),
            }
            for k, name in enumerate(series.names)
        ],
    }


def _decays(
    cycles: list[tuple[int, float, float, swing.Wave]], size: Floats
) -> list[dict[str, Any]]:
    """Logarithmic decrement wherever the blade was let go: amplitudes that only fall."""
    found = []
    falls = [
        bool(b < a * (1.0 - 1e-3)) and cycles[k + 1][0] == cycles[k][0] + 1
        for k, (a, b) in enumerate(pairwise(size))
    ]
    start = 0
    for place in range(len(size)):
        if place < len(falls) and falls[place]:
            continue
        if place - start + 1 >= DECAY_CYCLES and size[place] < DECAY_SHARE * size[start]:
            found.append(_decay(cycles[start : place + 1], size[start : place + 1]))
        start = place + 1
    return found


def _decay(cycles: list[tuple[int, float, float, swing.Wave]], size: Floats) -> dict[str, Any]:
    number = np.arange(len(size), dtype=np.float64)
    basis = np.column_stack([np.ones_like(number), -number])
    parts = np.linalg.lstsq(basis, np.log(size), rcond=None)[0]
    off = np.log(size) - basis @ parts
    freedom = max(len(size) - 2, 1)
    spread = float(np.sqrt(np.linalg.inv(basis.T @ basis)[1, 1] * (off @ off) / freedom))
    decrement = float(parts[1])
    return {
        "from_s": cycles[0][1],
        "to_s": cycles[-1][2],
        "cycles": len(size),
        "frequency_hz": len(size) / (cycles[-1][2] - cycles[0][1]),
        "decrement": decrement,
        "udecrement": spread,
        "damping_ratio": decrement / float(np.hypot(2.0 * np.pi, decrement)),
        "udamping_ratio": spread / (2.0 * np.pi),
    }
