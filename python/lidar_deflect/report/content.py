"""What was measured and how it compares: plain lists and words, no markup."""

from collections.abc import Mapping
from typing import Any

import polars as pl

from lidar_deflect import comparison
from lidar_deflect.folder import Folder
from lidar_deflect.report import digits, words
from lidar_deflect.steps import SEEN

Cells = list[str]


def title(folder: Folder) -> dict[str, Any]:
    """Name of the test, its cover's facts, and when it was."""
    test = folder.config.get("test", {})
    method = folder.run.get("method", "")
    start, stop = folder.deflection["time"].min(), folder.deflection["time"].max()
    facts = [(label, str(test[key])) for key, label in words.COVER.items() if test.get(key)]
    length = folder.config.get("blade", {}).get("length_m")
    facts += [("Blade length", f"{length:g} m")] if length else []
    facts += [("Start", digits.instant(start)), ("End", digits.instant(stop))]  # type: ignore[arg-type]
    return {"id": test.get("id") or folder.path.name, "facts": facts, "method": method}


def headline(folder: Folder) -> list[tuple[str, str, str]]:
    """Few numbers to see first: value, what it is, where."""
    found = []
    largest = folder.steps.filter(pl.col("d_m").is_not_null()).sort("d_m", descending=True)
    if largest.height:
        row = largest.row(0, named=True)
        place = f"{row['section']} ({row['s_m']:g} m) at {row['step']}"
        found.append((f"{digits.metres(row['d_m'])} m", "largest deflection", place))
    states = folder.deflection["status"].cast(pl.String).to_list()
    measured = 100.0 * sum(each in SEEN for each in states) / max(len(states), 1)
    found.append((digits.percent(measured, 1), "of all states measured", f"{len(states)} states"))
    found += _worst_error(folder.comparison)
    health = folder.health
    if health.height:
        lost, arrived = sum(health["lost"]), sum(health["packets"])
        lidars = f"{health['lidar'].n_unique()} lidars"
        share = 100.0 * lost / max(lost + arrived, 1)
        found.append((digits.percent(share), "of packets lost", lidars))
    return found


def _worst_error(frame: pl.DataFrame) -> list[tuple[str, str, str]]:
    """Largest error of the lidars against what can be trusted, at the largest deflection."""
    rows = comparison.by_method(frame).filter(pl.col("method") == comparison.LIDAR)
    rows = rows.drop_nulls("error_percent")
    if rows.is_empty():
        return []
    row = rows.sort(pl.col("error_percent").abs(), descending=True).row(0, named=True)
    place = f"{row['section']} at {comparison.largest_step(frame)}"
    return [
        (digits.percent(row["error_percent"]), f"largest error against {row['against']}", place)
    ]


def warnings(folder: Folder) -> list[str]:
    """Failed gates first, then what the run warned of."""
    gates = folder.run.get("gates") or {}
    failed = gates.get("failed", ()) if isinstance(gates, Mapping) else ()
    given = [*failed, *(folder.run.get("warnings") or ())]
    return list(dict.fromkeys(str(each) for each in given))


def key_table(folder: Folder) -> dict[str, Any]:
    """Sections and steps with their deflections, and what references say of them."""
    steps = folder.steps
    certain = steps["ud_m"].null_count() < steps.height
    twisted = steps["twist_deg"].null_count() < steps.height
    sources = _sources(folder.comparison)
    head = ["step", "load", "section", "s (m)", "dx (m)", "dy (m)", "dz (m)", "total (m)"]
    head += ["twist (°)"] if twisted else []
    head += [label for _, _, label in sources] + ["points", "lidars", "status"]
    rows = [
        _key_row(row, twisted, [_held(folder.comparison, row, s, q) for s, q, _ in sources])
        for row in steps.iter_rows(named=True)
    ]
    names = dict.fromkeys(row["step"] for row in rows)
    groups = [[row for row in rows if row["step"] == name] for name in names]
    note = words.UNCERTAINTY if certain else words.NO_UNCERTAINTY
    return {"head": head, "groups": groups, "note": note}


def _key_row(row: dict[str, Any], twisted: bool, held: Cells) -> dict[str, Any]:
    vector = [digits.metres(row[name]) for name in ("dx_m", "dy_m", "dz_m")]
    total = " ".join(filter(None, [digits.metres(row["d_m"]), digits.expanded(row["ud_m"])]))
    cells = [row["step"], digits.percent(row["load"], 1), row["section"], f"{row['s_m']:g}"]
    cells += [*vector, total]
    cells += [digits.degrees(row["twist_deg"])] if twisted else []
    cells += [*held, digits.count(row["n_points"]), row["lidars"] or digits.NONE, status_words(row)]
    return {"cells": cells, "status": row["status"], "step": row["step"]}


def status_words(row: Mapping[str, Any]) -> str:
    """Status with its reason."""
    return f"{row['status']}: {row['reason']}" if row["reason"] else str(row["status"])


_SHOWN = {
    "total": "{} (mm)",
    "wire": "{} along its line (mm)",
    "direction": "{} along the load (mm)",
}


def _sources(frame: pl.DataFrame) -> list[tuple[str, str, str]]:
    """Columns of the key table: source, quantity and head; draw wires share one."""
    wires = set(comparison.wire_names(frame))
    found: dict[tuple[str, str], str] = {}
    for source, quantity in frame.select("source", "quantity").unique(maintain_order=True).rows():
        name = "wire" if source in wires else source
        projected = quantity == "wire" or not _is_projected(frame, source)
        if quantity in _SHOWN and projected:
            found[name, quantity] = _SHOWN[quantity].format(name)
    return [(source, quantity, label) for (source, quantity), label in found.items()]


def _is_projected(frame: pl.DataFrame, source: str) -> bool:
    return "wire" in frame.filter(pl.col("source") == source)["quantity"].to_list()


def _held(frame: pl.DataFrame, row: Mapping[str, Any], source: str, quantity: str) -> str:
    """Set reference and error of one step and section, in one cell."""
    names = comparison.wire_names(frame) if source == "wire" else [source]
    found = frame.filter(
        pl.col("step") == row["step"],
        pl.col("section") == row["section"],
        pl.col("source").is_in(names),
        pl.col("quantity") == quantity,
    )
    if found.is_empty():
        return digits.NONE
    reference, error = found.row(0, named=True)["reference_m"], found["error_percent"][0]
    shown = digits.millimetres(reference)
    return shown if error is None else f"{shown} ({digits.percent(error)})"


def comparison_tables(folder: Folder) -> dict[str, Any] | None:
    """Set the paper's table 2 where T can be trusted, and every row; None without any."""
    frame = folder.comparison
    if frame.is_empty():
        return None
    methods = [
        [
            f"{row['section']} ({row['s_m']:g} m)",
            row["method"],
            digits.millimetres(row["value_m"]),
            row["against"],
            digits.millimetres(row["reference_m"]),
            digits.percent(row["error_percent"]),
        ]
        for row in comparison.by_method(frame).iter_rows(named=True)
    ]
    return {
        "step": comparison.largest_step(frame),
        "methods": methods,
        "rows": [_comparison_row(row) for row in frame.iter_rows(named=True)],
        "has_wires": bool((frame["quantity"] == "wire").any()),
    }


_QUANTITIES = {"wire": "along the wire", "direction": "along the load"}


def _comparison_row(row: Mapping[str, Any]) -> Cells:
    off = None if row["measured_m"] is None else row["measured_m"] - (row["reference_m"] or 0.0)
    return [
        row["step"],
        f"{row['section']} ({row['s_m']:g} m)",
        row["source"],
        _QUANTITIES.get(row["quantity"], row["quantity"]),
        digits.millimetres(row["measured_m"]),
        digits.millimetres(row["reference_m"]),
        digits.millimetres(None if row["reference_m"] is None else off),
        digits.percent(row["error_percent"]),
    ]
