"""Echoes of one stretch of time, thinned to what a pose is told from."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from lidar_deflect.drift.cells import keys

if TYPE_CHECKING:
    from collections.abc import Iterable, Sequence

    from numpy.typing import NDArray

    from lidar_deflect.capture import Sweep
    from lidar_deflect.drift.cells import Cells

MOST = 1_000_000
"""So many echoes of a stretch are kept: more take memory and tell little more."""


@dataclass(frozen=True)
class Echoes:
    """Echoes on watched cells.

    Attributes
    ----------
    cell, xyz
        Number of the cell, place in the sensor frame: shapes (n,), (n, 3).
    """

    cell: NDArray[np.uint32]
    xyz: NDArray[np.float32]

    @classmethod
    def thinned(cls, cell: NDArray[np.uint32], xyz: NDArray[np.float32]) -> Echoes:
        """At most `MOST` of these."""
        every = max(1, len(cell) // MOST)
        return cls(cell[::every], xyz[::every])


@dataclass(frozen=True)
class Kept(Echoes):
    """The same with the instant of each, shape (n,)."""

    time_ns: NDArray[np.int64]

    @classmethod
    def of(cls, sweep: Sweep, cells: Cells) -> Kept:
        """Keep the echoes of a sweep that fall into watched cells."""
        cell = keys(sweep)
        return cls(cell, sweep.xyz, sweep.time_ns)._where(cells.watches(cell))

    @classmethod
    def joined(cls, parts: Sequence[Kept]) -> Kept:
        """Echoes of several sweeps as one, at most `MOST` of them."""
        every = max(1, sum(len(part.time_ns) for part in parts) // MOST)
        columns = zip(*((p.cell, p.xyz, p.time_ns) for p in parts), strict=True)
        return cls(*(np.concatenate(column)[::every] for column in columns))

    @classmethod
    def read(cls, sweeps: Iterable[Sweep], cells: Cells) -> Kept | None:
        """Echoes of all sweeps, None without any."""
        parts = [cls.of(sweep, cells) for sweep in sweeps]
        return cls.joined(parts) if parts else None

    def since(self, time_ns: int) -> Kept:
        """Echoes from an instant on."""
        return self._where(self.time_ns >= time_ns)

    def _where(self, kept: NDArray[np.bool_]) -> Kept:
        return Kept(self.cell[kept], self.xyz[kept], self.time_ns[kept])
