"""The change of one lidar's pose from how far its static cells seem to have moved."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from numpy.typing import NDArray

    Floats = NDArray[np.float64]

PRACTICAL = np.array([0.3e-3] * 3 + [3e-3] * 3)
"""What a test does not notice: turn about, shift along each world axis; rad, m."""

PRIOR = np.array([10e-3] * 3 + [50e-3] * 3)
"""How far a tripod may move at all: what a free direction's uncertainty ends at; rad, m."""

QUANTILE = 27.86
"""Chi-square of six degrees of freedom that chance exceeds once in ten thousand windows."""

HUBER = 2.0
ROUNDS = 8
MAD_TO_SIGMA = 1.4826
TOLERANCE = np.diag(PRACTICAL**2) / QUANTILE
"""Covariance by which a change of the practical size is just not beyond chance."""


@dataclass(frozen=True)
class Change:
    """Change of a pose.

    Attributes
    ----------
    step
        wx wy wz tx ty tz: R_now = Exp(w) R, t_now = t + dt, world axes; rad, m. Zero along what
        the cells do not fix.
    covariance
        Shape (6, 6).
    """

    step: Floats
    covariance: Floats

    @property
    def moved(self) -> bool:
        """Whether the change is clearly beyond both its interval and the practical size."""
        wide = self.covariance + TOLERANCE
        return bool(self.step @ np.linalg.solve(wide, self.step) > QUANTILE)


def estimate(ray_m: Floats, normal: Floats, height_m: Floats, sigma_m: Floats) -> Change:
    """Find the change of pose that the cells agree on.

    Parameters
    ----------
    ray_m
        From the optical centre to each cell, world axes, shape (n, 3).
    normal
        Of the surface there, world axes, shape (n, 3).
    height_m
        How much farther along the normal the cell seems to lie than in the reference, shape (n,).
    sigma_m
        Its standard deviation, shape (n,).

    Notes
    -----
    A turn w and a shift t make a fixed point seem to move by -(t + w x ray), so the height changes
    by -(n.t + w.(ray x n)). Cells that disagree weigh less (Huber); the unit of weight is the
    scatter of what is left, so that roughness met anew is in the covariance.
    """
    design = -np.hstack([np.cross(ray_m, normal), normal]) / sigma_m[:, None]
    seen = height_m / sigma_m
    step: Floats = np.zeros(6)
    normal_matrix: Floats = np.zeros((6, 6))
    for _ in range(ROUNDS):
        left = seen - design @ step
        scale = max(1.0, MAD_TO_SIGMA * float(np.median(np.abs(left))))
        weight = np.minimum(1.0, HUBER * scale / np.maximum(np.abs(left), 1e-9)) / scale**2
        normal_matrix = (design * weight[:, None]).T @ design + np.diag(PRIOR**-2)
        step = np.asarray(np.linalg.solve(normal_matrix, (design * weight[:, None]).T @ seen))
    return Change(step, np.asarray(np.linalg.inv(normal_matrix)))
