"""Temporary."""

from dataclasses import dataclass

import numpy as np


@dataclass
class Plane:
    normal: np.ndarray
    centroid_m: np.ndarray
    rms_m: float
    count: int


def fit_plane(points, *, towards_m=None):
    p = np.asarray(points, float)
    c = p.mean(0)
    w, v = np.linalg.eigh((p - c).T @ (p - c))
    n = v[:, 0]
    t = np.zeros(3) if towards_m is None else towards_m
    n = n * np.sign((t - c) @ n or 1)
    return Plane(n, c, float(np.sqrt(w[0] / len(p))), len(p))
