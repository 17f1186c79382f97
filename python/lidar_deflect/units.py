"""Files that describe single units: the ones the user names, and the ones beside a capture."""

import os
import tempfile
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any

from lidar_deflect.errors import InvalidValueError

__all__ = ["UnitFile", "beside", "named", "scratch"]

UnitFile = tuple[str | None, str, bytes, bool]
"""Source or none, name, content, and whether the user named it."""

LARGEST_BYTES = 4_000_000
"""No description of a unit is larger."""

SUFFIXES = frozenset({".csv", ".dat", ".bin", ".json", ".yaml", ".yml", ".xml", ".txt"})
"""How descriptions of units are called; what they are, their content tells."""


def named(beams: Mapping[str, Any]) -> list[UnitFile]:
    """Read the files of ``beams``: a path or several by source, ``""`` for any lidar.

    Raises
    ------
    InvalidValueError
        If a file is not there, cannot be read, or is far too large (``beams.unreadable``).
    """
    files: list[UnitFile] = []
    for source, given in beams.items():
        paths = [given] if isinstance(given, str | Path) else given
        files.extend((source or None, Path(path).name, _read(Path(path)), True) for path in paths)
    return files


def beside(captures: Sequence[Path]) -> list[UnitFile]:
    """Read the files beside captures that have their name, as ``tower.csv`` of ``tower.pcap``."""
    found: dict[Path, bytes] = {}
    for capture in captures:
        for path in _siblings(capture):
            if path not in found:
                try:
                    found[path] = path.read_bytes()
                except OSError:
                    continue  # nobody asked for it
    return [(None, path.name, content, False) for path, content in sorted(found.items())]


def scratch() -> str:
    """Folder for large temporary files: ``TMPDIR``, else ``/var/tmp``, which lies on a disk."""
    if "TMPDIR" not in os.environ and os.access("/var/tmp", os.W_OK | os.X_OK):
        return "/var/tmp"
    return tempfile.gettempdir()


def _siblings(capture: Path) -> Iterator[Path]:
    stem = capture.name.split(".pcap")[0] if ".pcap" in capture.name else capture.stem
    try:
        for path in capture.parent.iterdir():
            is_namesake = path.name.startswith(f"{stem}.") and path.suffix.lower() in SUFFIXES
            if is_namesake and path.is_file() and path.stat().st_size <= LARGEST_BYTES:
                yield path
    except OSError:
        return


def _read(path: Path) -> bytes:
    try:
        size = path.stat().st_size
        if size > LARGEST_BYTES:
            raise InvalidValueError(
                f"{path}: expected a description of a unit, found {size} bytes",
                code="beams.unreadable",
                hint="give the unit's own angle, fire-time, channel or metadata file",
            )
        return path.read_bytes()
    except OSError as error:
        raise InvalidValueError(
            f"{path}: expected a file that can be read, found: {error.strerror}",
            code="beams.unreadable",
        ) from error
