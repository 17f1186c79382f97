"""How a lidar stands as the configuration has it: where every search for its pose starts."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from lidar_deflect.errors import ConfigError

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from lidar_deflect.config import Lidar


def mounted(lidar: Lidar, *, hint: str) -> NDArray[np.float64]:
    """Return the rotation world from sensor of a lidar whose position is known, shape (3, 3).

    Raises
    ------
    ConfigError
        If position or axes are missing; `hint` says what would help.
    """
    mounting = lidar.nominal_rotation()
    if mounting is None or lidar.position_m is None:
        raise ConfigError(
            f"lidar {lidar.id} has no {'axes' if mounting is None else 'position_m'}",
            code="config.no_pose",
            hint=hint,
        )
    return np.array(mounting, dtype=np.float64)


def optical_centre_m(lidar: Lidar, rotation: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return the optical centre from the surveyed point and the lever arm, world frame."""
    surveyed = np.array(lidar.position_m, dtype=np.float64)
    return np.asarray(surveyed + rotation @ np.array(lidar.lever_arm_m, dtype=np.float64))
