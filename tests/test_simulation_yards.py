"""Do simulated yards hold what a scene asks for: other sensors, targets, faults, fatigue?"""

from __future__ import annotations

import json
import math
import tomllib
from typing import TYPE_CHECKING, Any

import numpy as np
import polars as pl
import pytest

import lidar_deflect as ld
from lidar_deflect import _native, config
from lidar_deflect.errors import ConfigError, InvalidValueError
from lidar_deflect.scene import Scene, demo
from lidar_deflect.simulation import simulate

if TYPE_CHECKING:
    from pathlib import Path

MIXED = ("xt32", "vlp32c", "os1-32", "helios-16p")


def yard(**changes: Any) -> Scene:
    document = tomllib.loads(demo().dump())
    document["loading"] |= {"levels_percent": [0.0], "hold_s": 1.0}
    for key, value in changes.items():
        document[key] = document.get(key, {}) | value if isinstance(value, dict) else value
    return Scene.from_document(document)


def with_models(models: tuple[str, ...], **changes: Any) -> Scene:
    lidars = [
        lidar.model_dump(exclude_none=True) | {"model": model, "clock": {}}
        for lidar, model in zip(demo().lidars, models, strict=True)
    ]
    return yard(lidars=lidars, **changes)


def world(folder: Path, sweep: Any, lidar: int) -> Any:
    pose = np.array(
        json.loads((folder / "truth_lidars.json").read_text())[lidar]["world_from_sensor"]
    )
    return sweep.xyz @ pose[:3, :3].T + pose[:3, 3]


def ids(models: tuple[str, ...]) -> tuple[str, ...]:
    known = set(_native.simulated_sensors())
    return tuple(
        next(name for name in known if name.replace("-", "") == model.replace("-", ""))
        for model in models
    )


@pytest.fixture(scope="module")
def mixed(tmp_path_factory: pytest.TempPathFactory) -> Path:
    exact = {"noise_mm": 0.0, "channel_offset_mm": 0.0, "unit_offset_mm": 0.0}
    scene = with_models(
        ids(MIXED), sensors=exact, ground={"roughness_mm": 0.0}, network={"foreign_hz": 0.0}
    )
    return simulate(scene, tmp_path_factory.mktemp("mixed") / "yard")


def test_one_capture_mixes_sensors_and_each_is_read_by_its_own_name(mixed: Path) -> None:
    test = config.load(mixed / "test.toml")
    capture = ld.open(mixed / "capture.pcap", config=test)
    for number, lidar in enumerate(test.lidars):
        sweeps = list(capture.sweeps(lidar.id, stop_s=0.6))
        xyz = np.concatenate([world(mixed, sweep, number) for sweep in sweeps])
        ground = -7.2 + 0.018 * xyz[:, 0] - 0.012 * xyz[:, 2]
        away = np.abs(xyz[:, 1] - ground)[xyz[:, 1] < ground + 0.25]
        # Angles are whole hundredths of a degree: 1.7 mm at 20 m, flat rays less.
        assert len(away) > 2000, lidar.id
        assert np.median(away) < 0.002, (lidar.id, float(np.median(away)))


def test_what_a_unit_needs_lies_beside_its_capture(mixed: Path) -> None:
    test = tomllib.loads((mixed / "test.toml").read_text())
    assert test["lidars"][2]["beams"] == ["L3.os1-32.json"]
    assert (mixed / "L3.os1-32.json").is_file()


def test_a_sensor_that_cannot_be_simulated_is_refused(tmp_path: Path) -> None:
    with pytest.raises(InvalidValueError, match="xt32"):
        simulate(with_models(("vlp61", "vlp16", "vlp16", "vlp16")), tmp_path / "out")


@pytest.fixture(scope="module")
def faults(tmp_path_factory: pytest.TempPathFactory) -> Path:
    lidars = [lidar.model_dump(exclude_none=True) | {"clock": {}} for lidar in demo().lidars]
    lidars[0]["kick"] = {"at_s": 0.5, "turn_mrad": [0.0, 0.5, 0.0], "shift_mm": [2.0, 0.0, 0.0]}
    lidars[1]["silent_s"] = [[0.4, 60.0]]
    x, y, z = demo().lidars[2].position_m
    targets = [
        {"name": "T1", "size_m": 0.4, "position_m": [x - 8.0, y + 1.0, z], "facing": "+x"},
        {"name": "T2", "kind": "sphere", "size_m": 0.4, "position_m": [x + 6.0, y + 1.0, z]},
    ]
    scene = yard(
        lidars=lidars,
        targets=targets,
        loading={"levels_percent": [0.0, 100.0], "hold_s": 1.0, "root_mrad": [0.3, 0.0, -0.2]},
        wall={"bow_mm": 150.0, "lean": 0.01},
        ground={"swell_mm": 20.0},
        sensors={"noise_freedom": 4, "faint_bias_mm": 1.0, "incidence_bias_mm": 2.0},
        blade={"mould_mm": 2.0},
    )
    return simulate(scene, tmp_path_factory.mktemp("faults") / "yard")


def test_targets_are_surveyed_and_shine(faults: Path) -> None:
    test = config.load(faults / "test.toml")
    assert [target.name for target in test.targets] == ["T1", "T2"]
    capture = ld.open(faults / "capture.pcap", config=test)
    sweeps = capture.sweeps("L3", stop_s=0.9)
    bright = np.concatenate([world(faults, s, 2)[s.intensity > 100] for s in sweeps])
    for target in test.targets:
        away = np.linalg.norm(bright - np.array(target.xyz_m), axis=1)
        assert (away < 0.35).sum() >= 5, target.name


def test_a_kicked_tripod_stands_in_the_truth(faults: Path) -> None:
    first, second, *_ = json.loads((faults / "truth_lidars.json").read_text())
    before, after = (
        np.array(first[key]) for key in ("world_from_sensor", "moved_world_from_sensor")
    )
    assert first["moved_s"] == 0.5
    assert np.allclose(after[:3, 3] - before[:3, 3], [0.002, 0.0, 0.0], atol=1e-9)
    turned = after[:3, :3] @ before[:3, :3].T
    assert math.isclose(turned[0, 2], 0.5e-3, rel_tol=1e-3)
    assert "moved_s" not in second


def test_a_silent_lidar_sends_no_more(faults: Path) -> None:
    second = json.loads((faults / "truth_lidars.json").read_text())[1]
    arrived = second["packets_sent"] - second["packets_lost"]
    assert 250 < arrived < 310  # 0.4 s of 1.327 ms


def test_the_root_has_a_channel(faults: Path) -> None:
    test = tomllib.loads((faults / "test.toml").read_text())
    assert test["root"] == {"file": "root.csv", "rx": "rx_mrad", "rz": "rz_mrad", "u_mrad": 0.02}
    root = pl.read_csv(faults / "root.csv")
    assert abs(root["rx_mrad"][-5:].mean() - 0.3) < 0.06


def test_a_blade_that_nobody_published_is_bent(tmp_path: Path) -> None:
    scene = yard(blade={"drawn": 7, "length_m": 80.0}, saddles=[], sections_m=[60.0, 80.0])
    folder = simulate(scene, tmp_path / "drawn")
    assert pl.read_csv(folder / "blade.csv")["s_m"][-1] == 80.0
    with pytest.raises(ConfigError, match="length_m"):
        yard(blade={"drawn": 7})


@pytest.fixture(scope="module")
def fatigue(tmp_path_factory: pytest.TempPathFactory) -> Path:
    swings = [
        {"direction": "+x", "amplitude_m": 1.5},
        {"direction": "+y", "amplitude_m": 0.2, "phase_deg": 40.0},
    ]
    scene = yard(
        fatigue={"frequency_hz": 0.8, "cycles": 3, "growth_s": 1.5, "swings": swings}, sways=[]
    )
    return simulate(scene, tmp_path_factory.mktemp("fatigue") / "yard")


def test_a_fatigue_test_swings_at_its_frequency_and_amplitude(fatigue: Path) -> None:
    cycles = json.loads((fatigue / "truth_cycles.json").read_text())
    assert (cycles["frequency_hz"], cycles["cycles"]) == (0.8, 3)
    tip = cycles["sections"][-1]
    # The mode's shape is scaled where the blade rests; bending far shortens it a little.
    assert abs(tip["amplitude_m"][0] - 1.5) < 0.02
    truth = pl.read_parquet(fatigue / "truth.parquet").filter(pl.col("s_m") == 110.0)
    x = truth["x_m"].to_numpy()
    still = x[: int(1.0 / 0.01)]
    assert np.ptp(still) < 1e-9
    crest = x[int(2.5 / 0.01) :]
    crossings = np.nonzero(np.diff(np.sign(crest - crest.mean())))[0]
    assert len(crossings) in (6, 7)  # three cycles


def test_its_configuration_says_so(fatigue: Path) -> None:
    assert config.load(fatigue / "test.toml").test.kind == "fatigue"
    assert len(pl.read_parquet(fatigue / "truth.parquet")) > 3 * 600


def test_a_fatigue_test_has_one_level() -> None:
    with pytest.raises(ConfigError, match="one load level"):
        yard(
            loading={"levels_percent": [0.0, 100.0]},
            fatigue={"swings": [{"direction": "+x", "amplitude_m": 1.0}]},
        )
