"""When a tripod was moved, from every echo's own instant."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from lidar_deflect.drift.cells import Cells
    from lidar_deflect.drift.echoes import Kept

    Floats = NDArray[np.float64]

CLEAR = 8.0
"""An echo tells no more than this of either pose, in log-likelihood: it may be something else."""

UNSURE = 20.0
"""Instants whose log-likelihood is within this of the best may be the one."""

SWING_NS = 100_000_000
"""A tripod that was knocked needs so long to come to rest."""


def instant_ns(cells: Cells, echoes: Kept, old: Floats, new: Floats) -> tuple[int, int]:
    """Find when a lidar went from one pose to another.

    Every echo lies nearer to its surface from one pose than from the other. The sum over all echoes
    up to an instant of how much better the new pose explains them is least where it was moved.

    Returns
    -------
    tuple
        The last instant at which it surely stood in the old pose, the first at which it stands in
        the new one, nanoseconds.
    """
    time_ns, gain = _gains(cells, echoes, old, new)
    if not gain.size:
        return int(echoes.time_ns.min()), int(echoes.time_ns.max())
    total = np.concatenate([[0.0], np.cumsum(gain)])
    likely = np.flatnonzero(total < total.min() + UNSURE)
    left = time_ns[max(0, int(likely[0]) - 1)]
    back = time_ns[min(len(time_ns) - 1, int(likely[-1]))]
    return int(left), int(back) + SWING_NS


def _gains(
    cells: Cells, echoes: Kept, old: Floats, new: Floats
) -> tuple[NDArray[np.int64], Floats]:
    """Instants in order, and how much better each echo fits the new pose."""
    cell = echoes.cell
    before, after = (cells.away_m(cell, echoes.xyz, pose) for pose in (old, new))
    clear = np.fmin(np.abs(before), np.abs(after)) < cells.gate_m[cell]
    order = np.argsort(echoes.time_ns[clear], kind="stable")
    scatter = cells.sigma_m[cell[clear]]
    scatter = np.maximum(scatter, 0.5 * float(np.median(scatter))) if scatter.size else scatter
    told = _told(before[clear] / scatter) - _told(after[clear] / scatter)
    return echoes.time_ns[clear][order], told[order]


def _told(away: Floats) -> Floats:
    return np.asarray(np.minimum(0.5 * away**2, CLEAR))
