"""Velodyne and Hesai points against independent decoders: samples, and captures where they are."""

from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray

from lidar_deflect import capture

SAMPLES = Path(__file__).parent / "data" / "packets"
CAPTURES = Path(__file__).parents[2] / "shared" / "captures"

Columns = dict[str, NDArray[np.generic]]
NAMES = ("xyz", "ring", "packet", "block", "intensity", "time_ns", "azimuth_deg")


@dataclass(frozen=True)
class Golden:
    """A capture and what it holds."""

    name: str
    model: str
    return_mode: str
    rpm: float
    merged: int = 0


VELODYNE = (
    Golden("velodyne_hdl32e_gps", "hdl32e", "strongest", 702),
    Golden("velodyne_vlp32c_fov", "vlp32c", "strongest", 600),
    Golden("velodyne_vls128_single", "vls128", "strongest", 602),
)
HESAI = (
    Golden("hesai_pandar40p_1200rpm", "pandar40p", "last", 1199),
    Golden("hesai_pandar64_dual", "pandar64", "dual", 601, merged=342_163),
    Golden("hesai_xt32_dual", "xt32", "dual", 600, merged=234_474),
    Golden("hesai_qt128_dual", "qt128", "dual", 600, merged=160_129),
)


def whole(golden: Golden) -> tuple[Path, Path]:
    path = next(CAPTURES.glob(f"{golden.name}.pcap*"), None)
    if path is None:
        pytest.skip("the captures are not beside the project")
    return path, CAPTURES / f"{golden.name}.ref.npz"


def sample(golden: Golden) -> tuple[Path, Path]:
    return SAMPLES / f"{golden.name}.pcap", SAMPLES / f"{golden.name}.npz"


def decoded(path: Path) -> tuple[Columns, int, capture.StreamInfo]:
    """Columns of all sweeps, second returns merged, and the stream."""
    opened = capture.open(path)
    (stream,) = opened.streams
    sweeps = opened.sweeps()
    parts = list(sweeps)
    columns = {name: np.concatenate([getattr(part, name) for part in parts]) for name in NAMES}
    return columns, sweeps.merged, stream


def reference_of(path: Path) -> tuple[Columns, NDArray[np.float64]]:
    with np.load(path) as file:
        reference = {name: file[name] for name in file.files}
    axes = [reference[axis].astype(float) for axis in "xyz"]
    return reference, np.column_stack(axes)


def assert_stream(stream: capture.StreamInfo, golden: Golden) -> None:
    assert (stream.model, stream.return_mode) == (golden.model, golden.return_mode)
    assert (stream.lost, stream.late, stream.duplicated, stream.foreign) == (0, 0, 0, 0)
    assert stream.candidates == ()


def assert_times(found: NDArray[np.int64], expected: NDArray[np.float64], within_s: float) -> None:
    """Compare times but for one offset: that of the sensor's clock from UTC."""
    off_s = found / 1e9 - expected
    np.testing.assert_allclose(off_s, np.median(off_s), rtol=0, atol=within_s)


def check_hesai(path: Path, reference_path: Path, golden: Golden) -> capture.StreamInfo:
    found, merged, stream = decoded(path)
    reference, xyz = reference_of(reference_path)
    assert len(found["ring"]) + merged == len(xyz)

    def slots(columns: Columns) -> NDArray[np.int64]:
        packet, block, ring = (columns[n].astype(np.int64) for n in ("packet", "block", "ring"))
        return (packet << 16) + (block << 8) + ring

    common, mine, theirs = np.intersect1d(slots(found), slots(reference), return_indices=True)
    assert len(common) == len(found["ring"])
    off_m = np.linalg.norm(found["xyz"][mine] - xyz[theirs], axis=1)
    allowed_m = 1e-4 + 2e-6 * np.linalg.norm(xyz[theirs], axis=1)
    assert (off_m <= allowed_m).all(), f"worst {off_m.max()} m"
    np.testing.assert_array_equal(found["intensity"][mine], reference["intensity"][theirs])
    assert_times(found["time_ns"][mine], reference["timestamp"][theirs], 1e-6)
    assert stream.beams == f"{golden.name}.angle.csv, {golden.name}.firetime.csv"
    assert_stream(stream, golden)
    return stream


def check_velodyne(path: Path, reference_path: Path, golden: Golden) -> capture.StreamInfo:
    found, merged, stream = decoded(path)
    reference, xyz = reference_of(reference_path)
    assert (len(found["ring"]), merged) == (len(xyz), 0)
    for name in ("packet", "ring", "intensity"):
        np.testing.assert_array_equal(found[name], reference[name])
    mine = found["xyz"].astype(float)
    np.testing.assert_allclose(mine[:, 2], xyz[:, 2], rtol=0, atol=1e-3)
    level_m = np.hypot(xyz[:, 0], xyz[:, 1])
    np.testing.assert_allclose(np.hypot(mine[:, 0], mine[:, 1]), level_m, rtol=0, atol=1e-3)
    known = ~np.isin(found["packet"], packets_of_unknown_rate(golden, found))
    if golden.model == "hdl32e":
        off_m = np.linalg.norm(mine - xyz, axis=1)
        assert (off_m <= 1e-3 + 1.8e-4 * np.linalg.norm(xyz, axis=1)).all(), f"{off_m.max()} m"
    cross = mine[:, 0] * xyz[:, 1] - mine[:, 1] * xyz[:, 0]
    dot = mine[:, 0] * xyz[:, 0] + mine[:, 1] * xyz[:, 1]
    off_deg = np.abs(np.degrees(np.arctan2(cross, dot)))
    assert off_deg[known].max() < 0.15
    assert_times(found["time_ns"][known], reference["timestamp"][known], 8e-6)
    has_file = path.parent == CAPTURES
    beams = f"velodyne_{golden.model}.calib.yml" if has_file else "factory table"
    assert stream.beams == beams
    assert_stream(stream, golden)
    return stream


def packets_of_unknown_rate(golden: Golden, found: Columns) -> NDArray[np.generic]:
    """Packets in which the reference itself does not know how fast the rotor turns.

    It has no rate in the first packet of a VLS-128, and takes the gap of a limited field of view
    within a packet for rotation: there its azimuths are off by up to 10 degrees.
    """
    if golden.model == "vls128":
        return np.array([0])
    if golden.model != "vlp32c":
        return np.array([], dtype=int)
    blocks = np.unique(
        np.column_stack([found["packet"], found["block"]]), axis=0, return_index=True
    )
    rows, first = blocks
    azimuth_deg = found["azimuth_deg"][first]
    step_deg = np.abs((np.diff(azimuth_deg) + 180) % 360 - 180)
    is_gap = (step_deg > 20) & (np.diff(rows[:, 0]) == 0)
    return rows[1:][is_gap, 0]


@pytest.mark.parametrize("golden", HESAI, ids=lambda golden: golden.model)
def test_samples_of_hesai_decode_to_the_reference(golden: Golden) -> None:
    check_hesai(*sample(golden), golden)


@pytest.mark.parametrize("golden", HESAI, ids=lambda golden: golden.model)
def test_whole_captures_of_hesai_decode_to_the_reference(golden: Golden) -> None:
    stream = check_hesai(*whole(golden), golden)
    assert stream.merged == golden.merged
    assert stream.rpm == pytest.approx(golden.rpm, abs=2)


@pytest.mark.parametrize("golden", VELODYNE, ids=lambda golden: golden.model)
def test_samples_of_velodyne_decode_to_the_reference(golden: Golden) -> None:
    check_velodyne(*sample(golden), golden)


@pytest.mark.parametrize("golden", VELODYNE, ids=lambda golden: golden.model)
def test_whole_captures_of_velodyne_decode_to_the_reference(golden: Golden) -> None:
    stream = check_velodyne(*whole(golden), golden)
    assert stream.rpm == pytest.approx(golden.rpm, abs=3)


def test_few_packets_lie_in_the_packets_that_are_left_out() -> None:
    golden = VELODYNE[1]
    path, _ = whole(golden)
    found, _, stream = decoded(path)
    assert len(packets_of_unknown_rate(golden, found)) <= 5
    assert stream.field_of_view_deg == pytest.approx(182, abs=1)
