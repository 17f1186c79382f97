"""In which steps an adjustment brings the blade from metres away to its place."""

from __future__ import annotations

from dataclasses import dataclass

Step = tuple[float, float, str]
"""Gates of echoes along and of edges across the ray, metres, and what may change."""

LAST = (0.05, 0.05)
"""Gates of the last steps, in which everything may change."""
SETTLED = 0.05
"""An unknown that moves by less than this share of its prior deviation has settled."""
NEAR = 0.3
"""A blade that still moves by more than this share of the next gate is not yet within it ..."""
PATIENCE = 8
"""... and so many steps are taken before the gate closes all the same."""


@dataclass(frozen=True)
class Schedule:
    """Gates that close one after the other as the blade comes to rest, then steps with the last.

    Attributes
    ----------
    first
        With what steps are taken, in this order.
    more
        How many steps may follow with the last gates until nothing moves any more.
    skips
        Whether stages are left out that let the same change as the last one, in which the blade
        already moved by less than what comes behind them asks for.
    """

    first: tuple[Step, ...]
    more: int
    skips: bool = False

    def at(self, stage: int) -> Step:
        """Return what a step is taken with; `stage` counts from 0."""
        return self.first[stage] if stage < len(self.first) else (*LAST, "all")

    def is_near(self, stage: int, moved_m: float) -> bool:
        """Whether a blade that moved so far in a step can go on to the next stage."""
        return moved_m < NEAR * self.at(stage + 1)[0]

    def after(self, stage: int, moved_m: float) -> int:
        """Return the stage that follows one in which a blade moved so far at last."""
        following = stage + 1
        while (
            self.skips
            and following < len(self.first) - 1
            and self.at(following)[2] == self.at(stage)[2]
            and self.is_near(following, moved_m)
        ):
            following += 1
        return following


def _stage(name: str, *gates_m: tuple[float, float]) -> tuple[Step, ...]:
    return tuple((echo_m, edge_m, name) for echo_m, edge_m in gates_m)


_LOADS = _stage("loads", (3.0, 2.0), (2.0, 1.5), (1.5, 1.0))
_BLADE = _stage("blade", (1.0, 1.0), (0.6, 0.6), (0.3, 0.4), (0.2, 0.2))
DRAWN = Schedule((*_LOADS, *_BLADE, *_stage("all", (0.1, 0.1), LAST)), 14, skips=True)
"""For a blade with a drawing."""

_FAR = _stage("loads", *[(6.0, 5.0)] * 4, (4.0, 3.0))
_NEAR = [*[(0.5, 0.5)] * 6, *[(0.3, 0.3)] * 4, *[(0.2, 0.2)] * 8, *[(0.1, 0.1)] * 8]
UNDRAWN = Schedule((*_FAR, *_LOADS, *_stage("all", *_NEAR)), 40)
"""Where no drawing tells prebend and surface: a blade alone would bend to fit the surface."""
