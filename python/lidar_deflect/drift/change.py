"""The change of one lidar's pose from how far its static cells seem to have moved."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from lidar_deflect import _native

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


def moved_by(pose: Floats, step: Floats) -> Floats:
    """Pose (4, 4) after a step wx wy wz tx ty tz about the world axes."""
    moved = pose.copy()
    moved[:3, :3] = _turn(step[:3]) @ pose[:3, :3]
    moved[:3, 3] += step[3:]
    return moved


def step_between(old: Floats, new: Floats) -> Floats:
    """Step wx wy wz tx ty tz about the world axes that makes a pose (4, 4) another."""
    turn = new[:3, :3] @ old[:3, :3].T
    sine = 0.5 * np.array(
        [turn[2, 1] - turn[1, 2], turn[0, 2] - turn[2, 0], turn[1, 0] - turn[0, 1]]
    )
    size = float(np.linalg.norm(sine))
    rotation = sine * (np.arcsin(min(1.0, size)) / size if size > 0.0 else 1.0)
    return np.concatenate([rotation, new[:3, 3] - old[:3, 3]])


def _turn(rotation: Floats) -> Floats:
    """Rotation (3, 3) of a rotation vector (Rodrigues)."""
    x, y, z = rotation
    cross = np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])
    angle = float(np.linalg.norm(rotation))
    share = np.sinc(angle / np.pi), 0.5 * np.sinc(0.5 * angle / np.pi) ** 2
    return np.asarray(np.eye(3) + share[0] * cross + share[1] * cross @ cross)


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


def estimate(
    ray_m: Floats,
    normal: Floats,
    height_m: Floats,
    sigma_m: Floats,
    patch: NDArray[np.intp] | None = None,
) -> Change:
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
    patch
        Number of the patch of ground that each cell lies on, shape (n,): a lidar that turned meets
        other spots, and those of one patch are higher or lower together.

    Notes
    -----
    A turn w and a shift t make a fixed point seem to move by -(t + w x ray), so the height changes
    by -(n.t + w.(ray x n)). Cells that disagree weigh less (Huber); the unit of weight is the
    scatter of what is left, so that roughness met anew is in the covariance, and that again by
    how much larger the means over patches are than independent cells would make them.
    """
    design = _native.pose_design(*map(np.ascontiguousarray, (ray_m, normal, sigma_m)))
    seen = height_m / sigma_m
    step: Floats = np.zeros(6)
    normal_matrix: Floats = np.zeros((6, 6))
    weight = np.ones(len(sigma_m))
    for _ in range(ROUNDS):
        left = seen - design @ step
        scale = max(1.0, MAD_TO_SIGMA * _native.median_size(left))
        weight, rows = _native.huber_weighted(design, left, HUBER * scale, scale**2)
        weighted = rows.T
        normal_matrix = weighted @ design + np.diag(PRIOR**-2)
        step = np.asarray(np.linalg.solve(normal_matrix, weighted @ seen))
    covariance = np.asarray(np.linalg.inv(normal_matrix))
    if patch is None:
        return Change(step, covariance)
    alike = _alike((seen - design @ step) * np.sqrt(weight), patch)
    fixed = normal_matrix - np.diag(PRIOR**-2)
    return Change(step, np.asarray(np.linalg.inv(fixed / alike + np.diag(PRIOR**-2))))


def _alike(left: Floats, patch: NDArray[np.intp]) -> float:
    """How much larger squared sums over patches are than those of independent values; 1 or more."""
    sums = np.bincount(patch, left)
    return max(1.0, float(sums @ sums) / max(float(left @ left), 1e-12))
