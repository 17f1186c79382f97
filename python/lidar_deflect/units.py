"""Files that describe single units: the ones the user names, and the ones beside a capture."""

import os
import re
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

WORDS = (".angle", ".firetime", ".channel_config", ".calib", ".calibration", ".metadata")
"""What may stand between the name of a unit's file and its suffix."""

SHORTEST = 4
"""Shorter names begin too many others."""


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
    """Read the files beside captures that have their name, as ``tower.csv`` of ``tower.pcap``.

    A number may follow the name (``tower_0.json``, as Ouster's recorder writes), and the name may
    end early (``tower.yml`` of ``tower_calm.pcap``) where no capture has that shorter name. Files
    with the whole name come first, so that they count most.
    """
    found: dict[Path, tuple[int, bytes]] = {}
    for capture in captures:
        for path, order in _siblings(capture):
            if path not in found or order < found[path][0]:
                try:
                    found[path] = (order, path.read_bytes())
                except OSError:
                    continue  # nobody asked for it
    by_order = sorted(found.items(), key=lambda item: (item[1][0], item[0]))
    return [(None, path.name, content, False) for path, (_, content) in by_order]


def scratch() -> str:
    """Folder for large temporary files: ``TMPDIR``, else ``/var/tmp``, which lies on a disk."""
    if "TMPDIR" not in os.environ and os.access("/var/tmp", os.W_OK | os.X_OK):
        return "/var/tmp"
    return tempfile.gettempdir()


def _siblings(capture: Path) -> Iterator[tuple[Path, int]]:
    """Files beside a capture that may describe its units; those with the nearer name count more."""
    stem = _stem(capture.name)
    try:
        paths = sorted(path for path in capture.parent.iterdir() if path.is_file())
        recorded = {_stem(path.name) for path in paths if _is_capture(path.name)}
        for path in paths:
            if path.suffix.lower() in SUFFIXES and path.stat().st_size <= LARGEST_BYTES:
                order = _order(path.name, stem, recorded)
                if order is not None:
                    yield path, order
    except OSError:
        return


def _order(name: str, stem: str, recorded: set[str]) -> int | None:
    """How far a file's name is from the capture's; None where it is another's."""
    if name.startswith(f"{stem}."):
        return 0
    root = _root(name)
    if root in recorded:
        return None
    if re.fullmatch(rf"{re.escape(stem)}[_-]\d{{1,3}}", root):
        return 1
    is_start = SHORTEST <= len(root) < len(stem) and stem.startswith(root)
    return 1 + len(stem) - len(root) if is_start and stem[len(root)] in "_-. " else None


def _root(name: str) -> str:
    """Name of a file without its suffix and the word for what it tells."""
    root = name.rpartition(".")[0]
    for word in WORDS:
        root = root.removesuffix(word)
    return root


def _is_capture(name: str) -> bool:
    return ".pcap" in name or Path(name).suffix.lower() in {".bag", ".db3", ".mcap"}


def _stem(name: str) -> str:
    return name.split(".pcap")[0] if ".pcap" in name else Path(name).stem


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
