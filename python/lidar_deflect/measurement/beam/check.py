"""Whether the data agree with the model, and what on or near the blade did not count."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

if TYPE_CHECKING:
    from collections.abc import Mapping

    from lidar_deflect.holds import Hold
    from lidar_deflect.measurement.beam.adjustment import Solved
    from lidar_deflect.measurement.inputs import Inputs

NOISE_M = 0.03
"""Residuals of a lidar beyond this contradict the model: sensors are less noisy."""
EDGE_STEPS = 0.6
"""Edges that scatter by more steps between shots than this are not those of the blade."""
MEAN_M = 0.006
"""Mean residual of a lidar in a hold beyond this contradicts the model."""
COUNTED = 0.5
"""Fewer of the echoes that meet the model than this share count: the blade lies elsewhere."""
SETTLED = 0.5
"""A last step of more than this share of a prior deviation has not settled."""
OBJECT_M = 1.0
"""Rejected echoes are gathered to objects by so much of the span."""
MIN_ECHOES = 30


def contradictions(inputs: Inputs, solved: Solved) -> list[str]:
    """Say where the data contradict the model, a sentence each; none where they agree."""
    found = []
    if solved.told["largest"] > SETTLED:
        found.append(
            f"the adjustment did not settle: its last step was {solved.told['largest']:.2f} of a "
            "prior deviation"
        )
    lidars = [inputs.lidars[place] for place in inputs.stands]
    for lidar, noise_m in zip(lidars, solved.told["noise_m"], strict=True):
        if noise_m > NOISE_M:
            found.append(f"lidar {lidar}: residuals scatter by {1e3 * noise_m:.0f} mm")
    for hold, told in zip(solved.holds, solved.told["holds"], strict=True):
        found += _of_hold(inputs, hold, told)
    return found


def _of_hold(inputs: Inputs, hold: Hold, told: Mapping[str, Any]) -> list[str]:
    counted, rejected = len(told["residual_m"]), len(told["rejected"]["s_m"])
    name = f"hold {hold.label}"
    if counted < COUNTED * (counted + rejected) or not counted:
        return [f"{name}: {rejected} of {counted + rejected} echoes do not fit the blade"]
    found = []
    steps = np.array([edge[2] for edge in told["edges"]])
    if steps.size and float(np.std(steps)) > EDGE_STEPS:
        found.append(f"{name}: edges scatter by {np.std(steps):.2f} steps between shots")
    for number, lidar in enumerate(inputs.lidars):
        of_lidar = told["residual_m"][told["lidar"] == number]
        if of_lidar.size > MIN_ECHOES and abs(float(np.median(of_lidar))) > MEAN_M:
            found.append(f"{name}, lidar {lidar}: residuals are {1e3 * np.median(of_lidar):.1f} mm")
    return found


def loose_edges(inputs: Inputs, solved: Solved) -> list[str]:
    """Say where echoes end far from the silhouette, so that these edges do not count."""
    lidars = [inputs.lidars[place] for place in inputs.stands]
    sides = ("leading", "trailing")
    return [
        f"hold {solved.holds[hold].label}, lidar {lidars[lidar]}: echoes end "
        f"{1e3 * abs(off):.1f} mrad {'outside' if off > 0 else 'inside'} of the {sides[side]} edge "
        "and do not count"
        for hold, lidar, side, off in solved.native.loose_edges()
    ]


def objects(solved: Solved) -> Mapping[str, Any]:
    """Columns of the table `rejected`: echoes near the blade that do not fit it, by place."""
    rows: list[tuple[int, int, float, Any]] = []
    for span, told in zip(solved.spans_ns, solved.told["holds"], strict=True):
        rejected = told["rejected"]
        place = np.floor(rejected["s_m"] / OBJECT_M).astype(int)
        for here in np.unique(place):
            inside = place == here
            if inside.sum() < MIN_ECHOES:
                continue
            middle = (span[0] + span[1]) // 2
            s_m = float(np.median(rejected["s_m"][inside]))
            centre = np.median(rejected["xyz_m"][inside], axis=0)
            rows.append((middle, int(inside.sum()), s_m, centre))
    return {
        "time": np.array([row[0] for row in rows], dtype=np.int64),
        "reason": ["beside_model"] * len(rows),
        "count": np.array([row[1] for row in rows], dtype=np.uint32),
        "s_m": np.array([row[2] for row in rows]),
        **{f"{axis}_m": np.array([row[3][i] for row in rows]) for i, axis in enumerate("xyz")},
    }
