"""Standard uncertainties of positions, deflections and twist, from one joint covariance."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from lidar_deflect.measurement.beam.adjustment import Solved

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

    def change_variance_m2(self, hold: int, along: Floats) -> float:
        """Variance of the sum of the sections' changes since the first hold by weights (s, 3)."""

        def both(one: int, other: int) -> float:
            block = self.covariance[one, :, :3, other, :, :3]
            return float(np.einsum("si,sitj,tj", along, block, along))

        return both(hold, hold) + both(0, 0) - 2.0 * both(hold, 0)


@dataclass(frozen=True)
class Spreads:
    """How well the sections are known at every moment.

    Attributes
    ----------
    position_m2, deflection_m2
        Covariance of x, y, z and of their change since the hold with least load,
        shape (t, s, 3, 3).
    twist_rad2
        Variance of the twist change, shape (t, s).
    """

    position_m2: Floats
    deflection_m2: Floats
    twist_rad2: Floats

    @classmethod
    def empty(cls, moments: int, sections: int) -> Spreads:
        """Nothing is known yet."""
        block = (moments, sections, 3, 3)
        return cls(np.full(block, np.nan), np.full(block, np.nan), np.full(block[:2], np.nan))

    def put(self, inside: NDArray[np.intp], rows: Floats) -> None:
        """Take the rows of the compiled core, shape (len(inside) * s, 13), for some moments."""
        shape = (len(inside), *self.twist_rad2.shape[1:])
        at = rows.reshape(*shape, 13)
        self.position_m2[inside] = _matrices(at[..., :6])
        self.deflection_m2[inside] = _matrices(at[..., 6:12])
        self.twist_rad2[inside] = at[..., 12]


PLACES = ((0, 0), (1, 1), (2, 2), (0, 1), (0, 2), (1, 2))
"""Places of the columns of the compiled core in a symmetric matrix."""


def _matrices(columns: Floats) -> Floats:
    matrices = np.empty((*columns.shape[:-1], 3, 3))
    for k, (i, j) in enumerate(PLACES):
        matrices[..., i, j] = matrices[..., j, i] = columns[..., k]
    return matrices


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


def over_time(spreads: Spreads, kept_m2: Floats | None, deflection_m: Floats) -> Uncertainty:
    """Give the standard uncertainties of every moment.

    Parameters
    ----------
    kept_m2
        Covariance of a reference position from elsewhere, shape (s, 3, 3); None where it is that of
        the hold with least load.
    deflection_m
        Shape (t, s, 3).
    """
    moved = spreads.deflection_m2 if kept_m2 is None else spreads.position_m2 + kept_m2
    unit = deflection_m / np.maximum(np.linalg.norm(deflection_m, axis=2, keepdims=True), 1e-9)
    total = np.einsum("tsi,tsij,tsj->ts", unit, moved, unit)
    return Uncertainty(
        np.sqrt(np.diagonal(spreads.position_m2, axis1=2, axis2=3)),
        np.sqrt(np.maximum(np.diagonal(moved, axis1=2, axis2=3), 0.0)),
        np.sqrt(np.maximum(total, 0.0)),
        np.sqrt(spreads.twist_rad2),
    )
