"""Decoded points against an independent decoder: samples always, captures where they are."""

from pathlib import Path

import numpy as np
import pytest

from lidar_deflect import capture

SAMPLES = Path(__file__).parent / "data" / "packets"
CAPTURES = Path(__file__).parents[2] / "shared" / "captures"

# velodyne-decoder rounds azimuths to 0.01 degree.
TOLERANCE_M = 1e-3
TOLERANCE_OF_RANGE = 1.8e-4
KINDS = {1: "strongest", 2: "last", 3: "merged"}


def columns(path: Path) -> dict[str, np.ndarray]:
    sweeps = list(capture.open(path).sweeps())
    names = ("xyz", "range_m", "ring", "packet", "intensity", "return_kind", "time_ns")
    return {name: np.concatenate([getattr(s, name) for s in sweeps]) for name in names}


def assert_agrees(found: dict[str, np.ndarray], xyz: np.ndarray, reference: dict) -> None:
    for name in ("packet", "ring", "intensity"):
        np.testing.assert_array_equal(found[name], reference[name])
    kinds = [KINDS[kind] for kind in reference["return_type"]]
    assert [capture.RETURN_KINDS[kind] for kind in found["return_kind"]] == kinds
    off_m = np.linalg.norm(found["xyz"] - xyz, axis=1)
    allowed_m = TOLERANCE_M + TOLERANCE_OF_RANGE * found["range_m"]
    assert (off_m <= allowed_m).all(), f"worst {(off_m - allowed_m).max() + TOLERANCE_M} m"


@pytest.mark.parametrize("name", ["velodyne_vlp16_single", "velodyne_vlp16_dual"])
def test_samples_decode_to_the_reference(name: str) -> None:
    table = np.genfromtxt(SAMPLES / f"{name}.csv", delimiter=",", names=True)
    reference = {key: table[key].astype(int) for key in ("packet", "ring", "intensity")}
    reference["return_type"] = table["return_type"].astype(int)
    xyz = np.column_stack([table["x_m"], table["y_m"], table["z_m"]])
    assert_agrees(columns(SAMPLES / f"{name}.pcap"), xyz, reference)


@pytest.mark.parametrize(
    ("name", "merged"), [("velodyne_vlp16_single", 0), ("velodyne_vlp16_dual", 114_853)]
)
def test_whole_captures_decode_to_the_reference(name: str, merged: int) -> None:
    path = CAPTURES / f"{name}.pcap"
    if not path.is_file():
        pytest.skip("the captures are not beside the project")
    with np.load(CAPTURES / f"{name}.ref.npz") as reference:
        xyz = np.column_stack([reference["x"], reference["y"], reference["z"]])
        found = columns(path)
        assert_agrees(found, xyz, reference)
        # Firing times within the capture; the reference leaves a free clock as it is.
        since = (found["time_ns"] - found["time_ns"][0]) / 1e9
        expected = reference["timestamp"] - reference["timestamp"][0]
        np.testing.assert_allclose(since, expected, atol=1e-6)
    stream = capture.open(path).streams[0]
    assert (stream.lost, stream.late, stream.duplicated, stream.merged) == (0, 0, 0, merged)
    assert stream.rpm == pytest.approx(600, abs=1)


def test_a_locked_sensor_clock_is_believed() -> None:
    path = CAPTURES / "velodyne_vlp16_single.pcap"
    if not path.is_file():
        pytest.skip("the captures are not beside the project")
    stream = capture.open(path).streams[0]
    assert stream.clock["kind"] == "locked"
    assert stream.position is not None
    assert (stream.position["packets"], stream.position["pps"]) == (57, "locked")
    with np.load(CAPTURES / "velodyne_vlp16_single.ref.npz") as reference:
        times = columns(path)["time_ns"] / 1e9
        np.testing.assert_allclose(times, reference["timestamp"], atol=1e-6)
