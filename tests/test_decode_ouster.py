"""Ouster packets against ouster-sdk 1.0.1, pixel for pixel."""

from pathlib import Path

import numpy as np
import pytest

from lidar_deflect import capture

CAPTURES = Path(__file__).parents[2] / "shared" / "captures"
NAMES = (
    "ouster_os0_128_rng15",
    "ouster_os0_32_rng19_dual",
    "ouster_os1_32_legacy",
    "ouster_os2_128_rng19",
    "ouster_two_sensors_same_ports",
)

# Both programs work in f64 and store f32: 0.01 mm and the last digit of a coordinate.
TOLERANCE_M = 1e-5
FLOAT32 = 2.0**-23


def keys(sensor: np.ndarray, ring: np.ndarray, column: np.ndarray, index: np.ndarray) -> np.ndarray:
    wide = [values.astype(np.int64) for values in (sensor, ring, column, index)]
    return ((wide[0] * 1024 + wide[1]) * 65_536 + wide[2]) * 2 + wide[3]


def decoded(path: Path) -> dict[str, np.ndarray]:
    opened = capture.open(path)
    lists: dict[str, list[np.ndarray]] = {"lidar": []}
    for sweep in opened.sweeps():
        number = opened.lidars.index(sweep.lidar)
        lists["lidar"].append(np.full(len(sweep.ring), number))
        for name in ("xyz", "ring", "block", "return_index", "intensity", "time_ns", "range_m"):
            lists.setdefault(name, []).append(getattr(sweep, name))
    return {name: np.concatenate(parts) for name, parts in lists.items()}


@pytest.mark.parametrize("name", NAMES)
def test_captures_decode_to_the_reference(name: str) -> None:
    path = CAPTURES / f"{name}.pcap"
    if not path.is_file():
        pytest.skip("the captures are not beside the project")
    with np.load(CAPTURES / f"{name}.ref.npz") as file:
        reference = {key: file[key] for key in file.files}
    found = decoded(path)
    merged = sum(stream.merged for stream in capture.open(path).streams)
    assert len(found["ring"]) + merged == len(reference["ring"])
    # Both number the sensors of one capture by address.
    sensors = reference["sensor"] - reference["sensor"].min()
    ours = keys(found["lidar"], found["ring"], found["block"], found["return_index"])
    theirs = keys(sensors, reference["ring"], reference["column"], reference["return_index"])
    order, other = np.argsort(ours), np.argsort(theirs)
    other = other[np.isin(theirs[other], ours)]
    np.testing.assert_array_equal(ours[order], theirs[other])
    xyz = np.column_stack([reference[axis] for axis in "xyz"])[other]
    off_m = np.abs(found["xyz"][order] - xyz)
    allowed_m = TOLERANCE_M + FLOAT32 * np.abs(xyz)
    assert (off_m <= allowed_m).all(), f"worst {off_m.max()} m"
    np.testing.assert_array_equal(found["intensity"][order], reference["reflectivity"][other])
    np.testing.assert_array_equal(
        np.rint(found["range_m"][order] * 1e3), reference["range_mm"][other]
    )
    for lidar in np.unique(found["lidar"]):
        own = found["lidar"][order] == lidar
        times, stamps = (
            found["time_ns"][order][own],
            reference["timestamp_ns"][other][own].astype(int),
        )
        # A free clock is brought to the host's; within one turn its drift is nothing.
        assert np.ptp(times - stamps) <= 1


def test_packets_of_accelerations_are_not_foreign() -> None:
    path = CAPTURES / "ouster_os2_128_rng19.pcap"
    if not path.is_file():
        pytest.skip("the captures are not beside the project")
    opened = capture.open(path)
    assert dict(opened.drops) == {"companion": 10}
    (stream,) = opened.streams
    assert (stream.model, stream.packets, stream.lost) == ("os2-128", 64, 0)
