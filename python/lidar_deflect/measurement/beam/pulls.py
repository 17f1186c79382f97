"""Pulls: by how much the data moved what was known beforehand, against how much they could."""

from __future__ import annotations

from math import log, sqrt
from typing import TYPE_CHECKING

import numpy as np

from lidar_deflect.measurement.states import Check

if TYPE_CHECKING:
    from collections.abc import Iterator, Sequence

    from numpy.typing import NDArray

ONE = 2.0
"""Largest pull of a single unknown that is no warning."""
CONTRADICTS = 6.0
"""No luck explains a pull beyond this: it is no warning any more."""
TOLD = 0.95
"""An unknown whose deviation the data left above this share of what it was tells nothing."""


def pulls(names: Sequence[str], values: NDArray[np.float64]) -> Iterator[Check]:
    """Give the largest pull of each group of unknowns.

    One beyond its limit is a warning, one beyond `CONTRADICTS` a contradiction.

    Parameters
    ----------
    names, values
        Group of every unknown; change by the data, deviation before and after, shape (n, 3).
    """
    change, before, after = values.T
    told = after < TOLD * before
    pull = change / np.sqrt(np.maximum(before**2 - after**2, 1e-300))
    groups = np.array(names)
    for name in dict.fromkeys(names):
        own = pull[(groups == name) & told]
        if own.size:
            worst = float(own[np.argmax(np.abs(own))])
            limit = limit_of(own.size)
            yield Check(
                f"largest pull of {name.replace('_', ' ')}",
                f"{worst:+.1f}",
                f"{limit:.1f} of {own.size}",
                abs(worst) <= limit,
                only_warns=abs(worst) <= CONTRADICTS,
            )


def limit_of(count: int) -> float:
    """Return what the largest of `count` normal pulls passes about as rarely as a single one 2."""
    return sqrt(ONE**2 + 2.0 * log(count))
