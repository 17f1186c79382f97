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
    """Steps that are always taken, and how many at the most until nothing moves any more."""

    first: tuple[Step, ...]
    most: int

    def at(self, step: int) -> Step:
        """Return what a step is taken with; `step` counts from 0."""
        return self.first[step] if step < len(self.first) else (*LAST, "all")


def _stage(name: str, *gates_m: tuple[float, float]) -> tuple[Step, ...]:
    return tuple((echo_m, edge_m, name) for echo_m, edge_m in gates_m)


_LOADS = _stage("loads", (3.0, 2.0), (3.0, 2.0), (2.0, 1.5), (1.5, 1.0))
_BLADE = _stage("blade", *[(1.0, 1.0)] * 2, *[(0.6, 0.6)] * 2, *[(0.3, 0.4)] * 2, (0.2, 0.2))
_DRAWN = (*_LOADS, *_BLADE, *_stage("all", (0.1, 0.1), *[LAST] * 3))
DRAWN = Schedule(_DRAWN, len(_DRAWN) + 12)
"""For a blade with a drawing."""

_FAR = _stage("loads", *[(6.0, 5.0)] * 4, (4.0, 3.0))
_NEAR = [*[(0.5, 0.5)] * 6, *[(0.3, 0.3)] * 4, *[(0.2, 0.2)] * 8, *[(0.1, 0.1)] * 8]
_UNDRAWN = (*_FAR, *_LOADS, *_stage("all", *_NEAR))
UNDRAWN = Schedule(_UNDRAWN, len(_UNDRAWN) + 40)
"""Where no drawing tells prebend and surface: a blade alone would bend to fit the surface."""
