"""The other instruments of a test, read as its configuration names them."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from lidar_deflect import channels

if TYPE_CHECKING:
    from lidar_deflect.channels import Channel, Prediction
    from lidar_deflect.config import Config


def load(config: Config) -> Channel | None:
    """Read the load in percent, or None where no channel tells it."""
    given = config.load
    if given.file is None or given.value is None:
        return None
    return channels.read_load(given.file, time=given.time, value=given.value, unit=given.unit)


def wires(config: Config) -> tuple[Channel, ...]:
    """Read the real draw wires, metres; virtual ones have no file and are left out."""
    return tuple(
        channels.read_wire(
            wire.file,
            name=wire.name,
            column=wire.column,
            time=wire.time,
            unit=wire.unit,
            negate=wire.negate,
        )
        for wire in config.wires
        if wire.file is not None and wire.column is not None
    )


def root(config: Config) -> tuple[Channel, ...]:
    """Read the measured rotations of the root, rad."""
    if config.root is None:
        return ()
    given = config.root
    return channels.read_root(given.file, time=given.time, rx=given.rx, ry=given.ry, rz=given.rz)


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
