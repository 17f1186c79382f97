"""What the report says, gathered from a result folder: plain lists and words, no markup."""

from collections.abc import Iterator, Mapping
from typing import Any

import polars as pl

from lidar_deflect import comparison
from lidar_deflect.report import digits, words
from lidar_deflect.results import Folder
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
    health = folder.health
    if health.height:
        lost, arrived = sum(health["lost"]), sum(health["packets"])
        lidars = f"{health['lidar'].n_unique()} lidars"
        share = 100.0 * lost / max(lost + arrived, 1)
        found.append((digits.percent(share), "of packets lost", lidars))
    return found


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


def statuses(folder: Folder) -> list[Cells]:
    """Count states per status and reason, with words; empty where all are ok."""
    counted = (
        folder.deflection.group_by(pl.col("status"), "reason", "section")
        .len()
        .sort("status", "reason", "section", nulls_last=True)
    )
    if set(counted["status"].cast(pl.String)) <= {"ok"}:
        return []
    total = dict(folder.deflection.group_by("section").len().iter_rows())
    return [
        [
            row["section"],
            row["status"],
            words.STATUS.get(row["status"], ""),
            _reason(row["reason"]),
            digits.count(row["len"]),
            digits.percent(100.0 * row["len"] / total[row["section"]], 1),
        ]
        for row in counted.iter_rows(named=True)
    ]


def _reason(reason: str | None) -> str:
    if reason is None:
        return digits.NONE
    meaning = words.REASONS.get(reason)
    return f"{reason}: {meaning}" if meaning else reason


def lidars(folder: Folder) -> list[Cells]:
    """Totals per lidar over the test."""
    health = folder.health
    if health.is_empty():
        return []
    sums = ("packets", "lost", "duplicated", "late", "points", "blade_points")
    counted = health.group_by("lidar").agg(
        *(pl.col(name).cast(pl.Int64).sum() for name in sums),
        pl.col("blade_points").is_not_null().any().alias("counted"),
        pl.col("rpm", "clock_offset_s", "coverage").mean(),
    )
    return [_lidar_row(row) for row in counted.sort("lidar").iter_rows(named=True)]


def _lidar_row(row: Mapping[str, Any]) -> Cells:
    due = row["packets"] + row["lost"]
    offset = row["clock_offset_s"]
    return [
        row["lidar"],
        *(digits.count(row[name]) for name in ("packets", "lost")),
        digits.percent(100.0 * row["lost"] / max(due, 1)),
        *(digits.count(row[name]) for name in ("duplicated", "late", "points")),
        digits.count(row["blade_points"]) if row["counted"] else digits.NONE,
        digits.NONE if row["rpm"] is None else f"{row['rpm']:.1f}",
        digits.NONE if offset is None else f"{1e3 * offset:z.2f}",
        digits.NONE if row["coverage"] is None else digits.percent(100.0 * row["coverage"], 1),
    ]


def drops(folder: Folder) -> list[Cells]:
    """Everything that was left out: where, why, how often."""
    capture = folder.run.get("capture") or {}
    given = capture.get("drops") if isinstance(capture, Mapping) else None
    found = [["capture", *pair] for pair in _counts(given)]
    found += [["run", *pair] for pair in _counts(folder.run.get("drops"))]
    rejected = folder.rejected.group_by("reason").agg(pl.col("count").sum()).sort("reason")
    found += [["points near the blade", r, digits.count(n)] for r, n in rejected.iter_rows()]
    return found


def _counts(given: Any) -> Iterator[tuple[str, str]]:
    """Pairs of reason and count, from a list of objects or from a mapping."""
    if isinstance(given, Mapping):
        given = [{"reason": reason, "count": number} for reason, number in given.items()]
    for each in given or ():
        if isinstance(each, Mapping) and "reason" in each:
            number = each.get("count")
            yield str(each["reason"]), digits.count(number if isinstance(number, int) else None)


def inputs(folder: Folder) -> list[Cells]:
    """Name, size and hash of every input."""
    return [
        [
            str(each.get("file") or each.get("path") or digits.NONE),
            digits.size(each.get("bytes")),
            str(each.get("sha256", digits.NONE)),
        ]
        for each in folder.run.get("inputs") or ()
    ]


def streams(folder: Folder) -> list[Cells]:
    """Say what the capture's streams were recognised as, with their clocks."""
    capture = folder.run.get("capture") or {}
    names = ("source", "port", "model", "return_mode", "first_utc", "last_utc")
    found = []
    for each in capture.get("streams") or () if isinstance(capture, Mapping) else ():
        cells = [digits.NONE if each.get(name) is None else str(each[name]) for name in names]
        found.append([*cells, _flat(each.get("clock"))])
    return found


def facts(folder: Folder) -> list[tuple[str, str]]:
    """Versions, hash of the configuration, times taken."""
    run = folder.run
    versions = run.get("versions") or {}
    found = [(str(name), str(value)) for name, value in versions.items()]
    found.append(("configuration", folder.metadata.get("configuration_hash", digits.NONE)))
    timings = run.get("timings_s") or {}
    found += [(f"time for {stage}", f"{value:.1f} s") for stage, value in timings.items()]
    return found


def evidence(folder: Folder) -> list[tuple[str, str]]:
    """List what the method decided on the way, as it wrote it down."""
    given = folder.run.get("evidence") or {}
    return [(str(key), _flat(value)) for key, value in given.items()]


def _flat(value: Any) -> str:
    """Nested facts in one line, numbers to six digits."""
    if value is None:
        return digits.NONE
    if isinstance(value, Mapping):
        return ", ".join(f"{key} {_flat(each)}" for key, each in value.items())
    if isinstance(value, list | tuple):
        return "[" + ", ".join(_flat(each) for each in value) + "]"
    return f"{value:.6g}" if isinstance(value, float) else str(value)


def method(folder: Folder) -> tuple[str, ...]:
    """Describe the method in words."""
    name = str(folder.run.get("method", ""))
    return words.METHODS.get(name) or (words.METHOD_UNKNOWN.format(method=name),)


def configuration(folder: Folder) -> str:
    """Text of the resolved configuration."""
    path = folder.path / "test.toml"
    return path.read_text(encoding="utf-8") if path.is_file() else ""
