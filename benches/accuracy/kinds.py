"""What is tested: blade x load case x sensors x yard x nuisances, with seeds fixed beforehand.

Two lists that share no seed: `development`, which may be looked at while the estimator is worked
on, and `verification`, which is run to be reported.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

Split = Literal["development", "verification"]
Load = Literal["edge", "flap", "small"]
Yard = Literal["wall", "targets", "bent", "bare"]
Level = Literal["calm", "usual", "hard"]

FIRST_SEED: dict[Split, int] = {"development": 1_000_000, "verification": 2_000_000}


@dataclass(frozen=True)
class Kind:
    """Tests that are judged together."""

    load: Load
    sensors: tuple[str, ...]

    @property
    def name(self) -> str:
        """Load case and sensors, as tables have it."""
        models = sorted(set(self.sensors), key=self.sensors.index)
        return f"{self.load} {'+'.join(models)}"


@dataclass(frozen=True)
class Case:
    """One simulated test."""

    number: int
    split: Split
    kind: Kind
    blade: str
    yard: Yard
    level: Level

    @property
    def id(self) -> str:
        """Unique among all cases."""
        return f"{self.split[:3]}-{self.number:04d}"

    @property
    def seed(self) -> int:
        """Seed of all that is drawn for it."""
        return FIRST_SEED[self.split] + self.number


def four(model: str) -> tuple[str, ...]:
    """Four sensors of one model."""
    return (model,) * 4


KINDS: tuple[Kind, ...] = (
    Kind("edge", four("vlp16")),
    Kind("flap", four("vlp16")),
    Kind("small", four("vlp16")),
    Kind("edge", four("xt32")),
    Kind("flap", four("xt32")),
    Kind("edge", ("vlp16", "xt32", "vlp16", "xt32")),
    Kind("flap", four("os1-32")),
    Kind("edge", four("vlp32c")),
)
"""In the order of the cases: each comes up once in so many."""

LONG = ("iea15-110m", "drawn", "bar-usc-100m", "iea15-117m", "drawn", "iea22-138m", "drawn")
SHORT = ("nrel5-61m", "drawn-60m")
YARDS: tuple[Yard, ...] = ("wall", "targets", "wall", "bent", "bare")
LEVELS: tuple[Level, ...] = ("usual", "calm", "hard")


def cases(split: Split, count: int) -> list[Case]:
    """Return the first `count` cases of a list; a longer list begins with the shorter one."""
    return [case(split, number) for number in range(count)]


def case(split: Split, number: int) -> Case:
    """Return one case: everything but the kind changes with each round of the kinds."""
    turn, place = divmod(number, len(KINDS))
    kind = KINDS[place]
    blades = SHORT if kind.load == "small" else LONG
    return Case(
        number,
        split,
        kind,
        blades[(turn + 3 * place) % len(blades)],
        YARDS[(turn + 2 * place) % len(YARDS)],
        LEVELS[(turn + place) % len(LEVELS)],
    )


def named(case_id: str) -> Case:
    """Return the case with this id."""
    prefix, _, number = case_id.partition("-")
    split: Split = "development" if prefix == "dev" else "verification"
    return case(split, int(number))
