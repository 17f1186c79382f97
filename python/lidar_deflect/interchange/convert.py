"""One way in and one way out for every format."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

import tomlkit

from lidar_deflect.calibration import Calibration, Pose
from lidar_deflect.errors import CalibrationError, InvalidValueError
from lidar_deflect.files import write_text
from lidar_deflect.interchange.placed import Place, Placed, of_matrix
from lidar_deflect.interchange.rows import KITTI, MATRIX, TUM, kind_of, read_rows, write_rows
from lidar_deflect.interchange.structured import (
    read_ouster,
    read_ros,
    write_ouster,
    write_ros,
)

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

__all__ = ["FORMATS", "convert", "read", "renamed", "started", "write"]

OUSTER = "ouster"
ROS = "ros"
TOML = "calibration"
SUFFIXES = {
    ".toml": TOML,
    ".json": OUSTER,
    ".yaml": ROS,
    ".yml": ROS,
    ".kitti": KITTI,
    ".tum": TUM,
    ".txt": MATRIX,
}
FORMATS = (TOML, OUSTER, ROS, KITTI, TUM, MATRIX)
METHOD = "interchange"
LARGEST_BYTES = 10_000_000


def read(
    path: str | Path, *, format_name: str | None = None, world: str | None = None
) -> tuple[Placed, ...]:
    """Read poses.

    Parameters
    ----------
    path
        File; its suffix and, for rows of numbers, their length tell the format.
    format_name
        One of `FORMATS`, where they do not.
    world
        Frame that the poses are wanted in, where a file has several trees of frames.

    Returns
    -------
    tuple of Placed
        In the order of the file, each name once.

    Raises
    ------
    InvalidValueError
        With file, place, what was expected and what was found (``poses.malformed``).
    CalibrationError
        If a TOML file is no calibration.
    """
    path = Path(path)
    kind = _format(path, format_name, "read")
    if kind == TOML:
        poses = tuple(_of_calibration(path, pose) for pose in Calibration.load(path).poses)
    else:
        poses = tuple(_read(path, _text(path), kind, world, is_given=format_name is not None))
    names = [pose.name for pose in poses]
    for name in names:
        if names.count(name) > 1:
            raise Place(path, "names").refuse("every sensor once", repr(name))
    return poses


def _read(path: Path, text: str, kind: str, world: str | None, *, is_given: bool) -> list[Placed]:
    if kind == OUSTER:
        return read_ouster(path, text, world)
    if kind == ROS:
        return read_ros(path, text, world)
    if not is_given and path.suffix.lower() == ".txt":
        kind = kind_of(path, text)
    return read_rows(path, text, kind)


def _of_calibration(path: Path, pose: Pose) -> Placed:
    rows = [float(value) for value in pose.world_from_sensor.reshape(-1)]
    return Placed(pose.id, of_matrix(rows, Place(path, f"lidar {pose.id}")))


def _text(path: Path) -> str:
    try:
        if path.stat().st_size > LARGEST_BYTES:
            raise Place(path, "size").refuse("a file of poses", f"{path.stat().st_size} bytes")
        return path.read_text(encoding="utf-8")
    except UnicodeDecodeError as error:
        raise Place(path, f"byte {error.start}").refuse("text in UTF-8", "other bytes") from error
    except OSError as error:
        raise InvalidValueError(
            f"{path}: expected a file that can be read, found: {error.strerror}",
            code="poses.unreadable",
            hint="check the path",
        ) from error


def _format(path: Path, given: str | None, purpose: str) -> str:
    if given is not None and given not in FORMATS:
        raise InvalidValueError(
            f"format: expected one of {', '.join(FORMATS)}, found {given!r}", code="poses.format"
        )
    kind = given or SUFFIXES.get(path.suffix.lower())
    if kind is None:
        raise InvalidValueError(
            f"{path}: expected one of {', '.join(SUFFIXES)} to {purpose}, found {path.suffix!r}",
            code="poses.format",
            hint="name the format: --format or --from-format " + "|".join(FORMATS),
        )
    return kind


def write(
    path: str | Path,
    poses: Sequence[Placed],
    *,
    format_name: str | None = None,
    world: str = "world",
    overwrite: bool = False,
) -> Path:
    """Write poses into one file; its suffix says how, unless `format_name` does.

    Raises
    ------
    InvalidValueError
        If the format is not known.
    OutputError
        If the file exists or cannot be written.
    """
    path = Path(path)
    kind = _format(path, format_name, "write")
    if kind == TOML:
        return _calibration(poses).save(path, overwrite=overwrite)
    writers = {OUSTER: write_ouster, ROS: write_ros}
    text = writers[kind](poses, world) if kind in writers else write_rows(kind, poses, world)
    return write_text(path, text, overwrite=overwrite)


def _calibration(poses: Sequence[Placed]) -> Calibration:
    found = tuple(Pose(pose.name, "", pose.world_from_sensor) for pose in poses)
    warning = "poses come from elsewhere: nothing is known of their uncertainty"
    return Calibration(found, METHOD, (warning,))


def convert(
    source: str | Path,
    target: str | Path,
    *,
    from_format: str | None = None,
    format_name: str | None = None,
    names: Mapping[str, str] | None = None,
    world: str = "world",
    overwrite: bool = False,
) -> tuple[Placed, ...]:
    """Bring poses from one file into another.

    Parameters
    ----------
    source, target
        Files; their suffixes tell the formats, unless `from_format` and `format_name` do.
    names
        Other names for some frames, by the name in `source`.
    world
        Name of the world frame; in `source` it matters where there are several.
    overwrite
        Replace a file of that name.

    Returns
    -------
    tuple of Placed
        What was written.
    """
    wanted = world if world != "world" else None
    poses = renamed(read(source, format_name=from_format, world=wanted), names or {})
    write(target, poses, format_name=format_name, world=world, overwrite=overwrite)
    return poses


def renamed(poses: Sequence[Placed], names: Mapping[str, str]) -> tuple[Placed, ...]:
    """Give some frames other names.

    Raises
    ------
    InvalidValueError
        If there is no frame of a name, or two would have the same.
    """
    known = [pose.name for pose in poses]
    for name in names:
        if name not in known:
            raise InvalidValueError(
                f"name: expected one of {', '.join(known)}, found {name!r}", code="poses.unknown"
            )
    new = [names.get(name, name) for name in known]
    if len(set(new)) < len(new):
        raise InvalidValueError(f"names: expected each once, found {', '.join(new)}")
    return tuple(
        Placed(name, pose.world_from_sensor) for name, pose in zip(new, poses, strict=True)
    )


def started(config: str | Path, poses: Sequence[Placed]) -> str:
    """Put poses as ``world_from_sensor`` into the text of a configuration, comments kept.

    Raises
    ------
    InvalidValueError
        If no lidar of the configuration has the name of a frame.
    CalibrationError
        If the configuration is no TOML.
    """
    path = Path(config)
    try:
        document = tomlkit.parse(_text(path))
    except tomlkit.exceptions.ParseError as error:
        raise CalibrationError(f"{path} is no TOML: {error}", code="poses.configuration") from error
    by_name = {pose.name: pose for pose in poses}
    lidars = document.get("lidars", [])
    ids = [str(lidar.get("id")) for lidar in lidars]
    if not set(ids) & set(by_name):
        raise InvalidValueError(
            f"{path}: expected a lidar named {' or '.join(by_name)}, "
            f"found {', '.join(ids) or 'none'}",
            code="poses.unknown",
            hint="rename frames: --name FRAME=LIDAR",
        )
    for lidar in lidars:
        pose = by_name.get(str(lidar.get("id")))
        if pose is not None:
            rows = tomlkit.array()
            rows.extend(pose.world_from_sensor.tolist())
            lidar["world_from_sensor"] = rows.multiline(True)
    return tomlkit.dumps(document)
