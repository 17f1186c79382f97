"""Averages of the deflection table over the holds: one row per load step and section."""

from collections.abc import Sequence

import polars as pl

from lidar_deflect import tables
from lidar_deflect.holds import Hold

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
    parts = [_one(deflection, hold, section) for hold in holds for section in _sections(deflection)]
    if not parts:
        return tables.empty("steps")
    return tables.build("steps", pl.concat(parts, how="vertical"))


def _sections(deflection: pl.DataFrame) -> list[tuple[str, float]]:
    return deflection.select("section", "s_m").unique(maintain_order=True).rows()


def _one(deflection: pl.DataFrame, hold: Hold, section: tuple[str, float]) -> pl.DataFrame:
    time = pl.col("time").cast(pl.Int64)
    rows = deflection.filter(
        pl.col("section") == section[0], time.is_between(hold.from_ns, hold.to_ns)
    )
    used = _used(rows)
    status, reason = _status(rows, used)
    head: dict[str, tables.Values] = {
        "time": [hold.middle_ns],
        "t_s": [_t_s(deflection, hold)],
        "from": [hold.from_ns],
        "to": [hold.to_ns],
        "step": [hold.label],
        "load": [hold.load_percent],
        "section": [section[0]],
        "s_m": [section[1]],
    }
    tail: dict[str, tables.Values] = {
        "n_points": [round(used["n_points"].cast(pl.Float64).mean() or 0)],  # type: ignore[arg-type]
        "lidars": [_lidars(used)],
        "status": [status],
        "reason": [reason],
    }
    means: dict[str, tables.Values] = {}
    means.update(used.select(_means()).with_columns(_totals()).to_dict())
    return tables.build("steps", {**head, **means, **tail})


def _used(rows: pl.DataFrame) -> pl.DataFrame:
    placed = rows.filter(pl.col("x_m").is_not_null())
    for statuses, enough in zip(_TIERS, _ENOUGH, strict=True):
        good = placed.filter(pl.col("status").cast(pl.String).is_in(statuses))
        if good.height and good.height >= enough * rows.height:
            return good
    return placed.clear()


def _means() -> list[pl.Expr]:
    """Mean of every number of a state; null where none of the states has it."""
    names = tables.SCHEMAS["deflection"].names
    first, last = names.index("x_m"), names.index("utwist_deg")
    return [pl.col(name).mean() for name in names[first : last + 1]]


def _totals() -> list[pl.Expr]:
    return [
        sum((pl.col(c) ** 2 for c in components), start=pl.lit(0.0)).sqrt().alias(total)
        for components, total in zip(_COMPONENTS, _TOTALS, strict=True)
    ]


def _status(rows: pl.DataFrame, used: pl.DataFrame) -> tuple[str, str | None]:
    left_out = _commonest(rows, "reason") or ("lost" if rows.is_empty() else None)
    if used.is_empty():
        return "missing", left_out
    status = _commonest(used, "status") or "missing"
    if status == "ok" and used.height < _HALF * rows.height:
        return "degraded", left_out
    return status, None if status == "ok" else _commonest(used, "reason")


def _commonest(rows: pl.DataFrame, name: str) -> str | None:
    known = rows[name].drop_nulls().cast(pl.String)
    if known.is_empty():
        return None
    word: str = known.value_counts(sort=True).sort(["count", name], descending=[True, False])[name][
        0
    ]
    return word


def _lidars(used: pl.DataFrame) -> str:
    names = {name for row in used["lidars"] for name in row.split("+") if name}
    return "+".join(sorted(names))


def _t_s(deflection: pl.DataFrame, hold: Hold) -> float:
    """Seconds since the first packet of the middle of a hold, on the table's own clock."""
    time_ns, t_s = deflection["time"].cast(pl.Int64)[0], deflection["t_s"][0]
    return float(t_s + (hold.middle_ns - time_ns) * 1e-9)
