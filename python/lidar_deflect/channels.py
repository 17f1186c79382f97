"""What other instruments and calculations say: load, draw wires, root rotation, prediction."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Literal

import numpy as np
import numpy.typing as npt
import polars as pl

from lidar_deflect import delimited, holds, tables
from lidar_deflect.errors import ConfigError, InvalidValueError

METRES = {"mm": 1e-3, "cm": 1e-2, "m": 1.0}
RADIANS = {"mrad": 1e-3, "rad": 1.0, "deg": np.pi / 180.0}
PERCENT = {"percent": 1.0, "%": 1.0, "fraction": 100.0}
FORCE = ("N", "kN", "MN", "Nm", "kNm", "MNm", "t", "bar", "V")

Floats = npt.NDArray[np.float64]
Times = npt.NDArray[np.int64]


@dataclass(frozen=True)
class Channel:
    """One read channel.

    Parameters
    ----------
    name
        ``load``, a wire's name, ``root_rx`` ...
    time_ns
        Instants, shape (n,), nanoseconds since 1970 UTC, rising.
    value
        Readings, shape (n,), NaN where there is none.
    unit
        ``percent``, ``m`` or ``rad``; of other instruments as configured.
    """

    name: str
    time_ns: npt.NDArray[np.int64]
    value: Floats
    unit: str

    def shifted(self, seconds: float) -> "Channel":
        """Return the channel on a clock that is later by `seconds`."""
        return Channel(self.name, self.time_ns + round(seconds * 1e9), self.value, self.unit)

    def at(self, time_ns: npt.ArrayLike) -> Floats:
        """Return linear interpolation at instants, shape (m,); NaN outside of the record."""
        known = np.isfinite(self.value)
        times, wanted = self.time_ns[known], np.asarray(time_ns, dtype=np.int64)
        if not times.size:
            return np.full(wanted.shape, np.nan)
        seconds = (times - times[0]) * 1e-9
        at_s = (wanted - times[0]) * 1e-9
        value: Floats = np.interp(at_s, seconds, self.value[known], left=np.nan, right=np.nan)
        return value

    def mean(self, from_ns: int, to_ns: int) -> float:
        """Return the mean over a hold, both ends included; NaN without a reading in it."""
        inside = self.value[(self.time_ns >= from_ns) & (self.time_ns <= to_ns)]
        inside = inside[np.isfinite(inside)]
        return float(inside.mean()) if inside.size else float("nan")


def read_load(
    path: str | Path,
    *,
    time: str = "time_utc_s",
    value: str,
    unit: str = "percent",
    near_ns: int | None = None,
) -> Channel:
    """Read a load channel in percent.

    A force or pressure has no full load of its own: its highest hold is taken for 100 %.

    Parameters
    ----------
    path
        File of any format of `lidar_deflect.laboratory`.
    time, value
        Columns of the instants (UTC) and of the load.
    unit
        ``percent``, ``fraction``, or one of `FORCE`.
    near_ns
        Start of the test: dates times of day.

    Raises
    ------
    ConfigError
        If file, column or value cannot be read.
    InvalidValueError
        If the unit is unknown.
    """
    frame = delimited.read(path, [value, time])
    times = delimited.instants(frame, time, path, near_ns)
    values = delimited.numbers(frame, value, path)
    if unit in FORCE:
        return Channel("load", times, holds.percent_of_highest_hold(times, values), "percent")
    factor = _factor(unit, PERCENT, "load", [*PERCENT, *FORCE])
    return Channel("load", times, values * factor, "percent")


def read_wire(
    path: str | Path,
    *,
    name: str,
    column: str,
    time: str = "time_utc_s",
    unit: str = "mm",
    negate: bool = False,
    near_ns: int | None = None,
    instants: Callable[[pl.DataFrame, str, str | Path, int | None], Times] = delimited.instants,
) -> Channel:
    """Read a draw wire in metres, positive where the distance to its anchor became shorter.

    Parameters
    ----------
    path
        File of any format of `lidar_deflect.laboratory`.
    name
        Name of the wire, which the channel takes.
    column, time
        Columns of the reading and of the instants (UTC).
    unit
        ``mm``, ``cm`` or ``m``.
    negate
        True where the reading grows with the distance.
    near_ns
        Start of the test: dates times of day.
    instants
        What reads the column of instants.
    """
    frame = delimited.read(path, [column, time])
    factor = _factor(unit, METRES, f"wire {name}") * (-1.0 if negate else 1.0)
    values = delimited.numbers(frame, column, path) * factor
    return Channel(name, instants(frame, time, path, near_ns), values, "m")


def read_root(
    path: str | Path,
    *,
    time: str = "time_utc_s",
    rx: str | None = None,
    ry: str | None = None,
    rz: str | None = None,
    unit: str = "mrad",
    near_ns: int | None = None,
) -> tuple[Channel, ...]:
    """Read the measured rotation of root or stand, one channel in radians per column named."""
    frame = delimited.read(path, [time, *(name for name in (rx, ry, rz) if name is not None)])
    factor = _factor(unit, RADIANS, "root")
    times = delimited.instants(frame, time, path, near_ns)
    named = {"root_rx": rx, "root_ry": ry, "root_rz": rz}
    return tuple(
        Channel(name, times, delimited.numbers(frame, column, path) * factor, "rad")
        for name, column in named.items()
        if column is not None
    )


def read_other(
    path: str | Path,
    *,
    name: str,
    column: str,
    time: str = "time_utc_s",
    unit: str = "",
    near_ns: int | None = None,
) -> Channel:
    """Read any other instrument as it is; its unit is only shown."""
    frame = delimited.read(path, [column, time])
    values = delimited.numbers(frame, column, path)
    return Channel(name, delimited.instants(frame, time, path, near_ns), values, unit)


Quantity = Literal["total", "direction", "vector"]


@dataclass(frozen=True)
class Prediction:
    """A calculated deflection per section, linear in load.

    Parameters
    ----------
    s_m
        Arc length of the sections, shape (n,).
    value_m
        Deflection at `at_percent`, shape (n,), or (n, 3) for a vector in the world frame.
    quantity
        ``total``, ``direction`` (component along the load) or ``vector``.
    at_percent
        Load at which the values hold.
    """

    s_m: Floats
    value_m: Floats
    quantity: Quantity
    at_percent: float

    def at(self, s_m: float, load_percent: float) -> Floats | None:
        """Return the deflection of a section at a load, shape () or (3,); None if not predicted."""
        near = np.abs(self.s_m - s_m)
        if not near.size or near.min() > SAME_SECTION_M:
            return None
        value: Floats = self.value_m[int(near.argmin())] * (load_percent / self.at_percent)
        return value


SAME_SECTION_M = 0.02
"""Arc lengths this near to each other name one section: files round to centimetres."""


def read_prediction(
    path: str | Path,
    *,
    section: str,
    value: str | Sequence[str],
    unit: str = "mm",
    quantity: Quantity = "total",
    at_percent: float = 100.0,
) -> Prediction:
    """Read a prediction: one row per section.

    Parameters
    ----------
    path
        File of any format of `lidar_deflect.laboratory`.
    section
        Column of the arc length in metres.
    value
        Column of the deflection; three columns x, y, z for a vector.
    unit
        ``mm``, ``cm`` or ``m``.
    quantity
        What the values are.
    at_percent
        Load at which they hold.
    """
    names = [value] if isinstance(value, str) else list(value)
    if len(names) != (3 if quantity == "vector" else 1) or at_percent <= 0.0:
        raise InvalidValueError(
            f"a prediction of {quantity} at {at_percent} % has {len(names)} columns, expected "
            f"{3 if quantity == 'vector' else 1} at a load above 0"
        )
    frame = delimited.read(path)
    factor = _factor(unit, METRES, "prediction")
    columns = [delimited.numbers(frame, name, path) * factor for name in names]
    values = np.column_stack(columns) if quantity == "vector" else columns[0]
    return Prediction(delimited.numbers(frame, section, path), values, quantity, at_percent)


def read_truth(path: str | Path) -> pl.DataFrame:
    """Read the true states of sections: ``time_ns``, ``s_m``, ``x_m``, ``y_m``, ``z_m``.

    Parameters
    ----------
    path
        File with the columns ``time`` (instants, the same for every section),
        ``s_m``, and ``x_m``, ``y_m``, ``z_m`` of the mid-chord point in the world frame.
    """
    frame = delimited.read(path)
    s_m = delimited.numbers(frame, "s_m", path)
    parts = []
    for each in np.unique(s_m):
        part = frame.filter(pl.Series(s_m == each))
        columns = {f"{axis}_m": delimited.numbers(part, f"{axis}_m", path) for axis in "xyz"}
        times = delimited.instants(part, "time", path)
        parts.append(pl.DataFrame({"time_ns": times, "s_m": np.full(part.height, each), **columns}))
    if not parts:
        raise ConfigError(f"{path} has no rows", code="config.channel")
    return pl.concat(parts)


def to_table(channels: Sequence[Channel], first_time_ns: int) -> pl.DataFrame:
    """Return the table ``channels``; `first_time_ns` is the instant at which ``t_s`` is 0."""
    parts = [_rows(channel, first_time_ns) for channel in channels]
    return pl.concat(parts) if parts else tables.empty("channels")


def from_table(frame: pl.DataFrame, name: str) -> Channel | None:
    """Return the channel `name` out of the table ``channels``, or None when it has none."""
    rows = frame.filter(pl.col("channel") == name)
    if rows.is_empty():
        return None
    times = rows["time"].cast(pl.Int64).to_numpy()
    return Channel(name, times, rows["value"].cast(pl.Float64).to_numpy(), rows["unit"][0])


def _rows(channel: Channel, first_time_ns: int) -> pl.DataFrame:
    count = channel.time_ns.size
    return tables.build(
        "channels",
        {
            "time": channel.time_ns,
            "t_s": (channel.time_ns - first_time_ns) * 1e-9,
            "channel": [channel.name] * count,
            "value": channel.value,
            "unit": [channel.unit] * count,
        },
    )


def _factor(
    unit: str, known: dict[str, float], what: str, words: Sequence[str] | None = None
) -> float:
    if unit in known:
        return known[unit]
    words = words or list(known)
    raise InvalidValueError(
        f"unit of {what} is {unit!r}, expected one of {', '.join(words)}",
        code="value.unit",
        hint=tables.nearest_hint(unit, list(words)),
    )
