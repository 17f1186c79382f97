"""The blade as the drawing gives it, handed to the compiled core."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from lidar_deflect import _native, geometry
from lidar_deflect.measurement import paper
from lidar_deflect.measurement.beam import generic, trust

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from lidar_deflect.config import Config
    from lidar_deflect.measurement.beam.trust import BendTrust, ShapeTrust
    from lidar_deflect.measurement.inputs import Inputs

    Floats = NDArray[np.float64]

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
    trust, shape_trust
        By what bends it, and by its surface.
    source
        ``drawing`` or ``generic``.
    """

    blade: _native.BeamBlade
    trust: BendTrust
    shape_trust: ShapeTrust
    source: str


def drawing_of(inputs: Inputs) -> Drawing:
    """Take the drawing, else a blade as blades are."""
    blade, sides = inputs.config.blade, sides_of(inputs)
    given = geometry.read_geometry(blade)
    columns = None if given is None else _columns(given.stations)
    if given is None or given.contours is None or columns is None:
        at_m, outlines = generic.outlines(blade)
        native = _native_of(inputs.config, sides, generic.stations(blade), at_m, outlines)
        return Drawing(native, trust.UNDRAWN, trust.undrawn_shape(blade), "generic")
    outlines = np.stack([given.contours.x_c, given.contours.y_c], axis=2)
    native = _native_of(inputs.config, sides, columns, given.contours.s_m, outlines)
    return Drawing(native, trust.DRAWN, trust.drawn_shape(blade), "drawing")


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
