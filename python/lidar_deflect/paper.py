"""The paper's steps one by one, to call and to plot: Hu, Zhu, Zhou, Liu, Optics 2024, 5, 151-164.

A measurement runs the same code over all frames at once (`lidar_deflect.measurement`); here each
step takes and gives arrays of one frame. docs/method.md tells what each does and where the printed
paper had to be corrected.

| step | function |
|---|---|
| 2, 3 ground | `ground_band`, `ground_points`, `fit_plane` |
| 4 rotation, yaw | `rotation_onto`, `register` |
| 5 pass-through | `pass_through` |
| 6 dynamic-radius DBSCAN | `RadiusModel`, `Intervals`, `dbscan` |
| 7 extremes | `line_extremes` |
| 8 spatial line clustering | `line_clusters` |
| 9, 10, 11 curves, tip, sections | `Contours` |
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from lidar_deflect import _native
from lidar_deflect.clustering import Intervals, RadiusModel, dbscan, line_clusters
from lidar_deflect.fitting import fit_plane
from lidar_deflect.registration import (
    ground_band,
    ground_points,
    register,
    rotation_onto,
    surveyed_plane,
)

if TYPE_CHECKING:
    from numpy.typing import ArrayLike, NDArray

__all__ = [
    "Contours",
    "Intervals",
    "LineExtremes",
    "RadiusModel",
    "dbscan",
    "fit_plane",
    "ground_band",
    "ground_points",
    "line_clusters",
    "line_extremes",
    "pass_through",
    "register",
    "rotation_onto",
    "surveyed_plane",
]


@dataclass(frozen=True)
class LineExtremes:
    """Both ends of every scan line of one sweep (step 7).

    Attributes
    ----------
    ring
        Beams, shape (r,), rising.
    leading_m, trailing_m
        Echoes farthest towards the leading edge and against it, shape (r, 3), world frame.
    """

    ring: NDArray[np.uint16]
    leading_m: NDArray[np.float64]
    trailing_m: NDArray[np.float64]


def pass_through(xyz: ArrayLike, box_m: ArrayLike) -> NDArray[np.bool_]:
    """Tell which points lie in a box (step 5).

    Parameters
    ----------
    xyz
        Points, shape (n, 3), metres.
    box_m
        Low and high corner, shape (2, 3), metres; the faces belong to the box.

    Returns
    -------
    numpy.ndarray
        Shape (n,).

    Raises
    ------
    InvalidValueError
        If a side of the box is not longer than zero.
    """
    return _native.pass_through(
        np.ascontiguousarray(xyz, dtype=np.float32), np.ascontiguousarray(box_m, dtype=np.float64)
    )


def line_extremes(xyz: ArrayLike, ring: ArrayLike, leading_edge: ArrayLike) -> LineExtremes:
    """Find both ends of each scan line along the chord (step 7).

    Parameters
    ----------
    xyz
        Points of one lidar's sweep, shape (n, 3), metres, world frame.
    ring
        Their beams, shape (n,).
    leading_edge
        Direction along the chord towards the leading edge, shape (3,), world frame.
    """
    return LineExtremes(
        *_native.line_extremes(
            np.ascontiguousarray(xyz, dtype=np.float32),
            np.ascontiguousarray(ring, dtype=np.uint16),
            np.ascontiguousarray(leading_edge, dtype=np.float64),
        )
    )


class Contours:
    """Both contour curves of one frame, their tip, and sections before it (steps 9 to 11).

    Parameters
    ----------
    leading_m, trailing_m
        Samples of both edges that agree (step 8), shape (n, 3), metres, world frame.
    degree_yoz, degree_xoz
        Degrees of y(z) and x(z), equation (14).

    Raises
    ------
    MeasurementError
        If the samples are too few for the degrees.
    """

    def __init__(
        self,
        leading_m: ArrayLike,
        trailing_m: ArrayLike,
        *,
        degree_yoz: int = 1,
        degree_xoz: int = 2,
    ) -> None:
        self._native = _native.ContourCurves(
            np.ascontiguousarray(leading_m, dtype=np.float64),
            np.ascontiguousarray(trailing_m, dtype=np.float64),
            degree_yoz=degree_yoz,
            degree_xoz=degree_xoz,
        )

    def leading(self, z_m: ArrayLike) -> NDArray[np.float64]:
        """Points of the leading edge at places along the span, shape (n, 3)."""
        return self._native.at(_places(z_m))[0]

    def trailing(self, z_m: ArrayLike) -> NDArray[np.float64]:
        """Points of the trailing edge at places along the span, shape (n, 3)."""
        return self._native.at(_places(z_m))[1]

    def middle(self, z_m: ArrayLike) -> NDArray[np.float64]:
        """Points of the line half-way between both, shape (n, 3)."""
        return self._native.at(_places(z_m))[2]

    def tip(self, plane: str = "xoz", *, max_u_m: float = 5.0) -> NDArray[np.float64]:
        """Intersect both curves on a plane (step 10).

        Parameters
        ----------
        plane
            ``xoz`` or ``yoz``.
        max_u_m
            A tip less certain than this along the span is none.

        Returns
        -------
        numpy.ndarray
            The tip, shape (3,): on the plane the intersection, else the mean of both curves.

        Raises
        ------
        MeasurementError
            With code ``measurement.no_intersection`` or ``measurement.ill_posed``.
        """
        z_m, _ = self._native.tip(plane, max_u_m)
        return np.asarray(self.middle([z_m])[0])

    def length(self, from_z_m: float, to_z_m: float) -> float:
        """Arc length of the middle line between two places along the span, equation (15)."""
        return self._native.length_m(from_z_m, to_z_m)

    def before_tip(self, tip_z_m: float, length_m: float) -> NDArray[np.float64]:
        """Walk back so far along the middle line from the tip (step 11), shape (3,)."""
        return np.array(self._native.before_m(tip_z_m, length_m))


def _places(z_m: ArrayLike) -> NDArray[np.float64]:
    return np.ascontiguousarray(np.atleast_1d(z_m), dtype=np.float64)
