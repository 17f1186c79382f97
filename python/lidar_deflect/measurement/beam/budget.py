"""What the interval of a section in a hold is made of: noise, registration, edges, surface, ..."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from lidar_deflect.measurement.beam.schedule import LAST

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    from numpy.typing import NDArray

    from lidar_deflect.measurement.beam.adjustment import Solved

VALUES = ("x_m", "y_m", "z_m", "dx_m", "dy_m", "dz_m", "d_m", "twist_deg")
"""What a budget tells of, in the order of the compiled core."""


def budget_of(
    solved: Solved, names: Sequence[str], s_m: NDArray[np.float64]
) -> list[Mapping[str, Any]]:
    """Give standard uncertainties by source for every hold and section.

    Squares of the terms of a value sum up to the square of its standard uncertainty. The change in
    the first hold is zero by definition, so there its position tells more.
    """
    groups, variance = solved.native.budget(s_m.tolist(), *LAST)
    shape = (len(groups), len(solved.holds), len(s_m), len(VALUES))
    u = np.sqrt(np.maximum(variance, 0.0)).reshape(shape)
    u[..., VALUES.index("twist_deg")] = np.degrees(u[..., VALUES.index("twist_deg")])
    return [
        {
            "step": hold.label,
            "section": name,
            "s_m": float(s_m[section]),
            "terms": {
                group: dict(zip(VALUES, map(float, u[place, number, section]), strict=True))
                for place, group in enumerate(groups)
            },
        }
        for number, hold in enumerate(solved.holds)
        for section, name in enumerate(names)
    ]
