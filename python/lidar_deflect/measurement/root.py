"""The measured motion of the root, taken off the deflection."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from collections.abc import Sequence

    from numpy.typing import NDArray

    from lidar_deflect.channels import Channel

    Floats = NDArray[np.float64]

AXES = ("root_rx", "root_ry", "root_rz")


def rotation_rad(channels: Sequence[Channel], time_ns: NDArray[np.int64]) -> Floats | None:
    """Rotation vector of the root at each moment, shape (t, 3), world axes; None if not measured.

    An axis without a channel (an inclinometer cannot see ry) counts as still.
    """
    if not channels:
        return None
    by_name = {channel.name: channel for channel in channels}
    columns = [
        by_name[name].at(time_ns) if name in by_name else np.zeros(len(time_ns)) for name in AXES
    ]
    return np.column_stack(columns)


def taken_off(position_m: Floats, rotation: Floats) -> Floats:
    """Positions as they would be had the root stood still, shape (t, s, 3).

    Parameters
    ----------
    position_m
        Shape (t, s, 3); the root is the origin.
    rotation
        Rotation vector, shape (t, 3), of some milliradians: terms of third order (micrometres at
        the tip) are left out.
    """
    turn = rotation[:, None, :]
    first = np.cross(turn, position_m)
    return np.asarray(position_m - first + 0.5 * np.cross(turn, first))
