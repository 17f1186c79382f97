import numpy as np
import polars as pl
import pytest

import folders
from lidar_deflect import holds, steps, tables


def test_steps_are_the_means_over_the_holds() -> None:
    frame = folders.step_table(folders.deflection())
    assert frame["step"].to_list() == [s for s in ("0 %", "40 %", "100 %") for _ in range(3)]
    assert frame["section"].to_list() == ["S84", "S100", "tip"] * 3
    for row in frame.iter_rows(named=True):
        share = float(row["step"].split()[0]) / 100.0
        _, x, y, z = (folders.SHAPE | folders.TIP)[row["section"]]
        assert (row["dx_m"], row["dy_m"], row["dz_m"]) == pytest.approx(
            (share * x, share * y, share * z)
        )
        assert row["d_m"] == pytest.approx(share * np.linalg.norm((x, y, z)))
        assert row["load"] == pytest.approx(100.0 * share)
        assert (row["status"], row["reason"], row["lidars"]) == ("ok", None, "L1+L2")
        assert row["udx_m"] is None
        assert row["from"] < row["time"] < row["to"]


def test_the_total_is_the_norm_of_the_mean_not_the_mean_of_the_norms() -> None:
    # Noise of 0.1 m about zero has a mean norm of 0.16 m; the mean vector is near zero.
    frame = folders.deflection(overhead_s=None)
    noise = np.random.default_rng(4).normal(0.0, 0.1, (frame.height, 3))
    noisy = frame.with_columns(
        *(pl.col(f"d{axis}_m") + noise[:, k] for k, axis in enumerate("xyz"))
    )
    first = folders.step_table(frame).row(0, named=True)
    found = steps.average(noisy, [hold_of(first)]).row(0, named=True)
    assert found["d_m"] == pytest.approx(np.linalg.norm([found[f"d{a}_m"] for a in "xyz"]))
    assert found["d_m"] < 0.06


def hold_of(row: dict[str, object]) -> holds.Hold:
    start, stop = pl.Series([row["from"], row["to"]]).cast(pl.Datetime("ns", "UTC")).cast(pl.Int64)
    return holds.Hold(start, stop, "0 %", 0.0)


def overhead_in_hold(hidden_s: tuple[float, float]) -> dict[str, object]:
    """The 100 % step (from 14.25 s) of the tip when frames of it were overhead."""
    frame = folders.deflection(folders.TIP, overhead_s=hidden_s)
    return folders.step_table(frame).row(-1, named=True)


def test_measured_states_count_before_filled_ones() -> None:
    row = overhead_in_hold((15.0, 16.0))
    assert (row["status"], row["reason"]) == ("ok", None)


def test_a_step_measured_for_less_than_half_is_degraded() -> None:
    row = overhead_in_hold((14.0, 18.5))
    assert (row["status"], row["reason"]) == ("degraded", "overhead")
    assert row["dx_m"] == pytest.approx(6.07)


def test_a_step_of_filled_states_says_so() -> None:
    row = overhead_in_hold((14.0, 30.0))
    assert (row["status"], row["reason"]) == ("interpolated", "overhead")


def test_a_step_without_states_is_missing_and_never_zero() -> None:
    frame = folders.deflection(folders.TIP, overhead_s=(0.0, 20.0))
    row = steps.average(frame, [holds.Hold(*span(15.0, 19.0), "100 %", 100.0)]).row(0, named=True)
    assert (row["status"], row["reason"], row["n_points"]) == ("missing", "overhead", 0)
    assert row["dx_m"] is None
    assert row["d_m"] is None


def span(start_s: float, stop_s: float) -> tuple[int, int]:
    return folders.EPOCH_NS + round(start_s * 1e9), folders.EPOCH_NS + round(stop_s * 1e9)


def test_no_holds_give_an_empty_table_of_the_declared_form() -> None:
    frame = steps.average(folders.deflection(), [])
    assert frame.is_empty()
    assert frame.schema == tables.SCHEMAS["steps"].schema


def test_seconds_of_a_step_are_those_of_its_middle() -> None:
    row = folders.step_table(folders.deflection()).row(-1, named=True)
    assert row["t_s"] == pytest.approx((hold_of(row).middle_ns - folders.EPOCH_NS) * 1e-9)
