"""Is a tripod that moves during a test found and named, and one that stands left alone?"""

from __future__ import annotations

import gzip
import json
import tomllib
from datetime import timedelta
from typing import TYPE_CHECKING, Any

import numpy as np
import polars as pl
import pytest

from lidar_deflect import Test, drift
from lidar_deflect.calibration import Calibration, Pose
from lidar_deflect.drift.change import PRACTICAL, moved_by, step_between
from lidar_deflect.measurement import unloaded
from lidar_deflect.opened import OpenedTest
from lidar_deflect.scene import Scene, demo
from lidar_deflect.simulation import simulate
from scenes import SCENES, configuration, needs_scenes

if TYPE_CHECKING:
    from pathlib import Path

KICK_S = 5.0
UP, SIDE = np.array([0.0, 1.0, 0.0]), np.array([1.0, 0.0, 0.0])


def true_poses(folder: Path) -> Calibration:
    lidars = json.loads((folder / "truth_lidars.json").read_text())
    poses = [np.array(lidar["world_from_sensor"]) for lidar in lidars]
    return Calibration(tuple(Pose(f"L{k}", "", p) for k, p in enumerate(poses, 1)), "truth")


def watched(test: Test, capture: Path, truth: Path) -> drift.Drift:
    opened = OpenedTest.of(test.config, [capture], progress=None, threads=1)
    window = opened.unloaded_ns(None, None)
    clouds = unloaded.collect_all(opened.capture, opened.lidars, window)
    limits = opened.limits_ns(None, None)
    return drift.watch(opened.inputs(true_poses(truth), clouds, window, limits=limits))


def seen_ground_and_wall(step: Any, wall: bool) -> tuple[Any, Any, Any]:
    """Rays, normals and heights of cells after the sensor moved, by geometry alone."""
    rng = np.random.default_rng(5)
    ground = np.stack([rng.uniform(-9, 9, 400), np.full(400, -1.5), rng.uniform(-9, 9, 400)], 1)
    facade = np.stack([np.full(400, 12.0), rng.uniform(0, 6, 400), rng.uniform(-9, 9, 400)], 1)
    ray = np.vstack([ground, facade]) if wall else ground
    normal = np.where(np.arange(len(ray))[:, None] < 400, UP, SIDE)
    angle = np.linalg.norm(step[:3])
    axis = step[:3] / max(angle, 1e-12)
    x, y, z = axis
    cross = np.array([[0, -z, y], [z, 0, -x], [-y, x, 0]])
    turn = np.eye(3) + np.sin(angle) * cross + (1 - np.cos(angle)) * cross @ cross
    level = (ray * normal).sum(axis=1)
    beam = ray @ turn.T  # each beam now points there, and meets the surface elsewhere
    stretch = (level - normal @ step[3:]) / (beam * normal).sum(axis=1)
    return ray, normal, stretch * level - level + rng.normal(0.0, 1e-3, len(ray))


def test_a_change_is_found_as_the_geometry_makes_it() -> None:
    step = np.array([4e-4, -6e-4, 3e-4, 4e-3, -2e-3, 0.0])
    found = drift.estimate(*seen_ground_and_wall(step, wall=True), np.full(800, 1e-3))
    off = np.abs(found.step - step)[:5]
    assert (off < 4.0 * np.sqrt(np.diag(found.covariance))[:5] + 1e-5).all()
    assert found.moved


def test_what_no_cell_fixes_stays_zero_and_wide() -> None:
    step = np.array([0.0, 5e-3, 0.0, 0.02, 0.0, 0.02])  # yaw and shifts on the level
    found = drift.estimate(*seen_ground_and_wall(step, wall=False), np.full(400, 1e-3))
    free = [1, 3, 5]
    assert (np.abs(found.step[free]) < 1e-6).all()
    assert (np.sqrt(np.diag(found.covariance))[free] > [9e-3, 0.045, 0.045]).all()
    assert not found.moved


@pytest.mark.parametrize(("share", "moved"), [(0.8, False), (1.3, True)])
def test_what_a_test_does_not_notice_is_no_move(share: float, moved: bool) -> None:
    for axis in range(6):
        step = np.where(np.arange(6) == axis, share * PRACTICAL, 0.0)
        assert drift.Change(step, np.eye(6) * 1e-12).moved == moved
        assert not drift.Change(step, np.eye(6) * 1e-4).moved  # within its interval


@pytest.fixture(scope="module")
def kicked(tmp_path_factory: pytest.TempPathFactory) -> Path:
    document = tomllib.loads(demo().dump())
    document["loading"] |= {"levels_percent": [0.0, 50.0], "hold_s": 4.5}
    lidars = [lidar.model_dump(exclude_none=True) for lidar in demo().lidars]
    for number, turn in ((0, [0.5, 0.0, 0.0]), (1, [0.0, 0.5, 0.0]), (3, [0.0, 0.0, 0.5])):
        lidars[number]["kick"] = {"at_s": KICK_S, "turn_mrad": turn}
    scene = Scene.from_document(document | {"lidars": lidars})
    return simulate(scene, tmp_path_factory.mktemp("kicked") / "yard")


@pytest.fixture(scope="module")
def found(kicked: Path) -> drift.Drift:
    return watched(Test.load(kicked / "test.toml"), kicked / "capture.pcap", kicked)


def test_a_kick_is_found_within_one_window_and_named(found: drift.Drift) -> None:
    assert [move["lidar"] for move in found.facts["moved"]] == ["L1", "L2", "L4"]
    for axis, move in enumerate(found.facts["moved"]):
        turn = np.where(np.arange(3) == axis, 0.5, 0.0)
        assert (np.abs(move["turn_mrad"] - turn) < 3.0 * np.array(move["u"][:3]) + 0.03).all()
        assert abs(move["at_s"] - KICK_S) < move["at_within_s"] + 0.05  # and half a turn
        assert f"lidar {move['lidar']} moved at about {move['at_s']:.1f}" in found.warnings[axis]
    late = found.table.filter(found.table["t_s"] > KICK_S + 3.0)
    assert late["moved"].to_list() == [lidar != "L3" for lidar in late["lidar"]]
    assert not found.table.filter(found.table["t_s"] < KICK_S - 1.5)["moved"].any()


def test_new_poses_are_those_of_the_moved_tripods(kicked: Path, found: drift.Drift) -> None:
    calibrated = true_poses(kicked)
    assert sorted(move.lidar for move in found.moves) == ["L1", "L2", "L4"]
    for move in found.moves:
        axis = {"L1": 0, "L2": 1, "L4": 2}[move.lidar]
        turn = np.where(np.arange(6) == axis, 0.5e-3, 0.0)
        true = moved_by(calibrated.pose(move.lidar).world_from_sensor, turn)
        off = step_between(move.world_from_sensor, true)
        pull = off @ np.linalg.solve(move.covariance, off)
        assert pull < 22.5  # chi-square of six degrees of freedom: once in a thousand
        assert np.sqrt(np.diag(move.covariance))[:3].max() < 0.1e-3  # 0.3 mrad is a kick


def test_marking_flags_what_rests_on_a_moved_lidar(kicked: Path) -> None:
    test = Test.load(kicked / "test.toml", ['calibrate.drift="mark"'])
    calibration = true_poses(kicked)
    result = test.measure(kicked / "capture.pcap", calibration=calibration, method="paper")
    poses, rows = result.frames["poses"], result.deflection
    assert poses["moved"].any()
    assert not poses["followed"].any()
    assert sum(" moved at about " in warning for warning in result.run["warnings"]) == 3
    assert result.run["drift"]["followed"] is False
    before, after = rows.filter(rows["t_s"] < KICK_S - 0.5), rows.filter(rows["t_s"] > KICK_S + 0.5)
    assert "moved" not in before["reason"].to_list()
    assert "ok" not in after["status"].to_list()
    assert "moved" in after["reason"].to_list()


def test_following_measures_as_if_nobody_had_knocked(kicked: Path) -> None:
    test = Test.load(kicked / "test.toml")
    calibration = true_poses(kicked)
    capture = kicked / "capture.pcap"
    result = test.measure(capture, calibration=calibration, method="beam", rate_hz=2.0)
    truth = pl.read_parquet(kicked / "truth.parquet")
    late = result.deflection.filter(result.deflection["step"] == "50 %")
    assert late.height
    assert result.frames["poses"]["followed"].any()
    for row in late.iter_rows(named=True):
        own = truth.filter((truth["s_m"] - row["s_m"]).abs() < 1e-6)
        first = own.filter(own["time"] < own["time"].min() + timedelta(seconds=3.0))
        now = own.row(int((own["time"] - row["time"]).abs().arg_min() or 0), named=True)
        for axis in "xyz":
            true_m = now[f"{axis}_m"] - float(first[f"{axis}_m"].mean())
            # 0.5 mrad is 10 mm at 20 m; the rest is what the method leaves without a knock
            assert abs(row[f"d{axis}_m"] - true_m) < 3.0 * row[f"ud{axis}_m"] + 2e-3


@needs_scenes
def test_tripods_that_stand_are_left_alone(tmp_path: Path) -> None:
    (tmp_path / "edge.toml").write_text(configuration("edge"))
    capture = tmp_path / "edge.pcap"
    capture.write_bytes(gzip.decompress((SCENES / "edge" / "capture.pcap.gz").read_bytes()))
    found = watched(Test.load(tmp_path / "edge.toml"), capture, SCENES / "edge")
    assert set(found.table["lidar"]) == {"L1", "L2", "L3", "L4"}
    assert not found.table["moved"].any()
    assert found.warnings == ()
