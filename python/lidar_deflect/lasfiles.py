"""LAS and LAZ files of points that grow block by block; needs the extra ``points``.

Version 1.4, point format 6, in the sensor frame: metres in steps of 0.1 mm. ``gps_time`` is
adjusted standard GPS time (seconds since 1980-01-06 without leap seconds, less 1e9), good to
0.1 us; the exact instant stands in the extra dimension ``time``, nanoseconds since 1970 UTC. All
columns of `decode` are extra dimensions under their own names, ``lidar`` and ``return_kind`` as
numbers whose names stand, as JSON, in a record of user ``lidar-deflect``. A sensor's own count of
returns is not known, so ``number_of_returns`` is that of the return itself.
"""

import json
from collections.abc import Sequence
from pathlib import Path
from typing import Any, ClassVar

import numpy as np
from numpy.typing import NDArray

from lidar_deflect.errors import MissingExtraError
from lidar_deflect.pointfiles import PLAIN, Block, PointFile, frame_ids

__all__ = ["LasFile", "LazFile", "gps_time_s"]

SCALE_M = 1e-4
USER = "lidar-deflect"
GPS_EPOCH_S = 315_964_800
ADJUSTED_S = 1_000_000_000
LEAPS = (
    ("1999-01-01", 13),
    ("2006-01-01", 14),
    ("2009-01-01", 15),
    ("2012-07-01", 16),
    ("2015-07-01", 17),
    ("2017-01-01", 18),
)
"""Seconds that GPS is ahead of UTC from a day on."""

TYPES = {
    "time": "i8",
    "lidar": "u2",
    "sweep": "u4",
    "packet": "u4",
    "block": "u2",
    "frame_id": "f8",
    "ring": "u2",
    "azimuth_deg": "f4",
    "range_m": "f4",
    "x_m": "f4",
    "y_m": "f4",
    "z_m": "f4",
    "return_index": "u1",
    "return_kind": "u1",
}
"""Extra dimensions; ``intensity`` is one of the format's own."""


def gps_time_s(time_ns: NDArray[np.int64]) -> NDArray[np.float64]:
    """Give adjusted standard GPS time of instants in nanoseconds since 1970 UTC."""
    days = np.array([day for day, _ in LEAPS], "datetime64[ns]").astype(np.int64)
    ahead = np.array([LEAPS[0][1], *(seconds for _, seconds in LEAPS)])
    leap = ahead[np.searchsorted(days, time_ns, side="right")]
    seconds, nanos = np.divmod(time_ns, 1_000_000_000)
    return np.asarray((seconds + leap - GPS_EPOCH_S - ADJUSTED_S) + nanos * 1e-9)


class LasFile(PointFile):
    """LAS 1.4."""

    compressed: ClassVar[bool] = False

    def __init__(self, path: Path, lidars: Sequence[str], kinds: Sequence[str]) -> None:
        super().__init__(path, lidars, kinds)
        laspy = _laspy()
        self._header = self._head(laspy)
        self._writer = laspy.LasWriter(
            path.open("wb"), self._header, do_compress=self.compressed, closefd=True
        )
        self._record = laspy.ScaleAwarePointRecord

    def _head(self, laspy: Any) -> Any:
        header = laspy.LasHeader(point_format=6, version="1.4")
        header.scales, header.offsets = np.full(3, SCALE_M), np.zeros(3)
        header.global_encoding.gps_time_type = laspy.header.GpsTimeType.STANDARD
        header.global_encoding.wkt = True  # format 6 asks for it
        header.system_identifier = header.generating_software = USER
        header.add_extra_dims(
            [laspy.ExtraBytesParams(name=name, type=kind) for name, kind in TYPES.items()]
        )
        legend = {"lidar": list(self.lidars), "return_kind": list(self.kinds)}
        content = json.dumps(legend).encode()
        header.vlrs.append(laspy.VLR(USER, 1, "names of lidars and return kinds", content))
        return header

    def append(self, block: Block) -> None:
        """Add the points of a block."""
        record = self._record.zeros(len(block["xyz"]), header=self._header)
        for place, axis in enumerate("xyz"):
            values = block["xyz"][:, place]
            record[axis.upper()] = np.rint(values.astype(np.float64) / SCALE_M).astype(np.int32)
            record[f"{axis}_m"] = values
        record["gps_time"] = gps_time_s(block["time_ns"])
        record["return_number"] = record["number_of_returns"] = block["return_index"] + 1
        record["point_source_id"] = block["lidar"] + 1
        record["time"] = block["time_ns"]
        record["frame_id"] = frame_ids(block)
        for name in ("lidar", *PLAIN, "intensity", "return_index", "return_kind"):
            record[name] = block[name]
        self._writer.write_points(record)
        self.points += len(record)

    def close(self) -> None:
        """Complete the file."""
        self._writer.close()

    def discard(self) -> None:
        """Let go of the file."""
        self._writer.dest.close()


class LazFile(LasFile):
    """LAS 1.4, compressed without loss."""

    compressed = True


def _laspy() -> Any:
    try:
        import laspy
        import lazrs  # noqa: F401
    except ImportError as error:
        raise MissingExtraError(
            "writing .las and .laz needs the extra `points`",
            facts=[("missing", str(error.name or error))],
            hint="install it: pip install 'lidar-deflect[points]'",
        ) from error
    return laspy
