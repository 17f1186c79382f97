"""Health of the data: packets and points per second and lidar."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from lidar_deflect import tables

if TYPE_CHECKING:
    from collections.abc import Sequence

    import polars as pl

    from lidar_deflect.capture import Capture
    from lidar_deflect.measurement.states import States

SECOND_NS = 1_000_000_000


def health_table(capture: Capture, lidars: Sequence[str], states: States) -> pl.DataFrame:
    """Table `health` of the measured lidars, with the points that counted as blade."""
    counted = capture.health()
    names = tables.SCHEMAS["health"].names
    columns: dict[str, Any] = {name: counted[name] for name in names if name in counted}
    columns |= {
        "time": counted["time_ns"],
        "t_s": (counted["time_ns"] - capture.first_time_ns) * 1e-9,
        "lidar": counted["lidar"].tolist(),
        "blade_points": [
            _blade_points(int(start_ns), lidars.index(lidar), states)
            for start_ns, lidar in zip(counted["time_ns"], counted["lidar"], strict=True)
        ],
    }
    return tables.build("health", columns)


def _blade_points(start_ns: int, lidar: int, states: States) -> int:
    """Points used in the frames of one second."""
    from_, to = np.searchsorted(states.time_ns, [start_ns, start_ns + SECOND_NS])
    return int(states.blade_points[from_:to, lidar].sum())
