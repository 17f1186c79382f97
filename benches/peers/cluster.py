"""Hold dbscan against scikit-learn, `dbscan` of PyPI and Open3D on the same clouds."""

from __future__ import annotations

import time
from typing import TYPE_CHECKING, Any

import numpy as np
from rounds import Row, ratio, rounds, table
from sklearn.cluster import DBSCAN
from sklearn.neighbors import radius_neighbors_graph

from lidar_deflect.clustering import dbscan

if TYPE_CHECKING:
    from collections.abc import Callable

    from numpy.typing import NDArray

RADIUS_M = 0.15
MIN_POINTS = 4
ASKED = {10_000: 4, 100_000: 6, 1_000_000: 7, 10_000_000: 8}
SLOW = 1_000_000
"""From so many points on scikit-learn takes minutes in all, and fewer rounds do."""
HUGE = 10_000_000
"""With so many points the best peer alone is there, once."""
ONE, ALL, PEER = "ours, one thread", "ours, all threads", "scikit-learn"


def surface(count: int) -> NDArray[np.float32]:
    """Make a wavy surface: 400 points per square metre, 2 cm of noise, one in twenty astray."""
    rng = np.random.default_rng(1)
    side_m = np.sqrt(count / 400)
    x, z = rng.uniform(0, side_m, (2, count))
    z.sort()
    stray = np.where(np.arange(count) % 20 == 0, 3.0, 0.02)
    y = np.sin(0.7 * x) + np.cos(0.3 * z) + stray * rng.uniform(-1, 1, count)
    return np.column_stack([x, y, z]).astype(np.float32)


def peers(points: NDArray[np.float32]) -> dict[str, Callable[[], Any]]:
    """Jobs of the others, one thread each, as far as they are installed."""
    wide = points.astype(np.float64)
    own = DBSCAN(eps=RADIUS_M, min_samples=MIN_POINTS, algorithm="kd_tree", n_jobs=1)
    jobs: dict[str, Callable[[], Any]] = {PEER: lambda: own.fit(points).labels_}
    try:
        from dbscan import DBSCAN as PYPI

        jobs["dbscan (PyPI)"] = lambda: PYPI(wide, eps=RADIUS_M, min_samples=MIN_POINTS)[0]
    except ImportError as missing:
        print(f"without dbscan: {missing}")
    try:
        import open3d

        cloud = open3d.geometry.PointCloud(open3d.utility.Vector3dVector(wide))
        jobs["Open3D"] = lambda: np.asarray(cloud.cluster_dbscan(RADIUS_M, MIN_POINTS))
    except (ImportError, OSError) as missing:
        print(f"without Open3D: {missing}")
    return jobs


def one_radius(count: int, repeats: int) -> list[Row]:
    """Time one cloud."""
    points = surface(count)
    jobs = peers(points) | {
        ONE: lambda: dbscan(points, RADIUS_M, MIN_POINTS, threads=1),
        ALL: lambda: dbscan(points, RADIUS_M, MIN_POINTS),
    }
    timed = rounds(jobs, repeats if count < SLOW else 1)
    print(f"\n{count} points, one radius\n{table(timed, count, 'points', ONE)}")
    others = [name for name in timed if name not in (ONE, ALL)]
    best = min(others, key=lambda name: timed[name].median_s)
    differ = sum(int((timed[PEER].result != timed[name].result).sum()) for name in (ONE, ALL))
    found = f"{ratio(timed, best, ONE):.1f}, labels that differ from scikit-learn's: {differ}"
    rows = [
        Row(f"DBSCAN, {count:.0e} points", f"{ASKED.get(count, 1)} x the best peer ({best})", found)
    ]
    if count == SLOW:
        rows.append(Row("the same on two threads", f"5 x {best}", f"{ratio(timed, best, ALL):.1f}"))
    return rows


def radius_per_point(count: int, repeats: int) -> list[Row]:
    """Time radii that grow with range, against a graph of neighbours cut by both radii."""
    points = surface(count)
    radii = RADIUS_M * (0.7 + 0.6 * points[:, 2].astype(np.float64) / points[:, 2].max())
    wide = points.astype(np.float64)

    def by_graph() -> NDArray[np.int64]:
        graph = radius_neighbors_graph(
            wide, radii.max(), mode="distance", include_self=True
        ).tocoo()
        both = np.minimum(radii[graph.row], radii[graph.col])
        graph.data[graph.data > both] = 1e9
        graph = graph.tocsr()
        own = DBSCAN(eps=radii.max(), min_samples=MIN_POINTS, metric="precomputed", n_jobs=1)
        return own.fit(graph).labels_

    jobs: dict[str, Callable[[], Any]] = {
        PEER: by_graph,
        ONE: lambda: dbscan(points, radii, MIN_POINTS, threads=1),
        ALL: lambda: dbscan(points, radii, MIN_POINTS),
    }
    timed = rounds(jobs, repeats)
    print(f"\n{count} points, a radius per point\n{table(timed, count, 'points', ONE)}")
    return [
        Row(
            f"DBSCAN, radius per point, {count:.0e}",
            "5 x scikit-learn",
            f"{ratio(timed, PEER, ONE):.1f}",
        )
    ]


def huge() -> list[Row]:
    """Time a cloud that leaves room for few others, without a round before."""
    points = surface(HUGE)
    theirs, start = peers(points)["dbscan (PyPI)"], time.perf_counter()
    expected = theirs()
    between = time.perf_counter()
    found = dbscan(points, RADIUS_M, MIN_POINTS, threads=1)
    both = (between - start, time.perf_counter() - between)
    differ = int(((expected < 0) != (found < 0)).sum())  # clusters have other numbers there
    print(
        f"\n{HUGE} points: dbscan {both[0]:.1f} s, {ONE} {both[1]:.1f} s, noise differs: {differ}"
    )
    asked = f"{ASKED[HUGE]} x dbscan (PyPI)"
    return [Row(f"DBSCAN, {HUGE:.0e} points", asked, f"{both[0] / both[1]:.1f}")]


def measure(repeats: int, *, large: bool) -> list[Row]:
    """Print one table per size; return what was asked."""
    rows = [row for count in (10_000, 100_000, SLOW) for row in one_radius(count, repeats)]
    return rows + radius_per_point(100_000, repeats) + (huge() if large else [])
