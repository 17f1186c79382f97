"""Stretches of a noisy series that stand still, told from the ramps between them."""

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from lidar_deflect.errors import InvalidValueError

Floats = npt.NDArray[np.float64]
Times = npt.NDArray[np.int64]
Indices = npt.NDArray[np.intp]

_NOISE_OF_SECOND_DIFFERENCE = np.sqrt(6.0)  # sigma of x[i-1] - 2 x[i] + x[i+1] of white noise
_SIGMA_OF_MAD = 1.4826  # of a normal distribution
_LEVEL_SIGMAS = 5.0  # a sample farther from the level of its hold belongs to a ramp


@dataclass(frozen=True)
class HoldParams:
    """What counts as a hold.

    Parameters
    ----------
    min_hold_s
        Shortest hold, after the margins are taken off.
    margin_s
        Taken off at each end where the load was moving: 60 ms of a ramp are 150 mm at the tip.
    window_s
        Stretch over which the rate of change is judged; widened by itself where noise needs it.
    still_rate
        A rate below this share of the ramps' own rate counts as still.
    same_level_percent
        Levels this near to each other are one load step, in percent of the largest level.
    """

    min_hold_s: float = 1.0
    margin_s: float = 0.25
    window_s: float = 0.5
    still_rate: float = 0.25
    same_level_percent: float = 1.5

    def __post_init__(self) -> None:
        for name in ("min_hold_s", "window_s", "still_rate", "same_level_percent"):
            _check_positive(name, getattr(self, name))
        if not 0.0 <= self.margin_s < np.inf:
            raise InvalidValueError(f"margin_s is {self.margin_s}, expected a length of time >= 0")
        if self.still_rate >= 1.0:
            raise InvalidValueError(f"still_rate is {self.still_rate}, expected less than 1")


def _check_positive(name: str, value: float) -> None:
    if not 0.0 < value < np.inf:
        raise InvalidValueError(f"{name} is {value}, expected a number above 0")


def span(column: Floats) -> float:
    """Return the difference of largest and smallest known value; 0 without any."""
    known = column[np.isfinite(column)]
    return float(np.ptp(known)) if known.size else 0.0


def plateaus(times: Times, values: Floats, params: HoldParams) -> list[tuple[int, int, float]]:
    """First index, last index and level of every hold, margins taken off."""
    if times.size < 3:
        return []
    seconds = (times - times[0]) * 1e-9
    noise = _noise(values)
    runs, margin_s = [(0, times.size - 1)], 0.0
    if span(values) > 2.0 * _LEVEL_SIGMAS * noise:
        window_s, still = _still(seconds, values, noise, params)
        same = params.same_level_percent / 100.0 * span(values)
        runs = _merge(_runs(still), values, max(same, _LEVEL_SIGMAS * noise))
        level, sigma, margin_s = values, noise, params.margin_s
        if window_s > params.window_s:  # noise hides the corners of a slow test
            level, sigma = _average(seconds, values, noise, window_s)
            margin_s = max(margin_s, window_s / 4.0)
        runs = [_fit_to_level(run, level, sigma, same) for run in runs]
    trimmed = [_trim(run, seconds, margin_s) for run in runs]
    return [
        (a, b, float(np.median(values[a : b + 1])))
        for a, b in trimmed
        if b > a and seconds[b] - seconds[a] >= params.min_hold_s
    ]


def _noise(values: Floats) -> float:
    """White noise of a series, from second differences, blind to its trend."""
    second = np.diff(values, 2)
    return float(_SIGMA_OF_MAD * np.median(np.abs(second)) / _NOISE_OF_SECOND_DIFFERENCE)


def _still(
    seconds: Floats, values: Floats, noise: float, params: HoldParams
) -> tuple[float, npt.NDArray[np.bool_]]:
    """Mark samples whose rate is small against that of the ramps, and say over which window."""
    window_s = params.window_s
    longest_s = seconds[-1] / 10.0
    while True:
        rate, sigma = _rate(seconds, values, noise, window_s)
        ramp = float(np.sum(rate**2) / max(np.sum(np.abs(rate)), 1e-300))
        if 3.0 * sigma <= params.still_rate * ramp or 2.0 * window_s > longest_s:
            return window_s, np.abs(rate) < params.still_rate * ramp
        window_s *= 2.0


def _rate(seconds: Floats, values: Floats, noise: float, window_s: float) -> tuple[Floats, float]:
    """Least-squares slope in a window about each sample, and the slope's noise (median)."""
    low, high = _window(seconds, window_s)
    count = high - low
    # Sums over windows as differences of running sums, about the middle to keep digits.
    t, v = seconds - seconds.mean(), values - values.mean()
    sums = [_window_sum(x, low, high) / count for x in (t, v, t * t, t * v)]
    variance = np.maximum(sums[2] - sums[0] ** 2, 1e-300)
    rate = (sums[3] - sums[0] * sums[1]) / variance
    return rate, float(np.median(noise / np.sqrt(count * variance)))


def _average(
    seconds: Floats, values: Floats, noise: float, window_s: float
) -> tuple[Floats, float]:
    """Mean in a window about each sample, and the noise of a mean (median)."""
    low, high = _window(seconds, window_s)
    mean = _window_sum(values, low, high) / (high - low)
    return mean, float(np.median(noise / np.sqrt(high - low)))


def _window(seconds: Floats, window_s: float) -> tuple[Indices, Indices]:
    """First index of the window about each sample and the one behind its last: three at least."""
    place = np.arange(seconds.size)
    low = np.searchsorted(seconds, seconds - window_s / 2.0 - 1e-9)
    high = np.searchsorted(seconds, seconds + window_s / 2.0 + 1e-9)
    return (
        np.maximum(np.minimum(low, place - 1), 0),
        np.minimum(np.maximum(high, place + 2), seconds.size),
    )


def _window_sum(x: Floats, low: Indices, high: Indices) -> Floats:
    running = np.concatenate([[0.0], np.cumsum(x)])
    return np.asarray(running[high] - running[low])


def _runs(mask: npt.NDArray[np.bool_]) -> list[tuple[int, int]]:
    """First and last index of every stretch of True."""
    edges = np.flatnonzero(np.diff(np.concatenate([[False], mask, [False]]).astype(np.int8)))
    return [(int(a), int(b) - 1) for a, b in zip(edges[::2], edges[1::2], strict=True)]


def _merge(runs: list[tuple[int, int]], values: Floats, near: float) -> list[tuple[int, int]]:
    """Join neighbours at one level between which the series never left it."""
    joined: list[tuple[int, int]] = []
    for run in runs:
        if joined and _stays(values[joined[-1][0] : run[1] + 1], near):
            joined[-1] = (joined[-1][0], run[1])
        else:
            joined.append(run)
    return joined


def _stays(values: Floats, near: float) -> bool:
    """Whether all but single outliers of a stretch lie near its median."""
    off = np.abs(values - np.median(values)) > near
    return bool(np.count_nonzero(off) <= 1)


def _fit_to_level(
    run: tuple[int, int], values: Floats, noise: float, same: float
) -> tuple[int, int]:
    """Grow or shrink a run to the samples about its middle that share its level."""
    a, b = run
    level = np.median(values[a : b + 1])
    sway = np.max(np.abs(values[a : b + 1] - level))
    near = max(_LEVEL_SIGMAS * noise, min(float(sway), same))
    close = np.abs(values - level) <= near
    while b + 1 < values.size and close[b + 1]:
        b += 1
    while a > 0 and close[a - 1]:
        a -= 1
    while b > a and not close[b]:
        b -= 1
    while a < b and not close[a]:
        a += 1
    return a, b


def _trim(run: tuple[int, int], seconds: Floats, margin_s: float) -> tuple[int, int]:
    """Take the margin off at the ends that touch a ramp, not at the ends of the record."""
    a, b = run
    if a > 0:
        a = int(np.searchsorted(seconds, seconds[a] + margin_s))
    if b < seconds.size - 1:
        b = int(np.searchsorted(seconds, seconds[b] - margin_s, side="right")) - 1
    return a, b
