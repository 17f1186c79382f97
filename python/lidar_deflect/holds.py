"""Load steps: the holds of a static test, from a load channel or from the measured deflection."""

from collections.abc import Sequence
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


@dataclass(frozen=True)
class Hold:
    """One hold, both ends included.

    Parameters
    ----------
    from_ns, to_ns
        First and last instant, nanoseconds since 1970 UTC.
    label
        Load step: ``40 %``, a second time ``40 % (2)``; ``~40 %`` where it was judged from the
        deflection alone, as a share of the largest.
    load_percent
        Median load over the hold; None where no channel says it.
    """

    from_ns: int
    to_ns: int
    label: str
    load_percent: float | None

    @property
    def middle_ns(self) -> int:
        """Instant half-way through the hold."""
        return (self.from_ns + self.to_ns) // 2

    @property
    def duration_s(self) -> float:
        """Length of the hold."""
        return (self.to_ns - self.from_ns) * 1e-9

    def contains(self, time_ns: Times) -> npt.NDArray[np.bool_]:
        """Tell which instants lie in the hold, shape as given."""
        return (time_ns >= self.from_ns) & (time_ns <= self.to_ns)


def from_load(
    time_ns: npt.ArrayLike, load_percent: npt.ArrayLike, params: HoldParams | None = None
) -> tuple[Hold, ...]:
    """Find the holds in a load channel.

    Parameters
    ----------
    time_ns
        Instants, shape (n,), nanoseconds since 1970 UTC, rising.
    load_percent
        Load, shape (n,), percent of the full load; NaN where the channel has no value.
    params
        What counts as a hold.

    Returns
    -------
    tuple of Hold
        In time order; empty where the load never stands still.

    Raises
    ------
    InvalidValueError
        If shapes differ or the times do not rise.
    """
    params = params or HoldParams()
    times, values = _clean(time_ns, load_percent, "load_percent")
    levels = _plateaus(times, values, params)
    labels = _labels([level for _, _, level in levels], params.same_level_percent, "")
    return tuple(
        Hold(int(times[a]), int(times[b]), label, level)
        for (a, b, level), label in zip(levels, labels, strict=True)
    )


def from_deflection(
    time_ns: npt.ArrayLike, deflection_m: npt.ArrayLike, params: HoldParams | None = None
) -> tuple[Hold, ...]:
    """Find the holds in a measured deflection where no load channel says them.

    Parameters
    ----------
    time_ns
        Instants, shape (n,), nanoseconds since 1970 UTC, rising.
    deflection_m
        Position or deflection of one section, shape (n,) or (n, 3); the component that moves most
        is used. NaN where it was not measured.
    params
        What counts as a hold.

    Returns
    -------
    tuple of Hold
        In time order, without load; labels are shares of the largest deflection from the first
        hold, ``~40 %``, and ``0 %`` where the blade is back.
    """
    params = params or HoldParams()
    times, values = _clean(time_ns, _largest_component(deflection_m), "deflection_m")
    levels = _plateaus(times, values, params)
    first = levels[0][2] if levels else 0.0
    moved = np.array([level - first for _, _, level in levels])
    largest = moved[np.argmax(np.abs(moved))] if moved.size else 0.0
    shares = (100.0 * moved / largest if largest else moved).tolist()
    labels = _labels(shares, params.same_level_percent, "~")
    return tuple(
        Hold(int(times[a]), int(times[b]), label, None)
        for (a, b, _), label in zip(levels, labels, strict=True)
    )


def steps_at(holds: Sequence[Hold], time_ns: npt.ArrayLike) -> list[str | None]:
    """Return the load step of each instant, null between holds (column ``step``)."""
    times = np.asarray(time_ns, dtype=np.int64)
    steps = np.full(times.shape, None, dtype=object)
    for hold in holds:
        steps[hold.contains(times)] = hold.label
    found: list[str | None] = steps.tolist()
    return found


def percent_of_highest_hold(
    time_ns: npt.ArrayLike, force: npt.ArrayLike, params: HoldParams | None = None
) -> Floats:
    """Turn a load in any unit into percent of its highest hold, shape (n,).

    Raises
    ------
    InvalidValueError
        If the load never stands still away from zero, so that nothing is 100 %.
    """
    times, values = _clean(time_ns, force, "force")
    levels = [level for _, _, level in _plateaus(times, values, params or HoldParams())]
    full = max(levels, key=abs, default=0.0)
    if full == 0.0:
        raise InvalidValueError(
            "the load has no hold away from zero",
            code="load.no_hold",
            hint="give the load in percent, or name the holds",
        )
    return 100.0 * np.asarray(force, dtype=np.float64) / full


def _clean(time_ns: npt.ArrayLike, values: npt.ArrayLike, name: str) -> tuple[Times, Floats]:
    """Check a pair of columns and leave out the instants that have no value."""
    times = np.asarray(time_ns, dtype=np.int64)
    numbers = np.asarray(values, dtype=np.float64)
    if times.ndim != 1 or numbers.shape != times.shape:
        raise InvalidValueError(
            f"{name} has shape {numbers.shape}, time_ns {times.shape}; expected the same (n,)"
        )
    if np.any(np.diff(times) <= 0):
        row = int(np.argmax(np.diff(times) <= 0)) + 1
        raise InvalidValueError(f"time_ns does not rise at row {row}")
    known = np.isfinite(numbers)
    return times[known], numbers[known]


def _largest_component(deflection_m: npt.ArrayLike) -> Floats:
    values = np.asarray(deflection_m, dtype=np.float64)
    if values.ndim != 2:
        return values
    spans = [_span(column) for column in values.T]
    return values[:, int(np.argmax(spans))]


def _span(column: Floats) -> float:
    known = column[np.isfinite(column)]
    return float(np.ptp(known)) if known.size else 0.0


def _plateaus(times: Times, values: Floats, params: HoldParams) -> list[tuple[int, int, float]]:
    """First index, last index and level of every hold, margins taken off."""
    if times.size < 3:
        return []
    seconds = (times - times[0]) * 1e-9
    noise = _noise(values)
    runs, margin_s = [(0, times.size - 1)], 0.0
    if _span(values) > 2.0 * _LEVEL_SIGMAS * noise:
        window_s, still = _still(seconds, values, noise, params)
        same = params.same_level_percent / 100.0 * _span(values)
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


def _labels(levels: Sequence[float], same: float, about: str) -> list[str]:
    """Names of load steps in time order; a level that comes again is counted."""
    known: list[tuple[float, str, int]] = []
    labels = []
    for level in levels:
        place = next((k for k, seen in enumerate(known) if abs(seen[0] - level) <= same), None)
        if place is None:
            known.append((level, _percent(level, about), 1))
            labels.append(known[-1][1])
        else:
            first, name, count = known[place]
            known[place] = (first, name, count + 1)
            labels.append(f"{name} ({count + 1})")
    return labels


def _percent(level: float, about: str) -> str:
    whole = round(level)
    return f"{about if whole else ''}{whole} %"
