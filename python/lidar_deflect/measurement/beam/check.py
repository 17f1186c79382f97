"""Whether the data agree with the model, and what on or near the blade did not count."""

from __future__ import annotations

from itertools import pairwise
from typing import TYPE_CHECKING, Any

import numpy as np

from lidar_deflect.measurement.beam import whiteness
from lidar_deflect.measurement.beam.drawing import saddles_m
from lidar_deflect.measurement.beam.pulls import pulls
from lidar_deflect.measurement.beam.schedule import LAST
from lidar_deflect.measurement.states import Check

if TYPE_CHECKING:
    from collections.abc import Iterator, Mapping

    from numpy.typing import NDArray

    from lidar_deflect.measurement.beam.adjustment import Solved
    from lidar_deflect.measurement.beam.uncertainty import HoldCovariance
    from lidar_deflect.measurement.inputs import Inputs

    Floats = NDArray[np.float64]

NOISE_M = 0.03
"""Residuals of a lidar beyond this contradict the model: sensors are less noisy."""
CHI_SQUARE = 2.0
"""Mean square of a lidar's residuals in its own deviations; beyond it tails are not noise."""
EDGE_STEPS = 0.6
"""Edges that scatter by more steps between shots than this are not those of the blade."""
EDGES_LOST = 0.4
"""More of the hard edges than this share lie beyond the gate: the silhouette is another one."""
EDGE_DEVIATIONS, EDGE_MEAN_STEPS, EDGE_MEAN_GENERIC_STEPS = 5.0, 0.2, 0.5
"""A group of edges beyond both, deviations of its mean and steps, is not the silhouette; without a
drawing its shape is known less well."""
MEAN_M = 0.006
"""Mean residual of a lidar in a hold beyond this contradicts the model."""
COUNTED = 0.5
"""Fewer of the echoes that meet the model than this share count: the blade lies elsewhere."""
SETTLED = 0.5
"""A last step of more than this share of a prior deviation has not settled."""
DEVIATIONS = 3.0
"""What lies within so many of its own deviations contradicts nothing."""
STRAIN = 5e-4
"""A free axial strain beyond this and its deviations contradicts a blade that keeps its length."""
TURN_BACK_RAD, TURN_BACK_SHARE = 2e-3, 0.02
"""The blade may bend back by so little outboard of the last load, or by this share of its turn: the
middle of a chord that tapers goes back a little where its axis goes on."""
OBJECT_M = 1.0
"""Rejected echoes are gathered to objects by so much of the span."""
MIN_ECHOES = 30
MIN_EDGES = 12
SIDES = ("leading edge", "trailing edge")


def checks(
    inputs: Inputs, solved: Solved, s_m: Floats, covariance: HoldCovariance
) -> tuple[Check, ...]:
    """Hold the data against the model: one line per question, whatever the answer."""
    return (
        _settled(solved),
        *_counted(solved),
        *_noise(inputs, solved),
        *_means(inputs, solved),
        *_white(solved),
        *_edges(inputs, solved),
        *_strain(solved),
        *_turn(inputs, solved, s_m, covariance),
        *pulls(*solved.native.posterior(*LAST)),
    )


def _settled(solved: Solved) -> Check:
    last = float(solved.told["largest"])
    return Check("adjustment settled", f"last step {last:.3f}", f"{SETTLED:g}", last <= SETTLED)


def _counted(solved: Solved) -> Iterator[Check]:
    for hold, told in zip(solved.holds, solved.told["holds"], strict=True):
        counted, rejected = len(told["residual_m"]), len(told["rejected"]["s_m"])
        share = counted / max(counted + rejected, 1)
        yield Check(
            "echoes that fit the blade",
            f"{100.0 * share:.1f} %",
            f"{100.0 * COUNTED:g} % or more",
            share >= COUNTED,
            f"hold {hold.label}",
        )


def _noise(inputs: Inputs, solved: Solved) -> Iterator[Check]:
    """Scatter of each lidar, and its mean square in deviations."""
    stands = [inputs.lidars[place] for place in inputs.stands]
    for lidar, noise_m in zip(stands, solved.told["noise_m"], strict=True):
        text = f"{1e3 * noise_m:.1f} mm"
        yield Check("noise", text, f"{1e3 * NOISE_M:g} mm", noise_m <= NOISE_M, f"lidar {lidar}")
    for number, lidar in enumerate(inputs.lidars):
        sigma = float(solved.told["noise_m"][number])
        of = [t["residual_m"][t["lidar"] == number] for t in solved.told["holds"]]
        residual = np.concatenate(of)
        if residual.size > MIN_ECHOES:
            chi = float(np.mean((residual / sigma) ** 2))
            where = f"lidar {lidar}"
            yield Check("chi-square", f"{chi:.2f}", f"{CHI_SQUARE:g}", chi <= CHI_SQUARE, where)


def _means(inputs: Inputs, solved: Solved) -> Iterator[Check]:
    """Median residual of each lidar in the hold where it is largest."""
    for number, lidar in enumerate(inputs.lidars):
        found = []
        for hold, told in zip(solved.holds, solved.told["holds"], strict=True):
            residual = told["residual_m"][told["lidar"] == number]
            if residual.size > MIN_ECHOES:
                found.append((float(np.median(residual)), hold.label))
        if found:
            worst, label = max(found, key=lambda pair: abs(pair[0]))
            yield Check(
                "mean residual",
                f"{1e3 * worst:+.1f} mm",
                f"{1e3 * MEAN_M:g} mm",
                abs(worst) <= MEAN_M,
                f"lidar {lidar}, hold {label}",
            )


def _white(solved: Solved) -> Iterator[Check]:
    noise_m = np.array(solved.told["noise_m"])
    for hold, span, told in zip(solved.holds, solved.spans_ns, solved.told["holds"], strict=True):
        yield whiteness.along_span(told, noise_m, f"hold {hold.label}")
        yield whiteness.along_time(told, noise_m, span, f"hold {hold.label}")


def _edges(inputs: Inputs, solved: Solved) -> Iterator[Check]:
    for hold, told in zip(solved.holds, solved.told["holds"], strict=True):
        name = f"hold {hold.label}"
        edges = np.array(told["edges"], dtype=np.float64).reshape(-1, 3)
        if not len(edges):
            continue
        scatter = float(np.std(edges[:, 2]))
        text = f"{scatter:.2f} steps"
        yield Check("scatter of edges", text, f"{EDGE_STEPS:g} steps", scatter <= EDGE_STEPS, name)
        gone = told["edges_left_out"][2]
        share = gone / (gone + len(edges))
        text = f"{100.0 * share:.0f} %"
        limit = f"{100.0 * EDGES_LOST:g} %"
        yield Check("edges let go", text, limit, share <= EDGES_LOST, name)
        is_drawn = solved.source == "drawing"
        most_steps = EDGE_MEAN_STEPS if is_drawn else EDGE_MEAN_GENERIC_STEPS
        yield from _group(inputs, edges, name, most_steps)


def _group(inputs: Inputs, edges: Floats, name: str, most_steps: float) -> Iterator[Check]:
    """Find the group of edges, by lidar and side, that lies farthest beside the silhouette."""
    found = []
    for number, lidar in enumerate(inputs.lidars):
        for side, word in enumerate(SIDES):
            own = edges[(inputs.stands[edges[:, 0].astype(int)] == number) & (edges[:, 1] == side)]
            if len(own) >= MIN_EDGES:
                mean, spread = float(np.mean(own[:, 2])), float(np.std(own[:, 2]))
                off = abs(mean) / max(spread / np.sqrt(len(own)), 1e-9)
                found.append((off if abs(mean) > most_steps else 0.0, mean, lidar, word))
    if found:
        off, mean, lidar, word = max(found, key=lambda each: (each[0], abs(each[1])))
        yield Check(
            "mean of edges",
            f"{mean:+.2f} steps",
            f"{most_steps:g} steps or {EDGE_DEVIATIONS:g} deviations",
            off <= EDGE_DEVIATIONS,
            f"{name}, lidar {lidar}, {word}",
        )


def _strain(solved: Solved) -> Iterator[Check]:
    """Fit a free axial strain beside all else: of the first hold, then of the others against it."""
    strain, covariance = solved.native.strains(*LAST)
    for number, hold in enumerate(solved.holds):
        pick = np.zeros(len(strain))
        pick[number] = 1.0
        if number:
            pick[0] = -1.0
        value, u = float(pick @ strain), float(pick @ covariance @ pick) ** 0.5
        limit = max(STRAIN, DEVIATIONS * u)
        yield Check(
            "free axial strain" if number else "free axial strain (length of the blade)",
            f"{1e6 * value:+.0f} +- {1e6 * u:.0f} ppm",
            f"{1e6 * limit:.0f} ppm",
            abs(value) <= limit,
            f"hold {hold.label}",
        )


def _turn(
    inputs: Inputs, solved: Solved, s_m: Floats, covariance: HoldCovariance
) -> Iterator[Check]:
    """Whether the blade bends on in the direction of the load outboard of the last load."""
    order = np.argsort(s_m, kind="stable")
    order = order[np.concatenate([[True], np.diff(s_m[order]) > 0.2])]
    outside = order[s_m[order] >= saddles_m(inputs.config)[-1]]
    moved = covariance.values[:, :, :3] - covariance.values[0, :, :3]
    for number, hold in enumerate(solved.holds):
        total = float(np.linalg.norm(moved[number], axis=1).max())
        if number == 0 or len(outside) < 3 or total < 0.05:
            continue
        tip = moved[number, outside[-1]]
        ahead = tip / np.linalg.norm(tip)
        slopes = np.zeros((len(outside) - 1, len(s_m)))
        for place, (one, other) in enumerate(pairwise(outside)):
            slopes[place, [one, other]] = np.array([-1.0, 1.0]) / (s_m[other] - s_m[one])
        slope = slopes @ moved[number] @ ahead
        back = np.maximum.accumulate(slope) - slope
        worst = int(np.argmax(back))
        turned = slopes[np.argmax(slope[: worst + 1])] - slopes[worst]
        u_rad = covariance.change_variance_m2(number, np.outer(turned, ahead)) ** 0.5
        limit = max(TURN_BACK_RAD, TURN_BACK_SHARE * float(slope.max()), DEVIATIONS * u_rad)
        yield Check(
            "turns back outboard of the last load",
            f"{1e3 * back[worst]:.2f} mrad",
            f"{1e3 * limit:.1f} mrad",
            bool(back[worst] <= limit),
            f"hold {hold.label}, {s_m[outside][worst]:.0f} m",
        )


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
