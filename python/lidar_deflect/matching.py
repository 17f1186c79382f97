"""Channels of other instruments brought onto the clock of the lidars, and what was found said."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from lidar_deflect import clocks, instruments
from lidar_deflect.measurement.motion import blade_motion
from lidar_deflect.measurement.states import DEGRADED

if TYPE_CHECKING:
    from collections.abc import Mapping
    from pathlib import Path

    from lidar_deflect.channels import Channel
    from lidar_deflect.clocks import Floats, Shift, Times
    from lidar_deflect.measurement import Inputs, States
    from lidar_deflect.opened import OpenedTest


@dataclass(frozen=True)
class Match:
    """What the data say of the clock of one file.

    Attributes
    ----------
    channel
        The channel that told it.
    shift
        The estimate; None where nothing moved enough, or the readings do not follow the blade.
    """

    file: Path
    channel: str
    shift: Shift | None

    @property
    def applied_s(self) -> float:
        """Seconds added to the file's times: none where the clocks agree well enough."""
        return self.shift.seconds if self.shift is not None and self.shift.differs else 0.0

    def facts(self) -> dict[str, Any]:
        """Entry of ``channel_clocks`` in run.json."""
        found: dict[str, Any] = {"file": self.file.name, "channel": self.channel}
        if self.shift is not None:
            found |= {"shift_s": self.shift.seconds, "u_s": self.shift.u_s}
            found["explained"] = self.shift.explained
        return found | {"applied_s": self.applied_s, "text": self.text()}

    def text(self) -> str:
        """Say it in one sentence."""
        name = f"the clock of {self.file.name} ({self.channel})"
        if self.shift is None:
            return f"{name} could not be held against that of the lidars; it was taken as it is"
        if not self.applied_s:
            return f"{name} agrees with that of the lidars to {_about(self.shift)}"
        seconds, u = self.shift.seconds, self.shift.u_s
        late = "behind" if seconds > 0.0 else "ahead of"
        return (
            f"{name} is {abs(seconds):.3f} s {late} that of the lidars (u = {u:.3f} s, from the "
            f"data); its times were moved by {seconds:+.3f} s"
        )


def _about(shift: Shift) -> str:
    return f"{max(abs(shift.seconds), 2.0 * shift.u_s):.2f} s"


def match(opened: OpenedTest, inputs: Inputs, states: States) -> tuple[Match, ...]:
    """Estimate the shift of every file whose clock the configuration leaves to the data.

    The states tell it to within half a turn of a lidar; where clocks differ, the echoes of one
    lidar, each with its own instant, tell it to some milliseconds.
    """
    files = instruments.unsettled_files(opened.config)
    if not files:
        return ()
    times, values = _outermost(states)
    motion = _Motion(opened, inputs, states)
    return tuple(_one(file, _of(opened, file), times, values, motion) for file in files)


def _outermost(states: States) -> tuple[Times, Floats]:
    """Deflection of the outermost section at the moments at which it was measured."""
    place = int(np.argmax(states.s_m))
    seen = states.status[:, place] <= DEGRADED
    moved = states.position_m[:, place] - states.reference_m[place]
    return states.time_ns[seen], moved[seen]


def _of(opened: OpenedTest, file: Path) -> list[Channel]:
    """Every channel of a file, as it is written."""
    config = opened.config
    found: list[Channel] = []
    if config.load.file == file and opened.load is not None:
        found.append(opened.load)
    named = {wire.name for wire in config.wires if wire.file == file}
    if named:
        found += [each for each in opened.wires if each.name in named]
    if config.root is not None and config.root.file == file:
        found += opened.root
    other = {each.name for each in config.channels if each.file == file}
    if other:
        found += [each for each in opened.others if each.name in other]
    return found


class _Motion:
    """Motion of the blade from the echoes of one lidar; read once, when it is first asked for."""

    def __init__(self, opened: OpenedTest, inputs: Inputs, states: States) -> None:
        self._given = (opened.capture, inputs.calibration, states)
        self._found: tuple[Times, Floats] | None = None

    def __call__(self) -> tuple[Times, Floats]:
        if self._found is None:
            self._found = blade_motion(*self._given)
        return self._found


def _one(file: Path, given: list[Channel], times: Times, values: Floats, motion: _Motion) -> Match:
    rough = _surest(given, times, values)
    if rough is None:
        return Match(file, ", ".join(each.name for each in given), None)
    name, shift = rough
    if shift.differs:
        finer = _surest([each for each in given if each.name == name], *motion())
        if finer is not None and abs(finer[1].seconds - shift.seconds) < clocks.APPLIED_S:
            shift = finer[1]
    return Match(file, name, shift)


def _surest(given: list[Channel], times: Times, values: Floats) -> tuple[str, Shift] | None:
    """Return the channel with the smallest uncertainty: those of one file share a clock."""
    if not times.size:
        return None
    found = [(each.name, clocks.estimate(each, times, values)) for each in given]
    known = [(name, shift) for name, shift in found if shift is not None]
    return min(known, key=lambda each: each[1].u_s, default=None)


def shifts_of(matches: tuple[Match, ...]) -> Mapping[Path, float]:
    """Return seconds to add to the times of each file."""
    return {each.file: each.applied_s for each in matches if each.applied_s}
