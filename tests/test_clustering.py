"""Do clusters agree with scikit-learn, with the definition, and with themselves?"""

import pickle
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from lidar_deflect.clustering import NOISE, Intervals, RadiusModel, dbscan, line_clusters
from lidar_deflect.errors import InvalidValueError, MeasurementError

sklearn_cluster = pytest.importorskip("sklearn.cluster")

Cloud = NDArray[Any]


def blobs(rng: np.random.Generator, count: int) -> Cloud:
    """Dense and thin heaps with stray points between."""
    centers = rng.uniform(-10, 10, (12, 3))
    spread = rng.uniform(0.05, 0.8, 12)
    home = rng.integers(0, 12, count)
    points = centers[home] + spread[home, None] * rng.normal(size=(count, 3))
    points[::10] = rng.uniform(-12, 12, points[::10].shape)
    return points


def scan_lines(rng: np.random.Generator, count: int) -> Cloud:
    """Lines of a turning lidar over a slope: dense along, far apart across."""
    ring = rng.integers(-8, 8, count)
    azimuth = rng.integers(0, 1800, count) * np.radians(0.2)
    range_m = 20 + 3 * np.sin(3 * azimuth) + rng.normal(scale=0.02, size=count)
    up = np.radians(2 * ring + 1)
    flat = range_m * np.cos(up)
    return np.column_stack([flat * np.cos(azimuth), flat * np.sin(azimuth), range_m * np.sin(up)])


def lattice(rng: np.random.Generator, count: int) -> Cloud:
    """Points on a grid of 1/8: repeated, in line, and exactly at the radius of each other."""
    side = max(4, round((2.0 * count) ** (1 / 3)))
    return rng.integers(0, side, (count, 3)) / 8.0


CLOUDS = {"blobs": (blobs, 0.25), "scan_lines": (scan_lines, 0.15), "lattice": (lattice, 0.125)}


def peer(points: Cloud, radius_m: float, min_points: int) -> NDArray[np.int64]:
    # A k-d tree in 64 bits; the automatic choice takes rounded products for tiny clouds.
    model = sklearn_cluster.DBSCAN(eps=radius_m, min_samples=min_points, algorithm="kd_tree")
    return np.asarray(model.fit(points).labels_)


@pytest.mark.parametrize("kind", CLOUDS)
@pytest.mark.parametrize("dtype", [np.float32, np.float64])
@pytest.mark.parametrize("count", [1, 7, 60, 500, 5000])
def test_labels_are_those_of_scikit_learn(kind: str, dtype: type, count: int) -> None:
    make, radius_m = CLOUDS[kind]
    for seed in range(8):
        rng = np.random.default_rng([seed, count])
        points = make(rng, count).astype(dtype)
        for scale, min_points in [(1.0, 4), (2.0, 10), (0.5, 1), (np.sqrt(2), 6)]:
            expected = peer(points, scale * radius_m, min_points)
            found = dbscan(points, scale * radius_m, min_points)
            np.testing.assert_array_equal(found, expected, f"{seed=} {scale=} {min_points=}")


@pytest.mark.parametrize("kind", CLOUDS)
@pytest.mark.parametrize("dtype", [np.float32, np.float64])
def test_a_large_cloud_has_the_labels_of_scikit_learn_on_any_number_of_threads(
    kind: str, dtype: type
) -> None:
    make, radius_m = CLOUDS[kind]
    points = make(np.random.default_rng(5), 200_000).astype(dtype)
    # Fewer neighbours than blobs would have at this size keep the peer's memory small.
    radius_m *= 0.3 if kind == "blobs" else 1.0
    expected = peer(points, radius_m, 5)
    assert len(np.unique(expected)) > 2 or kind == "lattice"
    for threads in (1, 2, 3):
        found = dbscan(points, radius_m, 5, threads=threads)
        np.testing.assert_array_equal(found, expected)


def same_partition(a: NDArray[Any], b: NDArray[Any]) -> bool:
    pairs = np.unique(np.column_stack([a, b]), axis=0)
    return len(pairs) == len(np.unique(a)) == len(np.unique(b))


def test_shuffling_moves_only_the_numbers() -> None:
    rng = np.random.default_rng(11)
    points = blobs(rng, 20_000)
    order = rng.permutation(len(points))
    shuffled = points[order]
    np.testing.assert_array_equal(dbscan(shuffled, 0.2, 6), peer(shuffled, 0.2, 6))
    # Cores keep company; a border point may join another cluster, so look at cores only.
    tree = sklearn_cluster.DBSCAN(eps=0.2, min_samples=6).fit(points)
    is_core = np.zeros(len(points), bool)
    is_core[tree.core_sample_indices_] = True
    labels, moved = dbscan(points, 0.2, 6), np.empty(len(points), np.int32)
    moved[order] = dbscan(shuffled, 0.2, 6)
    assert same_partition(labels[is_core], moved[is_core])
    np.testing.assert_array_equal(labels == NOISE, moved == NOISE)


@pytest.mark.parametrize("scale", [1e-30, 1e-3, 1.0, 1e6, 1e30])
def test_labels_do_not_depend_on_the_unit(scale: float) -> None:
    unit = 2.0 ** round(np.log2(scale))  # a power of two, so that nothing is rounded
    points = lattice(np.random.default_rng(3), 2000)
    np.testing.assert_array_equal(dbscan(points * unit, 0.125 * unit, 4), dbscan(points, 0.125, 4))


def test_far_coordinates_keep_the_labels_of_scikit_learn() -> None:
    for far in (1e5, 1e9, 1e12):
        points = lattice(np.random.default_rng(3), 2000) + far
        np.testing.assert_array_equal(dbscan(points, 0.125, 4), peer(points, 0.125, 4))
    strays = np.array([[1e300, 0, 0], [-1e300, 1e300, 5.0]])
    near = lattice(np.random.default_rng(3), 2000)
    found = dbscan(np.vstack([near, strays]), 0.125, 4)
    np.testing.assert_array_equal(found[:-2], dbscan(near, 0.125, 4))
    assert found[-2:].tolist() == [NOISE, NOISE]


def brute(points: Cloud, radii_m: NDArray[np.float64], min_points: int) -> NDArray[np.int32]:
    """The definition for a radius per point, word for word, on the matrix of all pairs."""
    p = points.astype(np.float64)
    square = sum((p[:, None, k] - p[None, :, k]) ** 2 for k in range(3))
    reach = np.asarray(square) <= (radii_m**2)[:, None]  # [p, q]: q is a neighbour of p
    core = reach.sum(axis=1) >= min_points
    link = reach & reach.T & core[:, None] & core[None, :]
    labels = np.full(len(p), NOISE, np.int32)
    cluster = 0
    for seed in np.flatnonzero(core):
        if labels[seed] != NOISE:
            continue
        front = np.zeros(len(p), bool)
        front[seed] = True
        while front.any():
            labels[front] = cluster
            front = link[front].any(axis=0) & (labels == NOISE)
        cluster += 1
    for q in np.flatnonzero(~core):
        reached = labels[core & reach[:, q]]
        labels[q] = reached.min() if len(reached) else NOISE
    return labels


def varied() -> Iterator[tuple[Cloud, NDArray[np.float64], int]]:
    for seed in range(12):
        rng = np.random.default_rng(seed)
        for make, radius_m in CLOUDS.values():
            points = make(rng, 400).astype([np.float32, np.float64][seed % 2])
            steps = rng.integers(1, 6, len(points))
            yield points, radius_m * steps, 2 + seed % 5


def test_a_radius_per_point_follows_the_definition() -> None:
    kinds = set()
    for points, radii_m, min_points in varied():
        expected = brute(points, radii_m, min_points)
        for threads in (1, 2):
            found = dbscan(points, radii_m, min_points, threads=threads)
            np.testing.assert_array_equal(found, expected)
        kinds.add((expected.max() > 1, bool((expected == NOISE).any())))
    assert (True, True) in kinds  # some clouds have several clusters and noise


def test_equal_radii_are_one_radius() -> None:
    points = scan_lines(np.random.default_rng(2), 20_000).astype(np.float32)
    each = dbscan(points, np.full(len(points), 0.15), 4)
    np.testing.assert_array_equal(each, dbscan(points, 0.15, 4))


def test_a_radius_model_gives_each_point_its_own_radius() -> None:
    points = scan_lines(np.random.default_rng(2), 3000)
    model = RadiusModel(alpha_deg=0.2, mu=1.5, beta_m=0.02, min_points=4)
    distance_m = np.linalg.norm(points, axis=1)
    radii_m = 1.5 * np.tan(np.radians(0.2)) * 4 * distance_m + 0.02
    np.testing.assert_allclose(model.radii_m(points), radii_m, rtol=1e-14)
    np.testing.assert_allclose(model.radius_m(distance_m), radii_m, rtol=1e-14)
    found = dbscan(points, model, 4)
    np.testing.assert_array_equal(found, brute(points, model.radii_m(points), 4))
    assert pickle.loads(pickle.dumps(model)) == model


def test_strict_is_one_point_more() -> None:
    points = blobs(np.random.default_rng(1), 2000)
    strict = dbscan(points, 0.3, 5, strict=True)
    np.testing.assert_array_equal(strict, dbscan(points, 0.3, 6))
    assert (strict != dbscan(points, 0.3, 5)).any()


def test_an_empty_cloud_has_no_labels() -> None:
    assert dbscan(np.empty((0, 3), np.float32), 0.1, 4).shape == (0,)
    assert dbscan(np.empty((0, 3)), np.empty(0), 4).shape == (0,)


def test_any_layout_of_memory_is_taken() -> None:
    points = blobs(np.random.default_rng(1), 500)
    expected = dbscan(points, 0.3, 5)
    for view in (np.asfortranarray(points), np.repeat(points, 2, axis=0)[::2], points.tolist()):
        np.testing.assert_array_equal(dbscan(view, 0.3, 5), expected)
    whole = np.random.default_rng(1).integers(0, 9, (300, 3))
    np.testing.assert_array_equal(dbscan(whole, 1.0, 4), dbscan(whole.astype(float), 1.0, 4))


@pytest.mark.parametrize("bad", [np.nan, np.inf, -np.inf])
@pytest.mark.parametrize("dtype", [np.float32, np.float64])
def test_the_first_point_that_is_not_finite_is_named(bad: float, dtype: type) -> None:
    points = np.zeros((100, 3), dtype)
    points[[42, 77], [1, 0]] = bad
    for radius_m in (0.1, np.full(100, 0.1)):
        with pytest.raises(InvalidValueError, match="point 42") as caught:
            dbscan(points, radius_m, 4)
        assert caught.value.code == "cluster.not_finite"


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        ((np.zeros((5, 2)), 0.1, 4), r"xyz.*\(n, 3\).*\(5, 2\)"),
        ((np.zeros(3), 0.1, 4), "xyz"),
        ((np.zeros((5, 3)), 0.0, 4), "radius_m"),
        ((np.zeros((5, 3)), np.nan, 4), "radius_m"),
        ((np.zeros((5, 3)), -1.0, 4), "radius_m"),
        ((np.zeros((5, 3)), [0.1] * 4, 4), r"radius_m.*\(5,\).*\(4,\)"),
        ((np.zeros((5, 3)), [0.1, 0.1, 0.1, 0.1, 0.0], 4), "radius_m"),
        ((np.zeros((5, 3)), 0.1, 0), "min_points"),
        ((np.zeros((5, 3)), 0.1, 2.5), "min_points"),
    ],
)
def test_arguments_without_meaning_are_refused_by_name(arguments: Any, words: str) -> None:
    with pytest.raises(InvalidValueError, match=words):
        dbscan(*arguments)


def test_what_is_no_number_is_a_type_error() -> None:
    with pytest.raises(TypeError, match="xyz"):
        dbscan(np.zeros((5, 3), complex), 0.1, 4)
    with pytest.raises(InvalidValueError, match="threads"):
        dbscan(np.zeros((5, 3)), 0.1, 4, threads=0)


def test_models_without_meaning_are_refused_when_made() -> None:
    good = {"alpha_deg": 0.2, "mu": 1.5, "beta_m": 0.0, "min_points": 4}
    for name, bad in [("alpha_deg", 0.0), ("mu", -1.0), ("beta_m", -0.1), ("min_points", 0)]:
        with pytest.raises(InvalidValueError, match=name.removesuffix("_deg")):
            RadiusModel(**{**good, name: bad})  # type: ignore[arg-type]
    with pytest.raises(InvalidValueError):
        Intervals(min_m=3.0, max_m=2.0, count=4)


def test_intervals_are_those_of_a_search_in_their_edges() -> None:
    intervals = Intervals(min_m=12.0, max_m=37.0, count=7)
    distance_m = np.random.default_rng(0).uniform(5, 45, (40, 5))
    edges_m = np.linspace(12.0, 37.0, 8)[1:]
    place = np.searchsorted(edges_m, distance_m).clip(max=6)
    np.testing.assert_allclose(intervals.right_edge_m(distance_m), edges_m[place], rtol=1e-14)


def contour(z: NDArray[np.float64], off_m: float = 0.0) -> Cloud:
    return np.column_stack([0.002 * (z - 70) ** 2 + off_m, 0.1 * z, z])


def test_a_misplaced_lidar_leaves_the_contour() -> None:
    rng = np.random.default_rng(8)
    pieces = [
        contour(z0 + np.arange(8.0), off) for z0, off in [(70, 0), (80, 1.4), (90, 0), (100, 0)]
    ]
    samples = np.vstack([*pieces, [[30.0, 0.0, 85.0]]])
    samples += rng.normal(scale=0.01, size=samples.shape)
    labels = dbscan(samples, 1.6, 3)
    found = line_clusters(samples, labels, degrees=(2, 1), reach_m=0.6)
    assert [c.is_kept for c in found.clusters] == [True, False, True, True]
    assert found.noise == 1
    assert found.keep.tolist() == [True] * 8 + [False] * 8 + [True] * 16 + [False]
    left = found.clusters[1]
    np.testing.assert_allclose(left.center_m, samples[8:16].mean(axis=0), rtol=1e-12)
    chosen = found.clusters[found.chosen]
    assert chosen.supporters == 3
    assert chosen.distance_m == 0.0
    # The distance is to the nearest point of the curve: look along it densely.
    dense = chosen.curve.points_m(np.linspace(60, 110, 200_001))
    nearest = np.linalg.norm(dense - left.center_m, axis=1).min()
    assert left.distance_m == pytest.approx(nearest, abs=1e-7)
    assert left.distance_m == pytest.approx(float(chosen.curve.distance_m([left.center_m])[0]))


def test_a_contour_of_noise_has_no_line() -> None:
    with pytest.raises(MeasurementError) as caught:
        line_clusters(np.zeros((4, 3)), np.full(4, NOISE), degrees=(1, 1), reach_m=0.6)
    assert caught.value.code == "fit.no_cluster"
    with pytest.raises(InvalidValueError, match="labels"):
        line_clusters(np.zeros((4, 3)), np.zeros(3), degrees=(1, 1), reach_m=0.6)


MEMORY = """
import re, sys
from pathlib import Path
import numpy as np
from lidar_deflect.clustering import dbscan

def kilobytes(word):
    return int(re.search(word + r":\\s+(\\d+)", Path("/proc/self/status").read_text())[1])

count, per_point = int(sys.argv[1]), sys.argv[2] == "each"
points = np.random.default_rng(0).random((count, 3), dtype=np.float32)
points *= np.array([float(c) for c in sys.argv[3:6]], np.float32)
radius_m = np.full(count, 0.1) if per_point else 0.1
dbscan(points[:9], radius_m[:9] if per_point else 0.1, 4, threads=2)
Path("/proc/self/clear_refs").write_text("5")  # the peak starts anew
before = kilobytes("VmRSS")
labels = dbscan(points, radius_m, 4, threads=2)
print((kilobytes("VmHWM") - before) * 1024 / points.nbytes, labels.max())
"""


@pytest.mark.skipif(not Path("/proc/self/clear_refs").exists(), reason="reads peaks from /proc")
@pytest.mark.parametrize(
    ("count", "radii", "size_m"),
    [
        (1_500_000, "one", (60, 60, 1)),  # a handful of neighbours
        (1_500_000, "one", (1, 1, 1)),  # six thousand neighbours each
        (500_000, "each", (40, 40, 1)),
        (8_000, "each", (0.05, 0.05, 0.05)),  # all are neighbours of all
    ],
)
def test_memory_is_a_small_multiple_of_the_cloud(
    count: int, radii: str, size_m: tuple[float, ...]
) -> None:
    command = [sys.executable, "-c", MEMORY, str(count), radii, *map(str, size_m)]
    run = subprocess.run(command, capture_output=True, text=True, check=True)
    multiple, last = run.stdout.split()
    assert int(last) >= 0
    small_bytes = 4e6  # threads and pools, whatever the cloud
    assert float(multiple) < 6 + small_bytes / (12 * count)
