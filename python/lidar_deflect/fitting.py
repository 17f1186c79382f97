"""Shapes through points by least squares, and curves by their length."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Literal, cast

import numpy as np

from lidar_deflect import _native, arrays
from lidar_deflect.errors import InvalidValueError

if TYPE_CHECKING:
    from numpy.typing import ArrayLike, NDArray

    RawPolynomial = tuple[list[float], float, float]

Axis = Literal["x", "y", "z"]
"""A coordinate of the frame at hand."""

AXES: tuple[Axis, Axis, Axis] = ("x", "y", "z")
"""The coordinates in order."""

TOLERANCE_M = 1e-9
"""Default tolerance of arc lengths: far below anything a lidar sees, and cheap."""


@dataclass(frozen=True)
class Plane:
    """A plane through points, normal . p + offset_m = 0.

    Parameters
    ----------
    normal
        Unit normal, shape (3,).
    offset_m
        Minus the component along the normal of any point of the plane.
    centroid_m
        Mean of the points, shape (3,).
    covariance
        Covariance of (normal, offset_m), shape (4, 4), rank 3; NaN with three points.
    rms_m
        Root of the mean squared distance of the points.
    count
        Number of points.
    """

    normal: NDArray[np.float64]
    offset_m: float
    centroid_m: NDArray[np.float64]
    covariance: NDArray[np.float64]
    rms_m: float
    count: int


def fit_plane(
    xyz: ArrayLike, *, towards_m: ArrayLike = (0.0, 0.0, 0.0), threads: int | None = None
) -> Plane:
    """Fit a plane by orthogonal distances.

    Parameters
    ----------
    xyz
        Points, shape (n, 3) with n >= 3, metres; millions are fine.
    towards_m
        A point on the side to which the normal shall point; the origin (the sensor) by default.
    threads
        Number of threads; None takes all processors. The result does not depend on it.

    Raises
    ------
    MeasurementError
        With fewer than three points, points on a line, points that spread alike in all directions,
        or coordinates that are not finite; the code is ``fit.too_few``, ``fit.degenerate`` or
        ``fit.not_finite``.

    Notes
    -----
    Centroid and last right singular vector, equations (2)-(6) of Hu et al. 2024.

    Examples
    --------
    >>> ground = [[0, 0, -2], [1, 0, -2], [0, 1, -2], [1, 1, -2]]
    >>> plane = fit_plane(ground)
    >>> plane.normal.tolist(), plane.offset_m
    ([0.0, 0.0, 1.0], 2.0)
    """
    points, towards = arrays.cloud("xyz", xyz), arrays.vector("towards_m", towards_m)
    (normal, offset_m, centroid_m), covariance, rms_m, count = _native.fit_plane(
        points, towards, threads
    )
    return Plane(np.array(normal), offset_m, np.array(centroid_m), covariance, rms_m, count)


@dataclass(frozen=True)
class Line:
    """A straight line through points.

    Parameters
    ----------
    point_m
        Mean of the points, shape (3,).
    direction
        Unit direction, shape (3,).
    covariance
        Covariance of (point_m across the line, direction), shape (6, 6), rank 4; NaN with two
        points.
    rms_m
        Root of the mean squared distance of the points.
    count
        Number of points.
    """

    point_m: NDArray[np.float64]
    direction: NDArray[np.float64]
    covariance: NDArray[np.float64]
    rms_m: float
    count: int


def fit_line(
    xyz: ArrayLike, *, along: ArrayLike = (0.0, 0.0, 1.0), threads: int | None = None
) -> Line:
    """Fit a straight line in space by orthogonal distances.

    Parameters
    ----------
    xyz
        Points, shape (n, 3) with n >= 2, metres.
    along
        A direction with which that of the line shall agree in sign.
    threads
        Number of threads; None takes all processors. The result does not depend on it.

    Raises
    ------
    MeasurementError
        With fewer than two points, no direction in which they spread farthest, or coordinates that
        are not finite.

    Examples
    --------
    >>> fit_line([[0, 0, 0], [0, 3, 4], [0, 6, 8]]).direction.round(12).tolist()
    [0.0, 0.6, 0.8]
    """
    points, sign = arrays.cloud("xyz", xyz), arrays.vector("along", along)
    (point_m, direction), covariance, rms_m, count = _native.fit_line(points, sign, threads)
    return Line(np.array(point_m), np.array(direction), covariance, rms_m, count)


@dataclass(frozen=True)
class Polynomial:
    """Sum of coefficients[k] u^k with u = (t - center) / scale; call it for values.

    Parameters
    ----------
    coefficients
        Coefficients of the powers of u, lowest first.
    center
        Abscissa at which u is 0.
    scale
        Length on the abscissa of one u.

    Examples
    --------
    >>> square = Polynomial((0.0, 0.0, 4.0), center=1.0, scale=2.0)
    >>> square([1.0, 4.0]).tolist(), square.slope([4.0]).tolist(), square.powers().tolist()
    ([0.0, 9.0], [6.0], [1.0, -2.0, 1.0])
    """

    coefficients: tuple[float, ...]
    center: float = 0.0
    scale: float = 1.0

    def __post_init__(self) -> None:
        self(0.0)

    def __call__(self, t: ArrayLike) -> NDArray[np.float64]:
        """Values at abscissas of any shape."""
        t = np.asarray(t, dtype=np.float64)
        return _native.polynomial_values(self._raw, t.ravel()).reshape(t.shape)

    def slope(self, t: ArrayLike) -> NDArray[np.float64]:
        """First derivatives at abscissas of any shape."""
        t = np.asarray(t, dtype=np.float64)
        return _native.polynomial_slopes(self._raw, t.ravel()).reshape(t.shape)

    def powers(self) -> NDArray[np.float64]:
        """Coefficients of the powers of t itself, lowest first; digits are lost far from 0."""
        return _native.polynomial_powers(self._raw)

    @property
    def _raw(self) -> RawPolynomial:
        return [float(c) for c in self.coefficients], self.center, self.scale

    @staticmethod
    def _of(raw: RawPolynomial) -> Polynomial:
        return Polynomial(tuple(raw[0]), raw[1], raw[2])


@dataclass(frozen=True)
class PolynomialFit:
    """A polynomial through points; call it for values.

    Parameters
    ----------
    estimate
        The polynomial.
    covariance
        Covariance of its coefficients, shape (degree + 1, degree + 1); NaN without redundancy.
    rms
        Root of the mean squared residual.
    count
        Number of points.
    """

    estimate: Polynomial
    covariance: NDArray[np.float64]
    rms: float
    count: int

    def __call__(self, t: ArrayLike) -> NDArray[np.float64]:
        """Values at abscissas of any shape."""
        return self.estimate(t)

    def std(self, t: ArrayLike) -> NDArray[np.float64]:
        """Give the standard uncertainty of the values at abscissas of any shape."""
        t = np.asarray(t, dtype=np.float64)
        raw = self.estimate._raw
        variances = _native.polynomial_variances(raw, self.covariance, t.ravel())
        return cast("NDArray[np.float64]", np.sqrt(variances).reshape(t.shape))


def fit_polynomial(t: ArrayLike, x: ArrayLike, degree: int) -> PolynomialFit:
    """Fit x over t by a polynomial, by least squares.

    Parameters
    ----------
    t
        Abscissas, shape (n,).
    x
        Ordinates, shape (n,).
    degree
        Degree, 0 to 12.

    Raises
    ------
    MeasurementError
        With fewer than degree + 1 points or different abscissas, a degree beyond 12, or values that
        are not finite; the code is ``fit.too_few``, ``fit.degenerate`` or ``fit.not_finite``.

    Notes
    -----
    The abscissa is centred and scaled to [-1, 1], so that contours far from the origin keep their
    digits. The covariance comes from the scatter of the residuals.

    Examples
    --------
    >>> fit = fit_polynomial([80, 90, 100, 110], [1.0, 2.0, 5.0, 10.0], 2)
    >>> float(fit(120).round(9)), fit.estimate.powers().round(9).tolist()
    (17.0, [65.0, -1.6, 0.01])
    """
    if degree < 0:
        raise InvalidValueError(f"degree: expected at least 0, found {degree}")
    abscissas = arrays.column("t", t)
    ordinates = arrays.column("x", x, len(abscissas))
    raw, covariance, rms, count = _native.fit_polynomial(abscissas, ordinates, degree)
    return PolynomialFit(Polynomial._of(raw), covariance, rms, count)


@dataclass(frozen=True)
class SpaceCurve:
    """A curve in space whose parameter is one of its coordinates, as equation (14) writes it.

    Parameters
    ----------
    axis
        The coordinate that is the parameter t, metres.
    across
        The two other coordinates as polynomials in t, in ascending order: over z, x(z) and y(z).

    Examples
    --------
    >>> curve = SpaceCurve("z", (Polynomial((0.0, 2.0)), Polynomial((5.0, -2.0))))
    >>> curve.points_m([0.0, 1.0]).tolist()
    [[0.0, 5.0, 0.0], [2.0, 3.0, 1.0]]
    """

    axis: Axis
    across: tuple[Polynomial, Polynomial]

    def points_m(self, t_m: ArrayLike) -> NDArray[np.float64]:
        """Points at parameters of shape (n,), shape (n, 3)."""
        return _native.curve_points(self._raw, arrays.column("t_m", t_m))

    def distance_m(self, xyz: ArrayLike) -> NDArray[np.float64]:
        """Shortest distance of points, shape (n, 3), from the curve, shape (n,)."""
        points = np.ascontiguousarray(arrays.cloud("xyz", xyz), dtype=np.float64)
        return _native.curve_distances(self._raw, points)

    @property
    def _raw(self) -> tuple[int, tuple[RawPolynomial, RawPolynomial]]:
        if self.axis not in AXES:
            raise InvalidValueError(f"axis: expected x, y or z, found {self.axis!r}")
        return AXES.index(self.axis), (self.across[0]._raw, self.across[1]._raw)


def arc_length(
    curve: SpaceCurve, from_m: float, to_m: float, *, tolerance_m: float = TOLERANCE_M
) -> float:
    """Length of a curve between two parameters, metres, negative backwards.

    Parameters
    ----------
    curve
        The curve.
    from_m, to_m
        Parameters of both ends.
    tolerance_m
        Absolute tolerance.

    Raises
    ------
    MeasurementError
        If the tolerance is not reached (``fit.not_converged``), as with ends that are not finite.

    Notes
    -----
    Equation (15) of Hu et al. 2024 by adaptive Gauss-Kronrod quadrature.

    Examples
    --------
    >>> curve = SpaceCurve("z", (Polynomial((0.0, 2.0)), Polynomial((5.0, -2.0))))
    >>> round(arc_length(curve, 1.0, 4.0), 9)
    9.0
    """
    return _native.arc_length(curve._raw, from_m, to_m, tolerance_m)


def walk_arc(
    curve: SpaceCurve, from_m: float, length_m: float, *, tolerance_m: float = TOLERANCE_M
) -> float:
    """Parameter that is reached after a length of curve; the inverse of `arc_length`.

    Parameters
    ----------
    curve
        The curve.
    from_m
        Parameter of the start.
    length_m
        Length to walk, backwards where it is negative.
    tolerance_m
        Absolute tolerance of the length.

    Raises
    ------
    MeasurementError
        If the tolerance is not reached (``fit.not_converged``).

    Examples
    --------
    >>> curve = SpaceCurve("z", (Polynomial((0.0, 2.0)), Polynomial((5.0, -2.0))))
    >>> round(walk_arc(curve, 4.0, -9.0), 9)
    1.0
    """
    return _native.walk_arc(curve._raw, from_m, length_m, tolerance_m)
