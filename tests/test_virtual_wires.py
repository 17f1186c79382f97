"""Does a virtual wire read what a wire would have read?"""

from pathlib import Path

import numpy as np
import polars as pl
import pytest

import beam_folders
import folders
from lidar_deflect import comparison, tables, wires
from lidar_deflect.channels import Channel

ANCHOR = [42.0, -7.0, 84.0]
BLADE = {"leading_edge": "-x", "suction_side": "+y", "length_m": 110.0}


def settings(**wire: object) -> dict[str, object]:
    own = {"name": "V84", "section": "S84", "anchor_m": ANCHOR} | wire
    return {
        "wires": [own],
        "blade": BLADE,
        "sections": [{"name": "S84", "s_m": 84.0}],
    }


def test_a_wire_at_mid_chord_reads_the_change_of_its_length() -> None:
    frame = folders.deflection(overhead_s=None)
    (channel,) = wires.predicted(frame, settings())
    own = frame.filter(pl.col("section") == "S84")
    place = own.select("x_m", "y_m", "z_m").to_numpy()
    length = np.linalg.norm(place - np.array(ANCHOR), axis=1)
    assert channel.name == "V84" + wires.SUFFIX
    assert channel.value == pytest.approx(length[0] - length)
    assert channel.value[-1] > 3.0  # towards the winch


def test_a_tie_beside_the_axis_turns_with_the_section() -> None:
    """A straight blade turned rigidly about y by 0.1 rad carries its tie along exactly."""
    angle, offset = 0.1, np.array([0.8, 0.3])
    turn = np.array(
        [
            [np.cos(angle), 0.0, np.sin(angle)],
            [0.0, 1.0, 0.0],
            [-np.sin(angle), 0.0, np.cos(angle)],
        ]
    )
    frame = rigid(turn)
    (channel,) = wires.predicted(frame, settings(attach=offset.tolist()))
    # chordwise towards the trailing edge (+x), thickness towards the suction side (+y)
    tie = np.array([offset[0], offset[1], 84.0])
    expected = np.linalg.norm(tie - ANCHOR) - np.linalg.norm(turn @ tie - ANCHOR)
    assert channel.value[-1] == pytest.approx(expected, abs=1e-9)
    (middle,) = wires.predicted(frame, settings())
    assert abs(middle.value[-1] - expected) > 1e-3


def rigid(turn: np.ndarray) -> pl.DataFrame:
    """Two states of a straight blade: at rest, and turned about its root."""
    frame = folders.deflection({"S84": (84.0, 0.0, 0.0, 0.0), "tip": (110.0, 0.0, 0.0, 0.0)})
    parts = []
    for name, s_m in (("S84", 84.0), ("tip", 110.0)):
        rows = frame.filter(pl.col("section") == name).head(2)
        rest = np.array([0.0, 0.0, s_m])
        points = np.array([rest, turn @ rest])
        parts.append(
            rows.with_columns(
                *(pl.Series(f"{a}_m", points[:, k]) for k, a in enumerate("xyz")),
                *(pl.Series(f"d{a}_m", (points - rest)[:, k]) for k, a in enumerate("xyz")),
                twist_deg=pl.lit(0.0),
            )
        )
    return pl.concat(parts).sort("time", maintain_order=True)


def test_twist_carries_a_tie_about_the_blade() -> None:
    frame = rigid(np.eye(3)).with_columns(
        twist_deg=pl.when(pl.col("time") == pl.col("time").max()).then(90.0).otherwise(0.0)
    )
    (channel,) = wires.predicted(frame, settings(attach=[1.0, 0.0]))
    # positive twist turns the trailing edge (+x) towards the suction side (+y)
    before, after = np.array([1.0, 0.0, 84.0]), np.array([0.0, 1.0, 84.0])
    expected = np.linalg.norm(before - ANCHOR) - np.linalg.norm(after - ANCHOR)
    assert channel.value[-1] == pytest.approx(expected)


def test_an_edge_without_a_drawing_has_no_line() -> None:
    assert wires.lines(settings(attach="leading_edge")) == []


def test_an_edge_is_half_a_chord_away(tmp_path: Path) -> None:
    path = tmp_path / "blade.csv"
    path.write_text(
        "s_m,chord_m,twist_deg,rel_thickness,prebend_m,axis_fraction\n"
        "0,4,0,0.3,0,0.4\n110,2,0,0.2,0,0.4\n"
    )
    config = settings(attach="leading_edge")
    config["blade"] = BLADE | {"geometry": str(path)}
    (line,) = wires.lines(config)
    chord = 4.0 - 2.0 * 84.0 / 110.0
    assert line.offset_m == pytest.approx([-0.5 * chord, 0.0, 0.0])


def test_a_real_wire_and_a_virtual_one_stand_in_the_comparison() -> None:
    frame = beam_folders.deflection()
    steps = folders.step_table(frame)
    config = settings()
    config["wires"] = [
        {"name": "W84", "section": "S84", "anchor_m": ANCHOR},
        {"name": "V100", "section": "S100", "anchor_m": [42.0, -7.0, 100.0]},
    ]
    real = wires.predicted(frame, config)[0]
    read = Channel("W84", real.time_ns, real.value + 0.003, "m")
    found = comparison.configured(steps, config, [read])
    tables.check("comparison", found)
    last = found.filter(pl.col("step") == "100 %")
    own = last.filter(pl.col("source") == "W84", pl.col("quantity") == "wire")
    # both ends of a difference carry the 3 mm, so it cancels in the reading from zero
    assert own["measured_m"][0] == pytest.approx(own["reference_m"][0], abs=3e-4)
    assert own["u_m"][0] > 0.0
    virtual = last.filter(pl.col("source") == "V100")
    assert virtual["quantity"].to_list() == ["wire"]
    assert virtual["reference_m"].to_list() == [None]
    assert virtual["error_percent"].to_list() == [None]
    assert comparison.table2(found)
