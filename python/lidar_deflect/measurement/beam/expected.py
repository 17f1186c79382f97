"""What is expected of the load and of the blade: where the search begins."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np

from lidar_deflect import holds as hold_finder
from lidar_deflect import instruments
from lidar_deflect.errors import LidarDeflectError, MeasurementError
from lidar_deflect.holds import Hold
from lidar_deflect.measurement import paper

if TYPE_CHECKING:
    from collections.abc import Sequence

    from numpy.typing import NDArray

    from lidar_deflect.channels import Prediction
    from lidar_deflect.measurement.inputs import Inputs

    Floats = NDArray[np.float64]
    Times = NDArray[np.int64]

GUESS_SHARE = 0.1
"""Deflection under full load as a share of the length where no prediction tells it."""
STILL_SHARE = 0.02
"""A load below this share counts as none."""


@dataclass(frozen=True)
class Expected:
    """Load over time and the deflection under full load.

    Attributes
    ----------
    time_ns, share
        Load as a share of full load, shape (t,).
    holds
        Where it stands still.
    s_m, deflection_m
        Total deflection of some sections under full load, shape (n,).
    direction
        Of the load, unit vector.
    source
        Where this comes from: ``channel``, ``paper``, or ``unloaded``: no other hold.
    swings
        Whether the blade is swung after it.
    """

    time_ns: Times
    share: Floats
    holds: tuple[Hold, ...]
    s_m: Floats
    deflection_m: Floats
    direction: Floats
    source: str
    swings: bool = False

    def at(self, time_ns: Sequence[int] | Times) -> Floats:
        """Share of full load at instants, shape as given."""
        return np.asarray(np.interp(np.asarray(time_ns), self.time_ns, self.share))

    def hold_share(self, hold: Hold) -> float:
        """Share of full load in a hold; exactly zero where it is hardly any."""
        inside = hold.contains(self.time_ns)
        share = float(np.median(self.share[inside])) if inside.any() else 0.0
        return 0.0 if abs(share) < STILL_SHARE else share


def expected_of(inputs: Inputs) -> Expected:
    """Take load and prediction as configured; where one lacks, the paper's method stands in.

    Raises
    ------
    MeasurementError
        If there is neither a load channel with a prediction nor a result of the paper's method.
    """
    if inputs.config.test.kind == "fatigue":
        return swung(inputs)
    load, predicted = inputs.load, instruments.prediction(inputs.config)
    if load is not None and predicted is not None:
        s_m, deflection_m = _totals(predicted)
        return Expected(
            time_ns=load.time_ns,
            share=load.value / 100.0,
            holds=hold_finder.from_load(load.time_ns, load.value),
            s_m=s_m,
            deflection_m=deflection_m,
            direction=_direction(inputs),
            source="channel",
        )
    return _from_paper(inputs)


def swung(inputs: Inputs) -> Expected:
    """Nothing but the unloaded hold stands still; from there the blade is swung.

    Raises
    ------
    MeasurementError
        If there is no such hold in these captures.
    """
    if inputs.unloaded_ns is None:
        raise MeasurementError(
            "a fatigue test is measured from its blade at rest, and these captures have none",
            code="measurement.no_rest",
            hint="record some seconds before the blade is swung, in the same files",
        )
    return replace(still(inputs, inputs.unloaded_ns), swings=True)


def still(inputs: Inputs, window_ns: tuple[int, int]) -> Expected:
    """Nothing moves in the unloaded hold."""
    predicted = instruments.largest_predicted_m(inputs.config)
    length = inputs.config.blade.length_m
    return Expected(
        time_ns=np.array(window_ns, dtype=np.int64),
        share=np.zeros(2),
        holds=(Hold(*window_ns, "0 %", 0.0),),
        s_m=np.array([length]),
        deflection_m=np.array([predicted or GUESS_SHARE * length]),
        direction=np.array(inputs.config.load.direction or (1.0, 0.0, 0.0)),
        source="unloaded",
    )


def _totals(predicted: Prediction) -> tuple[Floats, Floats]:
    """Sections and total deflection at full load."""
    values = predicted.value_m.reshape(len(predicted.s_m), -1)
    totals = np.linalg.norm(values, axis=1) * (100.0 / predicted.at_percent)
    return predicted.s_m, totals


def _direction(inputs: Inputs) -> Floats:
    given = inputs.config.load.direction
    return np.array((1.0, 0.0, 0.0) if given is None else given, dtype=np.float64)


def _from_paper(inputs: Inputs) -> Expected:
    """Run the paper's method for a first look."""
    try:
        states = paper.measure(inputs)
    except LidarDeflectError as error:
        raise MeasurementError(
            "nothing tells where the blade is to be looked for",
            code="measurement.no_start",
            facts=[("paper's method", str(error))],
            hint="give a load channel in [load] and a calculated deflection in [prediction]",
        ) from error
    moved = states.farthest_m
    known = ~np.isnan(moved).any(axis=1)
    total = np.linalg.norm(moved[known], axis=1)
    full = float(np.percentile(total, 95.0))
    times = states.time_ns[known]
    deflection = np.linalg.norm(states.deflection_m[known], axis=2)
    top = total >= 0.95 * full
    direction = moved[known][top].mean(axis=0) * (1.0, 1.0, 0.0)
    return Expected(
        time_ns=times,
        share=total / full,
        holds=hold_finder.from_deflection(times, moved[known]),
        s_m=states.s_m,
        deflection_m=np.asarray(np.median(deflection[top], axis=0)),
        direction=direction / np.linalg.norm(direction),
        source="paper",
    )
