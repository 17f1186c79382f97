"""States of moments at which a lidar was not where it is taken to stand, marked."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from lidar_deflect.measurement.states import DEGRADED, OK

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from lidar_deflect.drift.watch import Drift
    from lidar_deflect.measurement.states import States

REASON = "moved"

TURN_NS = 50_000_000
"""A state may rest on echoes of so long before and after it: half a turn."""


def marked(states: States, drift: Drift) -> States:
    """Mark what rests on a lidar in a span in which it stood elsewhere."""
    wrong = np.zeros(states.status.shape, dtype=np.bool_)
    for lidar, from_ns, to_ns in drift.unsure:
        inside = (states.time_ns > from_ns - TURN_NS) & (states.time_ns < to_ns + TURN_NS)
        wrong |= inside[:, None] & _uses(states, lidar)
    wrong &= states.status == OK
    if not wrong.any():
        return states
    reason = np.where(wrong, REASON, states.reason)
    return replace(states, status=np.where(wrong, DEGRADED, states.status), reason=reason)


def _uses(states: States, lidar: str | None) -> NDArray[np.bool_]:
    """Whether a state rests on a lidar, or would: shape (t, s)."""
    if lidar is None:
        return np.ones(states.lidars.shape, dtype=np.bool_)
    uses = [lidar in str(names).split("+") for names in states.lidars.ravel()]
    return np.array(uses, dtype=np.bool_).reshape(states.lidars.shape)
