"""What watching the lidars gave, as table, sentences and facts."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from lidar_deflect import tables
from lidar_deflect.drift.change import step_between

if TYPE_CHECKING:
    from collections.abc import Iterator, Mapping, Sequence

    import polars as pl
    from numpy.typing import NDArray

    from lidar_deflect.drift.move import Move
    from lidar_deflect.drift.standing import Seen

    Floats = NDArray[np.float64]

_PARTS = (("turn_mrad", 0), ("shift_mm", 3))


@dataclass(frozen=True)
class Told:
    """Table `poses`, sentences, facts; lidars and spans in which they stood elsewhere."""

    table: pl.DataFrame
    warnings: tuple[str, ...]
    facts: dict[str, Any]
    unsure: tuple[tuple[str | None, int, int], ...]


def told(
    windows: Sequence[Seen],
    moves: Sequence[Move],
    calibrated: Mapping[str, Floats],
    span_ns: tuple[int, int],
    *,
    follows: bool,
) -> Told:
    """Tell of windows and moves; `calibrated` poses go by lidar, the span is that of the test."""
    first_ns, stop_ns = span_ns
    ordered = sorted(windows, key=lambda each: (each.start_ns, each.lidar))
    lidars = dict.fromkeys(window.lidar for window in ordered)
    facts = []
    unsure: list[tuple[str | None, int, int]] = []
    for lidar in sorted(lidars):
        own = [window for window in ordered if window.lidar == lidar]
        mine = sorted((m for m in moves if m.lidar == lidar), key=lambda m: m.from_ns)
        ends = [move.left_ns for move in mine[1:]] + [stop_ns]
        for move, end_ns in zip(mine, ends, strict=False):
            facts.append(_fact(move, calibrated[lidar], end_ns, first_ns, follows=follows))
            span = (None, move.left_ns, move.from_ns) if follows else (lidar, move.left_ns, end_ns)
            unsure.append(span)
        loose = list(_loose(own))
        unsure += [(lidar, window.start_ns, window.stop_ns) for window in loose]
        facts += [_passing(window, first_ns) for window in loose]
    facts.sort(key=lambda fact: (fact["lidar"], fact["at_s"]))
    return Told(
        _table(ordered, moves, first_ns, follows=follows),
        tuple(_said(fact) for fact in facts),
        {"moved": facts, "followed": follows and bool(moves)},
        tuple(unsure),
    )


def _loose(own: Sequence[Seen]) -> Iterator[Seen]:
    """Windows that show a lidar elsewhere, though it was back in the next one."""
    return (window for window in own if window.stay < 0 and window.change.moved)


def _fact(
    move: Move, calibrated: Floats, end_ns: int, first_ns: int, *, follows: bool
) -> dict[str, Any]:
    at_ns = (move.left_ns + move.from_ns) // 2
    step = step_between(calibrated, move.world_from_sensor)
    return {
        "lidar": move.lidar,
        "at_s": round((at_ns - first_ns) * 1e-9, 2),
        "at_within_s": round((move.from_ns - move.left_ns) * 0.5e-9, 2),
        "until_s": round((end_ns - first_ns) * 1e-9, 1),
        "followed": follows,
        **_values(step, move.covariance),
    }


def _passing(window: Seen, first_ns: int) -> dict[str, Any]:
    half_ns = (window.stop_ns - window.start_ns) // 2
    return {
        "lidar": window.lidar,
        "at_s": round((window.start_ns + half_ns - first_ns) * 1e-9, 2),
        "at_within_s": round(half_ns * 1e-9, 2),
        "until_s": round((window.stop_ns - first_ns) * 1e-9, 1),
        "followed": False,
        **_values(window.change.step, window.change.covariance),
    }


def _values(step: Floats, covariance: Floats) -> dict[str, Any]:
    sigma = np.sqrt(np.diag(covariance))
    return {
        "turn_mrad": [round(1e3 * float(value), 3) for value in step[:3]],
        "shift_mm": [round(1e3 * float(value), 2) for value in step[3:]],
        "u": [round(1e3 * float(value), 3) for value in sigma],
    }


def _table(
    seen: Sequence[Seen], moves: Sequence[Move], first_ns: int, *, follows: bool
) -> pl.DataFrame:
    middle_ns = np.array([(each.start_ns + each.stop_ns) // 2 for each in seen], dtype=np.int64)
    step = np.array([each.change.step for each in seen]).reshape(-1, 6) * 1e3
    variances = [np.diag(each.change.covariance) for each in seen]
    u = np.sqrt(np.array(variances).reshape(-1, 6)) * 1e3
    names = [f"{kind}{axis}" for kind in "rt" for axis in "xyz"]
    units = ["mrad"] * 3 + ["mm"] * 3
    come = {(move.lidar, move.from_ns) for move in moves} if follows else set()
    columns: dict[str, Any] = {
        "time": middle_ns,
        "t_s": (middle_ns - first_ns) * 1e-9,
        "lidar": [each.lidar for each in seen],
        "moved": [each.change.moved for each in seen],
        "followed": [
            any(lidar == each.lidar and ns <= middle for lidar, ns in come)
            for each, middle in zip(seen, middle_ns, strict=True)
        ],
    }
    for k, (name, unit) in enumerate(zip(names, units, strict=True)):
        columns[f"{name}_{unit}"], columns[f"u{name}_{unit}"] = step[:, k], u[:, k]
    return tables.build("poses", columns)


def _said(fact: Mapping[str, Any]) -> str:
    turn, shift = (_along(fact[name], fact["u"][k:]) for name, k in _PARTS)
    then = (
        "from then on it is measured from there"
        if fact["followed"]
        else ("what it measured then is not corrected for it")
    )
    return (
        f"lidar {fact['lidar']} moved at about {fact['at_s']:.1f} s: until {fact['until_s']:.1f} s "
        f"its static surfaces show a turn of {turn} mrad and a shift of {shift} mm since the "
        f"reference (world axes, k = 2); {then}"
    )


def _along(values: Sequence[float], u: Sequence[float]) -> str:
    axes = zip("xyz", values, u, strict=False)
    return ", ".join(f"{axis} {value:+.2f} ± {2 * own:.2f}" for axis, value, own in axes)
