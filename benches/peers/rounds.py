"""Jobs that take turns in one run: medians, spread and ratios mean something on a noisy machine."""

from __future__ import annotations

import time
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping


@dataclass(frozen=True)
class Timed:
    """Seconds that one job took, and what it gave the last time."""

    seconds: tuple[float, ...]
    result: Any

    @property
    def median_s(self) -> float:
        """Median of the seconds."""
        return float(np.median(self.seconds))

    @property
    def spread(self) -> float:
        """Half the distance of the quartiles over the median."""
        low, high = np.quantile(self.seconds, [0.25, 0.75])
        return float(0.5 * (high - low) / self.median_s)


def rounds(jobs: Mapping[str, Callable[[], Any]], repeats: int) -> dict[str, Timed]:
    """Run every job once, untimed, then all of them in turn, `repeats` times."""
    results = {name: job() for name, job in jobs.items()}
    seconds: dict[str, list[float]] = {name: [] for name in jobs}
    for _ in range(repeats):
        for name, job in jobs.items():
            start = time.perf_counter()
            results[name] = job()
            seconds[name].append(time.perf_counter() - start)
    return {name: Timed(tuple(seconds[name]), results[name]) for name in jobs}


def table(timed: Mapping[str, Timed], units: float, unit: str, ours: str) -> str:
    """Lines of job, median, spread, throughput and how much faster `ours` is."""
    head = f"{'job':<34}{'median':>12}{'spread':>9}{unit + '/s':>14}{'ours is':>10}"
    lines = [head]
    for name, job in timed.items():
        ratio = job.median_s / timed[ours].median_s
        lines.append(
            f"{name:<34}{job.median_s:>10.4f} s{job.spread:>8.0%}"
            f"{units / job.median_s:>14.3g}{ratio:>9.2f}x"
        )
    return "\n".join(lines)
