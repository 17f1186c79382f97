"""Does a simulated test hold together, and does it look like an independent one?"""

from __future__ import annotations

import json
import tomllib
from pathlib import Path
from typing import Any

import numpy as np
import polars as pl
import pytest

from lidar_deflect import config
from lidar_deflect.errors import ConfigError, InvalidValueError, OutputError
from lidar_deflect.scene import Scene, demo, flapwise
from lidar_deflect.simulation import simulate

SHARED = Path(__file__).parents[2] / "shared" / "scenes" / "edge"
FILES = {
    *("capture.pcap", "test.toml", "blade.csv", "contours.csv", "load.csv", "wire.csv"),
    *("theory.csv", "truth.parquet", "truth_lidars.json", "scene.toml"),
}


def small(**changes: Any) -> Scene:
    document = tomllib.loads(demo().dump())
    document["loading"] |= {"levels_percent": [0.0, 100.0], "hold_s": 0.4, "ramp_s": 0.2}
    document["network"] |= {"loss": 0.02}
    return Scene.from_document(document | changes)


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return simulate(small(), tmp_path_factory.mktemp("simulated") / "edge")


def columns_of(path: Path) -> list[str]:
    return path.read_text().splitlines()[0].split(",")


def test_all_files_are_there_and_nothing_else(folder: Path) -> None:
    assert {path.name for path in folder.iterdir()} == FILES
    assert [path.name for path in folder.parent.iterdir()] == ["edge"]


def test_tables_have_the_columns_of_an_independent_scene(folder: Path) -> None:
    if not SHARED.is_dir():
        pytest.skip("no independent scene beside the project")
    for name in ("blade.csv", "contours.csv", "load.csv", "wire.csv", "theory.csv"):
        assert columns_of(folder / name) == columns_of(SHARED / name)
    truth, other = (pl.read_parquet(path / "truth.parquet") for path in (folder, SHARED))
    assert truth.schema == other.schema
    keys = [
        set(json.loads((path / "truth_lidars.json").read_text())[0]) for path in (folder, SHARED)
    ]
    assert keys[0] == keys[1]


def test_the_configuration_is_complete(folder: Path) -> None:
    test = config.load(folder / "test.toml")
    assert len(test.lidars) == 4
    assert {point.on for point in test.control} == {"ground", "wall"}
    assert [section.s_m for section in test.sections] == [84.0, 100.0, 110.0]
    assert len(test.wires) == 3
    assert test.prediction is not None


def test_truth_is_sampled_every_ten_milliseconds(folder: Path) -> None:
    truth = pl.read_parquet(folder / "truth.parquet")
    for part in truth.partition_by("s_m"):
        assert part["time"].diff().drop_nulls().unique().to_list() == [
            pl.duration(milliseconds=10).pipe(pl.select).item()
        ]
        assert part["load"][0] == 0.0
        assert part["load"][-1] == 1.0


def test_sections_are_rigid_and_the_middle_is_half_way(folder: Path) -> None:
    truth = pl.read_parquet(folder / "truth.parquet")
    middle, leading, trailing, chord = (
        truth.select(names).to_numpy()
        for names in (
            ["x_m", "y_m", "z_m"],
            ["le_x_m", "le_y_m", "le_z_m"],
            ["te_x_m", "te_y_m", "te_z_m"],
            ["chord_x", "chord_y", "chord_z"],
        )
    )
    assert np.allclose(middle, (leading + trailing) / 2, atol=1e-12)
    length = np.linalg.norm(trailing - leading, axis=1)
    assert np.allclose(trailing - leading, chord * length[:, None], atol=1e-12)
    spread = (
        truth.with_columns(pl.Series("length", length))
        .group_by("s_m")
        .agg(pl.col("length").max() - pl.col("length").min())
    )
    assert spread["length"].max() < 1e-12


def test_the_axis_between_sections_keeps_its_length() -> None:
    """Chords between sections 1 m apart are shorter than the arc by (curvature)^2 / 24 only."""
    from lidar_deflect import _native, scene_plan

    scene = small(sections_m=[float(s) for s in range(20, 111)])
    document = scene_plan.plan(scene)
    document["levels"] = [0.0, 1.0]
    native = _native.Simulation(document)
    rows = native.truth(scene.sections_m, np.array([0.0, 0.9]), threads=1)
    nominal = native.nominal()
    axis_fraction = np.interp(scene.sections_m, nominal["s_m"], nominal["axis_fraction"])
    axis = rows[:, :, 3:6] + (rows[:, :, 6:9] - rows[:, :, 3:6]) * axis_fraction[None, :, None]
    length = np.linalg.norm(np.diff(axis, axis=1), axis=2).sum(axis=1)
    # 0.02 rad/m at most: 1.7e-5 m in each of 90 metres.
    assert np.all((length > 90.0 - 1.5e-3) & (length < 90.0 + 1e-6)), length


def test_the_load_moves_the_tip_as_promised() -> None:
    scene = demo()
    from lidar_deflect import _native, scene_plan

    native = _native.Simulation(scene_plan.plan(scene))
    held = np.array([1.0, 3 * (scene.loading.hold_s + scene.loading.ramp_s) + 2.0])
    rows = native.truth([110.0], held, threads=1)
    assert native.load(held).tolist() == [0.0, 1.0]
    assert 6.0 < np.linalg.norm(rows[1, 0, :3] - rows[0, 0, :3]) < 8.0
    # Unloaded: on the blade's axis but for prebend and sag.
    assert 109.5 < rows[0, 0, 2] < 110.1
    assert abs(rows[0, 0, 12]) < 1e-3


def test_packets_sent_and_not_lost_are_in_the_file(folder: Path) -> None:
    capture = pytest.importorskip("lidar_deflect.capture").open(folder / "capture.pcap")
    truth = {t["source"]: t for t in json.loads((folder / "truth_lidars.json").read_text())}
    assert len(capture.streams) == 4
    for stream in capture.streams:
        lidar = truth[stream.source.split(":")[0]]
        assert stream.packets == lidar["packets_sent"] - lidar["packets_lost"]
        assert stream.lost == lidar["packets_lost"] > 0


def test_wires_read_zero_at_rest_and_shorten_under_load(folder: Path) -> None:
    wires = pl.read_csv(folder / "wire.csv")
    readings = wires.select("s84_mm", "s100_mm", "s110_mm").to_numpy()
    assert np.abs(readings[:4]).max() < 60
    assert readings[-1, 0] < readings[-1, 1] < readings[-1, 2]
    assert readings[-1, 0] > 2000


def test_the_same_scene_gives_the_same_bytes(folder: Path, tmp_path: Path) -> None:
    again = simulate(Scene.load(folder / "scene.toml"), tmp_path / "again", threads=1)
    for name in FILES:
        assert (again / name).read_bytes() == (folder / name).read_bytes(), name


def test_a_folder_is_not_replaced_by_accident(folder: Path) -> None:
    before = (folder / "theory.csv").read_bytes()
    with pytest.raises(OutputError):
        simulate(small(seed=2), folder)
    assert (folder / "theory.csv").read_bytes() == before


def test_an_interrupted_simulation_leaves_nothing(tmp_path: Path) -> None:
    def interrupt(done: int, total: int) -> None:
        assert 0 < done <= total
        raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        simulate(small(), tmp_path / "out", progress=interrupt)
    assert list(tmp_path.iterdir()) == []


def test_a_misspelt_key_is_refused_with_the_nearest() -> None:
    document = tomllib.loads(demo().dump())
    document["sensors"]["noize_mm"] = 3.0
    with pytest.raises(ConfigError) as error:
        Scene.from_document(document)
    assert "noise_mm" in str(error.value.hint)


@pytest.mark.parametrize(
    "change",
    [
        {"sections_m": [84.0, 111.0]},
        {"blade": {"reference": "iea15"}},
        {"blade": {"leading_edge": "+z"}},
        {"saddles": [{"s_m": 120.0, "force_kn": 10.0}]},
        {"saddles": [{"s_m": 109.0, "force_kn": 1e6}]},
    ],
)
def test_a_scene_that_cannot_be_is_refused(change: dict[str, Any], tmp_path: Path) -> None:
    with pytest.raises(InvalidValueError):
        simulate(small(**change), tmp_path / "out")
    assert list(tmp_path.iterdir()) == []


def test_every_scene_survives_its_toml() -> None:
    for scene in (demo(), flapwise(seed=3)):
        assert Scene.from_document(tomllib.loads(scene.dump())) == scene
