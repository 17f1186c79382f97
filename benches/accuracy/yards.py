"""From a case to a scene: what is drawn, from which ranges, and how hard the winches pull.

Disturbances come from wider families than any estimator here assumes: heavy tails, ranges that
depend on incidence and brightness, moulds that are off, ground that rolls, walls that bow.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from lidar_deflect import _native, scene_plan
from lidar_deflect.scene import Scene

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from benches.accuracy.kinds import Case

HOLD_S = 2.0
GROUND_M = -7.0
CLEAR_M = 5.5
"""Nowhere does the blade hang nearer above the ground: stands are as high as their blades need."""
NOISE_MM = {"vlp16": 14.0, "xt32": 6.0, "os1-32": 10.0, "vlp32c": 12.0}
"""Sigma of one range, by sensor: what makers and users report on matt surfaces."""

LENGTHS_M = {
    "iea15-110m": 110.0,
    "iea15-117m": 117.0,
    "iea22-138m": 138.0,
    "bar-usc-100m": 100.0,
    "nrel5-61m": 61.5,
}


def scene(case: Case, *, hold_s: float = HOLD_S) -> Scene:
    """Return the scene of a case; the same case gives the same scene."""
    pulled = _drawn(case, hold_s, GROUND_M)
    lowest_m = float(_ends(pulled)[..., 1].min())
    missing_m = CLEAR_M - (lowest_m - pulled.ground.height_m)
    return pulled if missing_m <= 0.0 else _drawn(case, hold_s, GROUND_M - missing_m)


def _drawn(case: Case, hold_s: float, ground_m: float) -> Scene:
    random = np.random.default_rng([case.seed, 7])
    blade = _blade(case, random)
    length_m = float(blade["length_m"])
    aim_m = length_m * _aim(case, random)
    ground = _ground(case, ground_m, random)
    document: dict[str, Any] = {
        "id": case.id,
        "seed": case.seed,
        "blade": blade | _build(case, random),
        "sections_m": [round(length_m * share, 3) for share in (84 / 110, 100 / 110)] + [length_m],
        "loading": {
            "levels_percent": (0.0, 100.0),
            "hold_s": hold_s,
            "ramp_s": 1.5 if case.kind.load == "flap" else 0.8,
            "winch_m": round(1.5 * aim_m + 12.0, 2),
            "follower": bool(random.random() < 0.3),
        },
        "ground": ground,
        "sways": _sways(length_m, random),
        "lidars": _lidars(case, ground, length_m, aim_m, hold_s, random),
        "sensors": _sensors(case, random),
        "network": _network(case, random),
        "boxes": _boxes(ground, length_m, random),
    } | _references(case, ground, length_m, aim_m, random)
    shares = random.dirichlet([8.0, 8.0, 7.0, 4.0])
    lever_m = [float(v) for v in random.uniform(-0.06, 0.06, 2)]
    saddles = [
        {"s_m": round(length_m * place, 2), "force_kn": float(share), "lever_m": lever_m}
        for place, share in zip((0.30, 0.52, 0.68, 0.86), shares, strict=True)
    ]
    return _pulled(document, saddles, aim_m)


def _blade(case: Case, random: np.random.Generator) -> dict[str, Any]:
    flap = {"leading_edge": "+y", "suction_side": "+x"}
    edge = {"leading_edge": "-x", "suction_side": "+y" if random.random() < 0.5 else "-y"}
    is_flap = case.kind.load == "flap" or (case.kind.load == "small" and random.random() < 0.5)
    clamped = flap if is_flap else edge
    if case.blade.startswith("drawn"):
        span = (56.0, 66.0) if case.blade.endswith("60m") else (82.0, 128.0)
        length_m = round(float(random.uniform(*span)), 1)
        return {"drawn": case.seed, "length_m": length_m, **clamped}
    return {"reference": case.blade, "length_m": LENGTHS_M[case.blade], **clamped}


def _aim(case: Case, random: np.random.Generator) -> float:
    """Deflection of the tip over the length of the blade."""
    low, high = {"edge": (0.055, 0.073), "flap": (0.27, 0.33), "small": (0.045, 0.055)}[
        case.kind.load
    ]
    return float(random.uniform(low, high))


def _build(case: Case, random: np.random.Generator) -> dict[str, Any]:
    """How well the blade was built; the drawing stays what it is."""
    scale = {"calm": 0.3, "usual": 1.0, "hard": 1.3}[case.level]
    return {
        "chord_percent": 0.3 * scale,
        "setting_deg": 0.15 * scale,
        "prebend_percent": 2.0 * scale,
        "stiffness_percent": 5.0 * scale,
        "waves_mm": float(random.uniform(1.0, 3.0)) * scale,
        "mould_mm": 2.0 if case.level == "hard" else 0.0,
    }


def _ground(case: Case, ground_m: float, random: np.random.Generator) -> dict[str, Any]:
    hard = case.level == "hard"
    return {
        "height_m": ground_m - float(random.uniform(0.0, 0.6)),
        "slope_x": float(random.normal(0.0, 0.012)),
        "slope_z": float(random.normal(0.0, 0.008)),
        "roughness_mm": float(random.uniform(4.0, 12.0)) * (1.5 if hard else 1.0),
        "correlation_m": float(random.uniform(0.4, 1.5)),
        "swell_mm": float(random.uniform(5.0, 20.0)) if hard else 0.0,
    }


def _above(ground: dict[str, Any], x_m: float, z_m: float, height_m: float) -> list[float]:
    """Return a place at a height above the sloped ground, metres."""
    base_m = ground["height_m"] + ground["slope_x"] * x_m + ground["slope_z"] * z_m
    return [round(x_m, 3), round(base_m + height_m, 3), round(z_m, 3)]


def _sways(length_m: float, random: np.random.Generator) -> list[dict[str, Any]]:
    pace = (110.0 / length_m) ** 1.2
    phase = random.uniform(0, 360, 3)
    size = length_m / 110.0 * random.uniform(0.4, 1.6, 3)
    return [
        {
            "direction": direction,
            "order": order,
            "frequency_hz": float(frequency_hz * pace),
            "amplitude_mm": float(amplitude_mm * size[i]),
            "phase_deg": float(phase[i]),
        }
        for i, (direction, order, frequency_hz, amplitude_mm) in enumerate(
            [("+x", 1, 0.58, 8.0), ("+y", 1, 0.41, 6.0), ("+x", 2, 1.7, 1.5)]
        )
    ]


def _lidars(
    case: Case,
    ground: dict[str, Any],
    length_m: float,
    aim_m: float,
    hold_s: float,
    random: np.random.Generator,
) -> list[dict[str, Any]]:
    """Four sensors on the ground under the outer part of the blade, as the load moves it."""
    x_m = 0.45 * aim_m if case.kind.load == "flap" else 0.5 * aim_m
    reach = 0.97 if case.kind.load == "flap" else 1.0
    places = np.linspace(0.765, 0.995, 4) * length_m * reach
    entries = []
    for i, (model, z) in enumerate(zip(case.kind.sensors, places, strict=True)):
        entry: dict[str, Any] = {
            "id": f"L{i + 1}",
            "model": model,
            "address": f"192.168.1.{201 + i}",
            "position_m": _above(
                ground,
                x_m + float(random.uniform(-0.4, 0.4)),
                float(z + random.uniform(-0.5, 0.5)),
                float(random.uniform(1.0, 1.4)),
            ),
            "clock": {"drift_ppm": float(random.normal(0.0, 10.0)), "locked": True},
        }
        entries.append(entry)
    _disturb(case, entries, hold_s, random)
    return entries


def _disturb(
    case: Case, entries: list[dict[str, Any]], hold_s: float, random: np.random.Generator
) -> None:
    """Kick a tripod or lose a lidar in two of three hard tests."""
    fate, which = int(random.integers(3)), int(random.integers(4))
    if case.level != "hard":
        return
    if fate == 0:
        entries[which]["kick"] = {
            "at_s": hold_s + 0.3,
            "turn_mrad": [float(v) for v in random.normal(0.0, 0.3, 3)],
            "shift_mm": [float(v) for v in random.normal(0.0, 1.2, 3)],
        }
    elif fate == 1:
        entries[which]["silent_s"] = [[hold_s + 0.4, 1e4]]


def _sensors(case: Case, random: np.random.Generator) -> dict[str, Any]:
    scale = {"calm": 0.4, "usual": 1.0, "hard": 1.2}[case.level]
    hard = case.level == "hard"
    noise_mm = max(NOISE_MM[model] for model in case.kind.sensors)
    return {
        "tilt_deg": 2.5,
        "noise_mm": noise_mm,
        "noise_freedom": 4 if hard else 0,
        "channel_offset_mm": 7.0 * scale,
        "unit_offset_mm": 4.0 * scale,
        "incidence_bias_mm": float(random.normal(0.0, 2.0)) if hard else 0.0,
        "faint_bias_mm": float(random.normal(0.0, 1.0)) if hard else 0.0,
        "retro_bias_mm": float(random.normal(0.0, 4.0)) if hard else 0.0,
        "beam_mrad": float(random.uniform(0.8, 1.8)),
        "grazing_deg": float(random.uniform(84.0, 89.0)),
    }


def _network(case: Case, random: np.random.Generator) -> dict[str, Any]:
    bursts = case.level == "hard" and random.random() < 0.3
    return {
        "loss": 0.1 if bursts else 0.002,
        "bursts_per_s": 1.0 if bursts else 0.05,
        "burst_packets": 60.0 if bursts else 6.0,
    }


def _references(
    case: Case,
    ground: dict[str, Any],
    length_m: float,
    aim_m: float,
    random: np.random.Generator,
) -> dict[str, Any]:
    """Wall, targets and survey: what holds the lidars in the world."""
    survey: dict[str, Any] = {"ground_points": 24, "wall_points": 8}
    z_m = (0.5 * length_m, 1.3 * length_m)
    wall = {
        "x_m": -20.0 - float(random.uniform(0.0, 6.0)),
        "slope": float(random.normal(0.0, 0.01)),
        "z_m": z_m,
    }
    if case.yard == "bent":
        wall |= {
            "bow_mm": float(random.normal(0.0, 40.0)),
            "lean": float(random.normal(0.0, 0.004)),
        }
    if case.yard in ("wall", "bent"):
        return {"wall": wall, "survey": survey}
    if case.yard == "bare":
        # Ground and the sensors' positions alone, better surveyed.
        return {"survey": survey | {"ground_points": 60, "wall_points": 0, "position_mm": 2.0}}
    return {
        "survey": survey | {"wall_points": 0},
        "targets": _targets(ground, length_m, aim_m, random),
    }


def _targets(
    ground: dict[str, Any], length_m: float, aim_m: float, random: np.random.Generator
) -> list[dict[str, Any]]:
    places = [
        (side, z)
        for z in np.linspace(0.74, 1.02, 4) * length_m
        for side in (-9.0, 9.0 + 0.9 * aim_m)
    ]
    return [
        {
            "name": f"T{i + 1}",
            "kind": "sphere",
            "size_m": 0.4,
            "position_m": _above(
                ground,
                x + float(random.uniform(-1, 1)),
                float(z + random.uniform(-0.5, 0.5)),
                float(random.uniform(1.2, 3.0)),
            ),
        }
        for i, (x, z) in enumerate(places)
    ]


def _boxes(
    ground: dict[str, Any], length_m: float, random: np.random.Generator
) -> list[dict[str, Any]]:
    return [
        {
            "middle_m": _above(
                ground,
                float(random.uniform(-15, -8)),
                float(length_m * random.uniform(0.7, 1.0)),
                0.6,
            ),
            "size_m": (1.4, 1.4, 1.2),
        }
        for _ in range(2)
    ]


def _pulled(document: dict[str, Any], saddles: list[dict[str, Any]], aim_m: float) -> Scene:
    """Return the scene whose winches pull the tip as far as it shall go."""
    total_kn = 400.0
    shares = [float(saddle["force_kn"]) for saddle in saddles]
    for _ in range(5):
        pulling = [
            saddle | {"force_kn": round(total_kn * share, 3)}
            for saddle, share in zip(saddles, shares, strict=True)
        ]
        pulled = Scene.from_document(document | {"saddles": pulling})
        reached_m = _reached_m(pulled)
        if abs(reached_m / aim_m - 1.0) < 0.03:
            break
        total_kn *= float(np.clip(aim_m / max(reached_m, 1e-3), 0.2, 4.0))
    return pulled


def _reached_m(pulled: Scene) -> float:
    """How far the tip moves along the load, metres."""
    rest, full = _ends(pulled)[:, -1]
    return float(np.linalg.norm(full - rest))


def _ends(pulled: Scene) -> NDArray[np.float64]:
    """Sections at the first and the last instant, shape (2, s, 3), metres; without sway."""
    plan = scene_plan.plan(pulled) | {"sways": []}
    native = _native.Simulation(plan)
    ends = np.array([0.0, native.duration_s])
    return np.asarray(native.truth(list(pulled.sections_m), ends, threads=1))[..., :3]
