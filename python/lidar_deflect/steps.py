"""Averages of the deflection table over the holds: one row per load step and section."""

from collections import Counter
from collections.abc import Sequence
from typing import Any, TypeAlias

import numpy as np
import polars as pl
from numpy.typing import NDArray

from lidar_deflect import tables
from lidar_deflect.holds import Hold

Rows: TypeAlias = NDArray[np.intp]
"""Numbers of rows of the table ``deflection``."""

SEEN = ("ok", "degraded")
"""Statuses of states that were measured."""

_TIERS = (("ok",), SEEN, (*SEEN, "extrapolated"), ("interpolated",))
"""Qualities of state, from best to worst."""

_HALF = 0.5
_ENOUGH = (_HALF, _HALF, 0.0, 0.0)
"""States of a quality stand for a hold when they are more than this share of it."""

_COMPONENTS = (("dx_m", "dy_m", "dz_m"), ("dxr_m", "dyr_m", "dzr_m"))
_TOTALS = ("d_m", "dr_m")


def average(deflection: pl.DataFrame, holds: Sequence[Hold]) -> pl.DataFrame:
    """Average the deflection over each hold.

    Where half of a hold's states are `ok`, those count alone; else, where half are `ok` or
    `degraded`, those; else all that come from data of their moment, `extrapolated` ones too; only
    where there are none, `interpolated` ones. The row has the commonest status of what it averages,
    with the commonest reason; one of which under half of the states could be used is never `ok`.
    Total deflections are the norms of the averaged components. Uncertainties are averaged, not
    divided by the root of the count: what a hold's states share does not average out.

    Parameters
    ----------
    deflection
        Table ``deflection``.
    holds
        Load steps in time order.

    Returns
    -------
    polars.DataFrame
        Table ``steps``; sections in the order in which they first appear.
    """
    moments = _Moments(deflection)
    rows = [
        _one(moments, hold, section) for hold in holds for section in _sections(deflection).items()
    ]
    if not rows:
        return tables.empty("steps")
    return tables.build("steps", {name: [row[name] for row in rows] for name in rows[0]})


def _sections(deflection: pl.DataFrame) -> dict[str, float]:
    return dict(deflection.select("section", "s_m").unique(maintain_order=True).rows())


class _Moments:
    """The table by rows, columns looked up once: a frame per hold and section takes far longer."""

    def __init__(self, deflection: pl.DataFrame) -> None:
        self.table = deflection
        self.time_ns = deflection["time"].cast(pl.Int64).to_numpy()
        self.is_placed = deflection["x_m"].is_not_null().to_numpy()
        self._words = {
            name: np.array(deflection[name].cast(pl.String).to_list(), dtype=object)
            for name in ("lidars", "status", "reason")
        }
        names = deflection["section"].to_numpy()
        self._of_section = {name: np.flatnonzero(names == name) for name in _sections(deflection)}

    def during(self, hold: Hold, section: str) -> Rows:
        """Rows of one section in a hold, both ends included."""
        rows: Rows = self._of_section[section]
        time_ns = self.time_ns[rows]
        return rows[(time_ns >= hold.from_ns) & (time_ns <= hold.to_ns)]

    def words(self, name: str, rows: Rows) -> list[str | None]:
        """Return values of a column of names."""
        return list(self._words[name][rows])


def _one(moments: _Moments, hold: Hold, section: tuple[str, float]) -> dict[str, Any]:
    rows = moments.during(hold, section[0])
    used = _used(moments, rows)
    status, reason = _status(moments, rows, used)
    means = moments.table[used].select(_means()).with_columns(_totals()).row(0, named=True)
    return {
        "time": hold.middle_ns,
        "t_s": _t_s(moments.table, hold),
        "from": hold.from_ns,
        "to": hold.to_ns,
        "step": hold.label,
        "load": hold.load_percent,
        "section": section[0],
        "s_m": section[1],
        **means,
        "n_points": round(means["n_points"] or 0),
        "lidars": _lidars(moments.words("lidars", used)),
        "status": status,
        "reason": reason,
    }


def _used(moments: _Moments, rows: Rows) -> Rows:
    placed: Rows = rows[moments.is_placed[rows]]
    statuses = moments.words("status", placed)
    for tier, enough in zip(_TIERS, _ENOUGH, strict=True):
        good: Rows = placed[[status in tier for status in statuses]]
        if len(good) and len(good) >= enough * len(rows):
            return good
    return placed[:0]


def _means() -> list[pl.Expr]:
    """Mean of every number of a state; null where none of the states has it."""
    names = tables.SCHEMAS["deflection"].names
    first, last = names.index("x_m"), names.index("utwist_deg")
    points = pl.col("n_points").cast(pl.Float64).mean()
    return [*(pl.col(name).mean() for name in names[first : last + 1]), points]


def _totals() -> list[pl.Expr]:
    return [
        sum((pl.col(c) ** 2 for c in components), start=pl.lit(0.0)).sqrt().alias(total)
        for components, total in zip(_COMPONENTS, _TOTALS, strict=True)
    ]


def _status(moments: _Moments, rows: Rows, used: Rows) -> tuple[str, str | None]:
    left_out = _commonest(moments.words("reason", rows)) or (None if len(rows) else "lost")
    if not len(used):
        return "missing", left_out
    status = _commonest(moments.words("status", used)) or "missing"
    if status == "ok" and len(used) < _HALF * len(rows):
        return "degraded", left_out
    return status, None if status == "ok" else _commonest(moments.words("reason", used))


def _commonest(words: list[str | None]) -> str | None:
    """Return the word met most often, of several the first by name; None without any."""
    counts = Counter(word for word in words if word is not None)
    return min(counts, key=lambda word: (-counts[word], word), default=None)


def _lidars(words: list[str | None]) -> str:
    return "+".join(sorted({name for row in words for name in (row or "").split("+") if name}))


def _t_s(deflection: pl.DataFrame, hold: Hold) -> float:
    """Seconds since the first packet of the middle of a hold, on the table's own clock."""
    time_ns, t_s = deflection["time"].cast(pl.Int64)[0], deflection["t_s"][0]
    return float(t_s + (hold.middle_ns - time_ns) * 1e-9)
