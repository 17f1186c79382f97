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
class Check:
    """One question that a run asks of itself.

    Attributes
    ----------
    name
        What was looked at.
    value, limit
        What was found and how far it may go, as text with units.
    passed
        Whether it holds.
    where
        Hold, lidar, span or time of what was found; empty where it is of all.
    only_warns
        Whether a failure is a warning and no contradiction.
    """

    name: str
    value: str
    limit: str
    passed: bool
    where: str = ""
    only_warns: bool = False

    @property
    def text(self) -> str:
        """One sentence."""
        at = f" ({self.where})" if self.where else ""
        return f"self-check: {self.name}{at}: {self.value}, the limit is {self.limit}"

    def to_dict(self) -> dict[str, Any]:
        """Entry of ``self_check`` in run.json."""
        place = {"where": self.where} if self.where else {}
        kind = {"only_warns": True} if self.only_warns else {}
        found = {"name": self.name, "value": self.value, **place, "limit": self.limit}
        return {**found, "passed": self.passed, **kind}


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
    outline
        Columns of the table of this name, without ``t_s``; empty under a method that has none.
    checks
        What the run asked of itself.
    budget
        What the uncertainty of every section in every hold is made of, for run.json.
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
    outline: Mapping[str, Any] = field(default_factory=dict)
    checks: Sequence[Check] = ()
    budget: Sequence[Mapping[str, Any]] = ()

    @property
    def deflection_m(self) -> Floats:
        """Position minus reference, shape (t, s, 3)."""
        return self.position_m - self.reference_m

    @property
    def farthest_m(self) -> Floats:
        """Deflection of the section that moves most, shape (t, 3); NaN where missing."""
        moved = np.nan_to_num(np.linalg.norm(self.deflection_m, axis=2)).max(axis=0)
        return np.asarray(self.deflection_m[:, int(np.argmax(moved))])
