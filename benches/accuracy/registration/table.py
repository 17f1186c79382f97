"""Coverage of the 95 % regions by yard kind and sensor."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from benches.accuracy import page
from benches.accuracy.registration.yards import SENSORS, YARDS

if TYPE_CHECKING:
    from collections.abc import Sequence

HEADER = (
    *("yard", "sensor", "yards", "failed", "joint region holds", "single poses hold"),
    *("rotation mrad: x", "y", "z", "position mm: x", "y", "z"),
)


def chi2_95(freedom: int) -> float:
    """Return the 95 % quantile of chi-square (Wilson and Hilferty, to 0.3 % from 6 degrees on)."""
    spread = 2.0 / (9.0 * freedom)
    return float(freedom * (1.0 - spread + 1.644_854 * np.sqrt(spread)) ** 3)


def share(distances: Sequence[Sequence[float]]) -> str:
    """Return how many regions hold the truth, with the deviation of that share."""
    if not distances:
        return "not stated"
    inside = float(np.mean([d < chi2_95(int(freedom)) for d, freedom in distances]))
    sigma = np.sqrt(max(inside * (1 - inside), 0.25 / len(distances)) / len(distances))
    return f"{100 * inside:.1f} ± {100 * sigma:.1f} %"


def row(yard: str, sensor: str, records: Sequence[dict[str, Any]]) -> list[str]:
    """Return one row of the table."""
    known = [r for r in records if "errors" in r]
    joint = [r["joint"] for r in known if "joint" in r]
    single = [d for r in known for d in r["single"]]
    errors = np.abs([e for r in known for e in r["errors"]]) if known else np.full((1, 6), np.nan)
    median = 1e3 * np.median(errors, axis=0)
    return [
        yard,
        sensor,
        str(len(records)),
        str(len(records) - len(known)),
        share(joint),
        share(single),
        *(f"{v:.2f}" for v in median[:3]),
        *(f"{v:.1f}" for v in median[3:]),
    ]


def markdown(records: Sequence[dict[str, Any]], split: str) -> str:
    """Return the table with a sentence on what it is."""
    rows = []
    for yard in YARDS:
        for sensor in SENSORS:
            mine = [r for r in records if (r.get("yard"), r.get("sensor")) == (yard, sensor)]
            if mine:
                rows.append(row(yard, sensor, mine))
    rows.append(row("all", "all", records))
    codes: dict[str, int] = {}
    for record in records:
        if "failed" in record:
            codes[record["failed"]] = codes.get(record["failed"], 0) + 1
    failed = ", ".join(f"{count} x `{code}`" for code, count in codes.items()) or "none"
    return (
        f"{len(records)} simulated yards of two lidars, {split} seeds; errors are medians of the "
        f"absolute values about and along the world axes. Failed: {failed}.\n\n"
        + page.table(HEADER, rows)
    )
