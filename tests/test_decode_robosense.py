"""RoboSense packets against rs_driver 1.5.19, point for point."""

from pathlib import Path

import numpy as np
import pytest

from lidar_deflect import capture

CAPTURE = Path(__file__).parents[2] / "shared" / "captures" / "robosense_helios16p_a.pcap"

# The reference's angle table is in steps of 0.01 degree.
TOLERANCE_M = 1e-3
TOLERANCE_OF_RANGE = 1e-4
NAMES = ("xyz", "ring", "block", "packet", "intensity", "time_ns", "range_m")


@pytest.fixture(autouse=True)
def present() -> None:
    if not CAPTURE.is_file():
        pytest.skip("the captures are not beside the project")


def test_without_an_option_it_decodes_to_the_reference() -> None:
    opened = capture.open(CAPTURE)
    sweeps = list(opened.sweeps())
    found = {name: np.concatenate([getattr(s, name) for s in sweeps]) for name in NAMES}
    with np.load(CAPTURE.with_suffix(".ref.npz")) as file:
        reference = {key: file[key] for key in file.files}
    assert len(found["ring"]) == len(reference["ring"])
    # Both shots of a laser in one block have the same ring: their times tell them apart.
    order = np.lexsort((found["time_ns"], found["ring"], found["block"], found["packet"]))
    other = np.lexsort([reference[key] for key in ("channel", "ring", "block", "packet")])
    for name in ("packet", "block", "ring", "intensity"):
        np.testing.assert_array_equal(found[name][order], reference[name][other])
    xyz = np.column_stack([reference[axis] for axis in "xyz"])[other]
    off_m = np.linalg.norm(found["xyz"][order] - xyz, axis=1)
    allowed_m = TOLERANCE_M + TOLERANCE_OF_RANGE * found["range_m"][order]
    assert (off_m <= allowed_m).all(), f"worst {off_m.max()} m"
    # A free clock is brought to the host's; within the capture only f64 seconds are in between.
    times = found["time_ns"][order] / 1e9 - reference["timestamp"][other]
    assert np.ptp(times) < 2e-6


def test_what_speaks_for_another_model_is_said() -> None:
    # The header names no model, the unit tells 32 angles and sends twice as fast as a Helios 16P.
    (stream,) = capture.open(CAPTURE).streams
    assert (stream.model, stream.candidates) == ("helios16p", ("helios32",))
    assert stream.rpm == pytest.approx(600, abs=1)
    assert (stream.packets, stream.lost, stream.return_mode) == (375, 0, "strongest")
    assert any("--sensor SOURCE=helios32" in note for note in stream.notes)
    assert any("describes 32 lasers" in note for note in stream.notes)
    assert stream.beams == "packets to port 7788"


def test_the_other_model_is_taken_when_it_is_named() -> None:
    (stream,) = capture.open(CAPTURE, sensors={"192.168.1.201": "helios-32"}).streams
    assert (stream.model, stream.candidates) == ("helios32", ())
    assert not any("--sensor" in note for note in stream.notes)
