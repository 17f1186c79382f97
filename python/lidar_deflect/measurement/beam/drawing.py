"""The blade as the drawing gives it, handed to the compiled core."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from lidar_deflect import _native, geometry
from lidar_deflect.errors import ConfigError

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from lidar_deflect.config import Config

    Floats = NDArray[np.float64]

SADDLE_SHARES = (0.3, 0.5, 0.7, 0.86)
"""Where load is taken to enter, as shares of the length, when the configuration does not tell."""


def saddles_m(config: Config) -> list[float]:
    """Arc lengths at which load enters."""
    length = config.blade.length_m
    given = [s for s in config.load.saddles_s_m if s <= length]
    return sorted(given) or [share * length for share in SADDLE_SHARES]


def blade_of(config: Config) -> _native.BeamBlade:
    """Cut the drawing into elements.

    Raises
    ------
    ConfigError
        If geometry, contours, stiffness or the sides of the blade are not given.
    """
    drawing = geometry.read_geometry(config.blade)
    if drawing is None or drawing.contours is None:
        raise _lacking("geometry" if drawing is None else "contours")
    if config.blade.leading_edge is None or config.blade.suction_side is None:
        raise _lacking("leading_edge and suction_side")
    stations, contours = drawing.stations, drawing.contours
    if stations.ei_edge_nm2 is None or stations.ei_flap_nm2 is None or stations.gj_nm2 is None:
        raise _lacking("stiffness (ei_edge_nm2, ei_flap_nm2, gj_nm2) in geometry")
    columns = (
        stations.s_m,
        stations.chord_m,
        stations.twist_rad,
        stations.prebend_m,
        stations.axis_fraction,
        stations.ei_edge_nm2,
        stations.ei_flap_nm2,
        stations.gj_nm2,
    )
    return _native.BeamBlade(
        np.column_stack(columns),
        contours.s_m.tolist(),
        np.stack([contours.x_c, contours.y_c], axis=2),
        leading_edge=np.array(config.blade.leading_edge, dtype=np.float64),
        suction_side=np.array(config.blade.suction_side, dtype=np.float64),
        saddles_s_m=saddles_m(config),
    )


def _lacking(what: str) -> ConfigError:
    return ConfigError(
        f"the beam method needs {what} of [blade]",
        code="config.no_geometry",
        hint='give it, or measure with method = "paper"',
    )
