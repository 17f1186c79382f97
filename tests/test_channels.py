from datetime import UTC, datetime
from pathlib import Path

import numpy as np
import polars as pl
import pytest

from lidar_deflect import channels, delimited, tables
from lidar_deflect.channels import Channel
from lidar_deflect.errors import ConfigError, ConfigNotFoundError, InvalidValueError
from scenes import SCENES

START_NS = 1_718_000_000_255_000_000


def file(folder: Path, text: str, name: str = "load.csv") -> Path:
    path = folder / name
    path.write_text(text, encoding="utf-8")
    return path


COMMAS = "time_utc_s,load_percent\n1718000000.255,0.5\n1718000000.355,-1.25\n1718000000.455,\n"
VARIANTS = {
    "commas": COMMAS,
    "semicolons": COMMAS.replace(",", ";"),
    "tabs": COMMAS.replace(",", "\t"),
    "decimal comma": COMMAS.replace(",", ";").replace(".", ","),
    "quoted decimal comma": 'time_utc_s,load_percent\n"1718000000,255","0,5"\n'
    '"1718000000,355","-1,25"\n"1718000000,455",n/a\n',
    "blanks, comments, windows": "# made by a logger\r\n"
    + COMMAS.replace(",", ", ").replace("\n", "\r\n"),
    "byte order mark": "\ufeff" + COMMAS,
    "iso": "time_utc_s,load_percent\n2024-06-10T06:13:20.255Z,0.5\n2024-06-10 06:13:20.355Z,-1.25\n"
    "2024-06-10T06:13:20.455Z,-\n",
    "iso with a zone": "time_utc_s,load_percent\n2024-06-10T14:13:20.255+08:00,0.5\n"
    "2024-06-10T14:13:20.355+08:00,-1.25\n2024-06-10T14:13:20.455+08:00,nan\n",
}


@pytest.mark.parametrize("variant", VARIANTS)
def test_a_load_channel_reads_the_same_in_every_spelling(tmp_path: Path, variant: str) -> None:
    path = file(tmp_path, VARIANTS[variant])
    load = channels.read_load(path, value="load_percent")
    assert load.time_ns.tolist() == [START_NS + k * 100_000_000 for k in range(3)]
    np.testing.assert_equal(load.value, [0.5, -1.25, np.nan])
    assert (load.name, load.unit) == ("load", "percent")


def test_parquet_reads_like_csv(tmp_path: Path) -> None:
    noon = datetime(2024, 6, 10, 12, tzinfo=UTC)
    path = tmp_path / "load.dat"  # told by its content, not by its name
    pl.DataFrame({"when": [noon], "share": [0.4]}).write_parquet(path)
    load = channels.read_load(path, time="when", value="share", unit="fraction")
    assert load.time_ns.tolist() == [round(noon.timestamp()) * 10**9]
    assert load.value.tolist() == [40.0]


def test_a_nanosecond_survives_the_text(tmp_path: Path) -> None:
    path = file(tmp_path, "time_utc_s,a\n1718000000.123456789,1\n1718000001,2\n")
    assert delimited.instants(delimited.read(path), "time_utc_s", path).tolist() == [
        1_718_000_000_123_456_789,
        1_718_000_001_000_000_000,
    ]


def test_a_missing_column_is_answered_with_the_nearest(tmp_path: Path) -> None:
    path = file(tmp_path, COMMAS)
    with pytest.raises(ConfigError, match="no column 'load_pecent'") as caught:
        channels.read_load(path, value="load_pecent")
    assert caught.value.code == "config.column"
    assert caught.value.hint == "did you mean 'load_percent'?"
    assert caught.value.facts == (("columns", "time_utc_s, load_percent"),)


@pytest.mark.parametrize(
    ("text", "words"),
    [
        (COMMAS.replace("-1.25", "oops"), r"'oops' in data row 2, expected a number"),
        ("time_utc_s;load_percent\n1718000000.2;1.5\n1718000000.3;1,5\n", "'1,5' in data row 2"),
        ("time_utc_s,load_percent\n12.5,1\n", "12.5 in data row 1, expected seconds since 1970"),
        ("time_utc_s,load_percent\n1718000000255,1\n", "expected seconds since 1970"),
        ("time_utc_s,load_percent\n1718000001,1\n1718000001,2\n", "does not rise at data row 2"),
        ("time_utc_s,load_percent\n2024-06-10T06:13:20Z,1\n2024-13-10T06:13:20Z,1\n", "row 2"),
        ("", "neither as CSV nor as parquet"),
    ],
)
def test_what_cannot_be_meant_is_refused_with_its_row(
    tmp_path: Path, text: str, words: str
) -> None:
    with pytest.raises(ConfigError, match=words):
        channels.read_load(file(tmp_path, text), value="load_percent")


def test_a_file_that_is_not_there_is_not_found(tmp_path: Path) -> None:
    with pytest.raises(ConfigNotFoundError):
        channels.read_load(tmp_path / "none.csv", value="load_percent")


def test_a_broken_parquet_file_is_refused(tmp_path: Path) -> None:
    (tmp_path / "load.parquet").write_bytes(b"PAR1" + bytes(40))
    with pytest.raises(ConfigError, match="neither"):
        channels.read_load(tmp_path / "load.parquet", value="load_percent")


def test_a_wire_reads_in_metres_with_its_sign(tmp_path: Path) -> None:
    path = file(tmp_path, "time_utc_s,s84_mm\n1718000000,1500\n1718000001,-20\n")
    wire = channels.read_wire(path, name="W84", column="s84_mm", negate=True)
    assert wire.value.tolist() == [-1.5, 0.02]
    assert (wire.name, wire.unit) == ("W84", "m")


def test_root_rotation_reads_in_radians_for_the_columns_it_has(tmp_path: Path) -> None:
    path = file(tmp_path, "time_utc_s,a_mrad,b_mrad\n1718000000,1.5,-2\n")
    found = channels.read_root(path, rx="a_mrad", rz="b_mrad")
    assert [(c.name, c.unit, c.value.tolist()) for c in found] == [
        ("root_rx", "rad", [pytest.approx(0.0015)]),
        ("root_rz", "rad", [pytest.approx(-0.002)]),
    ]


def test_a_force_has_its_highest_hold_for_full_load(tmp_path: Path) -> None:
    seconds = np.arange(0.0, 20.0, 0.1)
    force = np.interp(seconds, [5.0, 15.0], [0.0, 250.0])
    rows = "".join(f"{1718000000 + t:.1f},{f:.3f}\n" for t, f in zip(seconds, force, strict=True))
    load = channels.read_load(file(tmp_path, "time_utc_s,f\n" + rows), value="f", unit="kN")
    assert load.value.max() == pytest.approx(100.0)


def test_an_unknown_unit_is_answered_with_the_known_ones(tmp_path: Path) -> None:
    path = file(tmp_path, COMMAS)
    with pytest.raises(InvalidValueError, match="expected one of mm, cm, m"):
        channels.read_wire(path, name="W", column="load_percent", unit="inch")
    with pytest.raises(InvalidValueError) as caught:
        channels.read_load(path, value="load_percent", unit="kn")
    assert caught.value.hint == "did you mean 'kN'?"


def test_a_prediction_is_linear_in_load_and_silent_where_it_says_nothing(tmp_path: Path) -> None:
    path = file(tmp_path, "section_m,mm\n84,3273\n110,6002\n")
    found = channels.read_prediction(path, section="section_m", value="mm")
    assert found.at(84.0, 40.0) == pytest.approx(0.4 * 3.273)
    assert found.at(100.0, 40.0) is None


def test_a_vector_prediction_has_three_columns(tmp_path: Path) -> None:
    path = file(tmp_path, "s,x,y,z\n84,3.0,-0.5,-0.1\n")
    found = channels.read_prediction(
        path, section="s", value=["x", "y", "z"], unit="m", quantity="vector", at_percent=80.0
    )
    np.testing.assert_allclose(found.at(84.0, 40.0), [1.5, -0.25, -0.05])
    with pytest.raises(InvalidValueError, match="expected 3"):
        channels.read_prediction(path, section="s", value="x", quantity="vector")


def test_truth_keeps_every_instant_of_every_section(tmp_path: Path) -> None:
    path = file(
        tmp_path,
        "time,s_m,x_m,y_m,z_m\n1718000000,84,0,1,84\n1718000000,110,0,2,110\n1718000001,84,3,1,83.9\n",
    )
    frame = channels.read_truth(path)
    assert frame.filter(pl.col("s_m") == 84.0)["x_m"].to_list() == [0.0, 3.0]
    assert frame.filter(pl.col("s_m") == 110.0).height == 1


def test_a_channel_is_read_between_its_samples_and_never_beyond() -> None:
    channel = Channel("load", START_NS + np.arange(3) * 10**9, np.array([0.0, np.nan, 4.0]), "m")
    np.testing.assert_allclose(channel.at([START_NS + 5 * 10**8]), [1.0])
    assert np.isnan(channel.at([START_NS - 1, START_NS + 2 * 10**9 + 1])).all()
    assert channel.mean(START_NS, START_NS + 2 * 10**9) == 2.0
    assert np.isnan(channel.mean(START_NS + 1, START_NS + 2))
    assert channel.shifted(0.25).time_ns[0] == START_NS + 250_000_000


def test_channels_survive_their_table() -> None:
    times = START_NS + np.arange(3) * 10**9
    load = Channel("load", times, np.array([0.0, np.nan, 4.0]), "percent")
    wire = Channel("W84", times, np.array([0.0, 0.1, 0.2]), "m")
    table = channels.to_table([load, wire], START_NS - 10**9)
    assert table["t_s"][0] == 1.0
    assert table["value"].null_count() == 1
    found = channels.from_table(table, "load")
    assert found is not None
    np.testing.assert_equal(found.value, load.value)
    assert found.time_ns.tolist() == times.tolist()
    assert channels.from_table(table, "W100") is None
    assert channels.to_table([], 0).schema == tables.SCHEMAS["channels"].schema


def test_the_channels_of_the_scenes_are_read() -> None:
    if not SCENES.is_dir():
        pytest.skip("the simulated scenes are not beside the project")
    edge = SCENES / "edge"
    load = channels.read_load(edge / "load.csv", value="load_percent")
    assert load.time_ns[0] == START_NS
    assert load.value.max() == pytest.approx(100.0, abs=1.0)
    wire = channels.read_wire(edge / "wire.csv", name="W110", column="s110_mm")
    assert 5.0 < wire.value.max() < 7.0
    theory = channels.read_prediction(
        edge / "theory.csv", section="section_m", value="deflection_mm_at_100_percent"
    )
    assert theory.at(110.0, 100.0) == pytest.approx(6.151)
    truth = channels.read_truth(edge / "truth.parquet")
    assert truth["s_m"].unique().sort().to_list() == [84.0, 100.0, 110.0]
