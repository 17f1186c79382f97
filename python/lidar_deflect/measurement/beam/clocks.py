"""How far the lidars' clocks are apart, from what they see of a moving blade."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

if TYPE_CHECKING:
    from collections.abc import Sequence

    from numpy.typing import NDArray

    Floats = NDArray[np.float64]

FREE_S = {"locked": 1e-4, "utc": 10e-3, "free_running": 2e-3}
"""Standard deviation of a clock before the blade is looked at, by what holds it: a lock to UTC, a
host's clock that is no farther than 20 ms, or the arrival of its packets."""
WANDER_S = 3e-4
"""How far a clock that nothing locks may wander from its offset ..."""
LOCKED_S = 1e-4
"""... and one that is locked."""
WORTH_A_WORD_S = 1e-3
"""An offset beyond this, and beyond three times its uncertainty, is told."""
MOST = 8
"""So many stretches of the fastest motion tell the clocks."""


@dataclass(frozen=True)
class ClockOffsets:
    """What each clock is behind the one that all share, seconds, and how well that is known.

    The blade tells differences only: the mean, weighted by how well each clock is held, is zero.
    """

    kinds: tuple[str, ...]
    offset_s: Floats
    u_s: Floats

    @property
    def deviation_s(self) -> Floats:
        """Deviation from the offset at any instant, seconds, shape (lidars,)."""
        wander = [LOCKED_S if kind == "locked" else WANDER_S for kind in self.kinds]
        return np.hypot(self.u_s, wander)


def unknown(kinds: Sequence[str]) -> Floats:
    """Return standard deviations before the blade is looked at, seconds, shape (lidars,)."""
    return np.array([FREE_S[kind] for kind in kinds])


def combined(kinds: Sequence[str], news: Sequence[Any]) -> ClockOffsets:
    """Put together what stretches tell, each as its information (1/s^2) and that times offsets.

    Where nothing moves nothing is told, and the clocks are taken for right.
    """
    if not news:
        return ClockOffsets(tuple(kinds), np.zeros(len(kinds)), np.zeros(len(kinds)))
    before = unknown(kinds)
    held = 1.0 / before**2
    held /= np.linalg.norm(held)
    information = np.diag(1.0 / before**2) + np.outer(held, held) / min(before) ** 2 * 1e6
    right = np.zeros(len(kinds))
    for one, asked in news:
        information += one
        right += asked
    covariance = np.linalg.inv(information)
    return ClockOffsets(tuple(kinds), covariance @ right, np.sqrt(np.diag(covariance)))


def telling(shares: Sequence[Floats], *, swings: bool) -> list[int]:
    """Return numbers of stretches that tell the clocks, given the loads at their moments.

    They are those in which the load changes fastest; of a blade that is swung, some of all.
    """
    if swings:
        return list(range(0, len(shares), max(1, -(-len(shares) // MOST))))
    pace = np.array([np.ptp(share) / max(len(share) - 1, 1) for share in shares])
    order = np.argsort(-pace, kind="stable")[:MOST]
    return [int(place) for place in np.sort(order) if pace[place] > 0.0]


def told(lidars: Sequence[str], found: ClockOffsets) -> list[str]:
    """Warnings of clocks that are off by more than a millisecond."""
    apart = np.abs(found.offset_s) > np.maximum(WORTH_A_WORD_S, 3.0 * found.u_s)
    return [
        f"clock of {lidars[place]}: {1e3 * abs(found.offset_s[place]):.1f} ms "
        f"{'behind' if found.offset_s[place] > 0 else 'ahead of'} that of the lidars together "
        f"(u = {1e3 * found.u_s[place]:.1f} ms, from the moving blade); its shots are taken at "
        "corrected times"
        for place in np.flatnonzero(apart).tolist()
    ]
