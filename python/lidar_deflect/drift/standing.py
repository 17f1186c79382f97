"""Where one lidar stands, window by window: it stays, is knocked, and stands anew."""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING

import numpy as np

from lidar_deflect.drift.cells import Sums
from lidar_deflect.drift.change import Change, moved_by, step_between

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from lidar_deflect.drift.cells import Cells
    from lidar_deflect.drift.echoes import Echoes

    Floats = NDArray[np.float64]

SHARE = 0.6
"""A lidar that sees fewer of its cells than this share is looked for farther off."""

WIDER = (8.0, 3.0, 1.0)
"""How many times wider echoes are accepted then, one after the other."""


@dataclass(frozen=True)
class Seen:
    """What one lidar's window told.

    Attributes
    ----------
    change
        Since the calibration.
    stay
        Number of the stay that it belongs to: 0 as calibrated; -1 where it fits none.
    """

    lidar: str
    start_ns: int
    stop_ns: int
    change: Change
    stay: int


@dataclass
class Stay:
    """A stretch of time in which the lidar stood still.

    Attributes
    ----------
    pose
        World from sensor, shape (4, 4).
    search_ns
        In this span it came there; (0, 0) for the calibrated place.
    covariance
        Of the change since the calibration, shape (6, 6).
    is_sure
        Whether a whole window saw it there.
    """

    pose: Floats
    search_ns: tuple[int, int] = (0, 0)
    covariance: Floats = field(default_factory=lambda: np.zeros((6, 6)))
    is_sure: bool = True


class Standing:
    """Follows one lidar through its windows.

    A window that shows the lidar elsewhere may hold the knock itself; the next one tells where it
    stands now, or that something only passed by.
    """

    def __init__(self, lidar: str, cells: Cells) -> None:
        self.cells = cells
        self.stays = [Stay(cells.pose)]
        self.windows: list[Seen] = []
        self._lidar = lidar
        self._sums: Sums | None = None  # of the present stay, None for the calibrated place
        self._doubt: int | None = None  # number of the window that showed it elsewhere

    def look(self, echoes: Echoes, start_ns: int, stop_ns: int) -> None:
        """Take the next window."""
        found = self._found(echoes)
        if found is None:
            return
        pose, covariance = found
        stay = self.stays[-1]
        elsewhere = Change(step_between(stay.pose, pose), covariance).moved
        number = len(self.stays) - 1
        if elsewhere and self._doubt is not None:
            self._settle(pose, covariance, stop_ns)
            number, elsewhere = number + 1, False
        elif elsewhere:
            self._doubt = len(self.windows)
            number = -1
        else:
            self._doubt = None
        if not elsewhere and self._sums is not None:
            self._sums.add(echoes.cell, echoes.xyz)
        step = step_between(self.cells.pose, pose)
        change = Change(step, covariance)
        self.windows.append(Seen(self._lidar, start_ns, stop_ns, change, number))

    def finish(self) -> None:
        """No more windows will come: a last one that showed it elsewhere is believed."""
        self._close()
        if self._doubt is not None and self._doubt == len(self.windows) - 1:
            last = self.windows[-1]
            pose = moved_by(self.cells.pose, last.change.step)
            search = (self._before_ns(last), last.stop_ns)
            self.stays.append(Stay(pose, search, last.change.covariance, is_sure=False))
            self.windows[-1] = replace(last, stay=len(self.stays) - 1)

    def _settle(self, pose: Floats, covariance: Floats, stop_ns: int) -> None:
        """Begin a new stay with this window; the one before holds the knock."""
        assert self._doubt is not None
        doubted = self.windows[self._doubt]
        self._close()
        self.stays.append(Stay(pose, (self._before_ns(doubted), stop_ns), covariance))
        self.windows[self._doubt] = replace(doubted, stay=len(self.stays) - 1)
        self._sums, self._doubt = Sums(self.cells, pose), None

    def _before_ns(self, doubted: Seen) -> int:
        place = self.windows.index(doubted)
        return self.windows[max(0, place - 1)].start_ns

    def _close(self) -> None:
        """Take what all windows of a stay tell together."""
        change = self._sums.change() if self._sums is not None else None
        if change is not None:
            stay = self.stays[-1]
            stay.pose, stay.covariance = moved_by(stay.pose, change.step), change.covariance
        self._sums = None

    def _found(self, echoes: Echoes) -> tuple[Floats, Floats] | None:
        """Pose in a window, and its covariance; None where too little was seen."""
        pose = self.stays[-1].pose
        sums = Sums(self.cells, pose)
        sums.add(echoes.cell, echoes.xyz)
        change = sums.change()
        if change is not None and not change.moved and sums.seen > SHARE * self.cells.seen:
            return moved_by(pose, change.step), change.covariance
        afar = found_again(self.cells, echoes, pose)
        if afar is not None and (change is None or afar[2] >= sums.seen):
            return afar[:2]
        return None if change is None else (moved_by(pose, change.step), change.covariance)


def found_again(cells: Cells, echoes: Echoes, pose: Floats) -> tuple[Floats, Floats, int] | None:
    """Look for a lidar farther off than a window's gates: pose, covariance, number of cells."""
    found = None
    for wider in WIDER:
        sums = Sums(cells, pose, wider)
        sums.add(echoes.cell, echoes.xyz)
        change = sums.change()
        if change is None:
            return None
        pose = moved_by(pose, change.step)
        found = pose, change.covariance, sums.seen
    return found
