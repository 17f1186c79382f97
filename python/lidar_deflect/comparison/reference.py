"""What a reference is: told by its columns, or said by the user."""

import re
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Literal, get_args

from lidar_deflect import channels, delimited
from lidar_deflect import wires as wire_lines
from lidar_deflect.errors import InvalidValueError, ResultError, ResultNotFoundError
from lidar_deflect.wires import Line

Kind = Literal["wire", "prediction", "truth", "run"]
KINDS: tuple[str, ...] = get_args(Kind)

_TRUTH = {"time", "s_m", "x_m", "y_m", "z_m"}
_SECTION_COLUMNS = ("section_m", "s_m", "z_m", "section")
_UNIT = re.compile(r"_(mm|cm|m)(?:_|$)")
_AT_PERCENT = re.compile(r"at_(\d+(?:\.\d+)?)_percent")
_NUMBER = re.compile(r"\d+(?:\.\d+)?")


@dataclass(frozen=True)
class Reference:
    """A reference whose kind is known.

    Parameters
    ----------
    path
        File, or folder of another run.
    kind
        ``wire``, ``prediction``, ``truth`` or ``run``.
    why
        How that was told, for people.
    """

    path: Path
    kind: Kind
    why: str


def recognise(path: str | Path, *, kind: str | None = None) -> Reference:
    """Tell what a reference is.

    Parameters
    ----------
    path
        File, or result folder.
    kind
        Overrides what the columns say.

    Raises
    ------
    ResultNotFoundError
        If there is neither a file nor a folder of that name.
    ResultError
        If its columns fit no kind.
    InvalidValueError
        If `kind` is none.
    """
    path = Path(path)
    if not path.exists():
        raise ResultNotFoundError(f"there is no reference {path}")
    if kind is not None:
        return Reference(path, _known(kind), "as asked for")
    if path.is_dir():
        return Reference(path, "run", "a folder")
    names = delimited.read(path).columns
    if set(names) >= _TRUTH:
        return Reference(path, "truth", "it has time, s_m, x_m, y_m and z_m")
    if time_column(names) is not None:
        return Reference(path, "wire", f"it has readings over {time_column(names)}")
    if section_column(names) is not None:
        return Reference(path, "prediction", f"it has values per {section_column(names)}")
    raise ResultError(
        f"{path} is no known kind of reference",
        code="comparison.unknown_reference",
        facts=[("columns", ", ".join(names))],
        hint=f"say what it is with --kind {'|'.join(KINDS)}",
    )


def _known(kind: str) -> Kind:
    for each in get_args(Kind):
        if each == kind:
            found: Kind = each
            return found
    raise InvalidValueError(f"kind is {kind!r}, expected one of {', '.join(KINDS)}")


def time_column(names: list[str]) -> str | None:
    """Return the first column whose name begins with ``time``."""
    return next((name for name in names if name.lower().startswith("time")), None)


def section_column(names: list[str]) -> str | None:
    """Return the column of the section's arc length."""
    return next((name for name in _SECTION_COLUMNS if name in names), None)


def prediction(reference: Reference, config: Mapping[str, Any]) -> channels.Prediction:
    """Read a prediction as ``[prediction]`` says, else as the names of its columns say."""
    names = delimited.read(reference.path).columns
    given = config.get("prediction") or {}
    value = given.get("value")
    wanted = [value] if isinstance(value, str) else list(value or ())
    if wanted and set(wanted) <= set(names):
        return channels.read_prediction(
            reference.path,
            section=given.get("section", "section_m"),
            value=wanted[0] if len(wanted) == 1 else wanted,
            unit=given.get("unit", "mm"),
            quantity=given.get("quantity", "total"),
            at_percent=given.get("at_percent", 100.0),
        )
    return _prediction_by_names(reference, names)


def _prediction_by_names(reference: Reference, names: list[str]) -> channels.Prediction:
    section = section_column(names)
    value = next((name for name in names if name != section and _UNIT.search(name)), None)
    if section is None or value is None:
        raise ResultError(
            f"{reference.path} does not say which column is the predicted deflection",
            code="comparison.prediction",
            facts=[("columns", ", ".join(names))],
            hint="describe it under [prediction] in the configuration",
        )
    unit, load = _UNIT.search(value), _AT_PERCENT.search(value)
    return channels.read_prediction(
        reference.path,
        section=section,
        value=value,
        unit=unit[1] if unit else "mm",
        at_percent=float(load[1]) if load else 100.0,
    )


@dataclass(frozen=True)
class Wire:
    """A draw wire: its readings, the section it is tied to, and its line where it is known."""

    channel: channels.Channel
    section: str | None
    s_m: float | None
    line: Line | None


def wires(
    reference: Reference, config: Mapping[str, Any], shifts: Mapping[str, float] | None = None
) -> list[Wire]:
    """Read the wires of a file as ``[[wires]]`` says, else one per column that names a section.

    Parameters
    ----------
    shifts
        Seconds by which the clocks of files were moved when the run was measured, by file name.

    Raises
    ------
    ResultError
        If no column of the file is a wire.
    """
    names = delimited.read(reference.path).columns
    given = [each for each in config.get("wires") or () if each.get("column") in names]
    lines = {line.name: line for line in wire_lines.lines(config)}
    moved_s = (shifts or {}).get(reference.path.name, 0.0)
    found = [_configured(reference, each, lines, moved_s) for each in given]
    found = found or _wires_by_names(reference, names, moved_s)
    if not found:
        raise ResultError(
            f"no column of {reference.path} is a draw wire",
            code="comparison.wires",
            facts=[("columns", ", ".join(names))],
            hint="name section, anchor and column under [[wires]] in the configuration",
        )
    return found


def _configured(
    reference: Reference, given: Mapping[str, Any], lines: Mapping[str, Line], moved_s: float
) -> Wire:
    channel = channels.read_wire(
        reference.path,
        name=given["name"],
        column=given["column"],
        time=given.get("time", "time_utc_s"),
        unit=given.get("unit", "mm"),
        negate=given.get("negate", False),
    )
    shift_s = given.get("shift_s")
    channel = channel.shifted(moved_s if shift_s is None else shift_s)
    return Wire(channel, given["section"], None, lines.get(given["name"]))


def _wires_by_names(reference: Reference, names: list[str], moved_s: float) -> list[Wire]:
    """Columns such as ``s84_mm``: readings at 84 m in millimetres, along an unknown line."""
    time = time_column(names)
    found = []
    for name in names if time else ():
        number, unit = _NUMBER.search(name), _UNIT.search(name)
        if name != time and number and unit:
            channel = channels.read_wire(
                reference.path, name=name, column=name, time=time or "", unit=unit[1]
            )
            found.append(Wire(channel.shifted(moved_s), None, float(number[0]), None))
    return found
