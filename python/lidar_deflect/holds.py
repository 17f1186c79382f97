"""Load steps: the holds of a static test, from a load channel or from the measured deflection."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from lidar_deflect.errors import InvalidValueError
from lidar_deflect.plateaus import Floats, HoldParams, Times, plateaus, span


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
    levels = plateaus(times, values, params)
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
    levels = plateaus(times, values, params)
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
    levels = [level for _, _, level in plateaus(times, values, params or HoldParams())]
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
    spans = [span(column) for column in values.T]
    return values[:, int(np.argmax(spans))]


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
