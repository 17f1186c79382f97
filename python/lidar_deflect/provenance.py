"""What a run was made of, for run.json: program, inputs, clocks, drops, gates."""

from __future__ import annotations

import hashlib
import platform
import threading
import time
from importlib.metadata import version
from typing import TYPE_CHECKING, Any, Self

import numpy as np

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence
    from pathlib import Path

    import polars as pl

    from lidar_deflect.config import Config
    from lidar_deflect.cycles import Found
    from lidar_deflect.drift import Drift
    from lidar_deflect.matching import Match
    from lidar_deflect.measurement import Inputs, States
    from lidar_deflect.opened import OpenedTest

SCHEMA = "lidar-deflect.run/1"
HASH_BLOCK = 1 << 20
LIBRARIES = ("numpy", "polars")


class Stopwatch:
    """Seconds of each stage of a run."""

    def __init__(self) -> None:
        self._last = time.perf_counter()
        self.laps: dict[str, float] = {}

    def lap(self, stage: str) -> None:
        """End a stage."""
        now = time.perf_counter()
        self.laps[stage] = now - self._last
        self._last = now


def run_document(
    opened: OpenedTest,
    inputs: Inputs,
    states: States,
    method: str,
    health: pl.DataFrame,
    watch: Stopwatch,
    files: FileFacts,
    matches: Sequence[Match] = (),
    drifted: Drift | None = None,
    swung: Found | None = None,
) -> Mapping[str, Any]:
    """Document of run.json."""
    return {
        "schema": SCHEMA,
        "versions": versions(),
        "test": opened.config.test.id,
        "method": method,
        "inputs": files.wait(),
        "capture": opened.capture.info(),
        "absent_lidars": list(opened.absent),
        "calibration": {
            "method": inputs.calibration.method,
            "warnings": list(inputs.calibration.warnings),
        },
        "evidence": states.evidence,
        "self_check": [each.to_dict() for each in states.checks],
        "budget": list(states.budget),
        "drift": drifted.facts if drifted else {},
        **({} if swung is None else {"cycles": swung.facts}),
        "channel_clocks": [each.facts() for each in matches],
        "warnings": [
            *inputs.calibration.warnings,
            *states.warnings,
            *(drifted.warnings if drifted else ()),
            *(swung.warnings if swung else ()),
            *(each.text() for each in matches if each.applied_s),
        ],
        "timings_s": {stage: round(seconds, 3) for stage, seconds in watch.laps.items()},
        "gates": gates(opened.config, health, opened.absent, states),
    }


def versions() -> Mapping[str, str]:
    """Versions of this program and of what its numbers depend on."""
    return {
        "lidar-deflect": version("lidar-deflect"),
        "python": platform.python_version(),
        **{name: version(name) for name in LIBRARIES},
    }


class FileFacts:
    """Name, size and SHA-256 of input files, found on a thread of its own within a ``with``."""

    def __init__(self, paths: Sequence[Path]) -> None:
        self._paths = paths
        self._found: list[Mapping[str, Any]] = []
        self._failure: OSError | None = None
        self._is_over = threading.Event()
        self._thread = threading.Thread(target=self._run, daemon=True)

    def __enter__(self) -> Self:
        self._thread.start()
        return self

    def __exit__(self, *_: object) -> None:
        self._is_over.set()

    def _run(self) -> None:
        try:
            self._found += [self._facts(path) for path in self._paths]
        except OSError as failure:
            self._failure = failure

    def _facts(self, path: Path) -> Mapping[str, Any]:
        digest = hashlib.sha256()
        with path.open("rb") as file:
            while not self._is_over.is_set() and (block := file.read(HASH_BLOCK)):
                digest.update(block)
        return {"file": path.name, "bytes": path.stat().st_size, "sha256": digest.hexdigest()}

    def wait(self) -> list[Mapping[str, Any]]:
        """Return the facts of every file, once they are there."""
        self._thread.join()
        if self._failure is not None:
            raise self._failure
        return self._found


def gates(
    config: Config, health: pl.DataFrame, absent: Sequence[str], states: States
) -> Mapping[str, Any]:
    """Judge a run by the limits of ``[gates]`` and by what should have been there.

    Returns
    -------
    Mapping
        ``failed``: sentences; ``lost_percent``: per lidar.
    """
    lost = _lost_percent(health)
    limit = config.gates.max_lost_percent
    failed = [f"lidar {id} never sent" for id in absent]
    failed += [
        f"lidar {id} lost {percent:.2f} % of its packets, the limit is {limit:g} %"
        for id, percent in lost.items()
        if percent > limit
    ]
    failed += _too_uncertain(config, states)
    failed += states.failed
    return {"failed": failed, "lost_percent": lost}


def _too_uncertain(config: Config, states: States) -> list[str]:
    """Name the sections whose median standard uncertainty is beyond the gate."""
    if states.u_total_m is None:
        return []
    limit = config.gates.max_u_m
    medians = np.nanmedian(states.u_total_m, axis=0)
    return [
        f"section {name}: the deflection's standard uncertainty is {u_m:.3f} m, above {limit:g} m"
        for name, u_m in zip(states.names, medians, strict=True)
        if u_m > limit
    ]


def _lost_percent(health: pl.DataFrame) -> dict[str, float]:
    counts = health.select("lidar", "lost", "packets")  # instants have no sum
    sums = counts.group_by("lidar", maintain_order=True).sum()
    sent = zip(sums["lidar"], sums["lost"], sums["packets"], strict=True)
    return {id: 100.0 * lost / max(1, lost + packets) for id, lost, packets in sent}
