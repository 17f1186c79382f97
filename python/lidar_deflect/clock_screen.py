"""Which shifts of a clock are worth an exact fit: all of a grid at once, in closed form.

The sums here are rounded otherwise than those of the fits that are kept. So what is chosen is
chosen generously: a shift that is left out cannot be the best one.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

Floats = npt.NDArray[np.float64]
Flags = npt.NDArray[np.bool_]

ROUNDING = 1e-9
"""Shares of variance that differ by less may be ordered otherwise by an exact fit: their rounding
errors are some 1e-13."""

_BLOCK = 1 << 18
"""Values of a block of shifts by states, so that memory stays small."""

_FEWEST_FITS = 5

_SLACK_S = 1e-6
"""States this near to the ends of the readings may be counted otherwise: their rounding errors are
some 1e-10."""


@dataclass(frozen=True)
class Screened:
    """What each shift of a grid leaves, nearly.

    Attributes
    ----------
    share, square
        Share of the variance and mean square that a parabola leaves, shape (n,); infinite for
        shifts that are refused.
    is_open
        Shifts of which only an exact fit tells whether they are refused, shape (n,).
    """

    share: Floats
    square: Floats
    is_open: Flags

    def near_lowest_share(self) -> Flags:
        """Tell which shifts may leave the smallest share."""
        lowest = self.share.min(initial=np.inf)
        known = np.isfinite(self.share)
        return np.asarray((known & (self.share <= lowest + ROUNDING)) | self.is_open)

    def about_lowest_square(self, steps: float) -> Flags:
        """Tell which shifts lie within so many steps of the one that may leave least."""
        known = np.isfinite(self.square)
        if self.is_open.any() or known.sum() < _FEWEST_FITS:
            return np.asarray(known | self.is_open)
        largest = (self.square[known] / np.maximum(self.share[known], ROUNDING)).max()
        lowest = np.flatnonzero(self.square <= self.square.min() + ROUNDING * largest)
        place = np.arange(self.square.size)
        inside = (place >= lowest[0] - steps - 1) & (place <= lowest[-1] + steps + 1)
        return np.asarray(known & inside)


@dataclass(frozen=True)
class Screen:
    """Deflection over its seconds, readings over theirs, and what a shift must at least have.

    Attributes
    ----------
    few, reach, spread
        States within the readings; how far the deflection must move among them; variance of the
        readings there.
    """

    t: Floats
    d: Floats
    channel_t: Floats
    channel: Floats
    few: float
    reach: float
    spread: float

    def __call__(self, shifts_s: Floats) -> Screened:
        """Fit all shifts, shape (n,)."""
        share = np.full(shifts_s.size, np.inf)
        square, is_open = share.copy(), np.zeros(shifts_s.size, dtype=np.bool_)
        every = max(1, _BLOCK // max(1, self.t.size))
        long = np.flatnonzero(self._may_have_enough(shifts_s))
        for first in range(0, long.size, every):
            part = long[first : first + every]
            worth, found = self._block(shifts_s[part])
            place = part[worth]
            share[place], square[place], is_open[place] = found.share, found.square, found.is_open
        return Screened(share, square, is_open)

    def _may_have_enough(self, shifts_s: Floats) -> Flags:
        """Tell, generously, which shifts leave enough states within the readings."""
        first = np.searchsorted(self.t, self.channel_t[0] + shifts_s - _SLACK_S)
        last = np.searchsorted(self.t, self.channel_t[-1] + shifts_s + _SLACK_S, side="right")
        return np.asarray(last - first >= self.few)

    def _block(self, shifts_s: Floats) -> tuple[Flags, Screened]:
        """Tell which shifts have enough states that move enough, and what those leave."""
        at = self.t - shifts_s[:, None]
        inside = (at >= self.channel_t[0]) & (at <= self.channel_t[-1])
        high = np.where(inside, self.d, -np.inf).max(axis=1)
        low = np.where(inside, self.d, np.inf).min(axis=1)
        worth = (inside.sum(axis=1) >= self.few) & ~(high - low < self.reach)
        y = np.interp(at[worth], self.channel_t, self.channel)
        return worth, self._left(y, inside[worth])

    def _left(self, y: Floats, inside: Flags) -> Screened:
        count = inside.sum(axis=1)
        y = _centred(y, inside, count)
        line = _centred(np.broadcast_to(self.d, y.shape), inside, count)
        bow = _centred(np.broadcast_to(self.d * self.d, y.shape), inside, count)
        curved = _dot(bow, bow)
        steep = _dot(line, line)
        bow = bow - (_dot(bow, line) / steep)[:, None] * line
        bent = _dot(bow, bow)
        is_flat = bent <= ROUNDING * curved  # the deflection has two values: no parabola
        whole = _dot(y, y)
        with np.errstate(divide="ignore", invalid="ignore"):
            told = _dot(y, line) ** 2 / steep + np.where(is_flat, 0.0, _dot(y, bow) ** 2 / bent)
            left = np.maximum(whole - told, 0.0)
            share = left / whole
        spread = whole / count
        edge = ROUNDING * self.spread
        is_open = is_flat | (np.abs(spread - self.spread) <= edge) | ~np.isfinite(share)
        is_refused = (spread <= self.spread) | is_open
        share, square = (np.where(is_refused, np.inf, each) for each in (share, left / count))
        return Screened(share, square, is_open)


def _centred(values: Floats, inside: Flags, count: npt.NDArray[np.intp]) -> Floats:
    """Return values less their mean within each row, zero outside of it."""
    kept = np.where(inside, values, 0.0)
    return np.where(inside, kept - (kept.sum(axis=1) / count)[:, None], 0.0)


def _dot(one: Floats, other: Floats) -> Floats:
    return np.asarray(np.einsum("ij,ij->i", one, other))
