"""Jobs that take turns in one run: medians, spread and ratios mean something on a noisy machine."""

from __future__ import annotations

import time
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping


@dataclass(frozen=True)
class Row:
    """One line of the table of what was asked: how many times faster than what."""

    job: str
    asked: str
    measured: str


@dataclass(frozen=True)
class Own:
    """What a job gives that has taken its time itself, such as a program of its own."""

    seconds: float
    result: Any


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
            result = job()
            taken = time.perf_counter() - start
            seconds[name].append(result.seconds if isinstance(result, Own) else taken)
            results[name] = result.result if isinstance(result, Own) else result
    return {name: Timed(tuple(seconds[name]), results[name]) for name in jobs}


def ratio(timed: Mapping[str, Timed], theirs: str, ours: str) -> float:
    """How many times faster one job is than another: median of the ratios of each round."""
    pairs = zip(timed[theirs].seconds, timed[ours].seconds, strict=True)
    return float(np.median([a / b for a, b in pairs]))


def table(timed: Mapping[str, Timed], units: float, unit: str, ours: str) -> str:
    """Lines of job, median, spread, throughput and how much faster `ours` is."""
    head = f"{'job':<38}{'median':>12}{'spread':>9}{unit + '/s':>14}{'ours is':>10}"
    lines = [head]
    for name, job in timed.items():
        lines.append(
            f"{name:<38}{job.median_s:>10.4f} s{job.spread:>8.0%}"
            f"{units / job.median_s:>14.3g}{ratio(timed, name, ours):>9.2f}x"
        )
    return "\n".join(lines)
