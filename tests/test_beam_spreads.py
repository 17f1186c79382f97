"""Do standard uncertainties follow from covariances as they should?"""

import numpy as np

from lidar_deflect.measurement.beam.uncertainty import Spreads, over_time

ROW = [4.0, 9.0, 16.0, 0.1, 0.2, 0.3, 1.0, 4.0, 9.0, 0.5, 0.0, 0.0, 25.0]
"""Covariances of position and deflection (xx, yy, zz, xy, xz, yz), variance of the twist."""


def _spreads() -> Spreads:
    spreads = Spreads.empty(2, 1)
    spreads.put(np.array([1]), np.array([ROW]))
    return spreads


def test_a_moment_without_a_state_has_no_uncertainty() -> None:
    found = over_time(_spreads(), None, np.ones((2, 1, 3)))
    assert np.isnan(found.deflection_m[0]).all()
    assert np.isnan(found.total_m[0]).all()


def test_the_total_is_known_along_the_deflection() -> None:
    along = np.zeros((2, 1, 3))
    along[:, :, :2] = 3.0
    found = over_time(_spreads(), None, along)
    assert found.deflection_m[1, 0].tolist() == [1.0, 2.0, 3.0]
    # (1 + 4 + 2 * 0.5) / 2 along (1, 1, 0) / sqrt(2)
    assert np.isclose(found.total_m[1, 0], np.sqrt(3.0))
    assert found.twist_rad[1, 0] == 5.0


def test_a_reference_from_elsewhere_adds_its_own() -> None:
    kept = np.diag([5.0, 7.0, 9.0])[None]
    found = over_time(_spreads(), kept, np.ones((2, 1, 3)))
    assert found.position_m[1, 0].tolist() == [2.0, 3.0, 4.0]
    assert found.deflection_m[1, 0].tolist() == [3.0, 4.0, 5.0]
