"""Measured against true: errors, and how many sigmas they are."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np
import polars as pl

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from lidar_deflect.result import Result

AXES = ("x", "y", "z")
WIDE_CHORD_M = 1.0
"""Twist is judged where the chord is over this."""


class Truth:
    """What the simulator knows of every section."""

    def __init__(self, table: pl.DataFrame) -> None:
        self._parts = {
            float(rows["s_m"][0]): rows.sort("time") for rows in table.partition_by("s_m")
        }

    def section(self, s_m: float) -> pl.DataFrame:
        """Rows of the section next to `s_m`."""
        return self._parts[min(self._parts, key=lambda known: abs(known - s_m))]

    def mean(self, s_m: float, from_: Any, to: Any) -> tuple[NDArray[np.float64], float]:
        """Mean position, metres, and twist, degrees, between two instants."""
        rows = self.section(s_m).filter(pl.col("time").is_between(from_, to))
        xyz = rows.select("x_m", "y_m", "z_m").to_numpy().mean(axis=0)
        return xyz, float(rows["twist_deg"].mean() or 0.0)  # type: ignore[arg-type]

    def at(self, s_m: float, time: pl.Series) -> NDArray[np.float64]:
        """Positions at instants, metres."""
        rows = self.section(s_m)
        known = rows["time"].cast(pl.Int64).to_numpy()
        wanted = time.cast(pl.Datetime("ns", "UTC")).cast(pl.Int64).to_numpy()
        # Subtracted as integers: nanoseconds since 1970 do not fit a float.
        known_s, wanted_s = (known - known[0]) * 1e-9, (wanted - known[0]) * 1e-9
        columns = (rows[f"{axis}_m"].to_numpy() for axis in AXES)
        return np.column_stack([np.interp(wanted_s, known_s, column) for column in columns])

    def chord_m(self, s_m: float) -> float:
        """Chord of a section."""
        row = self.section(s_m).head(1)
        edges = (row.select(f"{e}_x_m", f"{e}_y_m", f"{e}_z_m").to_numpy() for e in ("le", "te"))
        leading, trailing = edges
        return float(np.linalg.norm(trailing - leading))


def judge(result: Result, truth: Truth) -> dict[str, Any]:
    """Return the errors of one run: at the largest load step, and of its single states."""
    steps = result.steps
    if steps["step"].n_unique() < 2:
        return {"failed": "no_steps", "why": f"load steps found: {steps['step'].n_unique()}, not 2"}
    largest = steps.sort("load")["step"][-1]
    rest = steps.sort("load")["step"][0]
    sections, z_hold, widths, twists = [], [], [], []
    for row in steps.filter(pl.col("step") == largest).sort("s_m").to_dicts():
        start = steps.filter((pl.col("step") == rest) & (pl.col("s_m") == row["s_m"])).to_dicts()[0]
        before, twist_before = truth.mean(row["s_m"], start["from"], start["to"])
        after, twist_after = truth.mean(row["s_m"], row["from"], row["to"])
        entry: dict[str, Any] = {"s_m": row["s_m"], "status": row["status"]}
        entry["true_m"] = (after - before).tolist()
        error = _error(row, after - before)
        entry["error_m"] = error
        if error is not None:
            u = [float(row.get(f"ud{axis}_m") or 0.0) for axis in AXES]
            if min(u) > 0:
                z_hold += [e / s for e, s in zip(error, u, strict=True)]
                widths += [2 * 1.96 * s for s in u]
        if row.get("twist_deg") is not None and truth.chord_m(row["s_m"]) > WIDE_CHORD_M:
            twists.append(row["twist_deg"] - (twist_after - twist_before))
        sections.append(entry)
    return {
        "sections": sections,
        "z_hold": z_hold,
        "width_m": widths,
        "twist_error_deg": twists,
        **_states(result.deflection, steps, rest, truth),
    }


def _error(row: dict[str, Any], true: NDArray[np.float64]) -> list[float] | None:
    measured = [row[f"d{axis}_m"] for axis in AXES]
    if None in measured:
        return None
    return [m - float(t) for m, t in zip(measured, true, strict=True)]


def _states(deflection: pl.DataFrame, steps: pl.DataFrame, rest: str, truth: Truth) -> Any:
    """Errors of single states against the truth of their instants."""
    worst, worst_held, within = [], [], [0, 0, 0]
    missing = 0
    for s_m in deflection["s_m"].unique().sort():
        start = steps.filter((pl.col("step") == rest) & (pl.col("s_m") == s_m)).to_dicts()[0]
        before, _ = truth.mean(s_m, start["from"], start["to"])
        rows = deflection.filter(pl.col("s_m") == s_m).sort("time")
        missing += int(rows["dx_m"].null_count())
        rows = rows.filter(pl.col("dx_m").is_not_null())
        if rows.is_empty():
            continue
        measured = rows.select("dx_m", "dy_m", "dz_m").to_numpy()
        error = measured - (truth.at(s_m, rows["time"]) - before)
        largest = np.abs(error).max(axis=1)
        worst += largest.tolist()
        worst_held += largest[rows["step"].is_not_null().to_numpy()].tolist()
        u = rows.select("udx_m", "udy_m", "udz_m").to_numpy().astype(float)
        known = np.isfinite(u) & (u > 0)
        z = np.abs(error[known] / u[known])
        within = [w + n for w, n in zip(within, _counts(z), strict=True)]
    return {
        "state_p95_m": _p95(worst),
        "held_state_p95_m": _p95(worst_held),
        "states": len(worst),
        "missing_states": missing,
        "within": within,
    }


def _counts(z: NDArray[np.float64]) -> list[int]:
    return [int(z.size), int((z < 1.0).sum()), int((z < 1.96).sum())]


def _p95(values: list[float]) -> float | None:
    return float(np.quantile(values, 0.95)) if values else None


def hold_error_m(judged: dict[str, Any]) -> float | None:
    """Return the worst component over all sections; None where a section is missing."""
    errors: list[list[float] | None] = [section["error_m"] for section in judged["sections"]]
    if not errors or None in errors:
        return None
    return float(max(abs(e) for error in errors if error for e in error))
