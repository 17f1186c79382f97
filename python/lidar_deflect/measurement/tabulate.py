"""States become the table `deflection`."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from lidar_deflect import tables
from lidar_deflect.holds import steps_at
from lidar_deflect.measurement import root as root_motion

if TYPE_CHECKING:
    from collections.abc import Sequence

    import polars as pl
    from numpy.typing import NDArray

    from lidar_deflect.channels import Channel
    from lidar_deflect.holds import Hold
    from lidar_deflect.measurement.states import States

NO_ROOT: dict[str, Any] = dict.fromkeys(("dxr_m", "dyr_m", "dzr_m", "dr_m"))
NO_UNCERTAINTY: dict[str, Any] = dict.fromkeys(
    ("ux_m", "uy_m", "uz_m", "udx_m", "udy_m", "udz_m", "ud_m", "twist_deg", "utwist_deg")
)


def deflection(
    states: States,
    holds: Sequence[Hold],
    *,
    load: Channel | None,
    root: Sequence[Channel],
    first_ns: int,
) -> pl.DataFrame:
    """Table `deflection`: one row per time and section.

    Parameters
    ----------
    load
        Load in percent, or None without a channel.
    root
        Measured rotations of the root.
    first_ns
        Time of the first accepted lidar packet, where ``t_s`` is zero.
    """
    moments, sections = states.n_points.shape
    step = np.array(steps_at(holds, states.time_ns), dtype=object)
    load_percent = np.full(moments, np.nan) if load is None else load.at(states.time_ns)
    columns: dict[str, Any] = {
        "time": np.repeat(states.time_ns, sections),
        "t_s": np.repeat((states.time_ns - first_ns) * 1e-9, sections),
        "step": list(np.repeat(step, sections)),
        "load": np.repeat(load_percent, sections),
        "section": list(states.names) * moments,
        "s_m": np.tile(states.s_m, moments),
        "d_m": np.linalg.norm(states.deflection_m, axis=2).ravel(),
        "n_points": states.n_points.ravel(),
        "lidars": list(states.lidars.ravel()),
        "status": [tables.STATUSES[index] for index in states.status.ravel()],
        "reason": list(states.reason.ravel()),
    }
    columns |= _vectors("{}_m", states.position_m) | _vectors("d{}_m", states.deflection_m)
    columns |= _without_root_motion(states, root) | _uncertainty(states)
    return tables.build("deflection", columns)


def _uncertainty(states: States) -> dict[str, Any]:
    """Columns of uncertainty and twist; null under a method that has none."""
    found = dict(NO_UNCERTAINTY)
    if states.u_position_m is not None and states.u_deflection_m is not None:
        found |= _vectors("u{}_m", states.u_position_m)
        found |= _vectors("ud{}_m", states.u_deflection_m)
    scalars = {
        "ud_m": states.u_total_m,
        "twist_deg": states.twist_deg,
        "utwist_deg": states.u_twist_deg,
    }
    return found | {name: x.ravel() for name, x in scalars.items() if x is not None}


def _vectors(pattern: str, values: NDArray[np.float64]) -> dict[str, Any]:
    return {pattern.format(axis): values[:, :, i].ravel() for i, axis in enumerate("xyz")}


def _without_root_motion(states: States, channels: Sequence[Channel]) -> dict[str, Any]:
    rotation = root_motion.rotation_rad(channels, states.time_ns)
    if rotation is None:
        return NO_ROOT
    change = root_motion.taken_off(states.position_m, rotation) - states.reference_m
    return _vectors("d{}r_m", change) | {"dr_m": np.linalg.norm(change, axis=2).ravel()}
