"""Clusters: points that belong together by density, contour pieces that lie on one curve."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from lidar_deflect import _native, arrays
from lidar_deflect.errors import InvalidValueError
from lidar_deflect.fitting import AXES, Polynomial, SpaceCurve

if TYPE_CHECKING:
    from numpy.typing import ArrayLike, NDArray

    from lidar_deflect.fitting import Axis

NOISE = -1
"""Label of points that belong to no cluster."""


@dataclass(frozen=True)
class RadiusModel:
    """Search radius over distance: Eps = mu tan(alpha) MinPts d + beta.

    Equation (10) of Hu et al. 2024.

    Parameters
    ----------
    alpha_deg
        Angular step of the sensor, degrees, in (0, 90).
    mu
        Positive factor; the paper wants it above 1.
    beta_m
        Constant part, metres, at least 0.
    min_points
        MinPts of the formula, at least 1.

    Raises
    ------
    InvalidValueError
        If a parameter is outside of its range.

    Examples
    --------
    >>> model = RadiusModel(alpha_deg=0.2, mu=1.5, beta_m=0.02, min_points=4)
    >>> round(float(model.radius_m(20.0)), 4)
    0.4389
    """

    alpha_deg: float
    mu: float
    beta_m: float
    min_points: int

    def __post_init__(self) -> None:
        self.radius_m(0.0)

    def radius_m(self, distance_m: ArrayLike) -> NDArray[np.float64]:
        """Radius at distances from the sensor, metres; any shape."""
        distance_m = np.asarray(distance_m, dtype=np.float64)
        radii_m = _native.radii_at(self._raw, distance_m.ravel())
        return radii_m.reshape(distance_m.shape)

    def radii_m(self, xyz: ArrayLike, origin_m: ArrayLike = (0.0, 0.0, 0.0)) -> NDArray[np.float64]:
        """Radius of every point by its own distance from the sensor at `origin_m`, shape (n,).

        Raises
        ------
        InvalidValueError
            If a radius is not positive: beta is 0 and a point lies at the origin.
        """
        return _native.radii_of(
            self._raw, arrays.cloud("xyz", xyz), arrays.vector("origin_m", origin_m)
        )

    @property
    def _raw(self) -> tuple[float, float, float, int]:
        points = _count("min_points", self.min_points)
        return float(np.radians(self.alpha_deg)), self.mu, self.beta_m, points


@dataclass(frozen=True)
class Intervals:
    """The distances of a whole test cut into `count` equal intervals, each with one radius.

    Examples
    --------
    >>> Intervals(min_m=10.0, max_m=30.0, count=4).right_edge_m([12.0, 15.1]).tolist()
    [15.0, 20.0]
    """

    min_m: float
    max_m: float
    count: int

    def __post_init__(self) -> None:
        self.right_edge_m(0.0)

    def right_edge_m(self, distance_m: ArrayLike) -> NDArray[np.float64]:
        """Right edge of the interval that holds each distance, metres; any shape.

        An inner edge belongs to the interval on its left; distances outside belong to the first or
        the last.
        """
        distance_m = np.asarray(distance_m, dtype=np.float64)
        count = _count("count", self.count)
        edges_m = _native.right_edges(self.min_m, self.max_m, count, distance_m.ravel())
        return edges_m.reshape(distance_m.shape)


def dbscan(
    xyz: ArrayLike,
    radius_m: float | ArrayLike | RadiusModel,
    min_points: int,
    *,
    strict: bool = False,
    threads: int | None = None,
) -> NDArray[np.int32]:
    """Label the points of a cloud by density; noise is -1.

    A point with at least `min_points` neighbours, itself among them, is a core. Clusters are
    numbered by their smallest core index.

    Parameters
    ----------
    xyz
        Points, shape (n, 3), metres, any frame; float32 and float64 are taken as they are.
    radius_m
        Search radius, metres: a number, one per point (shape (n,)), or a `RadiusModel`, which gives
        each point the radius at its own distance from the origin of the frame, the sensor.
        q is a neighbour of p when their distance is at most the radius of p.
    min_points
        Least number of neighbours of a core.
    strict
        Ask for more than `min_points`, as the paper words it.
    threads
        Number of threads; None takes all processors. The labels do not depend on it.

    Returns
    -------
    numpy.ndarray
        Labels, shape (n,), int32.

    Raises
    ------
    InvalidValueError
        If a coordinate is not finite (the message names the first such point), a radius is not
        positive, `min_points` is 0, or shapes do not fit.
    TypeError
        If the points are not numbers.

    Notes
    -----
    With one radius the labels are those of `sklearn.cluster.DBSCAN`. With a radius per point two
    cores connect when their distance is within both radii, and a point that is no core belongs to
    the lowest-numbered cluster with a core whose radius reaches it. Neighbours are never stored, so
    memory is a small multiple of the cloud however dense it is.

    References
    ----------
    Ester, Kriegel, Sander, Xu, "A density-based algorithm for discovering clusters in large spatial
    databases with noise", KDD 1996; equations (9), (10) of Hu et al. 2024.

    Examples
    --------
    >>> points = [[0.0, 0.0, 0.0], [0.1, 0.0, 0.0], [0.2, 0.0, 0.0], [9.0, 0.0, 0.0]]
    >>> dbscan(points, 0.15, 3).tolist()
    [0, 0, 0, -1]
    """
    points = arrays.cloud("xyz", xyz)
    count = _count("min_points", min_points)
    if isinstance(radius_m, RadiusModel):
        radius_m = radius_m.radii_m(points)
    if np.ndim(radius_m) == 0:
        radius = float(np.asarray(radius_m))
        return _native.dbscan(points, radius, count, strict, threads)
    radii_m = arrays.column("radius_m", radius_m, len(points))
    return _native.dbscan_radii(points, radii_m, count, strict, threads)


@dataclass(frozen=True)
class ContourCluster:
    """One cluster of contour samples.

    Parameters
    ----------
    label
        Its label among the samples.
    count
        Number of samples.
    center_m
        Mean of the samples, shape (3,); equation (11).
    curve
        Curve through the samples.
    is_reduced
        Whether the samples were too few for the degrees asked for; those of the curve are lower.
    supporters
        Number of clusters on its curve, itself among them; equation (13).
    distance_m
        Distance of its centre from the chosen curve; 0 for the chosen cluster.
    is_kept
        Whether that distance is below the reach. Nothing else makes a cluster leave.
    """

    label: int
    count: int
    center_m: NDArray[np.float64]
    curve: SpaceCurve
    is_reduced: bool
    supporters: int
    distance_m: float
    is_kept: bool


@dataclass(frozen=True)
class LineClusters:
    """The clusters of one contour, judged.

    Parameters
    ----------
    clusters
        All clusters in the order of their labels.
    chosen
        Place in `clusters` of the one whose curve keeps the most.
    keep
        Whether each sample is kept, shape (n,).
    noise
        Number of samples that were noise.
    """

    clusters: tuple[ContourCluster, ...]
    chosen: int
    keep: NDArray[np.bool_]
    noise: int


def line_clusters(
    samples_m: ArrayLike,
    labels: ArrayLike,
    *,
    degrees: tuple[int, int],
    reach_m: float,
    axis: Axis = "z",
) -> LineClusters:
    """Find the clusters of a contour that lie on one curve.

    A curve is fitted to every cluster; the curve with most cluster centres nearer than `reach_m`
    wins (of several the one with the smallest mean distance from the samples of its clusters), and
    its clusters are kept.

    Parameters
    ----------
    samples_m
        Contour samples, shape (n, 3), metres.
    labels
        Cluster of every sample, shape (n,), -1 for noise, as `dbscan` gives them.
    degrees
        Degrees of the curves in the two other coordinates, in ascending order: over z, those of x
        and y. A cluster too small for them takes lower ones and says so.
    reach_m
        Largest distance of a centre from a curve, the paper's D.
    axis
        Coordinate over which the curves are written.

    Raises
    ------
    InvalidValueError
        If a degree is beyond 12, the reach is not positive, or shapes do not fit.
    MeasurementError
        If all samples are noise or one is not finite.

    Notes
    -----
    Equations (11)-(13) of Hu et al. 2024.

    Examples
    --------
    >>> z = np.arange(12.0)
    >>> samples = np.column_stack([0.1 * z, 0 * z, z])
    >>> samples[4:8, 0] += 2.0  # a piece that is off
    >>> found = line_clusters(samples, np.repeat([0, 1, 2], 4), degrees=(1, 1), reach_m=0.6)
    >>> [(cluster.label, round(cluster.distance_m, 2)) for cluster in found.clusters]
    [(0, 0.0), (1, 1.99), (2, 0.0)]
    >>> found.keep.sum()
    np.int64(8)
    """
    samples = np.ascontiguousarray(arrays.cloud("samples_m", samples_m), dtype=np.float64)
    names = np.ascontiguousarray(arrays.column("labels", labels, len(samples)), dtype=np.int32)
    raw, chosen, keep, noise = _native.line_clusters(
        samples, names, AXES.index(axis), degrees, reach_m
    )
    clusters = tuple(
        ContourCluster(
            label,
            count,
            np.array(center_m),
            SpaceCurve(axis, (Polynomial._of(first), Polynomial._of(second))),
            is_reduced,
            supporters,
            distance_m,
            is_kept,
        )
        for label, count, center_m, (
            first,
            second,
        ), is_reduced, supporters, distance_m, is_kept in raw
    )
    return LineClusters(clusters, chosen, keep, noise)


def _count(name: str, value: int) -> int:
    if int(value) != value or value < 1:
        raise InvalidValueError(f"{name}: expected a whole number of at least 1, found {value}")
    return int(value)
