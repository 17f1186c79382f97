"""What the numbers rest on: states, lidars, drops, inputs, method; plain lists and words."""

from collections.abc import Iterator, Mapping
from typing import Any

import polars as pl

from lidar_deflect.folder import Folder
from lidar_deflect.report import digits, words

Cells = list[str]


def statuses(folder: Folder) -> list[Cells]:
    """Count states per status and reason, with words, except those that are ok."""
    not_ok = folder.deflection.filter(pl.col("status").cast(pl.String) != "ok")
    counted = (
        not_ok.group_by("status", "reason", "section", "s_m")
        .len()
        .sort("status", "reason", "s_m", nulls_last=True)
    )
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
