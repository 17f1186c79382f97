"""Outlines of the sections in every hold, as columns of the table `outline`."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from lidar_deflect.measurement.beam.schedule import LAST

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    from numpy.typing import NDArray

    from lidar_deflect.measurement.beam.adjustment import Solved


def outline_of(solved: Solved, names: Sequence[str], s_m: NDArray[np.float64]) -> Mapping[str, Any]:
    """Give the surface of every section in every hold, with its uncertainty along the normal."""
    points = solved.native.outlines(s_m.tolist(), *LAST)
    holds, sections = len(solved.holds), len(s_m)
    count = len(points) // (holds * sections)
    middles = np.array([(first + last) // 2 for first, last in solved.spans_ns], dtype=np.int64)
    return {
        "time": np.repeat(middles, sections * count),
        "step": list(np.repeat([hold.label for hold in solved.holds], sections * count)),
        "section": list(np.tile(np.repeat(list(names), count), holds)),
        "s_m": np.tile(np.repeat(s_m, count), holds),
        "place": np.tile(np.arange(count, dtype=np.uint32), holds * sections),
        **{f"{axis}_m": points[:, i] for i, axis in enumerate("xyz")},
        "u_m": points[:, 3],
    }
