"""Costly simulated captures, made once per test run and shared."""

import os
import subprocess
import sys
import tempfile
from dataclasses import dataclass
from pathlib import Path

import pytest

from lidar_deflect import scene as scenes
from lidar_deflect.simulation import simulate

SCRATCH = tempfile.TemporaryDirectory(prefix="lidar-deflect-tests-")
"""Where commands run that are given no other place, so that none writes into the project."""


def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    """Start with the files of slow tests, so that no worker is left alone with one at the end."""
    slow = {item.path for item in items if item.get_closest_marker("slow")}
    items.sort(key=lambda item: item.path not in slow)


@dataclass(frozen=True)
class Finished:
    """What a command left behind."""

    code: int
    out: str
    err: str


def command_line(*arguments: str | Path, cwd: Path | None = None, **environment: str) -> Finished:
    """Run the real command in a process of its own."""
    done = subprocess.run(
        [sys.executable, "-m", "lidar_deflect", *map(str, arguments)],
        cwd=cwd or SCRATCH.name,
        env={**os.environ, **environment},
        capture_output=True,
        text=True,
        check=False,
    )
    return Finished(done.returncode, done.stdout, done.stderr)


def short_scene() -> scenes.Scene:
    """Return the demo's yard with one short load step: four lidars, four seconds."""
    scene = scenes.demo()
    loading = scene.loading.model_copy(
        update={"levels_percent": (0.0, 100.0), "hold_s": 1.6, "ramp_s": 0.8}
    )
    return scene.model_copy(update={"loading": loading})


@pytest.fixture(scope="session")
def short_test(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Folder of a short simulated test; nobody writes into it."""
    return simulate(short_scene(), tmp_path_factory.mktemp("short") / "simulated")
