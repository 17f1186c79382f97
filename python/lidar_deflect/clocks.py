"""Clocks of other instruments against those of the lidars: shifts estimated from the data.

What a winch, a wire or an inclinometer reads follows the blade. The shift of its clock is the one
by which its readings are best explained by the measured deflection.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np
import numpy.typing as npt

from lidar_deflect.clock_screen import Screen

if TYPE_CHECKING:
    from collections.abc import Sequence

    from lidar_deflect.channels import Channel

Floats = npt.NDArray[np.float64]
Times = npt.NDArray[np.int64]

SEARCH_S = 120.0
"""Clocks are searched this far apart, and as far about every whole quarter of an hour."""

APPLIED_S = 0.25
"""Shifts below this are said, not applied: a hold's margin bears them."""

_QUARTER_S = 900.0
_MOST_QUARTERS = 14 * 4
_COARSE_S = 0.1
_FINE_S = 0.004
_WINDOW_S = 0.1
_SHARE = 0.5
_EXPLAINED = 0.9
_FEWEST = 20
_MOVES = 0.15
_MOST_STATES = 4000
_SIGMAS = 5.0


@dataclass(frozen=True)
class Shift:
    """Shift of one instrument's clock.

    Attributes
    ----------
    seconds
        To be added to the instrument's times.
    u_s
        Standard uncertainty from the scatter of its readings about what the deflection explains.
    explained
        Share of the variance of its readings that the deflection explains at that shift.
    """

    seconds: float
    u_s: float
    explained: float

    @property
    def differs(self) -> bool:
        """Whether the clocks differ by more than holds can bear, beyond doubt."""
        return abs(self.seconds) > max(APPLIED_S, _SIGMAS * self.u_s)


def estimate(channel: Channel, time_ns: Times, deflection_m: Floats) -> Shift | None:
    """Estimate the shift of a channel's clock against that of the lidars.

    Parameters
    ----------
    channel
        Readings that follow the deflection, in whatever unit and curve.
    time_ns
        Instants of the states, shape (n,), rising.
    deflection_m
        Deflection of one section, shape (n,) or (n, 3); NaN where it was not measured. The
        component that explains the readings best is used.

    Returns
    -------
    Shift or None
        None where too little moved, or nothing explains the readings.
    """
    times, values = _states(time_ns, deflection_m)
    known = np.isfinite(channel.value)
    if times.size < _FEWEST or known.sum() < _FEWEST:
        return None
    seconds = (times - times[0]) * 1e-9
    channel_s = (channel.time_ns[known] - times[0]) * 1e-9
    largest = float(np.max(np.ptp(values, axis=0)))
    found = [
        _Pair(seconds, column / largest, channel_s, channel.value[known]).shift()
        for column in values.T
        if largest > 0.0 and np.ptp(column) > _MOVES * largest
    ]
    return max((each for each in found if each), key=lambda each: each.explained, default=None)


def _states(time_ns: Times, deflection_m: Floats) -> tuple[Times, Floats]:
    """Moments at which everything is known, shape (n,), and the columns then, shape (n, m)."""
    values = deflection_m.reshape(len(time_ns), -1)
    known = np.isfinite(values).all(axis=1)
    every = max(1, -(-int(known.sum()) // _MOST_STATES))
    return time_ns[known][::every], values[known][::every]


@dataclass(frozen=True)
class _Pair:
    """Deflection over its seconds, readings over theirs."""

    t: Floats
    d: Floats
    channel_t: Floats
    channel: Floats

    def shift(self) -> Shift | None:
        """Return the best shift, or None where nothing explains the readings."""
        coarse = [self.best(c - SEARCH_S, c + SEARCH_S, _COARSE_S) for c in self.offsets()]
        found = min((each for each in coarse if each), key=lambda each: each[1], default=None)
        return None if found is None else self.refined(found[0])

    def offsets(self) -> Sequence[float]:
        """Return shifts to search about: none, or quarters of an hour that bring them together."""
        if self._overlap(0.0) >= _SHARE:
            return [0.0]
        quarters = [_QUARTER_S * k for k in range(-_MOST_QUARTERS, _MOST_QUARTERS + 1)]
        return [0.0, *(each for each in quarters if self._overlap(each) >= _SHARE)]

    @cached_property
    def _screen(self) -> Screen:
        few = max(_FEWEST, _SHARE * self.t.size)
        reach, spread = 0.3 * self._reach, 0.2 * self._spread
        return Screen(self.t, self.d, self.channel_t, self.channel, few, reach, spread)

    @cached_property
    def _reach(self) -> float:
        return float(np.ptp(self.d))

    @cached_property
    def _spread(self) -> float:
        return float(np.var(self.channel))

    def _overlap(self, shift_s: float) -> float:
        """Share of the shorter record that lies within the other."""
        low = max(self.t[0], self.channel_t[0] + shift_s)
        high = min(self.t[-1], self.channel_t[-1] + shift_s)
        shorter = min(np.ptp(self.t), np.ptp(self.channel_t))
        return float((high - low) / shorter) if shorter > 0.0 else 0.0

    def _fit(self, shift_s: float) -> tuple[float, float, Floats] | None:
        """Mean square that a parabola in the deflection leaves, its share, and the residuals."""
        at = self.t - shift_s
        first = np.searchsorted(at, self.channel_t[0])
        last = np.searchsorted(at, self.channel_t[-1], side="right")
        if last - first < max(_FEWEST, _SHARE * self.t.size):
            return None
        terms = self._terms(int(first), int(last))
        if terms is None:
            return None
        y = np.interp(at[first:last], self.channel_t, self.channel)
        spread = float(np.var(y))
        if spread <= 0.2 * self._spread:
            return None
        solution = np.linalg.lstsq(terms, y, rcond=None)[0]
        off: Floats = y - terms @ solution
        square = float(np.mean(off**2))
        return square, square / spread, off

    def _terms(self, first: int, last: int) -> Floats | None:
        """Return a parabola's terms at these states, shape (n, 3); None where too little moves."""
        known = self._last_terms
        if (first, last) not in known:  # neighbouring shifts have the same states
            known.clear()
            d = self.d[first:last]
            moves = not d.max() - d.min() < 0.3 * self._reach
            known[first, last] = np.column_stack([np.ones_like(d), d, d * d]) if moves else None
        return known[first, last]

    @cached_property
    def _last_terms(self) -> dict[tuple[int, int], Floats | None]:
        return {}

    def best(self, low_s: float, high_s: float, step_s: float) -> tuple[float, float] | None:
        """Return the shift that leaves least, and what it leaves, on a grid."""
        grid = np.arange(low_s, high_s + 0.5 * step_s, step_s)
        grid = grid[self._screen(grid).near_lowest_share()]
        left = [(float(s), fit[1]) for s in grid if (fit := self._fit(float(s))) is not None]
        return min(left, key=lambda each: each[1], default=None)

    def refined(self, coarse_s: float) -> Shift | None:
        """Return the lowest point of the parabola through what is left near the best shift."""
        near = np.arange(coarse_s - 0.25, coarse_s + 0.2501, _FINE_S)
        near = near[self._screen(near).about_lowest_square(_WINDOW_S / _FINE_S)]
        fits = [(s, fit) for s in near if (fit := self._fit(float(s))) is not None]
        if len(fits) < 5:
            return None
        shifts = np.array([s for s, _ in fits])
        squares = np.array([fit[0] for _, fit in fits])
        lowest = int(np.argmin(squares))
        window = np.abs(shifts - shifts[lowest]) <= _WINDOW_S
        a, b, _ = np.polyfit(shifts[window] - shifts[lowest], squares[window], 2)
        if a <= 0.0:
            return None
        best = float(shifts[lowest] - 0.5 * b / a)
        _, share, off = fits[lowest][1]
        if 1.0 - share < _EXPLAINED:
            return None
        return Shift(best, _uncertainty(off, float(a)), 1.0 - share)


def _uncertainty(off: Floats, curvature: float) -> float:
    """Return the standard uncertainty of the lowest point; sway counts as correlated noise.

    The mean square is S + a (s - s0)^2, so the information on s is n a / S.
    """
    square = float(np.mean(off**2))
    lag = float(off[1:] @ off[:-1]) / max(float(off @ off), 1e-300)
    lag = min(max(lag, 0.0), 0.98)
    few = off.size * (1.0 - lag) / (1.0 + lag)
    return float(np.sqrt(square / max(few * curvature, 1e-300)))
