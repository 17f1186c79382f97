"""What a method gives: the state of every section at every moment, and what it rests on."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

import numpy as np

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    from numpy.typing import NDArray

    Floats = NDArray[np.float64]

# A status is kept as its index in tables.STATUSES, best first, until it enters a table.
OK, DEGRADED, INTERPOLATED, EXTRAPOLATED, MISSING = range(5)


def joined_names(lidars: Sequence[str], used: NDArray[np.bool_]) -> NDArray[np.object_]:
    """Names such as ``L1+L3`` of the lidars that were used, shape (t,), from marks (t, lidars)."""
    rows = ["+".join(name for name, uses in zip(lidars, row, strict=True) if uses) for row in used]
    return np.array(rows, dtype=object)


@dataclass(frozen=True)
class States:
    """Positions of material sections over time, world frame, metres.

    Attributes
    ----------
    time_ns
        Moments, shape (t,), nanoseconds since 1970 UTC.
    names, s_m
        The sections and their arc lengths from the root, each of length s.
    position_m
        Mid-chord points, shape (t, s, 3); NaN where missing.
    reference_m
        The same in the unloaded state, shape (s, 3).
    n_points, lidars
        Points used, shape (t, s); names of their lidars such as ``L1+L3``, shape (t, s).
    status, reason
        Index into `tables.STATUSES`, shape (t, s), and why it is not ``ok`` (else None).
    blade_points
        Points that counted as blade, shape (t, lidars), in the order of the calibration.
    contour, points, rejected
        Columns of the tables of these names, without ``t_s``.
    u_position_m, u_deflection_m, u_total_m
        Standard uncertainties of position and deflection, shape (t, s, 3), and of the deflection's
        norm, shape (t, s); None under a method that has none.
    twist_deg, u_twist_deg
        Twist change and its standard uncertainty, shape (t, s); None likewise.
    evidence
        What was decided on the way, for run.json.
    warnings
        Sentences for the user.
    failed
        Where the data contradict the method's model: sentences; the run exits with 6.
    """

    time_ns: NDArray[np.int64]
    names: Sequence[str]
    s_m: Floats
    position_m: Floats
    reference_m: Floats
    n_points: NDArray[np.uint32]
    lidars: NDArray[np.object_]
    status: NDArray[np.uint8]
    reason: NDArray[np.object_]
    blade_points: NDArray[np.uint32]
    contour: Mapping[str, Any]
    points: Mapping[str, Any]
    rejected: Mapping[str, Any]
    u_position_m: Floats | None = None
    u_deflection_m: Floats | None = None
    u_total_m: Floats | None = None
    twist_deg: Floats | None = None
    u_twist_deg: Floats | None = None
    evidence: Mapping[str, Any] = field(default_factory=dict)
    warnings: Sequence[str] = ()
    failed: Sequence[str] = ()

    @property
    def deflection_m(self) -> Floats:
        """Position minus reference, shape (t, s, 3)."""
        return self.position_m - self.reference_m

    @property
    def farthest_m(self) -> Floats:
        """Deflection of the section that moves most, shape (t, 3); NaN where missing."""
        moved = np.nan_to_num(np.linalg.norm(self.deflection_m, axis=2)).max(axis=0)
        return np.asarray(self.deflection_m[:, int(np.argmax(moved))])
