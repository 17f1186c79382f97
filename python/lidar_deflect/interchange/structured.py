"""Files that name their frames: Ouster extrinsics (JSON) and ROS static transforms (YAML)."""

from __future__ import annotations

import json
from typing import TYPE_CHECKING, Any

from lidar_deflect.interchange import yaml_subset
from lidar_deflect.interchange.placed import (
    Place,
    Placed,
    composed,
    number,
    of_matrix,
    of_quaternion,
    quaternion,
)

if TYPE_CHECKING:
    from collections.abc import Iterator, Sequence
    from pathlib import Path

    import numpy as np
    from numpy.typing import NDArray

__all__ = ["read_ouster", "read_ros", "write_ouster", "write_ros"]

Edge = "tuple[str, str, NDArray[np.float64]]"

POSITION = ("p_x", "p_y", "p_z")
ROTATION = ("q_x", "q_y", "q_z", "q_w")


def write_ouster(poses: Sequence[Placed], world: str) -> str:
    """Write the extrinsics file of the Ouster SDK: source frame to destination frame."""
    transforms = [
        {
            "source_frame": pose.name,
            "destination_frame": world,
            **dict(zip(POSITION, map(float, pose.world_from_sensor[:3, 3]), strict=True)),
            **dict(zip(ROTATION, quaternion(pose.world_from_sensor), strict=True)),
        }
        for pose in poses
    ]
    return json.dumps({"transforms": transforms}, indent=2) + "\n"


def read_ouster(path: Path, text: str, world: str | None) -> list[Placed]:
    """Read an extrinsics file of the Ouster SDK; also a 4 x 4 by name."""
    try:
        document = json.loads(text)
    except json.JSONDecodeError as error:
        raise Place(path, f"line {error.lineno}").refuse("JSON", error.msg) from error
    if isinstance(document, dict) and isinstance(document.get("transforms"), list):
        entries = document["transforms"]
        edges = [_ouster(entry, Place(path, f"transforms[{n}]")) for n, entry in enumerate(entries)]
        return composed(edges, world, Place(path, "transforms"))
    if isinstance(document, dict) and document:
        return [Placed(name, _matrix(rows, Place(path, name))) for name, rows in document.items()]
    raise Place(path, "top level").refuse('{"transforms": [...]}', type(document).__name__)


def _ouster(entry: Any, place: Place) -> Any:
    source, destination = (
        _text(entry, key, place) for key in ("source_frame", "destination_frame")
    )
    position = [_number(entry, key, place) for key in POSITION]
    rotation = [_number(entry, key, place) for key in ROTATION]
    return destination, source, of_quaternion(position, rotation, place)


def _matrix(rows: Any, place: Place) -> NDArray[np.float64]:
    flat = rows
    if isinstance(rows, list) and all(isinstance(row, list) for row in rows):
        flat = [value for row in rows for value in row]
    if not isinstance(flat, list) or len(flat) not in (12, 16):
        raise place.refuse("4 x 4 numbers", repr(rows)[:60])
    return of_matrix([number(value, place) for value in flat], place)


def write_ros(poses: Sequence[Placed], world: str) -> str:
    """Write what ``ros2 topic echo /tf_static`` prints: one TFMessage."""
    lines = ["transforms:"]
    for pose in poses:
        x, y, z = (float(value) for value in pose.world_from_sensor[:3, 3])
        qx, qy, qz, qw = quaternion(pose.world_from_sensor)
        lines += [
            "- header:",
            "    stamp: {sec: 0, nanosec: 0}",
            f"    frame_id: {json.dumps(world)}",
            f"  child_frame_id: {json.dumps(pose.name)}",
            "  transform:",
            f"    translation: {{x: {x!r}, y: {y!r}, z: {z!r}}}",
            f"    rotation: {{x: {qx!r}, y: {qy!r}, z: {qz!r}, w: {qw!r}}}",
        ]
    return "\n".join(lines) + "\n"


def read_ros(path: Path, text: str, world: str | None) -> list[Placed]:
    """Read TransformStamped messages: a TFMessage, a list, or one document each."""
    edges = [
        _transform(entry, Place(path, f"transform {count}"))
        for count, entry in enumerate(_transforms(path, text), 1)
    ]
    if not edges:
        raise Place(path, "top level").refuse("transforms", "none")
    return composed(edges, world, Place(path, "transforms"))


def _transforms(path: Path, text: str) -> Iterator[Any]:
    for document in yaml_subset.documents(path, text):
        if isinstance(document, dict) and "transforms" in document:
            yield from document["transforms"] or []
        elif isinstance(document, list):
            yield from document
        elif document is not None:
            yield document


def _transform(entry: Any, place: Place) -> Any:
    header = _mapping(entry, "header", place)
    transform = _mapping(entry, "transform", place)
    translation = _mapping(transform, "translation", place)
    rotation = _mapping(transform, "rotation", place)
    pose = of_quaternion(
        [_number(translation, key, place) for key in "xyz"],
        [_number(rotation, key, place) for key in "xyzw"],
        place,
    )
    return _text(header, "frame_id", place), _text(entry, "child_frame_id", place), pose


def _mapping(entry: Any, key: str, place: Place) -> dict[str, Any]:
    value = entry.get(key) if isinstance(entry, dict) else None
    if not isinstance(value, dict):
        raise place.refuse(f"a mapping {key!r}", repr(value)[:60])
    return value


def _text(entry: Any, key: str, place: Place) -> str:
    value = entry.get(key) if isinstance(entry, dict) else None
    if not isinstance(value, str | int) or isinstance(value, bool) or value == "":
        raise place.refuse(f"a name {key!r}", repr(value)[:60])
    return str(value)


def _number(entry: Any, key: str, place: Place) -> float:
    value = entry.get(key) if isinstance(entry, dict) else None
    return number(value, Place(place.path, f"{place.where}, {key}"))
