"""Uncertainty of a blade that is swung: what rest and swing have in common is lost as it moves."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from lidar_deflect.measurement.beam.uncertainty import HoldCovariance, Uncertainty

    Floats = NDArray[np.float64]

SHARED_M = 1.0
"""Beams meet other parts of the surface, edges other views, once a section moved so far."""


def widened(uncertainty: Uncertainty, covariance: HoldCovariance, moved_m: Floats) -> Uncertainty:
    """Widen deflections by the position's own uncertainty, at rest and in the swing.

    The adjustment has no hold in the swing, so the correlation of both states is not known. It is
    taken to fall from all to nothing over the first metre, which bounds the interval from above.

    Parameters
    ----------
    moved_m
        Deflection, shape (t, s, 3).
    """
    own = np.einsum("sisj->sij", covariance.covariance[0, :, :3, 0, :, :3])
    size = np.linalg.norm(np.nan_to_num(moved_m), axis=2)
    apart = 2.0 * np.minimum(size / SHARED_M, 1.0)
    unit = np.nan_to_num(moved_m) / np.maximum(size, 1e-9)[..., None]
    total = apart * np.einsum("tsi,sij,tsj->ts", unit, own, unit)
    axes = apart[..., None] * np.diagonal(own, axis1=1, axis2=2)
    return replace(
        uncertainty,
        deflection_m=np.sqrt(uncertainty.deflection_m**2 + axes),
        total_m=np.sqrt(uncertainty.total_m**2 + np.maximum(total, 0.0)),
    )
