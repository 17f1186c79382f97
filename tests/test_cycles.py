"""Are cycles counted exactly, and do amplitude, phase, frequency and damping come out?"""

import numpy as np
import polars as pl
import pytest
from numpy.typing import NDArray

import folders
from lidar_deflect import cycles, tables

Floats = NDArray[np.float64]

FREQUENCY_HZ = 0.6173
NOISE_M = 0.006
SECTIONS = {"S84": 84.0, "S100": 100.0, "S110": 110.0}
AMPLITUDE_M = 2.0
SIDE_SHARE, SIDE_PHASE_DEG = 0.15, 70.0


def swung(envelope: Floats, at_s: Floats, seed: int = 3) -> pl.DataFrame:
    """Table of states: along x by the envelope and the square of the span, a little along y."""
    angle = 2.0 * np.pi * FREQUENCY_HZ * at_s
    noise = np.random.default_rng(seed).normal(0.0, NOISE_M, (len(at_s), 3, 3))
    parts = []
    for k, (name, s_m) in enumerate(SECTIONS.items()):
        size = AMPLITUDE_M * envelope * (s_m / 110.0) ** 2
        side = np.radians(SIDE_PHASE_DEG)
        xyz = [
            0.1 + size * np.sin(angle) + noise[:, k, 0],
            -0.5 + SIDE_SHARE * size * np.sin(angle + side) + noise[:, k, 1],
            s_m - size**2 / 300.0 * np.sin(angle) ** 2 + noise[:, k, 2],
        ]
        columns: dict[str, tables.Values] = dict.fromkeys(tables.SCHEMAS["deflection"].names)
        columns |= {"time": folders.EPOCH_NS + folders.ns(at_s), "t_s": at_s}
        columns |= {"section": [name] * len(at_s), "s_m": [s_m] * len(at_s)}
        columns |= dict(zip(("x_m", "y_m", "z_m"), xyz, strict=True))
        columns |= {f"u{axis}_m": np.full(len(at_s), 0.004) for axis in "xyz"}
        columns |= {"n_points": [1000] * len(at_s), "lidars": ["L1"] * len(at_s)}
        columns |= {"status": ["ok"] * len(at_s)}
        parts.append(tables.build("deflection", columns))
    return pl.concat(parts).sort("time", maintain_order=True)


def steady(cycles_count: float = 20.4) -> pl.DataFrame:
    at_s = np.arange(0.0, cycles_count / FREQUENCY_HZ, 0.1)
    return swung(np.ones_like(at_s), at_s)


def test_whole_cycles_are_counted_and_parts_of_one_are_not() -> None:
    found = cycles.find(steady(20.4))
    assert found.facts["count"] == 20
    per_section = found.table.group_by("section").len()["len"]
    assert set(per_section) == {found.facts["count"]}
    start, stop = found.facts["steady_from_s"], found.facts["steady_to_s"]
    assert (stop - start) * FREQUENCY_HZ == pytest.approx(found.facts["steady"], abs=0.005)


def test_amplitude_phase_and_frequency_of_the_whole() -> None:
    found = cycles.find(steady())
    # Noise of 6 mm over 300 states leaves 6 / sqrt(150) = 0.5 mm and 1e-5 of the frequency.
    assert found.facts["frequency_hz"] == pytest.approx(FREQUENCY_HZ, rel=1e-4)
    tip = found.facts["sections"][-1]
    assert tip["amplitude_m"][0] == pytest.approx(AMPLITUDE_M, abs=0.003)
    assert tip["mean_m"][:2] == pytest.approx([0.1, -0.5], abs=0.003)
    assert tip["amplitude_m"][1] == pytest.approx(SIDE_SHARE * AMPLITUDE_M, abs=0.003)
    # The main direction lies between x and y; the phase of y against x is what was put in.
    assert tip["phase_deg"][1] - tip["phase_deg"][0] == pytest.approx(SIDE_PHASE_DEG, abs=1.0)


def test_every_cycle_has_its_own_amplitude_within_its_interval() -> None:
    found = cycles.find(steady())
    tip = found.table.filter(pl.col("section") == "S110")
    off = (tip["amplitude_x_m"] - AMPLITUDE_M).abs() / tip["uamplitude_x_m"]
    # 16 states of 6 mm each: 2 mm per cycle.
    assert float((tip["amplitude_x_m"] - AMPLITUDE_M).abs().max() or 1.0) < 0.008
    assert float((off < 2.5).mean() or 0.0) > 0.9
    hz = tip["frequency_hz"]
    assert float((hz - FREQUENCY_HZ).abs().max() or 1.0) < 0.005


def test_growth_is_counted_and_the_steady_part_is_full() -> None:
    at_s = np.arange(0.0, 40.0, 0.1)
    grows = np.clip((at_s - 5.0) / 6.0, 0.0, 1.0)
    found = cycles.find(swung(grows, at_s))
    full = (40.0 - 11.0) * FREQUENCY_HZ  # 17.9 turns
    # Whole cycles of the full part, with one of growth at most, less the first and the last one.
    assert found.facts["steady"] in (int(full) - 2, int(full) - 1)
    assert found.facts["count"] > found.facts["steady"]
    assert found.facts["sections"][-1]["amplitude_m"][0] == pytest.approx(AMPLITUDE_M, rel=0.01)


def test_a_snap_back_tells_damping() -> None:
    at_s = np.arange(0.0, 60.0, 0.1)
    decrement = 0.05
    let_go = np.exp(-decrement * FREQUENCY_HZ * at_s)
    (decay,) = cycles.find(swung(let_go, at_s)).facts["decays"]
    assert decay["decrement"] == pytest.approx(decrement, rel=0.02)
    assert abs(decay["decrement"] - decrement) < 4.0 * decay["udecrement"]
    assert decay["damping_ratio"] == pytest.approx(decrement / (2.0 * np.pi), rel=0.02)


def test_a_steady_swing_is_no_decay() -> None:
    assert cycles.find(steady()).facts["decays"] == []


def test_a_still_blade_has_no_cycles_and_says_so() -> None:
    at_s = np.arange(0.0, 20.0, 0.1)
    found = cycles.find(swung(np.zeros_like(at_s), at_s))
    assert found.table.is_empty()
    assert "does not swing" in found.warnings[0]


def test_states_too_far_apart_are_refused_by_name() -> None:
    at_s = np.arange(0.0, 60.0, 0.4)
    found = cycles.find(swung(np.ones_like(at_s), at_s))
    assert "rate_hz" in found.warnings[0]
