"""Standard uncertainties of positions, deflections and twist, from the holds' joint covariance."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from lidar_deflect.measurement.beam.adjustment import Solved
    from lidar_deflect.measurement.beam.expected import Expected
    from lidar_deflect.measurement.beam.following import Followed

    Floats = NDArray[np.float64]


@dataclass(frozen=True)
class HoldCovariance:
    """What the adjustment knows of the sections in all holds.

    Attributes
    ----------
    values
        x, y, z (m) and twist change (rad) averaged over each hold, shape (h, s, 4).
    covariance
        Of all of them, shape (h, s, 4, h, s, 4).
    """

    values: Floats
    covariance: Floats

    @classmethod
    def of(cls, solved: Solved, s_m: Floats, gates: tuple[float, float]) -> HoldCovariance:
        """Ask the adjustment."""
        values, covariance = solved.native.sections(s_m.tolist(), *gates)
        holds, sections = len(solved.holds), len(s_m)
        shape = (holds, sections, 4)
        return cls(values.reshape(shape), covariance.reshape(shape + shape))

    def position_variance(self) -> Floats:
        """Variance of x, y, z and twist in each hold, shape (h, s, 4)."""
        holds, sections, _ = self.values.shape
        flat = self.covariance.reshape(holds * sections * 4, -1)
        return np.asarray(np.diag(flat).reshape(holds, sections, 4))

    def deflection_covariance(self, reference: int = 0) -> Floats:
        """Covariance of x, y, z minus those of the reference hold, shape (h, s, 3, 3)."""
        holds, sections, _ = self.values.shape
        found = np.zeros((holds, sections, 3, 3))
        for hold in range(holds):
            for section in range(sections):
                at, rest = (hold, section), (reference, section)
                block = {
                    (a, b): self.covariance[a[0], a[1], :3, b[0], b[1], :3]
                    for a in (at, rest)
                    for b in (at, rest)
                }
                found[hold, section] = (
                    block[at, at] + block[rest, rest] - block[at, rest] - block[rest, at]
                )
        return found


@dataclass(frozen=True)
class Uncertainty:
    """Standard uncertainties over time.

    Attributes
    ----------
    position_m, deflection_m
        Of positions and deflections, shape (t, s, 3).
    total_m, twist_rad
        Of the norm of the deflection and of the twist change, shape (t, s).
    """

    position_m: Floats
    deflection_m: Floats
    total_m: Floats
    twist_rad: Floats


def over_time(
    covariance: HoldCovariance,
    solved: Solved,
    expected: Expected,
    followed: Followed,
    times_ns: NDArray[np.int64],
    deflection_m: Floats,
) -> Uncertainty:
    """Carry the holds' uncertainty to all moments; between holds that of both, and the noise."""
    position, deflection = covariance.position_variance(), covariance.deflection_covariance()
    low, high, share = _between(np.array(solved.shares), expected.at(times_ns))
    inside = followed.in_hold >= 0
    low[inside] = high[inside] = followed.in_hold[inside]
    noise = followed.noise

    def blend(of_holds: Floats) -> Floats:
        weight = share.reshape(-1, *(1,) * (of_holds.ndim - 1))
        return np.asarray(of_holds[low] * (1.0 - weight) + of_holds[high] * weight)

    moved = blend(deflection)
    moved[..., range(3), range(3)] += noise[..., :3]
    unit = deflection_m / np.maximum(np.linalg.norm(deflection_m, axis=2, keepdims=True), 1e-9)
    total = np.einsum("tsi,tsij,tsj->ts", np.nan_to_num(unit), moved, np.nan_to_num(unit))
    at = blend(position) + noise
    return Uncertainty(
        np.sqrt(np.maximum(at[..., :3], 0.0)),
        np.sqrt(np.maximum(np.diagonal(moved, axis1=2, axis2=3), 0.0)),
        np.sqrt(np.maximum(total, 0.0)),
        np.sqrt(np.maximum(at[..., 3], 0.0)),
    )


def _between(shares: Floats, load: Floats) -> tuple[NDArray[np.intp], NDArray[np.intp], Floats]:
    """Find the holds on both sides of each load, and the share of the way between them."""
    order = np.argsort(shares, kind="stable")
    sorted_shares = shares[order]
    above = np.clip(np.searchsorted(sorted_shares, load), 1, max(1, len(shares) - 1))
    if len(shares) == 1:
        zero = np.zeros(len(load), dtype=np.intp)
        return zero, zero.copy(), np.zeros(len(load))
    low, high = order[above - 1], order[above]
    reach = np.maximum(shares[high] - shares[low], 1e-9)
    return low, high, np.clip((load - shares[low]) / reach, 0.0, 1.0)
