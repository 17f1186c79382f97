"""Named poses, what a rotation has to be, and errors that say where a file is wrong."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from lidar_deflect.errors import InvalidValueError

if TYPE_CHECKING:
    from collections.abc import Iterable, Sequence
    from pathlib import Path

    from numpy.typing import NDArray

__all__ = ["Place", "Placed", "composed", "number", "of_matrix", "of_quaternion", "quaternion"]

ROTATION_TOLERANCE = 1e-3
"""Files round: rotations off by less are brought in order, others are refused."""


@dataclass(frozen=True)
class Placed:
    """A sensor in the world.

    Attributes
    ----------
    name
        Name of its frame.
    world_from_sensor
        Shape (4, 4), metres.
    """

    name: str
    world_from_sensor: NDArray[np.float64]


@dataclass(frozen=True)
class Place:
    """Where in a file something stands."""

    path: Path
    where: str

    def refuse(self, expected: str, found: object, hint: str | None = None) -> InvalidValueError:
        """Make the error that names file, place, what was expected and what was found."""
        return InvalidValueError(
            f"{self.path}, {self.where}: expected {expected}, found {found}",
            code="poses.malformed",
            hint=hint,
        )


def number(value: Any, place: Place) -> float:
    """Read a finite number."""
    try:
        read = float(value)
    except (TypeError, ValueError):
        raise place.refuse("a number", repr(value)) from None
    if not np.isfinite(read) or isinstance(value, bool):
        raise place.refuse("a finite number", repr(value))
    return read


def of_matrix(values: Sequence[float], place: Place) -> NDArray[np.float64]:
    """Read 12 or 16 numbers, rows first, as a pose."""
    matrix = np.eye(4)
    matrix[: len(values) // 4] = np.reshape(np.array(values, np.float64), (-1, 4))
    if not np.allclose(matrix[3], (0, 0, 0, 1), atol=1e-9):
        raise place.refuse("0 0 0 1 as the last row", " ".join(f"{v:g}" for v in matrix[3]))
    rotation = matrix[:3, :3]
    off = float(np.abs(rotation @ rotation.T - np.eye(3)).max())
    if off > ROTATION_TOLERANCE:
        raise place.refuse("a rotation", f"a matrix whose axes are off by {off:.3g}")
    if np.linalg.det(rotation) < 0:
        raise place.refuse(
            "a rotation", "a mirror image", "a left-handed frame: turn the sign of one axis"
        )
    if off > 1e-12:
        left, _, right = np.linalg.svd(rotation)
        matrix[:3, :3] = left @ right
    return matrix


def of_quaternion(
    position_m: Sequence[float], xyzw: Sequence[float], place: Place
) -> NDArray[np.float64]:
    """Make a pose of a position and a unit quaternion, its real part last."""
    length = float(np.linalg.norm(xyzw))
    if abs(length - 1) > ROTATION_TOLERANCE:
        raise place.refuse("a quaternion of length 1", f"length {length:.6g}")
    x, y, z, w = np.array(xyzw, np.float64) / length
    matrix = np.eye(4)
    matrix[:3, :3] = [
        [1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w)],
        [2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w)],
        [2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y)],
    ]
    matrix[:3, 3] = position_m
    return matrix


def quaternion(pose: NDArray[np.float64]) -> tuple[float, float, float, float]:
    """Quaternion x, y, z, w of a pose, w not negative: by its largest component, never by a small.

    After Shepperd, J. Guidance and Control 1 (1978) 223.
    """
    r = pose[:3, :3]
    squares = np.array(
        [
            1 + r[0, 0] - r[1, 1] - r[2, 2],
            1 - r[0, 0] + r[1, 1] - r[2, 2],
            1 - r[0, 0] - r[1, 1] + r[2, 2],
            1 + r[0, 0] + r[1, 1] + r[2, 2],
        ]
    )
    largest = int(np.argmax(squares))
    products = np.array(
        [
            [squares[0], r[0, 1] + r[1, 0], r[0, 2] + r[2, 0], r[2, 1] - r[1, 2]],
            [r[0, 1] + r[1, 0], squares[1], r[1, 2] + r[2, 1], r[0, 2] - r[2, 0]],
            [r[0, 2] + r[2, 0], r[1, 2] + r[2, 1], squares[2], r[1, 0] - r[0, 1]],
            [r[2, 1] - r[1, 2], r[0, 2] - r[2, 0], r[1, 0] - r[0, 1], squares[3]],
        ]
    )
    found = products[largest] / (2 * np.sqrt(squares[largest]))
    x, y, z, w = map(float, found if found[3] >= 0 else -found)
    return x, y, z, w


def composed(
    edges: Iterable[tuple[str, str, NDArray[np.float64]]], world: str | None, place: Place
) -> list[Placed]:
    """Follow transforms (parent, child, parent_from_child) from the leaves to one root.

    With `world`, frames that do not hang on it are left out.
    """
    parents: dict[str, tuple[str, NDArray[np.float64]]] = {}
    for parent, child, pose in edges:
        if child in parents:
            raise place.refuse(f"one parent of {child!r}", f"{parents[child][0]!r} and {parent!r}")
        parents[child] = (parent, pose)
    inner = {parent for parent, _ in parents.values()}
    placed, roots = [], set()
    for leaf in parents:
        if leaf not in inner:
            root, pose = _to_root(leaf, parents, world, place)
            if world is None or root == world:
                placed.append(Placed(leaf, pose))
                roots.add(root)
    if world is not None and not placed:
        raise place.refuse(f"frames under {world!r}", f"roots {sorted(inner - set(parents))}")
    if len(roots) > 1:
        raise place.refuse("one world frame", ", ".join(sorted(roots)), "name it with --frame")
    return placed


def _to_root(
    frame: str,
    parents: dict[str, tuple[str, NDArray[np.float64]]],
    world: str | None,
    place: Place,
) -> tuple[str, NDArray[np.float64]]:
    pose, seen = np.eye(4), {frame}
    while frame in parents and frame != world:
        frame, step = parents[frame]
        if frame in seen:
            raise place.refuse("a tree of frames", f"a ring through {frame!r}")
        seen.add(frame)
        pose = step @ pose
    return frame, pose
