"""Cells of one lidar that lie on static surfaces, and how high above them its echoes are."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np

from lidar_deflect import _native
from lidar_deflect.drift.change import Change, estimate

if TYPE_CHECKING:
    from collections.abc import Sequence

    from numpy.typing import NDArray

    from lidar_deflect.capture import Sweep
    from lidar_deflect.measurement.unloaded import HoldCloud

    Floats = NDArray[np.float64]

STEP_DEG = 0.5
"""Echoes are added up in azimuth cells of this size, per channel."""

NEAR_M = 0.4
"""Cells within this distance of a surface are taken to lie on it."""

GATE_M, GATE_RAD = 0.06, 0.006
"""Echoes farther from their cell's height (this, and this by the range) are something else."""

PATCH_M = 1.5
"""Size of patches of a surface whose roughness is taken to be independent."""

MIN_SEEN, MIN_ECHOES, MIN_CELLS = 4, 3, 60
"""Echoes of a cell in the reference and in a window; cells that a pose can be told from."""

ROUGH = 3.0
"""Cells that scatter this many times more than the median hold more than one thing."""

FLOOR_M = 5e-4
"""Added to the scatter of every mean: what does not average out."""

TURN = round(360 / STEP_DEG)
MAX_RING = 1023
"""Channels beyond share their cells, which then are too rough to be watched."""

GRID = (STEP_DEG, TURN, MAX_RING)
"""How echoes fall into cells: channel, then azimuth."""


@dataclass(frozen=True)
class Plane:
    """A static surface: `normal . x = offset_m`, world frame, out to `half_m` of `centre_m`."""

    normal: Floats
    offset_m: float
    centre_m: Floats
    half_m: float


@dataclass(frozen=True)
class Cells:
    """Static cells of one lidar: all arrays by cell but the last two, which go by plane.

    Attributes
    ----------
    plane
        Number of the plane that a cell lies on, -1 for none.
    ray_m
        Mean ray in the reference, world axes, shape (cells, 3).
    height_m, sigma_m, count
        Mean height of its echoes above the plane in the reference, their scatter and number.
    normals
        Of the planes, world axes, shape (planes, 3).
    offsets_m
        Of the planes along their normals, world frame, shape (planes,).
    pose
        World from sensor in the reference, shape (4, 4).
    """

    plane: NDArray[np.intp]
    ray_m: Floats
    height_m: Floats
    sigma_m: Floats
    count: NDArray[np.intp]
    normals: Floats
    offsets_m: Floats
    pose: Floats

    @classmethod
    def of(cls, cloud: HoldCloud, pose: Floats, planes: Sequence[Plane]) -> Cells:
        """Find the static cells of a reference hold, seen from `pose` (world from sensor)."""
        key = keys(cloud)
        size = (int(key.max(initial=0)) // TURN + 1) * TURN
        count, sums = _native.cell_positions(key, np.ascontiguousarray(cloud.xyz), size)
        mean = np.ascontiguousarray(sums.T) / np.maximum(count, 1)[:, None]
        ray = mean @ pose[:3, :3].T
        normals = np.array([plane.normal for plane in planes])
        offsets = np.array([plane.offset_m for plane in planes])
        plane = np.where(count < MIN_SEEN, -1, _plane_of(ray + pose[:3, 3], planes))
        start = np.zeros(size)
        cells = cls(plane, ray, start, start, count, normals, offsets, pose)
        for gate_m in (NEAR_M, 0.0):  # about the plane, then about that mean: movers drop out
            sums_ = Sums(cells, wider_m=gate_m)
            sums_.add(key, cloud.xyz)
            cells = sums_.as_reference()
        return cells._without_rough()

    def _without_rough(self) -> Cells:
        """Leave out cells that hold more than one thing."""
        known = self.sigma_m[self.plane >= 0]
        limit = ROUGH * float(np.median(known)) if len(known) else 0.0
        return replace(self, plane=np.where(self.sigma_m > limit, -1, self.plane))

    @cached_property
    def seen(self) -> int:
        """How many cells can be watched."""
        return int((self.plane >= 0).sum())

    def watches(self, key: NDArray[np.uint32]) -> NDArray[np.bool_]:
        """Tell which cells are watched, by their numbers, shape (n,)."""
        inside = key < len(self.plane)
        return np.asarray(inside & (self.plane[np.where(inside, key, 0)] >= 0))

    def away_m(self, cell: NDArray[np.uint32], xyz: NDArray[np.float32], pose: Floats) -> Floats:
        """How far above the reference echoes of watched cells lie, seen from `pose`, metres."""
        plane = self.plane[cell]
        along, beneath = self.seen_from(pose)
        along_x, along_y, along_z = along.T
        x, y, z = xyz.T  # column by column: rows of three are slow in numpy
        height = x * along_x[plane] + y * along_y[plane] + z * along_z[plane] - beneath[plane]
        return np.asarray(height - self.height_m[cell])

    def seen_from(self, pose: Floats) -> tuple[Floats, Floats]:
        """Return normals of the planes in sensor axes, and how far along them the planes lie."""
        return self.normals @ pose[:3, :3], self.offsets_m - self.normals @ pose[:3, 3]

    @cached_property
    def patch(self) -> NDArray[np.intp]:
        """Number of the patch that each cell lies on, by plane and then place, shape (cells,)."""
        place = np.floor(self.ray_m / PATCH_M).astype(np.intp)
        patch = np.column_stack([self.plane, place])
        patch -= patch.min(axis=0)
        number = np.ravel_multi_index(tuple(patch.T), tuple(patch.max(axis=0) + 1))
        return np.asarray(np.unique(number, return_inverse=True)[1], dtype=np.intp).ravel()

    @cached_property
    def gate_m(self) -> Floats:
        """How far from its cell's height an echo may lie, shape (cells,)."""
        return np.asarray(GATE_M + GATE_RAD * np.linalg.norm(self.ray_m, axis=1))


class Sums:
    """Heights of one stretch of time as seen from one pose, added up by cell."""

    def __init__(
        self, cells: Cells, pose: Floats | None = None, wider: float = 1.0, wider_m: float = 0.0
    ) -> None:
        size = len(cells.plane)
        self._cells = cells
        self._pose = cells.pose if pose is None else pose
        self._gate_m = np.maximum(wider * cells.gate_m, wider_m)
        self._count = np.zeros(size, dtype=np.intp)
        self._sum, self._squares = np.zeros(size), np.zeros(size)

    def add(self, cell: NDArray[np.uint32], xyz: NDArray[np.float32]) -> None:
        """Add echoes; those of cells that are not watched do not count."""
        own, xyz = self._cells, np.ascontiguousarray(xyz)
        along, beneath = own.seen_from(self._pose)
        count, sums, squares = _native.cell_heights(
            np.ascontiguousarray(cell), xyz, own.plane, own.height_m, self._gate_m, along, beneath
        )
        self._count += count
        self._sum += sums
        self._squares += squares

    def as_reference(self) -> Cells:
        """Return the cells with these heights as those of the reference."""
        count = np.maximum(self._count, 1)
        mean = self._sum / count
        spread = np.sqrt(np.maximum(self._squares / count - mean**2, 0.0))
        plane = np.where(self._count < MIN_SEEN, -1, self._cells.plane)
        height = self._cells.height_m + mean
        return replace(self._cells, plane=plane, height_m=height, sigma_m=spread, count=self._count)

    @property
    def seen(self) -> int:
        """How many cells were seen."""
        return int(((self._count >= MIN_ECHOES) & (self._cells.plane >= 0)).sum())

    def change(self) -> Change | None:
        """Change since the pose seen from; None where too few cells were seen."""
        cells = self._cells
        seen = np.flatnonzero((self._count >= MIN_ECHOES) & (cells.plane >= 0))
        if len(seen) < MIN_CELLS:
            return None
        typical = float(np.median(cells.sigma_m[seen]))
        scatter = np.maximum(cells.sigma_m[seen], 0.5 * typical)
        variance = scatter**2 * (1.0 / self._count[seen] + 1.0 / cells.count[seen])
        height = self._sum[seen] / self._count[seen]
        normal = cells.normals[cells.plane[seen]]
        sigma = np.sqrt(variance + FLOOR_M**2)
        return estimate(cells.ray_m[seen], normal, height, sigma, patches(cells, seen))


def patches(cells: Cells, seen: NDArray[np.intp]) -> NDArray[np.intp]:
    """Tell on which patch each cell lies, by number: roughness is alike within one."""
    own = cells.patch[seen]
    is_there = np.zeros(int(own.max(initial=-1)) + 1, dtype=np.intp)
    is_there[own] = 1
    return np.asarray((np.cumsum(is_there) - 1)[own], dtype=np.intp)


def keys(echoes: HoldCloud | Sweep) -> NDArray[np.uint32]:
    """Cell of every echo: channel, then azimuth."""
    return _native.echo_cells(
        np.ascontiguousarray(echoes.ring), np.ascontiguousarray(echoes.azimuth_deg), GRID
    )


def _plane_of(points_m: Floats, planes: Sequence[Plane]) -> NDArray[np.intp]:
    """Nearest plane of each point within `NEAR_M` of it, else -1."""
    away = np.stack([_away(points_m, plane) for plane in planes], axis=1)
    return np.where(away.min(axis=1) < NEAR_M, away.argmin(axis=1), -1)


def _away(points_m: Floats, plane: Plane) -> Floats:
    height = np.abs(points_m @ plane.normal - plane.offset_m)
    inside = np.linalg.norm(points_m - plane.centre_m, axis=1) < plane.half_m
    return np.where(inside, height, np.inf)
