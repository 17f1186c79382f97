"""What a file is by its first bytes, and what is needed to read it."""

import re
from collections.abc import Sequence
from pathlib import Path

from lidar_deflect.errors import CaptureError, CaptureNotFoundError, MissingExtraError

__all__ = ["MCAP", "ROS1", "ROS2", "kind_of", "located", "require"]

ROS1 = "ROS 1 bag"
ROS2 = "ROS 2 bag (SQLite)"
MCAP = "MCAP"

MAGICS = ((b"#ROSBAG V2.0", ROS1), (b"SQLite format 3\0", ROS2), (b"\x89MCAP0\r\n", MCAP))

PACKED = re.compile(r"\.(bag|db3|mcap)\.(gz|zst|zstd)$")
"""A bag must be read at any place, which a file compressed as a whole does not allow."""

METADATA = "metadata.yaml"
"""What makes a folder a ROS 2 bag."""


def kind_of(path: Path) -> str | None:
    """Kind of a bag; None for any other file."""
    try:
        with path.open("rb") as file:
            head = file.read(16)
    except OSError:
        return None
    return next((kind for magic, kind in MAGICS if head.startswith(magic)), None)


def located(path: Path) -> list[Path]:
    """Locate the storage files of a ROS 2 bag given as its folder; any other path stays.

    Raises
    ------
    CaptureError
        If the folder of a bag holds none (``capture.bag_empty``), or a bag is compressed as a whole
        (``capture.compression``).
    """
    if match := PACKED.search(path.name):
        raise CaptureError(
            f"{path}: expected a bag, found a compressed one",
            code="capture.compression",
            hint=f"decompress it first: {'gzip' if match[2] == 'gz' else 'zstd'} -dk {path.name}",
        )
    if not (path / METADATA).is_file():
        return [path]
    files = sorted(entry for entry in path.iterdir() if kind_of(entry) in (ROS2, MCAP))
    if not files:
        raise CaptureError(
            f"{path}: expected .db3 or .mcap files beside {METADATA}, found none",
            code="capture.bag_empty",
            hint="compressed storage files are decompressed first: zstd -d FILE",
        )
    return files


def require(paths: Sequence[Path]) -> None:
    """Refuse bags where the extra that reads them is not installed.

    Raises
    ------
    MissingExtraError
        With the command that installs it.
    """
    for path in paths:
        if not path.exists():
            raise CaptureNotFoundError(f"{path}: no such file")
    try:
        import rosbags.rosbag1  # noqa: F401
    except ImportError as error:
        raise MissingExtraError(
            f"{paths[0]} is a {kind_of(paths[0])}: reading it needs the extra `ros`",
            facts=[("missing", str(error.name or error))],
            hint="install it: pip install 'lidar-deflect[ros]'",
        ) from error
