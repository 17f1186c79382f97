"""Is what is taken of the unloaded hold, lidar by lidar, what all echoes at once would give?"""

from __future__ import annotations

import json
from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np
import polars as pl
import pytest

from lidar_deflect import Test, drift, memory, pipeline
from lidar_deflect.measurement import paper
from lidar_deflect.opened import OpenedTest
from lidar_deflect.rest import Rest
from lidar_deflect.scene import demo
from lidar_deflect.simulation import simulate

if TYPE_CHECKING:
    from pathlib import Path

    from lidar_deflect.calibration import Calibration


@pytest.fixture(scope="module")
def yard(tmp_path_factory: pytest.TempPathFactory) -> Path:
    scene = demo()
    loading = scene.loading.model_copy(update={"hold_s": 2.0, "levels_percent": (0.0, 100.0)})
    scene = scene.model_copy(update={"loading": loading})
    return simulate(scene, tmp_path_factory.mktemp("rest") / "yard")


@pytest.fixture(scope="module")
def known(yard: Path) -> Calibration:
    return Test.load(yard / "test.toml").calibrate(yard / "capture.pcap")


def test_one_lidar_at_a_time_gives_plan_and_cells_of_all(
    yard: Path, known: Calibration, monkeypatch: pytest.MonkeyPatch
) -> None:
    test = Test.load(yard / "test.toml")
    capture = yard / "capture.pcap"
    opened = OpenedTest.of(test.config, [capture], progress=None, threads=2)
    window = opened.unloaded_ns(None, None)
    clouds = opened.hold(window)
    limits = opened.limits_ns(None, None)
    at_once = opened.inputs(known, clouds, window, limits=limits)
    monkeypatch.setattr("lidar_deflect.rest.ECHOES", 1)
    rest = Rest.of(opened, known, "paper", limits, None)
    assert rest.inputs.clouds == {}
    assert rest.inputs.plan is not None
    assert rest.inputs.plan.to_dict() == paper.plan_of(at_once).to_dict()
    for lidar, own in drift.static_cells(at_once).items():
        found = rest.cells[lidar]
        assert own is not None
        assert found is not None
        for name in ("plane", "ray_m", "height_m", "sigma_m", "count"):
            assert np.array_equal(getattr(found, name), getattr(own, name)), name


def test_frames_beside_the_watch_are_those_made_alone(
    yard: Path, known: Calibration, monkeypatch: pytest.MonkeyPatch
) -> None:
    test = Test.load(yard / "test.toml")
    capture = yard / "capture.pcap"
    beside = test.measure(capture, calibration=known, method="paper", threads=2)

    def alone(inputs: object, cells: object, frames: object) -> drift.Drift:  # noqa: ARG001
        return replace(watch(inputs, cells), survey=None)  # type: ignore[arg-type]

    watch = drift.watch
    monkeypatch.setattr(pipeline.drift, "watch", alone)
    apart = test.measure(capture, calibration=known, method="paper", threads=1)
    assert set(beside.frames) == set(apart.frames)
    for name, table in beside.frames.items():
        assert table.equals(apart.frames[name], null_equal=True), name
    documents = [
        {key: value for key, value in run.run.items() if key != "timings_s"}
        for run in (beside, apart)
    ]
    assert json.dumps(documents[0], default=str) == json.dumps(documents[1], default=str)


def test_large_arrays_may_have_pages_of_their_own() -> None:
    with memory.own_pages():
        values = np.ones(1 << 18)
    assert pl.Series(values).sum() == 1 << 18
