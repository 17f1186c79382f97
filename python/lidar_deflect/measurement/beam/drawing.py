"""The blade as the drawing gives it, handed to the compiled core."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from lidar_deflect import _native, geometry
from lidar_deflect.measurement import paper
from lidar_deflect.measurement.beam import generic

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from lidar_deflect.config import Blade, Config
    from lidar_deflect.measurement.inputs import Inputs

    Floats = NDArray[np.float64]

COUPLING = 0.06
"""Coupling of both bendings over the mean of their stiffnesses: up to 0.16 in published blades."""
SADDLE_SHARES = (0.3, 0.5, 0.7, 0.86)
"""Where load is taken to enter, as shares of the length, when the configuration does not tell."""


def saddles_m(config: Config) -> list[float]:
    """Arc lengths at which load enters."""
    length = config.blade.length_m
    given = [s for s in config.load.saddles_s_m if s <= length]
    return sorted(given) or [share * length for share in SADDLE_SHARES]


@dataclass(frozen=True)
class Drawing:
    """A blade cut into elements, and how far it may differ from what is built.

    Attributes
    ----------
    blade
        The blade of the compiled core.
    trust
        Number of functions along the span, and prior deviations of stiffness (relative, at the
        root; how many times as large at the tip), weight, prebend (relative), stress-free curvature
        (rad/m), the root's rotation (rad) and the coupling of both bendings (share of their
        stiffness).
    shape_trust
        Of chord and its waves (relative; at the tip the latter grow by a factor), setting angle and
        waves of twist (rad), axis (chord lengths), contour (share of what blades differ by) and
        waves of the surface (m); distances of the knots of chord and twist, and of waves (m); second
        differences of the knots of chord and twist, over their deviations (0: as they come).
    source
        ``drawing`` or ``generic``.
    """

    blade: _native.BeamBlade
    trust: tuple[float, ...]
    shape_trust: tuple[float, ...]
    source: str


def drawing_of(inputs: Inputs) -> Drawing:
    """Take the drawing, else a blade as blades are."""
    blade, sides = inputs.config.blade, sides_of(inputs)
    given = geometry.read_geometry(blade)
    columns = None if given is None else _columns(given.stations)
    if given is None or given.contours is None or columns is None:
        at_m, outlines = generic.outlines(blade)
        native = _native_of(inputs.config, sides, generic.stations(blade), at_m, outlines)
        return Drawing(native, GENERIC_TRUST, _generic_shape(blade), "generic")
    outlines = np.stack([given.contours.x_c, given.contours.y_c], axis=2)
    native = _native_of(inputs.config, sides, columns, given.contours.s_m, outlines)
    return Drawing(native, TRUST, _drawn_shape(blade), "drawing")


TRUST = (5, 0.05, 1.0, 0.5, 0.05, 1.5e-5, 1e-3, COUPLING)
GENERIC_TRUST = (10, 0.2, 3.0, 0.7, 0.8, 3e-4, 2e-3, COUPLING)
"""More functions along the span: what is seen of the outer blade tells little of the inner."""
AXIS_U = 0.03
"""Without a drawing the axis may not go farther from where it is said to be: twist moves it, and
errors of the contour would pass for that."""


def _drawn_shape(blade: Blade) -> tuple[float, ...]:
    return (0.004, 0.001, 1.0, np.radians(blade.setting_u_deg), 0.0005, 0.002, 0.0, 0.002, 9.0, 1.0, 0.0)


def _generic_shape(blade: Blade) -> tuple[float, ...]:
    setting_rad = max(np.radians(blade.setting_u_deg), 0.03)
    axis = min(blade.axis_fraction_u, AXIS_U)
    return (0.2, 0.2, 3.0, setting_rad, 0.03, axis, 0.7, 0.006, 0.8, 2.0, 0.02)


def _native_of(
    config: Config,
    sides: tuple[Floats, Floats],
    stations: Floats,
    outline_s_m: Floats,
    outlines: Floats,
) -> _native.BeamBlade:
    return _native.BeamBlade(
        stations,
        outline_s_m.tolist(),
        outlines,
        leading_edge=sides[0],
        suction_side=sides[1],
        saddles_s_m=saddles_m(config),
    )


def _columns(stations: geometry.Stations) -> Floats | None:
    """Columns of the drawing; None where it has no stiffness."""
    if stations.ei_edge_nm2 is None or stations.ei_flap_nm2 is None or stations.gj_nm2 is None:
        return None
    return np.column_stack(
        [
            stations.s_m,
            stations.chord_m,
            stations.twist_rad,
            stations.prebend_m,
            stations.axis_fraction,
            stations.ei_edge_nm2,
            stations.ei_flap_nm2,
            stations.gj_nm2,
        ]
    )


def sides_of(inputs: Inputs) -> tuple[Floats, Floats]:
    """Where leading edge and suction side point; what is not given is guessed.

    The leading edge is then that of the plan, and the suction side the one that faces up, or along
    the load where the chord stands upright.
    """
    given = inputs.config.blade
    leading_edge = (
        paper.plan_of(inputs).leading_edge if given.leading_edge is None else given.leading_edge
    )
    leading = np.array(leading_edge, dtype=np.float64)
    if given.suction_side is not None:
        return leading, np.array(given.suction_side, dtype=np.float64)
    across = np.cross([0.0, 0.0, 1.0], leading)
    towards = np.array([0.2, 1.0, 0.0])
    return leading, across * (1.0 if across @ towards >= 0.0 else -1.0)
