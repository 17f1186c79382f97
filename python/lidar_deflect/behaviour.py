"""How the blade answered the load: slope, linearity, hysteresis, what stayed, creep in a hold.

All of it from the tables of a result, along the direction of the load.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
import numpy.typing as npt
import polars as pl

from lidar_deflect.comparison import measured
from lidar_deflect.steps import SEEN

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

Floats = npt.NDArray[np.float64]

_UNLOADED_PERCENT = 1.0
_SAME_LOAD_PERCENT = 1.5
_LEAST_SPAN_PERCENT = 5.0
_FEWEST_STATES = 8


@dataclass(frozen=True)
class Stiffness:
    """Straight line through the holds of rising load of one section.

    Attributes
    ----------
    slope_m_per_percent, u_slope
        Slope along the load; its standard uncertainty from those of the holds, which are taken as
        fully shared (what errs in one hold errs alike in all); None where none is stated.
    offset_m
        Value of the line without load.
    linearity_percent
        Largest distance of a hold from the line, in percent of the largest deflection.
    hysteresis_m, hysteresis_at_percent
        Unloading minus loading branch where they are farthest apart; None without both.
    residual_m, u_residual_m
        What stayed after unloading, and its standard uncertainty; None without such a hold.
    """

    section: str
    s_m: float
    slope_m_per_percent: float | None
    u_slope: float | None
    offset_m: float | None
    linearity_percent: float | None
    hysteresis_m: float | None
    hysteresis_at_percent: float | None
    residual_m: float | None
    u_residual_m: float | None


@dataclass(frozen=True)
class Creep:
    """Drift along the load over one hold, with the standard uncertainty of its scatter.

    `is_long` is false where sway fills so much of the hold that its scatter cannot be judged.
    """

    step: str
    section: str
    duration_s: float
    drift_m: float
    u_m: float
    is_long: bool

    @property
    def is_beyond(self) -> bool | None:
        """Whether the drift is beyond its expanded uncertainty; None where nobody can tell."""
        return abs(self.drift_m) > 2.0 * self.u_m if self.is_long else None


def direction(config: Mapping[str, Any], steps: pl.DataFrame) -> Floats | None:
    """Return the unit vector of the load: as configured, else of the largest deflection."""
    rows = measured.of_steps(steps)
    return measured.load_direction(config, rows) if rows else None


def along(frame: pl.DataFrame, unit: Floats) -> pl.DataFrame:
    """Add ``along_m`` and ``ualong_m``, the component along a unit vector (axes independent)."""
    value = sum((pl.col(f"d{a}_m") * unit[k] for k, a in enumerate("xyz")), start=pl.lit(0.0))
    square = sum(
        ((pl.col(f"ud{a}_m") * unit[k]) ** 2 for k, a in enumerate("xyz")), start=pl.lit(0.0)
    )
    return frame.with_columns(along_m=value, ualong_m=square.sqrt())


def stiffnesses(steps: pl.DataFrame, deflection: pl.DataFrame, unit: Floats) -> list[Stiffness]:
    """Describe every section that was measured, from the root outward."""
    rows = along(steps, unit).filter(pl.col("along_m").is_not_null()).sort("time")
    states = along(deflection, unit).filter(pl.col("status").cast(pl.String).is_in(SEEN))
    found = []
    for (name, s_m), part in rows.sort("s_m", maintain_order=True).group_by(
        "section", "s_m", maintain_order=True
    ):
        own = states.filter(pl.col("section") == name).sort("time")
        found.append(_stiffness(str(name), float(s_m), part, own))
    return found


def _stiffness(name: str, s_m: float, rows: pl.DataFrame, states: pl.DataFrame) -> Stiffness:
    line = _line(rows)
    lag = _hysteresis(rows, states)
    left, u_left = _residual(rows)
    return Stiffness(name, s_m, *line, *lag, left, u_left)


def _line(rows: pl.DataFrame) -> tuple[float | None, float | None, float | None, float | None]:
    rows = _rising(rows.filter(pl.col("load").is_not_null()))
    load, value = rows["load"].to_numpy(), rows["along_m"].to_numpy()
    if load.size < 2 or np.ptp(load) < _LEAST_SPAN_PERCENT:
        return None, None, None, None
    slope, offset = np.polyfit(load, value, 1)
    off = value - (slope * load + offset)
    full = float(np.max(np.abs(value)))
    linearity = 100.0 * float(np.max(np.abs(off))) / full if full and load.size > 2 else None
    top = rows.row(int(np.argmax(np.abs(load))), named=True)
    u = None if top["ualong_m"] is None else float(top["ualong_m"] / abs(top["load"]))
    return float(slope), u, float(offset), linearity


def _rising(rows: pl.DataFrame) -> pl.DataFrame:
    """Return the holds up to the first of the largest load."""
    if rows.is_empty():
        return rows
    return rows.head((rows["load"].abs().arg_max() or 0) + 1)


def _hysteresis(rows: pl.DataFrame, states: pl.DataFrame) -> tuple[float | None, float | None]:
    """Falling minus rising branch: of holds at one load, else of the states between them."""
    rows = rows.filter(pl.col("load").is_not_null())
    if rows.is_empty():
        return None, None
    top = rows["load"].abs().arg_max() or 0
    pairs = [
        (down["along_m"] - up["along_m"], up["load"])
        for up in rows.head(top).iter_rows(named=True)
        for down in rows.slice(top + 1).iter_rows(named=True)
        if abs(up["load"] - down["load"]) <= _SAME_LOAD_PERCENT
        and abs(up["load"]) > _UNLOADED_PERCENT
    ]
    found = max(pairs, key=lambda pair: abs(pair[0]), default=None)
    return found or _of_branches(states)


def _of_branches(states: pl.DataFrame) -> tuple[float | None, float | None]:
    known = states.filter(pl.col("load").is_not_null(), pl.col("along_m").is_not_null())
    if known.height < _FEWEST_STATES:
        return None, None
    load, value = known["load"].to_numpy(), known["along_m"].to_numpy()
    top = int(np.argmax(np.abs(load)))
    up, down = slice(0, top + 1), slice(top, None)
    low = max(np.min(np.abs(load[up])), np.min(np.abs(load[down])))
    high = float(np.abs(load[top]))
    if min(top, load.size - top) < _FEWEST_STATES or high - low < _LEAST_SPAN_PERCENT:
        return None, None
    at = low + np.linspace(0.2, 0.8, 13) * (high - low)
    gap = _branch(load[down][::-1], value[down][::-1], at) - _branch(load[up], value[up], at)
    worst = int(np.argmax(np.abs(gap)))
    return float(gap[worst]), float(at[worst])


def _branch(load: Floats, value: Floats, at: Floats) -> Floats:
    """Mean deflection near each load of one branch."""
    width = 0.05 * max(float(np.ptp(np.abs(load))), 1.0)
    weight = np.exp(-0.5 * ((np.abs(load)[None, :] - at[:, None]) / width) ** 2)
    means: Floats = weight @ value / np.maximum(weight.sum(axis=1), 1e-300)
    return means


def _residual(rows: pl.DataFrame) -> tuple[float | None, float | None]:
    unloaded = (pl.col("load").abs() < _UNLOADED_PERCENT) | pl.col("step").str.starts_with("0 %")
    idle = rows.filter(unloaded)
    loaded = rows.filter(~unloaded.fill_null(value=False))
    if idle.height < 2 or loaded.is_empty() or idle["time"][-1] < loaded["time"][0]:
        return None, None
    last, u = idle["along_m"][-1], idle["ualong_m"][-1]
    return float(last - idle["along_m"][0]), None if u is None else float(u)


def creep(steps: pl.DataFrame, deflection: pl.DataFrame, unit: Floats) -> list[Creep]:
    """Return the drift of every section over every hold that is long enough to tell."""
    states = along(deflection, unit).filter(
        pl.col("along_m").is_not_null(), pl.col("status").cast(pl.String).is_in(SEEN)
    )
    parts = {key[0]: part.sort("time") for key, part in states.group_by("section")}
    found = []
    for row in steps.sort("from", "s_m").iter_rows(named=True):
        own = parts.get(row["section"], states.clear())
        own = own.filter(pl.col("time").is_between(row["from"], row["to"]))
        drift = _drift(own["t_s"].to_numpy(), own["along_m"].to_numpy())
        if drift is not None:
            found.append(Creep(row["step"], row["section"], *drift))
    return found


def _drift(t_s: Floats, value: Floats) -> tuple[float, float, float, bool] | None:
    """Duration, drift over it, its standard uncertainty (sway counts as correlated noise)."""
    if t_s.size < _FEWEST_STATES or np.ptp(t_s) <= 0.0:
        return None
    t = t_s - t_s.mean()
    slope = float(t @ value / (t @ t))
    off = value - value.mean() - slope * t
    variance = float(off @ off) / (t_s.size - 2)
    lag = float(off[1:] @ off[:-1]) / max(float(off @ off), 1e-300)
    few = t_s.size * (1.0 - min(max(lag, 0.0), 0.95)) / (1.0 + min(max(lag, 0.0), 0.95))
    span = float(np.ptp(t_s))
    u = span * float(np.sqrt(variance / (t @ t) * t_s.size / few))
    return span, slope * span, u, few >= _FEWEST_STATES


def by_section(found: Sequence[Stiffness]) -> dict[str, Stiffness]:
    """Return stiffnesses by the name of their section."""
    return {each.section: each for each in found}
