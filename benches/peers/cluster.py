"""Time dbscan against scikit-learn on the same clouds, one run of each in turn.

python benches/peers/cluster.py [--sizes 1000 10000 100000] [--repeats 7]
"""

import argparse
import time
from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray
from sklearn.cluster import DBSCAN

from lidar_deflect.clustering import dbscan

RADIUS_M = 0.15
MIN_POINTS = 4


def surface(count: int) -> NDArray[np.float32]:
    """Make a wavy surface: 400 points per square metre, 2 cm of noise, one in twenty astray."""
    rng = np.random.default_rng(1)
    side_m = np.sqrt(count / 400)
    x, z = rng.uniform(0, side_m, (2, count))
    z.sort()
    stray = np.where(np.arange(count) % 20 == 0, 3.0, 0.02)
    y = np.sin(0.7 * x) + np.cos(0.3 * z) + stray * rng.uniform(-1, 1, count)
    return np.column_stack([x, y, z]).astype(np.float32)


def timed(work: Callable[[], NDArray[np.int32]]) -> tuple[float, NDArray[np.int32]]:
    start = time.perf_counter()
    labels = work()
    return time.perf_counter() - start, labels


def main() -> None:
    """Print medians and ratios."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--sizes", type=int, nargs="+", default=[1_000, 10_000, 100_000])
    parser.add_argument("--repeats", type=int, default=7)
    options = parser.parse_args()
    print("points    scikit-learn  1 thread  all threads  ratio (1 thread)  labels")
    for count in options.sizes:
        points = surface(count)
        peer = DBSCAN(eps=RADIUS_M, min_samples=MIN_POINTS, algorithm="kd_tree", n_jobs=1)
        runs = [
            lambda points=points, peer=peer: peer.fit(points).labels_,
            lambda points=points: dbscan(points, RADIUS_M, MIN_POINTS, threads=1),
            lambda points=points: dbscan(points, RADIUS_M, MIN_POINTS),
        ]
        seconds, equal = [], True
        for _ in range(options.repeats):
            taken, labels = zip(*map(timed, runs), strict=True)
            seconds.append(taken)
            equal &= all(np.array_equal(labels[0], other) for other in labels[1:])
        theirs, one, all_threads = np.median(seconds, axis=0)
        verdict = "equal" if equal else "DIFFERENT"
        print(
            f"{count:<9} {theirs:10.4f} s {one:8.4f} s {all_threads:10.4f} s"
            f"  {theirs / one:10.1f}        {verdict}"
        )


if __name__ == "__main__":
    main()
