"""How far a blade may differ from its drawing, or from blades as they are: standard deviations."""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple

import numpy as np

if TYPE_CHECKING:
    from lidar_deflect.config import Blade

COUPLING = 0.06
"""Coupling of both bendings over the mean of their stiffnesses: up to 0.16 in published blades."""
AXIS_U = 0.03
"""Without a drawing the axis may not go farther from where it is said to be: twist moves it, and
errors of the contour would pass for that."""


class BendTrust(NamedTuple):
    """What bends the blade, in the order of the compiled core.

    Attributes
    ----------
    span_modes
        Number of functions along the span.
    stiffness, stiffness_tip
        Relative, at the root; how many times as large at the tip.
    weight, prebend
        Relative.
    free_rad_m
        Stress-free curvature.
    root_rad
        Rotation of the root.
    coupling
        Of both bendings, as a share of their stiffness.
    """

    span_modes: int
    stiffness: float
    stiffness_tip: float
    weight: float
    prebend: float
    free_rad_m: float
    root_rad: float
    coupling: float


class ShapeTrust(NamedTuple):
    """The surface, in the order of the compiled core.

    Attributes
    ----------
    chord, chord_waves, tip
        Relative: as a whole, as it varies along the span, and how many times the latter at the tip.
    setting_rad, twist_waves_rad
        Twist as a whole and as it varies along the span.
    axis_fraction
        Of the axis, chord lengths.
    form
        Of the contour, as a share of what blades differ by.
    waves_m
        Waves of the surface.
    slow_knot_m, wave_knot_m
        Distances of the knots of chord and twist, and of waves.
    bend
        Second differences of the knots of chord and twist, over their deviations; 0: independent.
    """

    chord: float
    chord_waves: float
    tip: float
    setting_rad: float
    twist_waves_rad: float
    axis_fraction: float
    form: float
    waves_m: float
    slow_knot_m: float
    wave_knot_m: float
    bend: float


DRAWN = BendTrust(
    span_modes=5,
    stiffness=0.05,
    stiffness_tip=1.0,
    weight=0.5,
    prebend=0.05,
    free_rad_m=1.5e-5,
    root_rad=1e-3,
    coupling=COUPLING,
)
UNDRAWN = BendTrust(
    span_modes=10,  # what is seen of the outer blade tells little of the inner
    stiffness=0.2,
    stiffness_tip=3.0,
    weight=0.7,
    prebend=0.8,
    free_rad_m=3e-4,
    root_rad=2e-3,
    coupling=COUPLING,
)


def drawn_shape(blade: Blade) -> ShapeTrust:
    """Of a blade built after a drawing."""
    return ShapeTrust(
        chord=0.004,
        chord_waves=0.001,
        tip=1.0,
        setting_rad=float(np.radians(blade.setting_u_deg)),
        twist_waves_rad=0.0005,
        axis_fraction=0.002,
        form=0.0,
        waves_m=0.002,
        slow_knot_m=9.0,
        wave_knot_m=1.0,
        bend=0.0,
    )


def undrawn_shape(blade: Blade) -> ShapeTrust:
    """Of a blade as blades are."""
    return ShapeTrust(
        chord=0.2,
        chord_waves=0.2,
        tip=3.0,
        setting_rad=max(float(np.radians(blade.setting_u_deg)), 0.03),
        twist_waves_rad=0.03,
        axis_fraction=min(blade.axis_fraction_u, AXIS_U),
        form=0.7,
        waves_m=0.006,
        slow_knot_m=0.8,
        wave_knot_m=2.0,
        bend=0.02,
    )
