"""How far a network adjustment can be trusted: free directions, gross errors, evidence, verdict."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from lidar_deflect.calibration import Calibration, Joint, Nuisances, Pose
from lidar_deflect.errors import CalibrationError

if TYPE_CHECKING:
    from collections.abc import Iterator, Mapping, Sequence

    from numpy.typing import NDArray

    from lidar_deflect.config import Config, Lidar
    from lidar_deflect.network import Solution

FREE_RAD, FREE_M = 0.3, 30.0
"""A direction known no better than this is free: nothing but its first guess holds it."""

HELD_RAD, HELD_M = 5e-3, 0.1
"""A direction known no better than this rests on a prior, not on an observation of the yard."""

COUPLED = 0.5
"""A free direction has a part along every axis that is larger than this share of its largest."""

GOOD_RAD, GOOD_M = 1e-3, 6e-3
"""Poses as good as this across ground and walls deserve the verdict."""

CELL_M = 2.5
"""Residuals of rays are kept as means over squares of this side."""

TURNS = (
    ("about x (pitch along the blade)", "survey ground points that spread along the blade"),
    ("about the vertical (yaw)", 'survey a wall: three or more [[control]] points on = "wall"'),
    ("about z (roll across the blade)", "survey ground points that spread across the blade"),
)
SHIFTS = (
    ("along x", "survey its position_m, or a wall"),
    ("along y", "survey its position_m, or more ground points"),
    ("along z", "survey its position_m, or tape a [[distance]] to a neighbour"),
)


def calibration(config: Config, solution: Solution) -> Calibration:
    """Make a calibration of an adjustment.

    Raises
    ------
    CalibrationError
        If a direction of a pose is free (``calibration.free``) or two lidars look exchanged.
    """
    refuse_exchanged(config, solution)
    covariance = solution.covariance
    free = list(_loose(solution.lidars, covariance, FREE_RAD, FREE_M))
    if free:
        raise CalibrationError(
            f"lidar {free[0][0]} is free {free[0][1]}: nothing observed holds it",
            code="calibration.free",
            facts=[(lidar, f"free {direction}") for lidar, direction, _ in free],
            hint=free[0][2],
        )
    lidars = [config.lidar(id) for id in solution.lidars]
    poses = tuple(_pose(lidar, solution, number, covariance) for number, lidar in enumerate(lidars))
    warnings = (
        *_held(solution, covariance),
        *_left_out(config, solution),
        *_not_found(config, solution),
        *_unsettled(solution),
    )
    evidence = {"verdict": _verdict(covariance, warnings)} | _evidence(config, solution)
    return Calibration(poses, "network", warnings, {}, _joint(solution), evidence)


def _joint(solution: Solution) -> Joint:
    nuisances = tuple(
        Nuisances(lidar["offsets_m"], lidar["elevation_rad"], lidar["scale"])
        for lidar in solution.raw["lidars"]
    )
    return Joint(solution.lidars, solution.covariance, nuisances, solution.full_covariance)


def _loose(
    lidars: Sequence[str], covariance: NDArray[np.float64], most_rad: float, most_m: float
) -> Iterator[tuple[str, str, str]]:
    """Lidar, direction in words and what would fix it, of every eigenvector that is less sure."""
    limits = np.repeat([most_rad, most_m], 3)
    for number, id in enumerate(lidars):
        own = slice(6 * number, 6 * number + 6)
        squares, vectors = np.linalg.eigh(covariance[own, own] / np.outer(limits, limits))
        for square, vector in zip(squares[::-1], vectors.T[::-1], strict=True):
            if square > 1.0:
                yield id, *_in_words(vector)


def _in_words(direction: NDArray[np.float64]) -> tuple[str, str]:
    """Say where a direction of a pose goes, its largest part first, and what would fix that."""
    words = [(f"to turn {turn}", remedy) for turn, remedy in TURNS]
    words += [(f"to shift {shift}", remedy) for shift, remedy in SHIFTS]
    size = np.abs(direction)
    parts = [k for k in np.argsort(-size) if size[k] > COUPLED * size.max()]
    return " and with it ".join(words[k][0] for k in parts), words[parts[0]][1]


def _held(solution: Solution, covariance: NDArray[np.float64]) -> Iterator[str]:
    """Say which directions rest on a prior, all lidars of one direction in one sentence."""
    by_direction: dict[tuple[str, str], list[str]] = {}
    for id, direction, remedy in _loose(solution.lidars, covariance, HELD_RAD, HELD_M):
        by_direction.setdefault((direction, remedy), []).append(id)
    for (direction, remedy), ids in by_direction.items():
        yield (
            f"{', '.join(ids)}: free {direction} but for the mounting's prior "
            f"(axes_u_deg, position_u_m); {remedy}"
        )


def _left_out(config: Config, solution: Solution) -> Iterator[str]:
    """Name what the adjustment left out as a gross error."""
    for name, rows in named(config, solution):
        worst = max(rows, key=lambda row: abs(row[3]))
        if worst[4]:
            yield (
                f"{name} was left out: {1e3 * worst[0]:+.0f} mm from where all else puts it, "
                f"{abs(worst[3]):.0f} times its standard deviation; check its coordinates"
            )


def _unsettled(solution: Solution) -> Iterator[str]:
    if not solution.raw["converged"]:
        yield (
            f"the adjustment still moved after {solution.raw['steps']} steps, by less than a tenth "
            "of its standard deviations"
        )


def named(config: Config, solution: Solution) -> Iterator[tuple[str, Sequence[tuple[Any, ...]]]]:
    """Name surveyed values, with their rows: residual, sigma, redundancy, studentised, out."""
    used = [s.name for s in solution.surfaces]
    points = [point for point in config.control if point.on in used]
    for number, (point, rows) in enumerate(zip(points, solution.raw["control"], strict=True), 1):
        x, y, z = point.xyz_m
        yield f"control point {number} on {point.on} ({x:.2f}, {y:.2f}, {z:.2f})", rows
    lidars = [solution.lidars[at[0]] for at in solution.known["position"]]
    for id, rows in zip(lidars, solution.raw["position"], strict=True):
        yield f"position_m of {id}", rows
    for tape, rows in zip(solution.known["distance"], solution.raw["distance"], strict=True):
        ids = [solution.lidars[index] for index in tape[0]]
        yield f"distance {ids[0]}-{ids[1]}", rows
    for target, rows in zip(config.targets, solution.raw["target"], strict=True):
        yield f"target {target.name}", rows
    for sight, rows in zip(solution.known["sight"], solution.raw["sight"], strict=True):
        yield f"target {config.targets[sight[1]].name} as {solution.lidars[sight[0]]} sees it", rows


def seen_by(config: Config, solution: Solution) -> dict[str, dict[str, int]]:
    """Count the echoes of every target, by the lidars that see it."""
    counts: dict[str, dict[str, int]] = {target.name: {} for target in config.targets}
    for lidar, target, count, _ in solution.raw["seen"]:
        counts[config.targets[target].name][solution.lidars[lidar]] = count
    sheets = (solution.known["sight"], solution.raw["sight"], solution.known["sheet_echoes"])
    for (lidar, target, *_), rows, (count,) in zip(*sheets, strict=True):
        if not any(row[4] for row in rows):
            counts[config.targets[target].name][solution.lidars[lidar]] = count
    return counts


def _not_found(config: Config, solution: Solution) -> Iterator[str]:
    """Name the targets that no lidar sees."""
    for name, seen in seen_by(config, solution).items():
        if not seen:
            yield (
                f"target {name} is seen by no lidar within its place: is it uncovered, "
                "as large as size_m, and are its coordinates right?"
            )


def refuse_exchanged(config: Config, solution: Solution) -> None:
    """Refuse two lidars of which each stands where the other was surveyed.

    Raises
    ------
    CalibrationError
        ``calibration.exchanged``.
    """
    lidars = [solution.lidars[at[0]] for at in solution.known["position"]]
    wrong = [
        id
        for id, rows in zip(lidars, solution.raw["position"], strict=True)
        if any(row[4] for row in rows)
    ]
    if len(wrong) >= 2:
        raise CalibrationError(
            f"the positions of {' and '.join(wrong)} contradict what they see: exchanged?",
            code="calibration.exchanged",
            facts=[(id, f"surveyed at {config.lidar(id).position_m}") for id in wrong],
            hint="check which source belongs to which position_m",
        )


def _pose(lidar: Lidar, solution: Solution, number: int, covariance: NDArray[np.float64]) -> Pose:
    block = covariance[6 * number : 6 * number + 6, 6 * number : 6 * number + 6]
    return Pose(
        lidar.id,
        lidar.source or "",
        solution.world_from_sensor(number),
        _pose_evidence(solution, number, block),
        block,
    )


def _pose_evidence(
    solution: Solution, number: int, block: NDArray[np.float64]
) -> Mapping[str, Any]:
    raw = solution.raw
    own = raw["lidars"][number]
    sigma = np.sqrt(np.diag(block))
    mine = raw["met_lidar"] == number
    evidence: dict[str, Any] = {
        "u_rotation_mrad": (1e3 * sigma[:3]).round(3).tolist(),
        "u_position_mm": (1e3 * sigma[3:]).round(2).tolist(),
    }
    if any(surface.name == "ground" for surface in solution.surfaces):
        evidence["ground_height_m"] = _ground_height_m(solution, number)
    for index, surface in enumerate(solution.surfaces):
        on = raw["residuals"][mine & (raw["met_surface"] == index), 0]
        kept = on[np.isfinite(on)]
        evidence[f"rays_on_{surface.name}"] = int(kept.size)
        if kept.size:
            evidence[f"rms_on_{surface.name}_m"] = float(np.sqrt(np.mean(kept**2)))
    return evidence | {
        "elevation_offset_mrad": 1e3 * own["elevation_rad"],
        "range_scale": own["scale"],
        "channel_offset_mm": (1e3 * own["offsets_m"]).round(2).tolist(),
    }


def _ground_height_m(solution: Solution, number: int) -> float:
    """Height of the ground straight below a lidar, world y."""
    ground = solution.raw["surfaces"][0]
    normal, origin = np.array(ground["normal"]), np.array(ground["origin_m"])
    origin = origin + normal * ground["coefficients_m"][0]
    x, _, z = solution.raw["lidars"][number]["position_m"]
    beneath = normal[0] * (x - origin[0]) + normal[2] * (z - origin[2])
    return float(origin[1] - beneath / normal[1])


def _evidence(config: Config, solution: Solution) -> dict[str, Any]:
    covariance = solution.covariance
    common = np.tile(np.eye(6), len(solution.lidars)) / len(solution.lidars)
    u_roll = float(np.sqrt((common @ covariance @ common.T)[2, 2]))
    return {
        "u_common_roll_mrad": 1e3 * u_roll,
        "u_flapwise_mm_per_10_m": 1e4 * u_roll,
        "channel_offset_u_mm": 1e3 * solution.raw["offset_u_m"],
        "steps": solution.raw["steps"],
        "converged": solution.raw["converged"],
        "targets": [
            {"name": name, "echoes": seen} for name, seen in seen_by(config, solution).items()
        ],
        "retro_offset_mm": [round(1e3 * lidar["retro_m"], 2) for lidar in solution.raw["lidars"]],
        "slant_offset_mm": [round(1e3 * lidar["slant_m"], 2) for lidar in solution.raw["lidars"]],
        "surfaces": [
            {"name": surface.name, **_surface(raw)}
            for surface, raw in zip(solution.surfaces, solution.raw["surfaces"], strict=True)
        ],
        "cells": [_cells(solution, index) for index in range(len(solution.surfaces))],
        "survey": [
            {
                "what": name,
                "residual_mm": [round(1e3 * row[0], 2) for row in rows],
                "redundancy": [round(row[2], 3) for row in rows],
                "studentised": [round(row[3], 2) for row in rows],
                "left_out": any(row[4] for row in rows),
            }
            for name, rows in named(config, solution)
        ],
    }


def _cells(solution: Solution, index: int) -> dict[str, Any]:
    """Mean residuals of one surface by lidar and square, ground seen from above, walls upright."""
    raw, surface = solution.raw, solution.surfaces[index]
    is_ground = abs(surface.normal[1]) > 0.5
    kept = (raw["met_surface"] == index) & np.isfinite(raw["residuals"][:, 0])
    places = raw["met_xyz_m"][kept][:, [2, 0 if is_ground else 1]]
    keys = np.c_[raw["met_lidar"][kept], np.floor(places / CELL_M)].astype(np.int64)
    squares, of, counts = np.unique(keys, axis=0, return_inverse=True, return_counts=True)
    means = np.bincount(of.ravel(), raw["residuals"][kept, 0]) / counts
    return {
        "surface": surface.name,
        "across": "x_m" if is_ground else "y_m",
        "lidar": [solution.lidars[number] for number in squares[:, 0]],
        "z_m": (CELL_M * (squares[:, 1] + 0.5)).tolist(),
        "across_m": (CELL_M * (squares[:, 2] + 0.5)).tolist(),
        "mean_mm": (1e3 * means).round(2).tolist(),
        "rays": counts.tolist(),
    }


def _surface(raw: Mapping[str, Any]) -> dict[str, Any]:
    """Plane, bend and roughness of one surface, millimetres where named so."""
    described = {
        "normal": list(raw["normal"]),
        "origin_m": list(raw["origin_m"]),
        "half_m": list(raw["half_m"]),
        "coefficients_m": list(raw["coefficients_m"]),
    }
    names = {"roughness_m": "roughness_mm", "nugget_m": "nugget_mm"}
    rough = {to: 1e3 * raw[of] for of, to in names.items() if of in raw}
    if "correlation_m" in raw:
        rough["correlation_m"] = raw["correlation_m"]
    return described | rough


def _verdict(covariance: NDArray[np.float64], warnings: Sequence[str]) -> str:
    sigma = np.sqrt(np.diag(covariance)).reshape(-1, 6)
    across_m = float(sigma[:, 3:5].max())
    turn_rad = float(sigma[:, :3].max())
    said = f"poses to {1e3 * turn_rad:.2f} mrad and {1e3 * across_m:.1f} mm across (k = 1)"
    if turn_rad > GOOD_RAD or across_m > GOOD_M:
        return f"poor: {said}"
    return f"usable, with warnings: {said}" if warnings else f"good: {said}"
