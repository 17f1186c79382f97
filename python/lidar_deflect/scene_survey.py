"""What surveyors and the engineer of a simulated test would have written down."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np
import tomlkit

from lidar_deflect.scene_plan import anchor, plane_m

if TYPE_CHECKING:
    from lidar_deflect import _native
    from lidar_deflect.scene import Lidar, Scene


def configuration(scene: Scene, native: _native.Simulation) -> str:
    """Write the configuration that a test engineer would have written for this test."""
    random = np.random.default_rng([scene.seed, 3])
    sigma_m = scene.survey.position_mm * 1e-3

    def surveyed(xyz_m: Any) -> list[float]:
        return [round(float(v + sigma_m * random.normal()), 4) for v in xyz_m]

    loading = scene.loading
    document: dict[str, Any] = {
        "test": {
            "id": scene.id,
            "kind": "fatigue" if scene.fatigue else "static",
            "notes": f"simulated, seed {scene.seed}",
        },
        "blade": {
            "length_m": round(float(native.nominal()["s_m"][-1]), 4),
            "geometry": "blade.csv",
            "contours": "contours.csv",
            "leading_edge": list(scene.blade.leading_edge),
            "suction_side": list(scene.blade.suction_side),
            "setting_u_deg": max(scene.blade.setting_deg, 0.01),
        },
        "load": {
            "file": "load.csv",
            "value": "load_percent",
            "direction": list(loading.direction),
            "saddles_s_m": [saddle.s_m for saddle in scene.saddles],
        },
        "prediction": {
            "file": "theory.csv",
            "section": "section_m",
            "value": "deflection_mm_at_100_percent",
            "unit": "mm",
        },
        "lidars": [
            {
                "id": lidar.id,
                "model": model,
                "source": lidar.address,
                **({"beams": [unit_name(lidar, name) for name, _ in files]} if files else {}),
                "position_m": surveyed(lidar.position_m),
                "position_u_m": max(sigma_m, 1e-4),
                "axes": {
                    "x": list(lidar.axes.x),
                    "y": list(lidar.axes.y),
                    "z": list(lidar.axes.z),
                },
            }
            for lidar, (model, files) in zip(scene.lidars, native.units(), strict=True)
        ],
        "control": [
            {"on": on, "xyz_m": surveyed(xyz_m), "u_m": max(sigma_m, 1e-4)}
            for on, xyz_m in _control(scene, native, random)
        ],
        "sections": [{"name": f"S{s:g}", "s_m": s} for s in scene.sections_m],
        "wires": [
            {
                "name": f"W{s:g}",
                "section": f"S{s:g}",
                "anchor_m": anchor(scene, native, s),
                "file": "wire.csv",
                "column": wire_column(s),
            }
            for s in scene.sections_m
        ],
    }
    if scene.targets:
        sharp_m = scene.survey.target_mm * 1e-3
        document["targets"] = [
            {
                "name": target.name,
                "kind": target.kind,
                "size_m": target.size_m,
                "xyz_m": [
                    round(float(v + sharp_m * random.normal()), 4) for v in target.position_m
                ],
                "u_m": max(sharp_m, 1e-4),
            }
            for target in scene.targets
        ]
    if any(loading.root_mrad):
        document["root"] = {
            "file": "root.csv",
            "rx": "rx_mrad",
            "rz": "rz_mrad",
            "u_mrad": max(scene.survey.root_mrad, 1e-3),
        }
    if not is_loaded(scene):
        del document["prediction"]
    if loading.levels_percent[0] == 0:
        document["reference"] = {"from_s": 0.0, "to_s": loading.hold_s}
    return tomlkit.dumps(document)


def _control(
    scene: Scene, native: _native.Simulation, random: np.random.Generator
) -> list[tuple[str, tuple[float, float, float]]]:
    """Lay surveyed points on ground and wall: a grid around the lidars, each a little off it."""
    z = [lidar.position_m[2] for lidar in scene.lidars]
    x = [lidar.position_m[0] for lidar in scene.lidars]
    columns = 6
    rows = -(-scene.survey.ground_points // columns)
    places = [
        (float(px + random.uniform(-2, 2)), float(pz + random.uniform(-2, 2)))
        for pz in np.linspace(min(z) - 7, max(z) + 7, max(rows, 1))
        for px in np.linspace(min(x) - 19, max(x) + 19, columns)
    ][: scene.survey.ground_points]
    heights = native.ground_m(places)
    points = [("ground", (px, py, pz)) for (px, pz), py in zip(places, heights, strict=True)]
    if scene.wall is None:
        return points
    for pz in np.linspace(min(z) - 7, max(z) + 7, scene.survey.wall_points):
        px = scene.wall.x_m + scene.wall.slope * float(pz)
        low = plane_m(scene, px, float(pz)) + 0.8
        py = float(random.uniform(low, scene.wall.top_m - 0.8))
        points.append(("wall", (native.wall_m([(py, float(pz))])[0], py, float(pz))))
    return points


def unit_name(lidar: Lidar, name: str) -> str:
    """Return the name of a file that describes a unit."""
    return f"{lidar.id}.{name}"


def wire_column(s_m: float) -> str:
    """Return the column of a draw wire in wire.csv."""
    return f"s{s_m:g}_mm".replace(".", "_")


def is_loaded(scene: Scene) -> bool:
    """Return whether any winch pulls."""
    return max(scene.loading.levels_percent) > 0
