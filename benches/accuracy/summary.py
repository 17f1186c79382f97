"""What a list of records says: by kind and method, with the campaign's own sampling error."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from benches.accuracy.judge import hold_error_m

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable, Sequence

    from numpy.typing import NDArray

DRAWS = 1000
"""Resamples of whole tests."""
AIMS_MM = {
    "edge vlp16": (8.0, 12.0),
    "flap vlp16": (15.0, 30.0),
    "small vlp16": (6.0, 10.0),
    "edge xt32": (6.0, 10.0),
    "flap xt32": (12.0, 20.0),
}
"""Aims with the nominal geometry: hold error, 95 % of single states."""


@dataclass(frozen=True)
class Row:
    """One kind, or all of them, under one method; None where nothing was measured."""

    kind: str
    tests: int
    failed: int
    hold_mm: tuple[float, float, float] | None
    state_mm: float | None
    held_state_mm: float | None
    twist_deg: float | None
    hold_within: tuple[float, float] | None
    state_within: tuple[float, float] | None
    state_95_range: tuple[float, float] | None
    width_mm: float | None
    ratio: float | None


def judged(record: dict[str, Any], method: str) -> dict[str, Any] | None:
    """Return the errors of a record under a method; None where it failed."""
    found: dict[str, Any] | None = record.get("methods", {}).get(method)
    return None if found is None or "failed" in found else found


def hold_mm(record: dict[str, Any], method: str) -> float | None:
    """Return the hold error of a record, mm; None where it failed or a section is missing."""
    found = judged(record, method)
    error = hold_error_m(found) if found else None
    return None if error is None else 1e3 * error


def row(kind: str, records: Sequence[dict[str, Any]], method: str) -> Row:
    """Summarise the records of one kind."""
    runs = [run for record in records if (run := judged(record, method))]
    holds = [mm for record in records if (mm := hold_mm(record, method)) is not None]
    twists = [max(map(abs, run["twist_error_deg"])) for run in runs if run["twist_error_deg"]]
    z_hold = [np.abs(run["z_hold"]) for run in runs if run["z_hold"]]
    widths = [w for run in runs for w in run["width_m"]]
    within = [run["within"] for run in runs if run["within"][0]]
    return Row(
        kind,
        len(records),
        len(records) - len(holds),
        None if not holds else _quantiles(holds),
        _median_mm(run["state_p95_m"] for run in runs),
        _median_mm(run["held_state_p95_m"] for run in runs),
        float(np.median(twists)) if twists else None,
        None if not z_hold else _shares(np.concatenate(z_hold)),
        None if not within else _states_within(within),
        None if not within else resampled(within, lambda w: _states_within(w)[1]),
        1e3 * float(np.median(widths)) if widths else None,
        ratio(records, method),
    )


def ratio(records: Sequence[dict[str, Any]], method: str) -> float | None:
    """Return median error of the paper's method over that of `method`, where both measured."""
    pairs = [(hold_mm(record, "paper"), hold_mm(record, method)) for record in records]
    both = [(p, m) for p, m in pairs if p is not None and m is not None]
    if method == "paper" or not both:
        return None
    paper, own = np.median(np.array(both), axis=0)
    return float(paper / own)


def _quantiles(values: Sequence[float]) -> tuple[float, float, float]:
    median, ninety, worst = np.quantile(values, [0.5, 0.9, 1.0])
    return float(median), float(ninety), float(worst)


def _median_mm(values: Iterable[float | None]) -> float | None:
    known = [value for value in values if value is not None]
    return 1e3 * float(np.median(known)) if known else None


def _shares(z: NDArray[np.float64]) -> tuple[float, float]:
    return float((z < 1.0).mean()), float((z < 1.96).mean())


def _states_within(within: Sequence[Sequence[int]]) -> tuple[float, float]:
    total, one, two = np.sum(within, axis=0)
    return float(one / total), float(two / total)


def resampled(tests: Sequence[Any], measure: Callable[[list[Any]], float]) -> tuple[float, float]:
    """Return the middle 95 % of `measure` over resamples of whole tests."""
    random = np.random.default_rng(1)
    picks = random.integers(len(tests), size=(DRAWS, len(tests)))
    values = [measure([tests[i] for i in pick]) for pick in picks]
    low, high = np.quantile(values, [0.025, 0.975])
    return float(low), float(high)


def rows(records: Sequence[dict[str, Any]], method: str) -> list[Row]:
    """Return one row per kind in the order of the records, then all together."""
    kinds = list(dict.fromkeys(str(record.get("kind", "crashed")) for record in records))
    each = [row(k, [r for r in records if r.get("kind", "crashed") == k], method) for k in kinds]
    return [*each, row("all", records, method)]


def levels(records: Sequence[dict[str, Any]], method: str) -> list[Row]:
    """Return one row per nuisance level."""
    known = ("calm", "usual", "hard")
    return [row(k, [r for r in records if r.get("level") == k], method) for k in known]


def failures(records: Sequence[dict[str, Any]], method: str) -> dict[str, int]:
    """Count what failed, by its code."""
    counts: dict[str, int] = {}
    for record in records:
        if hold_mm(record, method) is None:
            code = _failed(record, method)
            counts[code] = counts.get(code, 0) + 1
    return dict(sorted(counts.items(), key=lambda item: -item[1]))


def _failed(record: dict[str, Any], method: str) -> str:
    for part in (record, record.get("calibration", {}), record.get("methods", {}).get(method, {})):
        if "failed" in part:
            return str(part["failed"])
    return "section missing"


def worst(
    records: Sequence[dict[str, Any]], method: str, count: int = 10
) -> list[tuple[dict[str, Any], float, str, str]]:
    """Return the worst tests: record, error in mm, where, and what was out of the ordinary."""
    errors = [(mm, record) for record in records if (mm := hold_mm(record, method)) is not None]
    errors.sort(key=lambda entry: -entry[0])
    return [
        (record, mm, _where(record, method), cause(record, method)) for mm, record in errors[:count]
    ]


def _where(record: dict[str, Any], method: str) -> str:
    found = judged(record, method)
    assert found is not None
    places = [
        (abs(e), f"{axis} at {section['s_m']:.0f} m")
        for section in found["sections"]
        for axis, e in zip("xyz", section["error_m"], strict=True)
    ]
    return max(places)[1]


def cause(record: dict[str, Any], method: str) -> str:
    """Return what may have caused the error of a test: what its scene has out of the ordinary.

    The share of the registration is the common rotation of all lidars about the blade, times the
    deflection: nothing in the blade's data can correct it.
    """
    found = judged(record, method)
    poses = record.get("calibration", {}).get("errors", [])
    parts = []
    if found and poses:
        turn = np.mean(poses, axis=0)[:3]
        moved = np.array(found["sections"][-1]["true_m"])
        share_mm = 1e3 * float(np.abs(np.cross(turn, moved)).max())
        parts.append(f"registration {share_mm:.0f} mm")
    parts += [f"{record['yard']} yard", record["level"], *record.get("disturbances", [])]
    return ", ".join(parts)
