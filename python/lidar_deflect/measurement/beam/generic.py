"""A blade as blades are, scaled to its length: the start where no drawing is given.

Chord, twist, thickness and stiffness follow round numbers that lie between published blades of
60 to 140 m; none is copied. What the built blade differs by is then learned from the lidars.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from lidar_deflect.config import Blade

    Floats = NDArray[np.float64]

SHARE = np.array([0.0, 0.05, 0.12, 0.2, 0.3, 0.4, 0.5, 0.6, 0.7, 0.8, 0.9, 0.95, 0.98, 1.0])
CHORD_M = np.array([4.7, 4.8, 5.3, 5.5, 5.4, 4.8, 4.2, 3.5, 2.9, 2.3, 1.75, 1.4, 0.95, 0.35])
"""Chord of a blade of `LENGTH_M`; it grows with `CHORD_GROWS` of the length."""
TWIST_DEG = np.array([15.5, 14.5, 12.5, 9.5, 6.2, 4.7, 3.1, 1.5, 0.0, -1.8, -2.8, -2.9, -2.7, -2.4])
THICKNESS = np.array(
    [1.0, 0.92, 0.6, 0.38, 0.32, 0.295, 0.27, 0.25, 0.23, 0.215, 0.205, 0.2, 0.195, 0.19]
)
"""Thickness over chord."""
PREBEND = -0.03 * SHARE**4
"""Over the length."""
LOG_EDGE = np.array(
    [0.0, -0.2, -0.42, -0.58, -0.73, -0.87, -1.07, -1.35, -1.7, -2.1, -2.6, -3.0, -3.8, -4.9]
)
LOG_FLAP = np.array(
    [0.0, -0.2, -0.57, -0.9, -1.12, -1.3, -1.57, -1.92, -2.3, -2.75, -3.35, -3.85, -4.75, -6.0]
)
LOG_TORSION = np.array(
    [-0.35, -0.55, -0.97, -1.45, -1.85, -2.1, -2.4, -2.75, -3.2, -3.6, -4.1, -4.5, -5.35, -6.4]
)
"""Decades of stiffness under `ROOT_NM2`."""
ROOT_NM2, LENGTH_M = 1.2e11, 110.0
"""Bending stiffness of the root of a blade of this length."""
CHORD_GROWS, STIFFNESS_GROWS = 0.25, 2.8
"""Exponents of the length."""

HALF_POINTS = 36


def stations(blade: Blade) -> Floats:
    """Columns of the drawing as the compiled core wants them, shape (n, 8)."""
    length = blade.length_m
    longer = length / LENGTH_M
    scale = ROOT_NM2 * longer**STIFFNESS_GROWS
    return np.column_stack(
        [
            SHARE * length,
            CHORD_M * longer**CHORD_GROWS,
            np.radians(TWIST_DEG),
            PREBEND * length,
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
