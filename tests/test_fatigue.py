"""Is a simulated fatigue test measured: amplitude, frequency, number of cycles?

All figures are of simulated data; poses come from the calibration of the same capture.
"""

import json
import tomllib
from pathlib import Path

import numpy as np
import polars as pl
import pytest

import lidar_deflect as ld
from lidar_deflect.result import Result
from lidar_deflect.scene import Scene, demo

pytestmark = pytest.mark.slow

FREQUENCY_HZ, CYCLES, GROWTH_S, REST_S = 0.8, 7, 2.5, 2.0
TIP_M = 2.5


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    document = tomllib.loads(demo().dump())
    document["loading"] |= {"levels_percent": [0.0], "hold_s": REST_S}
    document["sways"] = []
    document["fatigue"] = {
        "frequency_hz": FREQUENCY_HZ,
        "cycles": CYCLES,
        "growth_s": GROWTH_S,
        "swings": [
            {"direction": "+x", "amplitude_m": TIP_M},
            {"direction": "+y", "amplitude_m": 0.3, "phase_deg": 40.0},
        ],
    }
    scene = Scene.from_document(document)
    return ld.simulate(scene, tmp_path_factory.mktemp("fatigue") / "swung")


@pytest.fixture(scope="module")
def measured(folder: Path) -> Result:
    return ld.Test.load(folder / "test.toml").measure(folder / "capture.pcap")


def test_amplitude_frequency_and_count_are_those_of_the_truth(
    folder: Path, measured: Result
) -> None:
    truth = json.loads((folder / "truth_cycles.json").read_text())
    found = measured.run["cycles"]
    assert found["frequency_hz"] == pytest.approx(FREQUENCY_HZ, rel=1e-4)
    # From where the swing begins: 2.5 s of growth and 7 cycles are 9.0 turns, less the last tenth
    # of a second, which has no state.
    assert found["count"] == int(CYCLES + GROWTH_S * FREQUENCY_HZ - 0.1)
    assert measured.cycles.height == 3 * found["count"]
    for own, true in zip(found["sections"], truth["sections"], strict=True):
        for axis in range(3):
            off = own["amplitude_m"][axis] - true["amplitude_m"][axis]
            assert abs(off) < max(0.005, 0.003 * true["amplitude_m"][axis]), (own, axis)
            assert abs(off) < 3.5 * own["uamplitude_m"][axis], (own, axis)


def test_states_within_the_swing_are_right_at_their_own_time(
    folder: Path, measured: Result
) -> None:
    truth = pl.read_parquet(folder / "truth.parquet").filter(pl.col("s_m") == 110.0)
    tip = measured.deflection.filter(pl.col("s_m") == 110.0)
    tip = tip.head(tip.height - 2)  # the last states have data on one side only
    at = truth["time"].cast(pl.Int64).to_numpy()
    for axis in "xyz":
        true = np.interp(tip["time"].cast(pl.Int64).to_numpy(), at, truth[f"{axis}_m"].to_numpy())
        off = np.abs(tip[f"{axis}_m"].to_numpy() - true)
        # The tip passes its middle with 12 m/s: a millisecond would be 12 mm.
        assert np.quantile(off, 0.95) < 0.015, axis


def test_crests_are_no_load_steps(measured: Result) -> None:
    assert measured.steps["step"].unique().to_list() == ["0 %"]
    assert measured.failed_gates == ()


def test_without_rest_it_is_refused_by_name(folder: Path, measured: Result) -> None:
    test = ld.Test.load(folder / "test.toml")
    with pytest.raises(ld.LidarDeflectError) as caught:
        test.measure(folder / "capture.pcap", calibration=measured.calibration, start_s=6.0)
    assert caught.value.code == "measurement.no_rest"
