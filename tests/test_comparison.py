import json
from pathlib import Path

import numpy as np
import polars as pl
import pytest

import folders
from lidar_deflect import comparison, config, holds, steps, tables
from lidar_deflect.comparison import ComparisonWarning, error_percent
from lidar_deflect.errors import InvalidValueError, ResultError, ResultNotFoundError
from scenes import SCENES

# Hu, Zhu, Zhou, Liu, Optics 2024, 5, 151-164 (CC BY 4.0), as printed.
TABLE_1 = {  # section (m): x, y, total (m)
    84: (3.28, 0.52, 3.318),
    100: (4.989, 0.72, 5.04),
    110: (6.07, 0.71, 6.112),
}
TABLE_2 = {  # section (m): wire, theory, lidar (mm); error of wire, error of lidar (percent)
    84: (3094, 3273, 3318, -5.47, 1.37),
    100: (4731, 4921, 5040, -3.86, 2.42),
    110: (5561, 6002, 6112, -7.35, 1.83),
}
TABLE_3 = {  # section (m): x, y, z, total (m)
    84: (17.77, 1.39, 2.70, 18.03),
    100: (28.96, 1.88, 6.49, 29.74),
    110: (35.29, 2.21, 8.32, 36.32),
}


@pytest.mark.parametrize("section", TABLE_2)
def test_equation_16_gives_the_errors_of_table_2(section: int) -> None:
    wire, theory, lidar, wire_error, lidar_error = TABLE_2[section]
    # Printed to two decimals.
    assert error_percent(wire, theory) == pytest.approx(wire_error, abs=0.005)
    assert error_percent(lidar, theory) == pytest.approx(lidar_error, abs=0.005)


def test_equation_16_has_no_value_at_zero() -> None:
    assert np.isnan(error_percent([1.0, 0.0], [0.0, 0.0])).all()


def test_totals_of_table_1_are_norms_of_components_but_for_84_m() -> None:
    norm = {s: float(np.hypot(x, y)) for s, (x, y, _) in TABLE_1.items()}
    assert norm[84] == pytest.approx(3.321, abs=0.0005)
    assert abs(norm[84] - TABLE_1[84][2]) > 0.0025  # the printed 3.318 is another number
    assert norm[100] == pytest.approx(TABLE_1[100][2], abs=0.001)
    assert norm[110] == pytest.approx(TABLE_1[110][2], abs=0.001)


def test_the_error_at_84_m_follows_from_the_printed_total_not_from_its_components() -> None:
    assert error_percent(1e3 * np.hypot(3.28, 0.52), 3273) == pytest.approx(1.47, abs=0.005)


def test_lidar_values_of_table_2_are_the_totals_of_table_1() -> None:
    for section, row in TABLE_2.items():
        assert row[2] == pytest.approx(1e3 * TABLE_1[section][2])


@pytest.mark.parametrize("section", TABLE_3)
def test_totals_of_table_3_are_norms_of_components(section: int) -> None:
    *components, total = TABLE_3[section]
    assert np.linalg.norm(components) == pytest.approx(total, abs=0.006)


def test_table_3_would_need_a_blade_that_stretches_or_bends_backwards() -> None:
    # The unloaded blade lies along z; with z variations towards the root, as bending has it.
    loaded = np.array([[x, y, s - z] for s, (x, y, z, _) in TABLE_3.items()])
    chords = np.diff(loaded, axis=0)
    stretch = np.linalg.norm(chords, axis=1) / [16.0, 10.0]
    assert stretch == pytest.approx(
        [1.035, 1.034], abs=0.001
    )  # a chord is never longer than its arc
    slope_deg = np.degrees(np.arctan2(np.hypot(chords[:, 0], chords[:, 1]), chords[:, 2]))
    assert slope_deg[1] < slope_deg[0] - 4.0  # the tip turns back although the load pulls outward
    # With z variations away from the root it would stretch still more.
    outward = np.array([[x, y, s + z] for s, (x, y, z, _) in TABLE_3.items()])
    assert (np.linalg.norm(np.diff(outward, axis=0), axis=1) / [16.0, 10.0] > 1.34).all()


PAPER_SHAPE = {f"S{s}": (float(s), x, y, 0.0) for s, (x, y, _) in TABLE_1.items()}


def paper_folder(path: Path) -> Path:
    """The paper's measurement as a result folder: table 1 at 100 %."""
    return folders.write(path, folders.deflection(PAPER_SHAPE, overhead_s=None))


def theory(path: Path) -> Path:
    rows = "".join(f"{s},{row[1]}\n" for s, row in TABLE_2.items())
    path.write_text("section_m,deflection_mm_at_100_percent\n" + rows)
    return path


def wire(path: Path) -> Path:
    """Readings over time that reach those of table 2 at 100 %."""
    at_s = folders.time_s()
    share = folders.load_percent(at_s) / 100.0
    columns = {f"s{s}_mm": row[0] * share for s, row in TABLE_2.items()}
    pl.DataFrame({"time_utc_s": folders.EPOCH_NS * 1e-9 + at_s, **columns}).write_csv(path)
    return path


def at(frame: pl.DataFrame, step: str, section: str, source: str, quantity: str) -> dict:
    rows = frame.filter(
        pl.col("step") == step,
        pl.col("section") == section,
        pl.col("source") == source,
        pl.col("quantity") == quantity,
    )
    assert rows.height == 1
    return rows.row(0, named=True)


def test_the_papers_table_2_comes_out_of_its_measurement(tmp_path: Path) -> None:
    folder = paper_folder(tmp_path / "results")
    found = comparison.compare(folder, theory(tmp_path / "theory.csv"))
    with pytest.warns(ComparisonWarning, match="its line is not known"):
        wires = comparison.compare(folder, wire(tmp_path / "wire.csv"))
    text = comparison.table2(pl.concat([found, wires]))
    lines = [line.split() for line in text.splitlines()[3:6]]
    assert [line[:3] for line in lines] == [
        [str(s), str(row[0]), str(row[1])] for s, row in TABLE_2.items()
    ]
    # 84 m: 3321 mm and 1.47 %, as the components give them; wires as printed.
    assert [line[3] for line in lines] == ["3321", "5041", "6111"]
    assert [float(line[4]) for line in lines] == [row[3] for row in TABLE_2.values()]
    assert [float(line[6]) for line in lines] == [1.47, 2.43, 1.82]


def test_the_papers_table_1_comes_out_of_its_measurement() -> None:
    text = comparison.table1(folders.step_table(folders.deflection(PAPER_SHAPE)))
    lines = [line.split() for line in text.splitlines()[2:]]
    assert text.startswith("change from the unloaded hold at 100 %")
    assert [line[2:6] for line in lines] == [
        ["3.280", "0.520", "0.000", "3.321"],
        ["4.989", "0.720", "0.000", "5.041"],
        ["6.070", "0.710", "0.000", "6.111"],
    ]


def test_a_prediction_is_linear_in_load_and_no_error_is_relative_to_nothing(tmp_path: Path) -> None:
    folder = paper_folder(tmp_path / "results")
    frame = comparison.compare(folder, theory(tmp_path / "theory.csv"))
    assert frame.schema == tables.SCHEMAS["comparison"].schema
    row = at(frame, "40 %", "S110", "prediction", "total")
    assert row["reference_m"] == pytest.approx(0.4 * 6.002)
    assert row["error_percent"] == pytest.approx(
        100 * (0.4 * 6.1114 - 0.4 * 6.002) / (0.4 * 6.002), abs=1e-3
    )
    assert row["u_m"] is None
    assert at(frame, "0 %", "S110", "prediction", "total")["error_percent"] is None


def test_a_prediction_along_the_load_is_held_against_that_component(tmp_path: Path) -> None:
    folder = paper_folder(tmp_path / "results")
    config = {
        "load": {"direction": "+x"},
        "prediction": {"value": "t", "section": "s", "unit": "m", "quantity": "direction"},
    }
    (tmp_path / "t.csv").write_text("s,t\n110,6.0\n")
    frame = comparison.compare(folder, tmp_path / "t.csv", config=config, kind="prediction")
    row = at(frame, "100 %", "S110", "prediction", "direction")
    assert row["measured_m"] == pytest.approx(6.07)
    assert row["error_percent"] == pytest.approx(100 * 0.07 / 6.0)


def test_a_vector_prediction_is_held_against_each_component(tmp_path: Path) -> None:
    folder = folders.write(tmp_path / "r", folders.deflection(folders.TIP, u_m=0.004))
    config = {"prediction": {"value": ["x", "y", "z"], "section": "s", "unit": "m"}}
    config["prediction"] |= {"quantity": "vector", "at_percent": 50.0}
    (tmp_path / "t.csv").write_text("s,x,y,z\n110,3.0,-0.4,-0.1\n")
    frame = comparison.compare(folder, tmp_path / "t.csv", config=config, kind="prediction")
    row = at(frame, "100 %", "tip", "prediction", "dy")
    assert (row["measured_m"], row["reference_m"]) == pytest.approx((-0.71, -0.8), abs=1e-3)
    assert row["error_percent"] == pytest.approx(100 * (-0.71 + 0.8) / -0.8, abs=0.1)
    assert row["u_m"] == pytest.approx(0.004)


def test_a_prediction_without_a_load_is_refused(tmp_path: Path) -> None:
    frame = folders.deflection(PAPER_SHAPE, load=False, overhead_s=None)
    folder = folders.write(tmp_path / "results", frame)
    with pytest.raises(ResultError) as caught:
        comparison.compare(folder, theory(tmp_path / "theory.csv"))
    assert caught.value.code == "comparison.no_load"


WIRE_CONFIG = {
    "wires": [
        {
            "name": "W110",
            "section": "tip",
            "attach": "mid_chord",
            "anchor_m": [20.0, -7.0, 110.0],
            "column": "s110_mm",
            "unit": "mm",
        }
    ]
}


def test_a_wire_is_held_against_what_it_would_have_read_and_against_the_total(
    tmp_path: Path,
) -> None:
    folder = folders.write(tmp_path / "r", folders.deflection(folders.TIP, u_m=0.004))
    frame = comparison.compare(folder, wire(tmp_path / "wire.csv"), config=WIRE_CONFIG)
    row = at(frame, "100 %", "tip", "W110", "wire")
    # Mid-chord from (0, 1, 110) by (6.07, -0.71, -0.21); both distances to the anchor by hand.
    before = np.linalg.norm([20.0, -8.0, 0.0])
    after = np.linalg.norm([13.93, -7.29, 0.21])
    assert row["measured_m"] == pytest.approx(before - after)
    assert row["reference_m"] == pytest.approx(5.561)
    assert row["u_m"] == pytest.approx(0.004)  # equal in all directions
    total = at(frame, "100 %", "tip", "W110", "total")
    assert total["measured_m"] == pytest.approx(np.linalg.norm([6.07, 0.71, 0.21]))
    assert total["reference_m"] == row["reference_m"]


def test_a_checked_configuration_serves_as_well_as_a_mapping(tmp_path: Path) -> None:
    folder = folders.write(tmp_path / "r", folders.deflection(folders.TIP))
    path = wire(tmp_path / "wire.csv")
    (tmp_path / "test.toml").write_text(
        '[blade]\nlength_m = 110.0\n[[lidars]]\nid = "L1"\n'
        '[[sections]]\nname = "tip"\ns_m = 110.0\n'
        '[[wires]]\nname = "W110"\nsection = "tip"\nanchor_m = [20.0, -7.0, 110.0]\n'
        'file = "wire.csv"\ncolumn = "s110_mm"\n'
    )
    checked = comparison.compare(folder, path, config=config.load(tmp_path / "test.toml"))
    assert checked.equals(comparison.compare(folder, path, config=WIRE_CONFIG))


def test_a_wire_counts_from_its_own_reading_in_the_unloaded_hold(tmp_path: Path) -> None:
    folder = folders.write(tmp_path / "r", folders.deflection(folders.TIP))
    path = wire(tmp_path / "wire.csv")
    shifted = pl.read_csv(path).with_columns(pl.col("s110_mm") + 250.0)
    shifted.write_csv(path)
    frame = comparison.compare(folder, path, config=WIRE_CONFIG)
    assert at(frame, "100 %", "tip", "W110", "wire")["reference_m"] == pytest.approx(5.561)


def test_a_wire_tied_elsewhere_is_not_projected_and_that_is_said(tmp_path: Path) -> None:
    folder = folders.write(tmp_path / "r", folders.deflection(folders.TIP))
    config = {"wires": [WIRE_CONFIG["wires"][0] | {"attach": "leading_edge"}]}
    with pytest.warns(ComparisonWarning, match="W110"):
        frame = comparison.compare(folder, wire(tmp_path / "wire.csv"), config=config)
    assert frame["quantity"].unique().to_list() == ["total"]


def test_two_runs_are_compared_step_by_step(tmp_path: Path) -> None:
    a = folders.write(tmp_path / "a", folders.deflection(overhead_s=None))
    scaled = {n: (s, 1.1 * x, 1.1 * y, 1.1 * z) for n, (s, x, y, z) in folders.SHAPE.items()}
    b = folders.write(tmp_path / "b", folders.deflection(scaled, overhead_s=None))
    frame = comparison.compare(b, a)
    assert set(frame["source"]) == {"a"}
    assert set(frame["section"]) == {"S84", "S100"}  # the tip has no twin
    loaded = frame.filter(pl.col("step") == "100 %")
    assert loaded["error_percent"].to_list() == pytest.approx([10.0] * loaded.height)


def test_the_kind_of_a_reference_is_told_by_its_columns_and_can_be_said(tmp_path: Path) -> None:
    assert comparison.recognise(theory(tmp_path / "t.csv")).kind == "prediction"
    found = comparison.recognise(wire(tmp_path / "w.csv"))
    assert (found.kind, found.why) == ("wire", "it has readings over time_utc_s")
    assert comparison.recognise(paper_folder(tmp_path / "results")).kind == "run"
    truth = tmp_path / "truth.csv"
    truth.write_text("time,s_m,x_m,y_m,z_m\n1718000000,84,0,0,84\n")
    assert comparison.recognise(truth).kind == "truth"
    assert comparison.recognise(truth, kind="wire").kind == "wire"
    with pytest.raises(InvalidValueError, match="expected one of wire, prediction, truth, run"):
        comparison.recognise(truth, kind="guess")
    odd = tmp_path / "odd.csv"
    odd.write_text("a,b\n1,2\n")
    with pytest.raises(ResultError) as caught:
        comparison.recognise(odd)
    assert caught.value.facts == (("columns", "a, b"),)


def test_what_does_not_fit_is_an_error_and_never_an_empty_table(tmp_path: Path) -> None:
    folder = paper_folder(tmp_path / "results")
    with pytest.raises(ResultNotFoundError):
        comparison.compare(folder, tmp_path / "none.csv")
    with pytest.raises(ResultNotFoundError, match="no result folder"):
        comparison.compare(tmp_path, theory(tmp_path / "t.csv"))
    (tmp_path / "far.csv").write_text("section_m,deflection_mm\n12,1\n")
    with pytest.raises(ResultError, match="nothing in"):
        comparison.compare(folder, tmp_path / "far.csv")
    (tmp_path / "none.csv").write_text("time_utc_s,force\n1718000000,1\n")
    with pytest.raises(ResultError, match=r"no column of .* is a draw wire"):
        comparison.compare(folder, tmp_path / "none.csv")


def test_saving_keeps_other_sources_and_replaces_its_own(tmp_path: Path) -> None:
    folder = paper_folder(tmp_path / "results")
    first = comparison.compare(folder, theory(tmp_path / "t.csv"))
    comparison.save(folder, first)
    with pytest.warns(ComparisonWarning):
        second = comparison.compare(folder, wire(tmp_path / "w.csv"))
    comparison.save(folder, second)
    path = comparison.save(folder, first)
    found = tables.read(path, name="comparison")
    assert found.height == first.height + second.height
    assert set(found["source"]) == {"prediction", "s84_mm", "s100_mm", "s110_mm"}
    own = tables.metadata(folder / "steps.parquet")["configuration_hash"]
    assert tables.metadata(path)["configuration_hash"] == own


def scene_folder(name: str, path: Path) -> tuple[Path, Path]:
    """The truth of a scene as if it had been measured, at 10 Hz, and the scene itself."""
    if not SCENES.is_dir():
        pytest.skip("the simulated scenes are not beside the project")
    scene = SCENES / name
    truth = pl.read_parquet(scene / "truth.parquet").gather_every(10)
    truth = truth.with_columns(
        pl.lit("S").alias("section") + pl.col("s_m").cast(pl.Int32).cast(pl.String)
    )
    zero = truth.filter(pl.col("time") < truth["time"].min() + pl.duration(milliseconds=3700))
    zero = zero.group_by("s_m").agg(pl.col("x_m", "y_m", "z_m").mean().name.suffix("_0"))
    truth = truth.join(zero, on="s_m").sort("time", "s_m")
    delta = {f"d{a}_m": truth[f"{a}_m"] - truth[f"{a}_m_0"] for a in "xyz"}
    columns: dict[str, tables.Values] = dict.fromkeys(tables.SCHEMAS["deflection"].names)
    columns |= {
        c: truth[c] for c in ("time", "s_m", "load", "section", "x_m", "y_m", "z_m")
    } | delta
    columns |= {"load": 100.0 * truth["load"]}  # a share there, percent here
    columns |= {"t_s": (truth["time"].cast(pl.Int64) - truth["time"].cast(pl.Int64).min()) * 1e-9}
    columns |= {"n_points": [9] * truth.height, "lidars": ["L1"] * truth.height}
    columns |= {"status": ["ok"] * truth.height}
    frame = tables.build("deflection", columns)
    one = frame.filter(pl.col("section") == "S84")
    found = holds.from_load(one["time"].cast(pl.Int64).to_numpy(), one["load"].to_numpy())
    folder = folders.write(path, frame, steps=steps.average(frame, found))
    return folder, scene


@pytest.mark.parametrize("name", ["edge", "flap"])
def test_on_a_scene_the_projected_wire_agrees_with_the_truth_and_the_total_does_not(
    tmp_path: Path, name: str
) -> None:
    folder, scene = scene_folder(name, tmp_path / name)
    survey = json.loads((scene / "survey.json").read_text())
    wires = [
        {
            "name": f"W{w['section_m']}",
            "section": f"S{w['section_m']}",
            "anchor_m": w["anchor_m"],
            "column": w["column"],
        }
        for w in survey["wires"]
    ]
    frame = comparison.compare(folder, scene / "wire.csv", config={"wires": wires})
    loaded = frame.filter(pl.col("step") == "100 %").with_columns(
        (pl.col("measured_m") - pl.col("reference_m")).abs().alias("off")
    )
    # The wires' own noise is a few millimetres; over a hold its mean is within one or two, and
    # sampling the sway at 10 Hz adds as much.
    assert loaded.filter(pl.col("quantity") == "wire")["off"].max() < 0.004
    assert loaded.filter(pl.col("quantity") == "total")["off"].min() > 0.015


def test_on_a_scene_the_truth_agrees_with_itself(tmp_path: Path) -> None:
    folder, scene = scene_folder("edge", tmp_path / "edge")
    frame = comparison.compare(folder, scene / "truth.parquet")
    assert set(frame["quantity"]) == {"total", "dx", "dy", "dz"}
    # 10 ms against 100 ms samples of a hold that sways by centimetres.
    assert (frame["measured_m"] - frame["reference_m"]).abs().max() < 0.005
    theory = comparison.compare(folder, scene / "theory.csv")
    worst = theory.filter(pl.col("step") == "100 %")["error_percent"].abs().max()
    assert 0.2 < worst < 3.0  # "a prediction, off by about a percent"
