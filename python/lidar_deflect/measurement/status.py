"""Step 12 and honesty: how good each row is, and which overhead rows are filled in time."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from lidar_deflect.measurement.states import (
    DEGRADED,
    EXTRAPOLATED,
    INTERPOLATED,
    MISSING,
    OK,
)

if TYPE_CHECKING:
    from numpy.typing import NDArray

    Floats = NDArray[np.float64]
    Bools = NDArray[np.bool_]

FEW_POINTS = 0.5
"""Fewer points than this share of the reference's: `degraded`."""

BEYOND_M = 1.0
"""A section farther than this from the scan lines on the blade is `extrapolated`."""


STRETCH = 0.02
"""A section farther from the root than its arc length by this share of it is impossible."""


@dataclass(frozen=True)
class Uses:
    """What became of each lidar's points, all of shape (t, lidars).

    Attributes
    ----------
    present
        Whether the lidar gave a sweep.
    lost
        Whether packets were lost where it saw the blade.
    overhead
        Whether its points were left out because the blade was overhead.
    used
        Points used.
    """

    present: Bools
    lost: Bools
    overhead: Bools
    used: NDArray[np.uint32]


def grade_frames(
    uses: Uses, failure: NDArray[np.object_], reference_points: Floats
) -> tuple[NDArray[np.uint8], NDArray[np.object_]]:
    """Status and reason of each frame, shapes (t,), before sections are looked at.

    Parameters
    ----------
    failure
        Name of what kept the frame from a result, shape (t,), else None.
    reference_points
        Points of each lidar in the unloaded state, shape (lidars,).
    """
    expected = reference_points > 0
    absent = (uses.used == 0) & expected
    few = uses.used.sum(axis=1) < FEW_POINTS * reference_points.sum()
    cases = (
        (few, "few_points"),
        (absent.any(axis=1), "no_points"),
        ((uses.lost & expected).any(axis=1) | (~uses.present & expected).any(axis=1), "lost"),
        ((uses.overhead & expected).any(axis=1), "overhead"),
    )
    status = np.full(len(failure), OK, dtype=np.uint8)
    reason = np.full(len(failure), None, dtype=object)
    for applies, name in cases:  # the later ones explain the earlier ones
        status[applies], reason[applies] = DEGRADED, name
    failed = np.array([name is not None for name in failure], dtype=bool)
    status[failed] = MISSING
    unexplained = failed & ~uses.overhead.any(axis=1)
    reason[unexplained] = failure[unexplained]
    return status, reason


def extrapolate(
    status: NDArray[np.uint8], reason: NDArray[np.object_], z_m: Floats, seen_z_m: Floats
) -> None:
    """Mark sections before the first or beyond the last scan line, in place.

    Parameters
    ----------
    status, reason
        Shape (t, s).
    z_m
        Sections along the span, shape (t, s).
    seen_z_m
        First and last scan line on the blade, shape (t, 2).
    """
    measured = status != MISSING
    before = measured & (z_m < seen_z_m[:, :1] - BEYOND_M)
    beyond = measured & (z_m > seen_z_m[:, 1:] + BEYOND_M)
    status[before | beyond] = EXTRAPOLATED
    reason[before] = "before_first_line"
    reason[beyond] = "beyond_last_line"


def refuse_stretched(
    status: NDArray[np.uint8], reason: NDArray[np.object_], position_m: Floats, s_m: Floats
) -> None:
    """Refuse sections that only a stretched blade could reach, in place.

    The root is the origin, and no point of a blade is farther from it than its arc length.

    Parameters
    ----------
    status, reason, position_m
        Shapes (t, s), (t, s), (t, s, 3).
    s_m
        Arc lengths of the sections, shape (s,).
    """
    stretched = np.linalg.norm(position_m, axis=2) > (1.0 + STRETCH) * s_m
    status[stretched] = MISSING
    reason[stretched] = "stretched"
    position_m[stretched] = np.nan


def interpolate(
    time_ns: NDArray[np.int64],
    position_m: Floats,
    status: NDArray[np.uint8],
    reason: NDArray[np.object_],
) -> None:
    """Fill overhead rows linearly in time between measured ones, in place (step 12).

    Rows before the first or after the last measured state stay missing.

    Parameters
    ----------
    position_m, status, reason
        Shapes (t, s, 3), (t, s), (t, s).
    """
    for section in range(status.shape[1]):
        known = np.flatnonzero(status[:, section] != MISSING)
        wanted = (status[:, section] == MISSING) & (reason[:, section] == "overhead")
        if known.size < 2:
            continue
        wanted[: known[0]] = False
        wanted[known[-1] :] = False
        for axis in range(3):
            position_m[wanted, section, axis] = np.interp(
                time_ns[wanted], time_ns[known], position_m[known, section, axis]
            )
        status[wanted, section] = INTERPOLATED
