"""Files of numbers in rows: KITTI, TUM, and plain 4 x 4. Names stand in comments."""

from __future__ import annotations

import re
from dataclasses import dataclass
from typing import TYPE_CHECKING

from lidar_deflect.interchange.placed import (
    Place,
    Placed,
    number,
    of_matrix,
    of_quaternion,
    quaternion,
)

if TYPE_CHECKING:
    from collections.abc import Sequence
    from pathlib import Path

    import numpy as np
    from numpy.typing import NDArray

__all__ = ["KITTI", "MATRIX", "TUM", "kind_of", "read_rows", "write_rows"]

KITTI = "kitti"
TUM = "tum"
MATRIX = "matrix"
COLUMNS = {12: KITTI, 8: TUM, 4: MATRIX}
NAME = re.compile(r"#\s*sensor\s+(\S.*?)\s*")


@dataclass(frozen=True)
class _Row:
    values: tuple[float, ...]
    place: Place


def write_rows(kind: str, poses: Sequence[Placed], world: str) -> str:
    """Write poses: KITTI 3 x 4 a row, TUM number, position and quaternion a row, or 4 x 4."""
    lines = [f"# {world}_from_sensor, metres"]
    for count, pose in enumerate(poses):
        lines.append(f"# sensor {pose.name}")
        matrix = pose.world_from_sensor
        if kind == KITTI:
            lines.append(_joined(matrix[:3].reshape(-1)))
        elif kind == TUM:
            lines.append(f"{count} {_joined((*matrix[:3, 3], *quaternion(matrix)))}")
        else:
            lines.extend(_joined(row) for row in matrix)
    return "\n".join(lines) + "\n"


def _joined(values: Sequence[float] | NDArray[np.float64]) -> str:
    return " ".join(repr(float(value)) for value in values)


def kind_of(path: Path, text: str) -> str:
    """Tell a file of rows by the numbers in its first one."""
    rows, _ = _rows(path, text)
    if not rows:
        raise Place(path, "line 1").refuse("rows of numbers", "none")
    kind = COLUMNS.get(len(rows[0].values))
    if kind is None:
        found = f"{len(rows[0].values)} numbers"
        raise rows[0].place.refuse("4 (4 x 4), 8 (TUM) or 12 (KITTI) numbers", found)
    return kind


def read_rows(path: Path, text: str, kind: str) -> list[Placed]:
    """Read a file of rows; sensors without a name get their number, from 1."""
    rows, names = _rows(path, text)
    columns = next(count for count, name in COLUMNS.items() if name == kind)
    for row in rows:
        if len(row.values) != columns:
            raise row.place.refuse(f"{columns} numbers", len(row.values))
    if kind == MATRIX and len(rows) % 4:
        raise rows[-1].place.refuse("four rows for each sensor", f"{len(rows)} rows in all")
    poses = _poses(kind, rows)
    if not poses:
        raise Place(path, "line 1").refuse("rows of numbers", "none")
    if names and len(names) != len(poses):
        raise Place(path, "comments").refuse(f"{len(poses)} names", len(names))
    named = names or [str(count) for count in range(1, len(poses) + 1)]
    return [Placed(name, pose) for name, pose in zip(named, poses, strict=True)]


def _poses(kind: str, rows: Sequence[_Row]) -> list[NDArray[np.float64]]:
    if kind == KITTI:
        return [of_matrix(row.values, row.place) for row in rows]
    if kind == TUM:
        return [of_quaternion(row.values[1:4], row.values[4:8], row.place) for row in rows]
    starts = range(0, len(rows), 4)
    return [
        of_matrix([v for row in rows[start : start + 4] for v in row.values], rows[start].place)
        for start in starts
    ]


def _rows(path: Path, text: str) -> tuple[list[_Row], list[str]]:
    rows, names = [], []
    for count, line in enumerate(text.removeprefix("\ufeff").splitlines(), 1):
        place = Place(path, f"line {count}")
        if match := NAME.fullmatch(line.strip()):
            names.append(match[1])
        words = line.partition("#")[0].replace(",", " ").split()
        if words:
            rows.append(_Row(tuple(number(word, place) for word in words), place))
    return rows, names
