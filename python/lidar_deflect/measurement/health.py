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
    ours = np.isin(counted["lidar"], list(lidars))
    columns: dict[str, Any] = {name: values[ours] for name, values in counted.items()}
    start_ns = columns.pop("time_ns")
    return tables.build(
        "health",
        columns
        | {
            "time": start_ns,
            "t_s": (start_ns - capture.first_time_ns) * 1e-9,
            "lidar": list(columns["lidar"]),
            "blade_points": _blade_points(start_ns, columns["lidar"], lidars, states),
        },
    )


def _blade_points(start_ns: Any, of_lidar: Any, lidars: Sequence[str], states: States) -> list[int]:
    """Points used in the frames of each second, by lidar."""
    second = np.searchsorted(np.unique(start_ns), states.time_ns, side="right") - 1
    row_second = np.searchsorted(np.unique(start_ns), start_ns)
    sums = np.zeros((second.max(initial=0) + 1 + len(start_ns), len(lidars)), dtype=np.int64)
    np.add.at(sums, np.clip(second, 0, None), states.blade_points)
    column = {id: index for index, id in enumerate(lidars)}
    return [int(sums[s, column[id]]) for s, id in zip(row_second, of_lidar, strict=True)]
