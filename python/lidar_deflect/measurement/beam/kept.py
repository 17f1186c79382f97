"""The unloaded blade as a calibration keeps it: runs without an unloaded hold are then measured."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from lidar_deflect.errors import MeasurementError
from lidar_deflect.measurement.beam.adjustment import solve
from lidar_deflect.measurement.beam.expected import still
from lidar_deflect.measurement.beam.schedule import LAST
from lidar_deflect.measurement.beam.uncertainty import HoldCovariance

if TYPE_CHECKING:
    from collections.abc import Mapping

    from numpy.typing import NDArray

    from lidar_deflect.measurement.inputs import Inputs

    Floats = NDArray[np.float64]

STATION_M = 0.5
FIRST_SHARE = 0.4
"""Stations are kept outboard of this share of the length."""


@dataclass(frozen=True)
class Kept:
    """Mid-chord points of the unloaded blade.

    Attributes
    ----------
    s_m
        Stations, shape (n,).
    position_m
        Shape (n, 3).
    covariance_m2
        Shape (n, 3, 3).
    """

    s_m: Floats
    position_m: Floats
    covariance_m2: Floats

    def at(self, s_m: Floats) -> tuple[Floats, Floats]:
        """Position (s, 3) and covariance (s, 3, 3) of sections, linear between stations.

        Raises
        ------
        MeasurementError
            If a section lies inboard of all that is kept.
        """
        if s_m.min() < self.s_m[0] or s_m.max() > self.s_m[-1] + STATION_M:
            raise MeasurementError(
                "the unloaded state in the calibration does not reach all sections",
                code="measurement.reference_sections",
                facts=[("calibration", f"{self.s_m[0]:g} m to {self.s_m[-1]:g} m")],
                hint="calibrate again with the configuration of this test",
            )
        places = np.clip(np.searchsorted(self.s_m, s_m), 1, len(self.s_m) - 1)
        share = (s_m - self.s_m[places - 1]) / (self.s_m[places] - self.s_m[places - 1])
        low, high = self.position_m[places - 1], self.position_m[places]
        nearest = np.where(share < 0.5, places - 1, places)
        return low + (high - low) * share[:, None], self.covariance_m2[nearest]

    def to_dict(self) -> dict[str, Any]:
        """Plain document for files."""
        return {name: getattr(self, name).tolist() for name in self.__dataclass_fields__}

    @classmethod
    def from_dict(cls, document: Mapping[str, Any]) -> Kept:
        """Read what `to_dict` wrote."""
        names = cls.__dataclass_fields__
        return cls(**{name: np.array(document[name], dtype=np.float64) for name in names})


def calibrated_reference(inputs: Inputs) -> Mapping[str, Any]:
    """Return the unloaded blade of this capture's unloaded hold for a calibration file.

    Raises
    ------
    MeasurementError
        If the blade is not found in it.
    """
    assert inputs.unloaded_ns is not None
    solved = solve(inputs, still(inputs, inputs.unloaded_ns))
    length = inputs.config.blade.length_m
    s_m = np.append(np.arange(FIRST_SHARE * length, length, STATION_M), length)
    found = HoldCovariance.of(solved, s_m, LAST)
    covariance = np.array([found.covariance[0, i, :3, 0, i, :3] for i in range(len(s_m))])
    return Kept(s_m, found.values[0, :, :3], covariance).to_dict()
