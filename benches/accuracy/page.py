"""docs/accuracy.md, written from the records alone."""

from __future__ import annotations

from datetime import UTC, datetime
from typing import TYPE_CHECKING, Any

from benches.accuracy import summary

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable, Sequence

HEADER = (
    *("kind", "tests", "failed", "hold error mm: median", "90 %", "worst"),
    *("aim", "states at 10 Hz, 95 %, mm", "in holds", "aim", "twist deg"),
    *("holds in 68 %", "in 95 %", "states in 68 %", "in 95 %", "by resampling"),
    *("width mm", "paper / own"),
)


def markdown(
    records: Sequence[dict[str, Any]], split: str, command: str, registration: str | None
) -> str:
    """Return the whole page."""
    methods = list(dict.fromkeys(m for r in records for m in r.get("methods", {})))
    today = datetime.now(UTC).date().isoformat()
    parts = [
        "# Accuracy (simulated)",
        f"Written on {today} by `{command}` from {len(records)} simulated tests, {split} seeds. "
        "Every number on this page comes from simulation: no real blade was measured.",
        "A hold error is the largest component (x, y or z) over all sections of the change from "
        "the unloaded hold to full load, measured minus true. States at 10 Hz are judged against "
        "the truth of their instants, ramps included; of each test 95 % are better than its "
        "number, and the table has the median test. Twist is the worst section with a chord over "
        "1 m. Coverage counts components within the stated 68 and 95 % intervals; its own sampling "
        "error comes from resampling whole tests. Both methods had the same captures and poses.",
    ]
    for method in reversed(methods):
        parts += _method(records, method)
    parts += ["## Poses", poses(records)]
    if registration:
        parts += ["## Registration of small yards", registration]
    return "\n\n".join(parts) + "\n"


def _method(records: Sequence[dict[str, Any]], method: str) -> list[str]:
    worst = [
        (r["id"], r["kind"], r["blade"], f"{mm:.0f}", where, cause)
        for r, mm, where, cause in summary.worst(records, method)
    ]
    lost = summary.failures(records, method)
    return [
        f"## Method `{method}`",
        table(HEADER, map(cells, summary.rows(records, method))),
        "By nuisance level:",
        table(HEADER, map(cells, summary.levels(records, method))),
        "The ten worst tests:",
        table(("test", "kind", "blade", "mm", "where", "out of the ordinary"), worst),
        "Not measured: "
        + (", ".join(f"{count} x `{code}`" for code, count in lost.items()) or "none")
        + ".",
    ]


def poses(records: Sequence[dict[str, Any]]) -> str:
    """Return a sentence on the errors of the poses that all methods had."""
    import numpy as np

    known = [e for r in records for e in r.get("calibration", {}).get("errors", [])]
    if not known:
        return "No lidar was registered."
    errors = np.abs(np.array(known))
    turns, shifts = 1e3 * np.median(errors[:, :3], axis=0), 1e3 * np.median(errors[:, 3:], axis=0)
    chi2 = [c for r in records for c in r.get("calibration", {}).get("chi2", [])]
    # 12.59: 95 % of chi-square with six degrees of freedom.
    share = f"{100 * np.mean(np.array(chi2) < 12.59):.0f} %" if chi2 else "not stated"
    return (
        f"{len(known)} lidars: median error about x, y, z "
        f"{', '.join(f'{v:.2f}' for v in turns)} mrad, along them "
        f"{', '.join(f'{v:.1f}' for v in shifts)} mm; poses inside their 95 % region: {share}."
    )


def cells(row: summary.Row) -> list[str]:
    """Return a row of the table; a dash where nothing was measured."""
    holds = row.hold_mm or (None, None, None)
    within = [*(row.hold_within or (None, None)), *(row.state_within or (None, None))]
    spread = row.state_95_range
    aims = summary.AIMS_MM.get(row.kind, (None, None))
    return [
        row.kind,
        str(row.tests),
        str(row.failed),
        *(_number(v) for v in holds),
        _number(aims[0]),
        _number(row.state_mm),
        _number(row.held_state_mm),
        _number(aims[1]),
        _number(row.twist_deg, "{:.3f}"),
        *(_number(v, "{:.1%}") for v in within),
        "-" if spread is None else f"{spread[0]:.1%} to {spread[1]:.1%}",
        _number(row.width_mm),
        _number(row.ratio),
    ]


def _number(value: float | None, form: str = "{:.1f}") -> str:
    return "-" if value is None else form.format(value)


def table(header: Sequence[str], rows: Iterable[Sequence[str]]) -> str:
    """Return a Markdown table."""
    line: Callable[[Sequence[str]], str] = lambda row: "| " + " | ".join(row) + " |"  # noqa: E731
    return "\n".join([line(header), line(["---"] * len(header)), *map(line, rows)])
