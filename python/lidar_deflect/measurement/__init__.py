"""The methods of measuring, behind one interface: `Inputs` in, `States` of every section out."""

from __future__ import annotations

from typing import TYPE_CHECKING

from lidar_deflect.measurement import beam, paper
from lidar_deflect.measurement.inputs import Inputs
from lidar_deflect.measurement.states import States

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping

METHODS: Mapping[str, Callable[[Inputs], States]] = {"beam": beam.measure, "paper": paper.measure}
"""Every method by the name it has in ``[measure] method``."""

__all__ = ["METHODS", "Inputs", "States"]
