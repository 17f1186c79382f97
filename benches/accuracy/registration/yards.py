"""Small yards: two lidars for half a second, with ground, walls or targets that are not ideal.

A bare yard has neither wall nor target: the mounting alone holds the turns about the vertical.

Disturbances come from wider families than an adjustment assumes: heavy tails, roughness that is
alike over metres, walls that bow and lean, ranges that depend on incidence and brightness,
elevations of a whole unit that are off.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from lidar_deflect.scene import Scene

FIRST_SEED = {"development": 3_000_000, "verification": 4_000_000}
YARDS = ("wall", "bent wall", "targets", "rough ground", "bare")
SENSORS = ("vlp16", "xt32", "vlp32c", "os1-32")
NOISE_MM = {"vlp16": 14.0, "xt32": 6.0, "vlp32c": 12.0, "os1-32": 10.0}
ELEVATION_DEG = 0.02
HOLD_S = 0.6
APART_M = 8.0


@dataclass(frozen=True)
class Case:
    """One yard."""

    number: int
    split: str
    yard: str
    sensor: str

    @property
    def seed(self) -> int:
        """Seed of all that is drawn for it."""
        return FIRST_SEED[self.split] + self.number


def case(split: str, number: int) -> Case:
    """Return one yard: all pairs of yard kind and sensor come up equally often."""
    turn = number // len(YARDS)
    return Case(number, split, YARDS[number % len(YARDS)], SENSORS[turn % len(SENSORS)])


def scene(case: Case) -> Scene:
    """Return the scene of a yard."""
    random = np.random.default_rng([case.seed, 8])
    swells = random.random() < 0.5 if case.yard == "bare" else False
    rough = case.yard == "rough ground" or swells
    ground = {
        "height_m": -7.0,
        "slope_x": float(random.normal(0.0, 0.012)),
        "slope_z": float(random.normal(0.0, 0.003)),
        "roughness_mm": float(random.uniform(12.0, 25.0) if rough else random.uniform(3.0, 9.0)),
        "correlation_m": float(random.uniform(0.8, 3.0) if rough else random.uniform(0.4, 1.2)),
        "swell_mm": float(random.uniform(5.0, 25.0)) if rough else 0.0,
    }
    heavy = random.random() < 0.5
    document: dict[str, Any] = {
        "id": f"yard-{case.number}",
        "seed": case.seed,
        "ground": ground,
        "loading": {"levels_percent": (0.0,), "hold_s": HOLD_S},
        "lidars": [_lidar(case, ground, i, random) for i in range(2)],
        "sensors": {
            "noise_mm": NOISE_MM[case.sensor],
            "noise_freedom": 4 if heavy else 0,
            "elevation_deg": ELEVATION_DEG if heavy else 0.0,
            "incidence_bias_mm": float(random.normal(0.0, 1.0)) if heavy else 0.0,
            "faint_bias_mm": float(random.normal(0.0, 0.7)) if heavy else 0.0,
        },
        "survey": _survey(case.yard),
    }
    return Scene.from_document(document | _references(case, ground, random))


def _survey(yard: str) -> dict[str, Any]:
    """Return what is surveyed: without walls and targets more ground, and the sensors better."""
    if yard == "bare":
        return {"ground_points": 60, "wall_points": 0, "position_mm": 2.0}
    return {"ground_points": 24, "wall_points": 0 if yard == "targets" else 8}


def _height_m(ground: dict[str, Any], x: float, z: float) -> float:
    return float(ground["height_m"] + ground["slope_x"] * x + ground["slope_z"] * z)


def _lidar(
    case: Case, ground: dict[str, Any], i: int, random: np.random.Generator
) -> dict[str, Any]:
    x, z = 3.0 + float(random.uniform(-1, 1)), 94.0 + APART_M * i
    return {
        "id": f"L{i + 1}",
        "model": case.sensor,
        "address": f"192.168.1.{201 + i}",
        "position_m": (x, _height_m(ground, x, z) + float(random.uniform(1.0, 1.4)), z),
        "clock": {"locked": True},
    }


def _references(case: Case, ground: dict[str, Any], random: np.random.Generator) -> dict[str, Any]:
    if case.yard == "targets":
        return {"targets": _targets(ground, random)}
    if case.yard == "bare":
        return {}
    bent = case.yard == "bent wall"
    return {
        "wall": {
            "x_m": -22.0,
            "slope": float(random.normal(0.0, 0.01)),
            "z_m": (60.0, 140.0),
            "bow_mm": float(random.normal(0.0, 30.0)) if bent else 0.0,
            "lean": float(random.normal(0.0, 0.003)) if bent else 0.0,
        }
    }


def _targets(ground: dict[str, Any], random: np.random.Generator) -> list[dict[str, Any]]:
    """Six spheres where rings go: two beside each lidar, two far out between both."""
    middle = 94.0 + 0.5 * APART_M
    beside = [
        (x, 94.0 + APART_M * i + (1.0 if x > 0 else -1.0)) for i in range(2) for x in (-6, 12)
    ]
    return [
        {
            "name": f"T{i + 1}",
            "kind": "sphere",
            "size_m": 0.4,
            "position_m": (x, _height_m(ground, x, z) + float(random.uniform(1, 3)), z),
        }
        for i, (x, z) in enumerate([*beside, (-15.0, middle), (21.0, middle)])
    ]
