"""A blade as blades are, scaled to its length: the start where no drawing is given.

Chord, twist, thickness and stiffness follow round numbers that lie between published blades of 60 to
140 m; none is copied. What the built blade differs by is then learned from the lidars.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from lidar_deflect.config import Blade

    Floats = NDArray[np.float64]

SHARE = np.array([0.0, 0.05, 0.12, 0.2, 0.3, 0.4, 0.5, 0.6, 0.7, 0.8, 0.9, 0.95, 0.98, 1.0])
CHORD = np.array(
    [
        0.043,
        0.044,
        0.049,
        0.053,
        0.049,
        0.044,
        0.039,
        0.033,
        0.028,
        0.023,
        0.0175,
        0.013,
        0.009,
        0.002,
    ]
)
"""Chord over length."""
TWIST_DEG = np.array([14.0, 13.5, 12.5, 10.5, 8.0, 6.0, 5.0, 3.8, 2.6, 1.6, 0.5, -0.5, -1.0, -1.5])
THICKNESS = np.array(
    [1.0, 0.95, 0.75, 0.5, 0.39, 0.34, 0.3, 0.27, 0.25, 0.23, 0.21, 0.195, 0.185, 0.18]
)
"""Thickness over chord."""
LOG_EDGE = np.array(
    [0.0, -0.15, -0.35, -0.58, -0.72, -0.88, -1.02, -1.2, -1.47, -1.8, -2.35, -2.8, -3.7, -5.0]
)
LOG_FLAP = np.array(
    [0.0, -0.2, -0.5, -0.82, -1.06, -1.25, -1.45, -1.7, -1.92, -2.2, -2.75, -3.3, -4.6, -6.0]
)
LOG_TORSION = np.array(
    [-0.23, -0.4, -0.8, -1.6, -2.25, -2.5, -2.7, -2.9, -3.1, -3.35, -3.75, -4.1, -4.8, -6.3]
)
"""Decades of stiffness under `ROOT_NM2`."""
ROOT_NM2, ROOT_LENGTH_M = 1.2e11, 110.0
"""Bending stiffness of the root of a blade of this length; it grows with the fourth power."""

HALF_POINTS = 36


def stations(blade: Blade) -> Floats:
    """Columns of the drawing as the compiled core wants them, shape (n, 8)."""
    length = blade.length_m
    scale = ROOT_NM2 * (length / ROOT_LENGTH_M) ** 4
    return np.column_stack(
        [
            SHARE * length,
            CHORD * length,
            np.radians(TWIST_DEG),
            np.zeros_like(SHARE),
            np.where(
                SHARE < 0.2, 0.5 + (blade.axis_fraction - 0.5) * SHARE / 0.2, blade.axis_fraction
            ),
            scale * 10.0**LOG_EDGE,
            scale * 10.0**LOG_FLAP,
            scale * 10.0**LOG_TORSION,
        ]
    )


def outlines(blade: Blade) -> tuple[Floats, Floats]:
    """Arc lengths and outlines, shapes (n,) and (n, m, 2), from circle to thin section."""
    turn = np.linspace(0.0, np.pi, HALF_POINTS)
    x_c = 0.5 - 0.5 * np.cos(turn)
    parts = []
    for thickness in THICKNESS:
        round_share = np.clip((thickness - 0.4) / 0.6, 0.0, 1.0)
        half = (1.0 - round_share) * _half(x_c) + round_share * 0.5 * np.sin(turn)
        camber = (1.0 - round_share) * 0.08 * x_c * (1.0 - x_c)
        upper, lower = camber + thickness * half, camber - thickness * half
        points = [*zip(x_c, upper, strict=True), *zip(x_c[-2:0:-1], lower[-2:0:-1], strict=True)]
        parts.append(points)
    return SHARE * blade.length_m, np.array(parts)


def _half(x_c: Floats) -> Floats:
    """Half of the thickness distribution of the four-digit family, per unit of thickness."""
    series = (
        0.2969 * np.sqrt(x_c) - 0.126 * x_c - 0.3516 * x_c**2 + 0.2843 * x_c**3 - 0.1015 * x_c**4
    )
    return np.asarray(5.0 * series)
