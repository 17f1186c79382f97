"""Does a configuration say what is meant, and is what cannot be meant refused with its place?"""

import json
import math
import tomllib
from pathlib import Path

import pytest
from pydantic import BaseModel

from lidar_deflect import config as cfg
from lidar_deflect.config.nearest import table_model
from lidar_deflect.errors import ConfigError, ConfigNotFoundError

EVERY_KEY = Path(__file__).parent / "data" / "config" / "every_key.toml"
MINIMAL = '[blade]\nlength_m = 110\n[[lidars]]\nid = "L1"\n'


def load(*overrides: str, path: Path = EVERY_KEY) -> cfg.Config:
    return cfg.load(path, overrides, check_files=False)


def written(folder: Path, text: str) -> Path:
    path = folder / "test.toml"
    path.write_text(text, encoding="utf-8")
    return path


def refused(*overrides: str) -> ConfigError:
    with pytest.raises(ConfigError) as caught:
        load(*overrides)
    assert caught.value.exit_code == 4
    return caught.value


def test_every_documented_key_is_in_the_models() -> None:
    config = load()
    assert config.lidars[0].axes is not None
    assert config.lidars[0].axes.x == (-1.0, 0.0, 0.0)
    assert config.paper.box_m is not None
    assert config.paper.box_m.z == (60.0, 112.0)
    assert config.load.saddles_s_m == (33.0, 57.2, 75.0, 95.0)
    assert config.section("S84").s_m == 84.0
    assert config.lidar("L2").source == "192.168.1.202:2368"


def test_every_number_and_path_of_the_models_has_a_meaning() -> None:
    def fields(model: type[BaseModel]) -> None:
        for name, field in model.model_fields.items():
            assert field.description, f"{model.__name__}.{name}"
            inner = table_model(field)
            if inner:
                fields(inner)

    fields(cfg.Config)


def test_little_needs_to_be_said(tmp_path: Path) -> None:
    config = cfg.load(written(tmp_path, MINIMAL))
    assert config.lidars[0].model == "auto"
    assert config.measure.method == "beam"
    assert config.paper.mu == 1.5


def test_a_written_configuration_loads_again_equal(tmp_path: Path) -> None:
    for config in (load(), cfg.load(written(tmp_path, MINIMAL))):
        text = cfg.dump(config)
        again = cfg.load(written(tmp_path, text), check_files=False)
        assert again == config
        assert cfg.dump(again) == text


def test_paths_are_relative_to_the_file() -> None:
    folder = EVERY_KEY.resolve().parent
    assert load().blade.geometry == folder / "blade.csv"
    assert load("load.file=x/y.csv").load.file == folder / "x" / "y.csv"


def test_the_hash_follows_the_meaning_and_not_the_folder(tmp_path: Path) -> None:
    moved = load(path=written(tmp_path, EVERY_KEY.read_text(encoding="utf-8")))
    assert cfg.config_hash(moved) == cfg.config_hash(load())
    assert cfg.config_hash(load("paper.mu=2")) != cfg.config_hash(load())


def test_a_vector_becomes_a_unit_vector() -> None:
    direction = load("load.direction=[3, 4, 0]").load.direction
    assert direction == pytest.approx((0.6, 0.8, 0.0), abs=1e-15)
    assert math.hypot(*direction or ()) == pytest.approx(1.0, abs=1e-15)


def test_axes_give_the_rotation_whose_columns_they_are() -> None:
    rotation = load("lidars.L1.axes={x='+y', y='+z', z='+x'}").lidars[0].nominal_rotation()
    assert rotation == ((0.0, 0.0, 1.0), (1.0, 0.0, 0.0), (0.0, 1.0, 0.0))


@pytest.mark.parametrize(
    ("override", "value"),
    [
        ("lidars.L1.model=vlp16", "vlp16"),
        ('lidars.0.model="vlp16"', "vlp16"),
        ("lidars.\"L1\".model = 'vlp16'", "vlp16"),
    ],
)
def test_an_override_names_a_lidar_by_id_or_index(override: str, value: str) -> None:
    assert load(override).lidars[0].model == value


@pytest.mark.parametrize(
    ("override", "key", "hint"),
    [
        ("paper.min_point=3", "paper.min_point", "did you mean min_points?"),
        ("papr.mu=3", "papr", "did you mean paper?"),
        ("lidars.L1.sorce=x", "lidars.L1.sorce", "did you mean source?"),
        ("measure.alpha_deg=3", "measure.alpha_deg", "alpha_deg belongs to paper"),
    ],
)
def test_an_unknown_key_is_refused_with_the_nearest(override: str, key: str, hint: str) -> None:
    error = refused(override)
    assert error.code == "config.unknown_key"
    assert dict(error.facts)["key"] == key
    assert dict(error.facts)["file"] == str(EVERY_KEY)
    assert error.hint == hint


@pytest.mark.parametrize(
    ("override", "key", "found"),
    [
        ("paper.mu='1,5'", "paper.mu", "'1,5'"),
        ("paper.mu=-1", "paper.mu", "-1"),
        ("paper.mu=nan", "paper.mu", "nan"),
        ("paper.min_points=4.0", "paper.min_points", "4.0"),
        ("paper.strict=1", "paper.strict", "1"),
        ("blade.length_m=true", "blade.length_m", "True"),
        ("blade.length_m='110'", "blade.length_m", "'110'"),
        ("load.direction=q", "load.direction", "'q'"),
        ("load.direction=[0, 0, 0]", "load.direction", "[0, 0, 0]"),
        ("load.file=5", "load.file", "5"),
        ("lidars.L1.source='300.1.1.1'", "lidars.L1.source", "'300.1.1.1'"),
        ("lidars.L1.source='192.168.1.1:0'", "lidars.L1.source", "'192.168.1.1:0'"),
        ("paper.box_m.x=[3, 1]", "paper.box_m.x", "[3, 1]"),
        ("wires.W84.attach='nose'", "wires.W84.attach", "'nose'"),
        ("control.0.on='roof'", "control.0.on", "'roof'"),
    ],
)
def test_a_value_out_of_its_range_is_refused(override: str, key: str, found: str) -> None:
    error = refused(override)
    facts = dict(error.facts)
    assert (facts["key"], facts["found"]) == (key, found)
    assert facts["expected"]
    assert facts["meaning"]


@pytest.mark.parametrize(
    ("override", "key", "words"),
    [
        ("lidars.L2.source='192.168.1.201'", "lidars.L2.source", "same source"),
        ("lidars.L2.source='192.168.1.201:2368'", "lidars.L2.source", "same source"),
        ("lidars.L1.id='L2'", "lidars.L2.id", "used twice"),
        ("sections.S84.s_m=110.01", "sections.S84.s_m", "beyond the blade"),
        ("load.saddles_s_m=[30, 200]", "load.saddles_s_m.1", "beyond the blade"),
        ("wires.W84.section='S85'", "wires.W84.section", "no section 'S85'"),
        ("distance.0.between=['L1', 'L9']", "distance.0.between", "no lidar 'L9'"),
        ("distance.0.between=['L1', 'L1']", "distance.0.between", "one lidar"),
        ("lidars.L1.axes.y='+y'", "lidars.L1.axes", "left-handed"),
        ("lidars.L1.axes.y='-x'", "lidars.L1.axes", "right angles"),
        ("blade.suction_side=[1, 1, 0]", "blade.suction_side", "right angles"),
        ("blade.leading_edge='+z'", "blade.leading_edge", "along the blade"),
        ("reference.to_s=0.0", "reference.to_s", "ends before"),
        ("prediction.quantity='vector'", "prediction.value", "quantity"),
    ],
)
def test_keys_that_contradict_each_other_are_refused(override: str, key: str, words: str) -> None:
    error = refused(override)
    assert dict(error.facts)["key"] == key
    assert words in error.message


def test_two_sensors_behind_one_address_are_told_apart_by_port() -> None:
    config = load("lidars.L1.source='192.168.1.202:2369'")
    assert [lidar.source for lidar in config.lidars] == ["192.168.1.202:2369", "192.168.1.202:2368"]


def test_several_lidars_need_a_source(tmp_path: Path) -> None:
    path = written(tmp_path, MINIMAL + '[[lidars]]\nid = "L2"\n')
    with pytest.raises(ConfigError, match="has no source"):
        cfg.load(path)


def test_all_troubles_of_a_file_are_told_at_once() -> None:
    error = refused("paper.mu=-1", "paper.muu=1", "gates.max_u_m=0")
    also = [line for word, line in error.facts if word == "also"]
    assert error.message == "unknown key paper.muu"
    assert [line.partition(":")[0] for line in also] == ["paper.mu", "gates.max_u_m"]


@pytest.mark.parametrize("override", ["paper", "=3", "a b=3", "lidars.L9.id=x", "test.id.x=3"])
def test_an_override_that_cannot_be_meant_is_refused(override: str) -> None:
    assert refused(override).code == "config.override"


def test_a_file_that_is_missing_or_no_toml_is_told(tmp_path: Path) -> None:
    with pytest.raises(ConfigNotFoundError):
        cfg.load(tmp_path / "none.toml")
    with pytest.raises(FileNotFoundError):
        cfg.load(tmp_path / "none.toml")
    with pytest.raises(ConfigError, match="line 1"):
        cfg.load(written(tmp_path, "length_m = = 3"))
    (tmp_path / "test.toml").write_bytes(b"\xff\xfe\x00")
    with pytest.raises(ConfigError, match="UTF-8"):
        cfg.load(tmp_path / "test.toml")
    with pytest.raises(ConfigError, match="cannot be read"):
        cfg.load(tmp_path)


def test_a_named_file_must_be_there_unless_a_finished_run_is_read() -> None:
    with pytest.raises(ConfigNotFoundError) as caught:
        cfg.load(EVERY_KEY)
    assert dict(caught.value.facts)["key"] == "blade.geometry"


def test_the_json_schema_knows_every_key_of_the_example() -> None:
    schema = cfg.json_schema()
    json.dumps(schema)
    document = tomllib.loads(EVERY_KEY.read_text(encoding="utf-8"))
    assert set(document) == set(schema["properties"])
    paper = schema["$defs"]["Paper"]["properties"]
    assert set(document["paper"]) == set(paper)
    assert paper["mu"]["default"] == 1.5
