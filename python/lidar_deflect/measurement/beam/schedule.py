"""In which steps an adjustment brings the blade from metres away to its place."""

from __future__ import annotations

from dataclasses import dataclass

Step = tuple[float, float, str]
"""Gates of echoes along and of edges across the ray, metres, and what may change."""

LAST = (0.05, 0.05)
"""Gates of the last steps, in which everything may change."""
SETTLED = 0.05
"""An unknown that moves by less than this share of its prior deviation has settled."""


@dataclass(frozen=True)
class Schedule:
    """Gates that close one after the other as the blade comes to rest, then steps with the last.

    Attributes
    ----------
    first
        With what steps are taken, in this order.
    more
        How many steps may follow with the last gates until nothing moves any more.
    near
        A blade that still moves by more than this share of the next gate is not yet within it ...
    patience
        ... and so many steps are taken before the gate closes all the same.
    """

    first: tuple[Step, ...]
    more: int
    near: float
    patience: int

    def at(self, stage: int) -> Step:
        """Return what a step is taken with; `stage` counts from 0."""
        return self.first[stage] if stage < len(self.first) else (*LAST, "all")

    def is_over(self, stage: int, steps: int, moved_m: float) -> bool:
        """Whether a stage is, after so many steps the last of which moved the blade so far."""
        is_near = moved_m < self.near * self.at(stage + 1)[0]
        return is_near or steps >= self.patience or stage >= len(self.first)


def _stage(name: str, *gates_m: tuple[float, float]) -> tuple[Step, ...]:
    return tuple((echo_m, edge_m, name) for echo_m, edge_m in gates_m)


_LOADS = _stage("loads", (3.0, 2.0), (2.0, 1.5), (1.5, 1.0))
_BLADE = _stage("blade", (1.0, 1.0), (0.6, 0.6), (0.3, 0.4), (0.2, 0.2))
_ALL = _stage("all", (0.1, 0.1), LAST)
DRAWN = Schedule((*_LOADS, *_BLADE, *_ALL), more=14, near=0.3, patience=8)
"""For a blade with a drawing."""

_FAR = _stage("loads", *[(6.0, 5.0)] * 4, (4.0, 3.0))
_SURFACE = _stage("surface", (1.0, 1.0), (0.6, 0.6), (0.3, 0.4), (0.2, 0.2), (0.1, 0.1))
UNDRAWN = Schedule((*_FAR, *_LOADS, *_SURFACE, *_ALL), more=20, near=0.05, patience=20)
"""Where no drawing tells prebend and surface: a blade alone would bend to fit the surface."""
