"""Are rotations of the blade line and their uncertainty those of its slope?"""

import numpy as np
import pytest

from lidar_deflect.measurement.beam import rotation
from lidar_deflect.measurement.beam.uncertainty import HoldCovariance

STATIONS = np.arange(60.0, 111.0)


def test_a_line_that_turns_about_y_moves_along_x() -> None:
    rest = np.stack([0.0 * STATIONS, 0.0 * STATIONS, STATIONS], axis=1)
    turn = 0.1
    bent = np.stack([np.sin(turn) * STATIONS, 0.0 * STATIONS, np.cos(turn) * STATIONS], axis=1)
    found = rotation.rotations_rad(STATIONS, bent[None], rest)
    assert found[0, :, 0] == pytest.approx(0.0, abs=1e-12)
    assert found[0, :, 1] == pytest.approx(turn, abs=1e-9)


def test_the_uncertainty_of_a_slope_comes_from_what_neighbours_do_not_share() -> None:
    count, sigma = len(STATIONS), 0.003
    shape = (2, count, 4)
    independent = np.zeros(shape + shape)
    shared = np.zeros(shape + shape)
    for axis in range(3):
        independent[1, :, axis, 1, :, axis] = sigma**2 * np.eye(count)
        shared[1, :, axis, 1, :, axis] = sigma**2
    values = np.zeros(shape)
    own = rotation.variance_rad2(STATIONS, HoldCovariance(values, independent), slice(None))
    # Differences over two metres between independent points: sqrt(2) sigma / 2 m.
    assert np.sqrt(own[1, 5]) == pytest.approx(np.sqrt(2.0) * sigma / 2.0)
    same = rotation.variance_rad2(STATIONS, HoldCovariance(values, shared), slice(None))
    assert np.sqrt(same[1, 5]) == pytest.approx(0.0, abs=1e-9)
    assert own[0] == pytest.approx(0.0)


def test_between_holds_it_lies_between_them() -> None:
    variance = np.zeros((2, 1, 2))
    variance[1] = 4e-6
    u = rotation.over_time(variance, np.array([0.0, 1.0]), np.array([0.0, 0.25, 1.0]))
    assert u[:, 0, 0] == pytest.approx([0.0, 1e-3, 2e-3])


def test_a_swung_blade_keeps_nothing_in_common_with_its_rest_beyond_a_metre() -> None:
    from lidar_deflect.measurement.beam.swung import widened
    from lidar_deflect.measurement.beam.uncertainty import Uncertainty

    joint = np.zeros((1, 1, 4, 1, 1, 4))
    for axis, sigma in enumerate((0.003, 0.004, 0.001)):
        joint[0, 0, axis, 0, 0, axis] = sigma**2
    moved = np.array([[[0.0, 0.0, 0.0]], [[2.0, 0.0, 0.0]]])
    bare = Uncertainty(*(np.zeros((2, 1, 3)),) * 2, *(np.zeros((2, 1)),) * 2)
    found = widened(bare, HoldCovariance(np.zeros((1, 1, 4)), joint), moved)
    assert found.deflection_m[0] == pytest.approx(0.0)
    assert found.deflection_m[1, 0] == pytest.approx(np.sqrt(2.0) * np.array([0.003, 0.004, 0.001]))
    assert found.total_m[1, 0] == pytest.approx(np.sqrt(2.0) * 0.003)
