"""Do fits and curve lengths agree with numpy and scipy, and state how well they are known?"""

import numpy as np
import pytest
from numpy.typing import NDArray

from lidar_deflect.errors import InvalidValueError, MeasurementError
from lidar_deflect.fitting import (
    Polynomial,
    SpaceCurve,
    arc_length,
    fit_line,
    fit_plane,
    fit_polynomial,
    walk_arc,
)

optimize = pytest.importorskip("scipy.optimize")
integrate = pytest.importorskip("scipy.integrate")


def ground(rng: np.random.Generator, count: int) -> NDArray[np.float64]:
    x, y = rng.uniform(20, 40, count), rng.uniform(-10, 10, count)
    return np.column_stack([x, y, -2 + 0.05 * x - 0.02 * y + rng.normal(scale=0.02, size=count)])


@pytest.mark.parametrize("count", [4, 50, 20_000])
@pytest.mark.parametrize("far_m", [0.0, 1e4])
def test_a_plane_is_the_last_singular_vector(count: int, far_m: float) -> None:
    points = ground(np.random.default_rng(count), count) + far_m
    plane = fit_plane(points, towards_m=points.mean(axis=0) + np.array([0, 0, 5]))
    centroid = points.mean(axis=0)
    _, singular, right = np.linalg.svd(points - centroid, full_matrices=False)
    normal = right[2] * np.sign(right[2, 2])
    # Moments square the numbers: half the digits of the ratio of spreads, far below the noise.
    np.testing.assert_allclose(plane.normal, normal, atol=1e-9)
    np.testing.assert_allclose(plane.centroid_m, centroid, rtol=1e-12)
    assert plane.rms_m == pytest.approx(singular[2] / np.sqrt(count), rel=1e-6)
    assert plane.offset_m == pytest.approx(-plane.normal @ centroid, rel=1e-12)
    assert plane.count == count
    away = fit_plane(points, towards_m=points.mean(axis=0) - np.array([0, 0, 5]))
    np.testing.assert_array_equal(away.normal, -plane.normal)


def test_the_covariance_of_a_plane_is_that_of_many_fits() -> None:
    fits = [fit_plane(ground(np.random.default_rng(seed), 40)) for seed in range(1500)]
    found = np.cov([[*fit.normal, fit.offset_m] for fit in fits], rowvar=False)
    stated = np.mean([fit.covariance for fit in fits], axis=0)
    # 1500 samples fix a variance to sqrt(2 / 1500) = 4 %; four sigma.
    np.testing.assert_allclose(np.diag(found)[[0, 1, 3]], np.diag(stated)[[0, 1, 3]], rtol=0.15)
    correlation = stated[0, 3] / np.sqrt(stated[0, 0] * stated[3, 3])
    sampled = found[0, 3] / np.sqrt(found[0, 0] * found[3, 3])
    assert sampled == pytest.approx(correlation, abs=0.02)


def test_fits_of_large_clouds_do_not_depend_on_threads_or_width() -> None:
    points = ground(np.random.default_rng(0), 300_000)
    one, two = (fit_plane(points, threads=threads) for threads in (1, 2))
    np.testing.assert_array_equal(one.normal, two.normal)
    np.testing.assert_array_equal(one.covariance, two.covariance)
    narrow = fit_plane(points.astype(np.float32))
    np.testing.assert_allclose(narrow.normal, one.normal, atol=1e-8)  # 40 m in 24 bits: 2 um


def test_a_line_is_the_first_singular_vector() -> None:
    rng = np.random.default_rng(4)
    direction = np.array([2.0, -1.0, 2.0]) / 3
    points = rng.uniform(-5, 5, 300)[:, None] * direction + rng.normal(scale=0.03, size=(300, 3))
    line = fit_line(points, along=[0, 1, 0])
    right = np.linalg.svd(points - points.mean(axis=0))[2][0]
    np.testing.assert_allclose(line.direction, right * np.sign(right[1]), atol=1e-12)
    np.testing.assert_allclose(line.point_m, points.mean(axis=0), atol=1e-13)
    # Noise across the line in two directions, 0.03 each.
    assert line.rms_m == pytest.approx(0.03 * np.sqrt(2), rel=0.15)
    assert np.sqrt(line.covariance[0, 0]) == pytest.approx(
        0.03 / np.sqrt(300) * np.sqrt(1 - direction[0] ** 2), rel=0.15
    )


@pytest.mark.parametrize("degree", range(7))
def test_a_polynomial_is_that_of_numpy_with_its_covariance(degree: int) -> None:
    rng = np.random.default_rng(degree)
    t = rng.uniform(80, 110, 60)
    x = np.sin(t / 7) + rng.normal(scale=0.1, size=60)
    fit = fit_polynomial(t, x, degree)
    peer = np.polynomial.Polynomial.fit(t, x, degree)
    places = np.linspace(75, 115, 9)
    np.testing.assert_allclose(fit(places), peer(places), rtol=1e-8, atol=1e-9)
    np.testing.assert_allclose(
        fit.estimate.slope(places), peer.deriv()(places), rtol=1e-7, atol=1e-8
    )
    u = (t - fit.estimate.center) / fit.estimate.scale
    _, covariance = np.polyfit(u, x, degree, cov=True)
    np.testing.assert_allclose(fit.covariance, covariance[::-1, ::-1], rtol=1e-6, atol=1e-12)
    residual = x - peer(t)
    assert fit.rms == pytest.approx(np.sqrt(np.mean(residual**2)), rel=1e-9)
    design = np.vander((places - fit.estimate.center) / fit.estimate.scale, degree + 1, True)
    variance = np.einsum("ij,jk,ik->i", design, fit.covariance, design)
    np.testing.assert_allclose(fit.std(places), np.sqrt(variance), rtol=1e-12)


def test_powers_rebuild_the_polynomial() -> None:
    polynomial = Polynomial((1.0, -2.0, 0.5, 0.25), center=3.0, scale=2.0)
    again = np.polynomial.Polynomial(polynomial.powers())
    t = np.linspace(-5, 5, 11)
    np.testing.assert_allclose(polynomial(t), again(t), rtol=1e-12, atol=1e-12)
    assert polynomial(t.reshape(11, 1)).shape == (11, 1)
    assert float(polynomial(3.0)) == 1.0


def curves() -> list[SpaceCurve]:
    rng = np.random.default_rng(6)
    scales = [1e-3, 0.05, 0.5, 3.0]
    return [
        SpaceCurve(
            axis,
            (
                Polynomial(tuple(scale * rng.normal(size=4)), 95.0, 15.0),
                Polynomial(tuple(scale * rng.normal(size=3)), 95.0, 15.0),
            ),
        )
        for axis in ("x", "y", "z")
        for scale in scales
    ]


@pytest.mark.parametrize("curve", curves())
def test_arc_length_is_that_of_scipy_and_the_walk_is_its_inverse(curve: SpaceCurve) -> None:
    first, second = curve.across

    def speed(t: float) -> float:
        return float(np.sqrt(1 + first.slope(t) ** 2 + second.slope(t) ** 2))

    for start, end in [(80.0, 110.0), (110.0, 84.0), (100.0, 100.0), (0.0, 110.0)]:
        expected = integrate.quad(speed, start, end, epsabs=1e-11, epsrel=1e-13, limit=500)[0]
        length_m = arc_length(curve, start, end)
        assert length_m == pytest.approx(expected, abs=2e-9, rel=1e-12)
        assert walk_arc(curve, start, length_m) == pytest.approx(end, abs=3e-9)


def test_a_chord_sum_closes_in_on_the_arc_length() -> None:
    curve = SpaceCurve("z", (Polynomial((0.0, 0.0, 0.004)), Polynomial((1.0, 0.1))))
    points = curve.points_m(np.linspace(70, 110, 100_001))
    chords = np.linalg.norm(np.diff(points, axis=0), axis=1).sum()
    assert arc_length(curve, 70, 110) == pytest.approx(chords, abs=1e-8)


@pytest.mark.parametrize("curve", curves())
def test_distances_are_those_of_a_search_along_the_curve(curve: SpaceCurve) -> None:
    rng = np.random.default_rng(9)
    t = rng.uniform(80, 110, 20)
    points = curve.points_m(t) + rng.normal(scale=0.7, size=(20, 3))
    dense = np.linspace(70, 120, 50_001)
    path = curve.points_m(dense)
    expected = [np.linalg.norm(path - point, axis=1).min() for point in points]
    # A step of 1 mm misses the nearest point by h^2 / 8 d times the speed squared.
    np.testing.assert_allclose(curve.distance_m(points), expected, atol=5e-5)
    assert (curve.distance_m(points) <= np.array(expected) + 1e-12).all()


@pytest.mark.parametrize(
    ("points", "code"),
    [
        ([[0, 0, 0], [1, 0, 0]], "fit.too_few"),
        ([[0, 0, 0], [1, 1, 1], [2, 2, 2], [3, 3, 3]], "fit.degenerate"),
        ([[1, 2, 3]] * 6, "fit.degenerate"),
        ([[0, 0, 0], [1, 0, 0], [0, np.nan, 0]], "fit.not_finite"),
    ],
)
def test_points_that_fix_no_plane_are_named(points: list[list[float]], code: str) -> None:
    with pytest.raises(MeasurementError) as caught:
        fit_plane(points)
    assert caught.value.code == code


@pytest.mark.parametrize(
    ("t", "degree", "code"),
    [
        ([0.0, 1.0], 2, "fit.too_few"),
        ([1.0, 1.0, 1.0, 2.0], 2, "fit.degenerate"),
        ([0.0, 1.0, 2.0, np.inf], 1, "fit.not_finite"),
        (list(range(30)), 13, "fit.degenerate"),
        ([], 0, "fit.too_few"),
    ],
)
def test_pairs_that_fix_no_polynomial_are_named(t: list[float], degree: int, code: str) -> None:
    with pytest.raises(MeasurementError) as caught:
        fit_polynomial(t, np.zeros(len(t)), degree)
    assert caught.value.code == code


def test_arguments_without_meaning_are_refused_by_name() -> None:
    with pytest.raises(InvalidValueError, match=r"x: expected shape \(3,\)"):
        fit_polynomial([0, 1, 2], [0, 1], 1)
    with pytest.raises(InvalidValueError, match="degree"):
        fit_polynomial([0, 1, 2], [0, 1, 2], -1)
    with pytest.raises(InvalidValueError, match="scale"):
        Polynomial((1.0,), scale=0.0)
    with pytest.raises(InvalidValueError, match="coefficients"):
        Polynomial(())
    with pytest.raises(InvalidValueError, match="towards_m"):
        fit_plane(np.eye(3), towards_m=[0, np.nan, 0])
    flat = Polynomial((0.0,))
    with pytest.raises(InvalidValueError, match="axis"):
        SpaceCurve("w", (flat, flat)).points_m([0.0])  # type: ignore[arg-type]


def test_lengths_that_are_not_finite_do_not_converge() -> None:
    line = SpaceCurve("z", (Polynomial((0.0, 1.0)), Polynomial((0.0,))))
    for end in (np.nan, np.inf):
        with pytest.raises(MeasurementError) as caught:
            arc_length(line, 0.0, end)
        assert caught.value.code == "fit.not_converged"
