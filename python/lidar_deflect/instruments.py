"""The other instruments of a test, read as its configuration names them."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from lidar_deflect import channels, delimited

if TYPE_CHECKING:
    from collections.abc import Mapping
    from pathlib import Path

    from lidar_deflect.channels import Channel, Prediction
    from lidar_deflect.config import Config

    Shifts = Mapping[Path, float]

NO_SHIFTS: dict[Path, float] = {}


def load(config: Config, near_ns: int | None = None, shifts: Shifts = NO_SHIFTS) -> Channel | None:
    """Read the load in percent, or None where no channel tells it.

    Parameters
    ----------
    near_ns
        Start of the test: dates times of day.
    shifts
        Seconds to add to the times of a file whose configuration names none.
    """
    given = config.load
    if given.file is None or given.value is None:
        return None
    found = channels.read_load(
        given.file, time=given.time, value=given.value, unit=given.unit, near_ns=near_ns
    )
    return found.shifted(_shift(given.shift_s, given.file, shifts))


def wires(
    config: Config, near_ns: int | None = None, shifts: Shifts = NO_SHIFTS
) -> tuple[Channel, ...]:
    """Read the real draw wires, metres; virtual ones have no file and are left out."""
    instants = delimited.Instants()
    return tuple(
        channels.read_wire(
            wire.file,
            name=wire.name,
            column=wire.column,
            time=wire.time,
            unit=wire.unit,
            negate=wire.negate,
            near_ns=near_ns,
            instants=instants,
        ).shifted(_shift(wire.shift_s, wire.file, shifts))
        for wire in config.wires
        if wire.file is not None and wire.column is not None
    )


def root(
    config: Config, near_ns: int | None = None, shifts: Shifts = NO_SHIFTS
) -> tuple[Channel, ...]:
    """Read the measured rotations of the root, rad."""
    given = config.root
    if given is None:
        return ()
    found = channels.read_root(
        given.file, time=given.time, rx=given.rx, ry=given.ry, rz=given.rz, near_ns=near_ns
    )
    return tuple(each.shifted(_shift(given.shift_s, given.file, shifts)) for each in found)


def others(
    config: Config, near_ns: int | None = None, shifts: Shifts = NO_SHIFTS
) -> tuple[Channel, ...]:
    """Read the other instruments, each in its own unit."""
    return tuple(
        channels.read_other(
            given.file,
            name=given.name,
            column=given.column,
            time=given.time,
            unit=given.unit,
            near_ns=near_ns,
        ).shifted(_shift(given.shift_s, given.file, shifts))
        for given in config.channels
    )


def _shift(configured: float | None, file: Path, shifts: Shifts) -> float:
    return configured if configured is not None else shifts.get(file, 0.0)


def unsettled_files(config: Config) -> dict[Path, None]:
    """Files of channels whose clock the configuration leaves to the data, the load's first."""
    given = [config.load, *config.wires, config.root, *config.channels]
    return {
        each.file: None
        for each in given
        if each is not None and each.file is not None and each.shift_s is None
    }


def prediction(config: Config) -> Prediction | None:
    """Read the prediction, metres."""
    given = config.prediction
    if given is None:
        return None
    return channels.read_prediction(
        given.file,
        section=given.section,
        value=given.value,
        unit=given.unit,
        quantity=given.quantity,
        at_percent=given.at_percent,
    )


def largest_predicted_m(config: Config) -> float | None:
    """Return the largest predicted deflection of any section, or None without a prediction."""
    predicted = prediction(config)
    if predicted is None or not predicted.value_m.size:
        return None
    values = predicted.value_m.reshape(len(predicted.s_m), -1)
    return float(np.nanmax(np.linalg.norm(values, axis=1)))
