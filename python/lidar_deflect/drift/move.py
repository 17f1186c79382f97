"""A tripod that was moved and stands anew."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

    Floats = NDArray[np.float64]


@dataclass(frozen=True)
class Move:
    """From where a lidar stood to where it stands.

    Attributes
    ----------
    lidar
        Its id.
    left_ns, from_ns
        It stood in the old place before the one and stands in the new one from the other on,
        nanoseconds; nothing is known of it in between.
    world_from_sensor
        The new pose, shape (4, 4).
    covariance
        Of the change since the calibration, shape (6, 6), wx wy wz tx ty tz as in
        `Pose.covariance`; what the calibration does not know comes on top.
    """

    lidar: str
    left_ns: int
    from_ns: int
    world_from_sensor: Floats
    covariance: Floats
