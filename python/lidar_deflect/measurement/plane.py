"""Step 10: the plane on which the contour curves are intersected."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from lidar_deflect.config import Config
    from lidar_deflect.measurement.contours import ContourRun

EDGE_ON = 0.3
"""On a plane that shows less than this share of the chord the contours nearly coincide."""

ACROSS = {"xoz": 0, "yoz": 1}
"""Index of the world axis that each plane holds beside z."""


def choose_plane(config: Config, contours: ContourRun) -> tuple[str, tuple[str, ...]]:
    """Return the plane of the two axes that deform most; z is always one of them here.

    Where that plane sees the blade edge-on, so that both contours nearly coincide on it, the other
    one is taken and a warning says so.
    """
    if config.paper.plane != "auto":
        return config.paper.plane, ()
    z_m = np.array([contours.middle_z_m()])
    moved = np.ptp(_without_gaps(contours.points_at(z_m)[:, 0, :2]), axis=0)
    plane, other = ("xoz", "yoz") if moved[0] >= moved[1] else ("yoz", "xoz")
    chord = np.median(np.abs(_without_gaps(contours.chord_at(z_m)[:, 0, :2])), axis=0)
    if chord[ACROSS[plane]] >= EDGE_ON * np.hypot(*chord):
        return plane, ()
    return other, (
        f"the blade deforms most in {plane}, but its contours nearly coincide there "
        f"({chord[ACROSS[plane]]:.2f} m apart, {chord[ACROSS[other]]:.2f} m in {other}): "
        f"the tip is intersected in {other}",
    )


def _without_gaps(values: NDArray[np.float64]) -> NDArray[np.float64]:
    """Rows that are numbers; one row of zeros where none is."""
    good = values[~np.isnan(values).any(axis=1)]
    return good if len(good) else np.zeros((1, values.shape[1]))
