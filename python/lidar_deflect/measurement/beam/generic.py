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
CHORD_M = np.array([4.7, 4.8, 5.3, 5.5, 5.4, 4.8, 4.2, 3.5, 2.9, 2.3, 1.75, 1.4, 1.0, 0.15])
"""Chord of a blade of `LENGTH_M`; it grows with `CHORD_GROWS` of the length."""
TIP_SHARE = np.array([0.985, 0.99, 0.995, 0.998])
TIP_CHORD_M = np.array([0.93, 0.82, 0.62, 0.4])
"""The same where the tip is round."""
TWIST_DEG = np.array([15.5, 14.5, 12.5, 9.5, 6.2, 4.7, 3.1, 1.5, 0.0, -1.8, -2.8, -2.9, -2.7, -2.4])
THICKNESS = np.array(
    [1.0, 0.92, 0.6, 0.38, 0.32, 0.295, 0.27, 0.25, 0.23, 0.215, 0.205, 0.2, 0.195, 0.19]
)
"""Thickness over chord."""
PREBEND = -0.03
"""Of the tip, over the length; it grows with the fourth power towards it."""
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
    root_nm2 = ROOT_NM2 * longer**STIFFNESS_GROWS
    share = np.sort([*SHARE, *TIP_SHARE])
    chord_m = np.sort([*CHORD_M[-2:], *TIP_CHORD_M])[::-1]
    inner = np.clip(share / 0.2, 0.0, 1.0)

    def at(values: Floats) -> Floats:
        return np.asarray(np.interp(share, SHARE, values))

    return np.column_stack(
        [
            share * length,
            np.concatenate([CHORD_M[:-2], chord_m]) * longer**CHORD_GROWS,
            np.radians(at(TWIST_DEG)),
            PREBEND * share**4 * length,
            0.5 + (blade.axis_fraction - 0.5) * inner,
            *(root_nm2 * 10.0 ** at(decades) for decades in (LOG_EDGE, LOG_FLAP, LOG_TORSION)),
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
        camber = (1.0 - round_share) * _camber(x_c)
        upper, lower = camber + thickness * half, camber - thickness * half
        points = [*zip(x_c, upper, strict=True), *zip(x_c[-2:0:-1], lower[-2:0:-1], strict=True)]
        parts.append(points)
    return SHARE * blade.length_m, np.array(parts)


def _half(x_c: Floats) -> Floats:
    """Half of the thickness distribution, per unit of thickness.

    Between that of the four-digit family and those of large blades, whose noses are sharper and
    whose rears are thinner.
    """
    series = (
        0.2969 * np.sqrt(x_c) - 0.126 * x_c - 0.3516 * x_c**2 + 0.2843 * x_c**3 - 0.1015 * x_c**4
    )
    nose = 1.0 - 0.1 * np.clip(1.0 - x_c / 0.3, 0.0, 1.0) ** 2
    return np.asarray(5.0 * series * nose * (1.0 - 0.5 * x_c**3))


def _camber(x_c: Floats) -> Floats:
    """Camber line in chord lengths, likewise: sections of large blades carry load at the rear."""
    return np.asarray((0.07 + 0.1 * x_c**2) * x_c * (1.0 - x_c))
