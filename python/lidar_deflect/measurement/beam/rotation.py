"""Rotations of the blade line since the unloaded hold, with their uncertainty, from its slope."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from lidar_deflect.measurement.beam.uncertainty import HoldCovariance

    Floats = NDArray[np.float64]


def rotations_rad(s_m: Floats, position_m: Floats, rest_m: Floats) -> Floats:
    """Rotation about world x and y of a line against its rest, shape (t, s, 2).

    Parameters
    ----------
    s_m
        Stations, rising, shape (s,).
    position_m, rest_m
        The line, shape (t, s, 3), and at rest, shape (s, 3).
    """
    return _turns(s_m, position_m) - _turns(s_m, rest_m[None])


def _turns(s_m: Floats, position_m: Floats) -> Floats:
    x, y, z = np.moveaxis(np.gradient(position_m, s_m, axis=1), 2, 0)
    return np.stack([-np.arctan2(y, z), np.arctan2(x, z)], axis=2)


def variance_rad2(s_m: Floats, covariance: HoldCovariance, stations: slice) -> Floats:
    """Variance of those rotations in each hold, shape (h, s, 2), from the joint covariance.

    In the unloaded hold, where they are zero by definition, it is zero.
    """
    joint = covariance.covariance[:, stations, :3, :, stations, :3]
    holds, count = joint.shape[:2]
    slope = np.gradient(np.eye(count), s_m, axis=0)
    found = np.zeros((holds, count, 2))
    for place, axis in enumerate((1, 0)):
        of_axis = joint[:, :, axis, :, :, axis]
        for hold in range(holds):
            moved = of_axis[hold, :, hold] + of_axis[0, :, 0]
            moved = moved - of_axis[hold, :, 0] - of_axis[0, :, hold]
            found[hold, :, place] = np.einsum("ij,jk,ik->i", slope, moved, slope)
    return np.maximum(found, 0.0)


def over_time(variance_rad2: Floats, shares: Floats, load: Floats) -> Floats:
    """Blend the variance of holds (h, s, 2) by the load to deviations at moments (t, s, 2)."""
    order = np.argsort(shares, kind="stable")
    holds, count, _ = variance_rad2.shape
    columns = variance_rad2[order].reshape(holds, -1).T
    blended = [np.interp(load, shares[order], column) for column in columns]
    return np.sqrt(np.stack(blended, axis=1)).reshape(len(load), count, 2)
