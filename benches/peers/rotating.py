"""Ouster packets to points beside ouster-sdk, on a real capture where there is one.

A file by the name of a package would be imported in its place.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import captures
from ouster.sdk import core, open_source
from rounds import Row, ratio, rounds, table

import lidar_deflect as ld

if TYPE_CHECKING:
    from collections.abc import Callable

NAME = "ouster_os0_128_rng15"
OURS, PEER = "ours, all columns", "ouster-sdk, scans and positions"


def measure(repeats: int, *, large: bool) -> list[Row]:  # noqa: ARG001
    """Print one table; return what was asked."""
    path, unit = captures.REFERENCES / f"{NAME}.pcap", captures.REFERENCES / f"{NAME}.json"
    if not path.exists():
        print(f"left out: {path.name} is not there")
        return []

    def theirs() -> int:
        source = open_source(str(path), meta=[str(unit)])
        look_up = core.XYZLut(source.sensor_info[0])
        return sum(look_up(scans[0]).shape[0] * look_up(scans[0]).shape[1] for scans in source)

    def ours() -> int:
        capture = ld.open(path)  # takes the metadata file of the same name
        return sum(len(sweep.xyz) for sweep in capture.sweeps(capture.lidars[0]))

    jobs: dict[str, Callable[[], Any]] = {PEER: theirs, OURS: ours}
    timed = rounds(jobs, repeats)
    print(table(timed, timed[OURS].result, "points", OURS))
    return [Row("Ouster packets to points", "1.2 x ouster-sdk", f"{ratio(timed, PEER, OURS):.1f}")]
