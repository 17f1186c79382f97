"""The drawing's geometry: stations along the span, and the contours of their sections."""

from __future__ import annotations

import csv
import math
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from lidar_deflect.errors import ConfigError, ConfigNotFoundError

if TYPE_CHECKING:
    from collections.abc import Sequence
    from pathlib import Path

    from numpy.typing import NDArray

    from lidar_deflect.config import Blade

REQUIRED = ("s_m", "chord_m", "twist_deg", "rel_thickness", "prebend_m", "axis_fraction")
STIFFNESS = ("ei_edge_nm2", "ei_flap_nm2", "gj_nm2")
CONTOUR_COLUMNS = ("s_m", "x_c", "y_c")
# Lowest and highest value that can be meant.
LIMITS = {
    "s_m": (0.0, 500.0),
    "chord_m": (0.0, 50.0),
    "twist_deg": (-180.0, 180.0),
    "rel_thickness": (0.0, 1.5),
    "prebend_m": (-50.0, 50.0),
    "axis_fraction": (0.0, 1.0),
    "ei_edge_nm2": (0.0, math.inf),
    "ei_flap_nm2": (0.0, math.inf),
    "gj_nm2": (0.0, math.inf),
    "x_c": (-0.5, 1.5),
    "y_c": (-1.0, 1.0),
}
# How far the last station may lie from the tip: linear continuation is honest over this share.
TIP_GAP = 0.02


@dataclass(frozen=True, eq=False)
class Stations:
    """Nominal geometry per station; every array has shape (n,), linear in between.

    Attributes
    ----------
    s_m
        Arc length from the root along the neutral axis, rising.
    chord_m, rel_thickness
        Chord length; thickness over chord.
    twist_rad
        Positive turns the trailing edge towards the suction side.
    prebend_m
        Offset of the stress-free axis towards the suction side.
    axis_fraction
        Where the axis crosses the chord, from the leading edge.
    ei_edge_nm2, ei_flap_nm2, gj_nm2
        Bending and torsional stiffness, or None where the drawing does not tell.
    """

    s_m: NDArray[np.float64]
    chord_m: NDArray[np.float64]
    twist_rad: NDArray[np.float64]
    rel_thickness: NDArray[np.float64]
    prebend_m: NDArray[np.float64]
    axis_fraction: NDArray[np.float64]
    ei_edge_nm2: NDArray[np.float64] | None = None
    ei_flap_nm2: NDArray[np.float64] | None = None
    gj_nm2: NDArray[np.float64] | None = None


@dataclass(frozen=True, eq=False)
class Contours:
    """Section contours with the same number of points at every station.

    From the leading edge (0, 0) over the suction side to the trailing edge (1, 0) and back, open;
    linear in between at equal index.

    Attributes
    ----------
    s_m
        Stations, shape (n,), rising.
    x_c, y_c
        Along the chord and towards the suction side, in chord lengths, shape (n, m).
    """

    s_m: NDArray[np.float64]
    x_c: NDArray[np.float64]
    y_c: NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class Geometry:
    """What the drawing says: stations, and contours where there are any."""

    stations: Stations
    contours: Contours | None


def read_geometry(blade: Blade) -> Geometry | None:
    """Read the files that the configuration names under ``[blade]``; None without any.

    Raises
    ------
    ConfigError
        Naming file, line and column of what cannot be meant.
    """
    if blade.geometry is None:
        return None
    stations = read_stations(blade.geometry, blade.length_m)
    return Geometry(stations, read_contours(blade.contours) if blade.contours else None)


def read_stations(path: Path, length_m: float) -> Stations:
    """Read ``blade.csv`` and check it against the length of the blade."""
    table = _Table.read(path, REQUIRED, STIFFNESS)
    table.check_rising("s_m")
    table.check_positive("chord_m", *STIFFNESS)
    table.check_span(length_m)
    columns = {name: table.column(name) for name in table.names if name != "twist_deg"}
    return Stations(**columns, twist_rad=np.radians(table.column("twist_deg")))


def read_contours(path: Path) -> Contours:
    """Read ``contours.csv``: blocks of rows with equal ``s_m``, all of the same length."""
    table = _Table.read(path, CONTOUR_COLUMNS, ())
    s_m = table.column("s_m")
    starts = np.flatnonzero(np.diff(s_m, prepend=np.nan) != 0)
    counts = np.diff(np.append(starts, len(s_m)))
    table.check_blocks(s_m[starts], starts, counts)
    shape = (len(starts), int(counts[0]))
    x_c, y_c = table.column("x_c").reshape(shape), table.column("y_c").reshape(shape)
    table.check_leading_edges(starts, np.hypot(x_c[:, 0], y_c[:, 0]))
    return Contours(s_m[starts], x_c, y_c)


@dataclass(frozen=True)
class _Table:
    """A CSV file of numbers that remembers the line of every row."""

    path: Path
    names: tuple[str, ...]
    rows: tuple[tuple[float, ...], ...]
    lines: tuple[int, ...]

    @classmethod
    def read(cls, path: Path, required: Sequence[str], optional: Sequence[str]) -> _Table:
        header, body = _records(path)
        missing = [name for name in required if name not in header]
        if missing:
            expected = ", ".join(required)
            raise _refused(
                path, 1, missing[0], "this column is missing", ",".join(header), expected
            )
        names = tuple(name for name in (*required, *optional) if name in header)
        places = [header.index(name) for name in names]
        if len(body) < 2:
            raise _refused(path, 1, names[0], "too few rows", str(len(body)), "at least 2")
        rows = tuple(
            tuple(
                _number(path, line, name, row, at) for name, at in zip(names, places, strict=True)
            )
            for line, row in body
        )
        return cls(path, names, rows, tuple(line for line, _ in body))

    def column(self, name: str) -> NDArray[np.float64]:
        at = self.names.index(name)
        return np.array([row[at] for row in self.rows])

    def fail(self, row: int, name: str, why: str, found: float, expected: str) -> ConfigError:
        return _refused(self.path, self.lines[row], name, why, f"{found:g}", expected)

    def check_rising(self, name: str) -> None:
        values = self.column(name)
        for row in np.flatnonzero(np.diff(values) <= 0)[:1] + 1:
            expected = f"more than {values[row - 1]:g}"
            raise self.fail(row, name, "stations must rise", values[row], expected)

    def check_positive(self, *names: str) -> None:
        for name in names:
            values = self.column(name) if name in self.names else np.ones(1)
            for row in np.flatnonzero(values <= 0)[:1]:
                raise self.fail(row, name, "must be positive", values[row], "more than 0")

    def check_span(self, length_m: float) -> None:
        s_m = self.column("s_m")
        gap_m = TIP_GAP * length_m
        if s_m[0] > gap_m:
            raise self.fail(0, "s_m", "the first station is not the root", s_m[0], "0")
        if abs(s_m[-1] - length_m) > gap_m:
            expected = f"blade.length_m = {length_m:g}"
            raise self.fail(-1, "s_m", "the last station is not the tip", s_m[-1], expected)

    def check_blocks(
        self, s_m: NDArray[np.float64], starts: NDArray[np.intp], counts: NDArray[np.intp]
    ) -> None:
        for block in np.flatnonzero(np.diff(s_m) <= 0)[:1] + 1:
            expected = f"more than {s_m[block - 1]:g}"
            raise self.fail(starts[block], "s_m", "stations must rise", s_m[block], expected)
        for block in np.flatnonzero(counts != counts[0])[:1]:
            why = f"the contour at {s_m[block]:g} m has another number of points than the first"
            raise self.fail(starts[block], "x_c", why, float(counts[block]), str(counts[0]))
        if len(starts) < 2 or counts[0] < 4:
            why = "too few stations, or too few points per contour"
            raise self.fail(0, "s_m", why, float(len(starts)), "2 stations of 4 points")

    def check_leading_edges(self, starts: NDArray[np.intp], distance: NDArray[np.float64]) -> None:
        for block in np.flatnonzero(distance > 0.05)[:1]:
            why = "a contour starts away from the leading edge (0, 0)"
            raise self.fail(starts[block], "x_c", why, distance[block], "at most 0.05 chords away")


def _records(path: Path) -> tuple[list[str], list[tuple[int, list[str]]]]:
    """Return the header and the rows with their line numbers, without blank and ``#`` lines."""
    try:
        with path.open(encoding="utf-8-sig", newline="") as file:
            reader = csv.reader(file, strict=True)
            records = [(reader.line_num, [cell.strip() for cell in row]) for row in reader]
    except FileNotFoundError:
        raise ConfigNotFoundError(f"no geometry file {path}", facts=[("file", str(path))]) from None
    except (OSError, UnicodeDecodeError, csv.Error) as error:
        raise ConfigError(
            f"{path} cannot be read as a CSV table: {error}",
            code="config.geometry",
            facts=[("file", str(path))],
        ) from None
    records = [(line, row) for line, row in records if any(row) and not row[0].startswith("#")]
    if not records:
        raise _refused(path, 1, REQUIRED[0], "the file is empty", "nothing", "a header and rows")
    return records[0][1], records[1:]


def _number(path: Path, line: int, name: str, row: Sequence[str], at: int) -> float:
    text = row[at] if at < len(row) else ""
    low, high = LIMITS[name]
    try:
        value = float(text)
    except ValueError:
        raise _refused(path, line, name, "not a number", repr(text), "a number") from None
    if not (math.isfinite(value) and low <= value <= high):
        raise _refused(path, line, name, "out of range", text, f"{low:g} to {high:g}")
    return value


def _refused(
    path: Path, line: int, column: str, why: str, found: str, expected: str
) -> ConfigError:
    return ConfigError(
        f"{path.name}, line {line}, column {column}: {why}",
        code="config.geometry",
        facts=[
            ("file", str(path)),
            ("line", str(line)),
            ("column", column),
            ("found", found),
            ("expected", expected),
        ],
    )
