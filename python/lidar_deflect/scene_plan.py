"""A scene in SI units, as the compiled simulator takes it."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from lidar_deflect import _native
    from lidar_deflect.scene import Lidar, Scene


def plan(scene: Scene) -> dict[str, Any]:
    """Put a scene into SI units, as the compiled part takes it."""
    blade, loading, sensors = scene.blade, scene.loading, scene.sensors
    network = scene.network.model_dump(exclude={"jitter_us"})
    return {
        "seed": scene.seed,
        "start_ns": start_ns(scene),
        "blade": {
            "reference": blade.reference,
            "drawn": blade.drawn,
            "length_m": blade.length_m,
            "leading_edge": blade.leading_edge,
            "suction_side": blade.suction_side,
            "chord_u": blade.chord_percent * 1e-2,
            "setting_u_rad": math.radians(blade.setting_deg),
            "prebend_u": blade.prebend_percent * 1e-2,
            "stiffness_u": blade.stiffness_percent * 1e-2,
            "waves_m": blade.waves_mm * 1e-3,
            "mould_m": blade.mould_mm * 1e-3,
        },
        "direction": loading.direction,
        "follower": loading.follower,
        "saddles": [
            {
                "s_m": saddle.s_m,
                "force_n": saddle.force_kn * 1e3,
                "lever_m": saddle.lever_m,
                "anchor_m": _winch(
                    scene, saddle.s_m, plane_m(scene, *_winch_place(scene, saddle.s_m))
                ),
            }
            for saddle in scene.saddles
        ],
        "show_saddles": scene.show_saddles,
        "cable_radius_m": scene.cable_mm * 0.5e-3,
        "levels": [level * 1e-2 for level in loading.levels_percent],
        "hold_s": _lasts_s(scene) if scene.fatigue else loading.hold_s,
        "ramp_s": loading.ramp_s,
        "sways": [
            {
                "direction": sway.direction,
                "order": sway.order,
                "frequency_hz": sway.frequency_hz,
                "amplitude_m": sway.amplitude_mm * 1e-3,
                "phase_rad": math.radians(sway.phase_deg),
                "driven_s": None,
            }
            for sway in scene.sways
        ]
        + _swings(scene),
        "root_turn_rad": [turn * 1e-3 for turn in loading.root_mrad],
        "ground": {
            "height_m": scene.ground.height_m,
            "slope": (scene.ground.slope_x, scene.ground.slope_z),
            "roughness_m": scene.ground.roughness_mm * 1e-3,
            "correlation_m": scene.ground.correlation_m,
            "swell_m": scene.ground.swell_mm * 1e-3,
        },
        "wall": scene.wall.model_dump(exclude={"bow_mm"}) | {"bow_m": scene.wall.bow_mm * 1e-3}
        if scene.wall
        else None,
        "boxes": [box.model_dump() for box in scene.boxes],
        "targets": [
            {
                "middle_m": target.position_m,
                "half_m": 0.5 * target.size_m,
                "facing": target.facing if target.kind == "sheet" else None,
            }
            for target in scene.targets
        ],
        "lidars": [_lidar_plan(scene, lidar) for lidar in scene.lidars],
        "optics": {
            "beam_rad": sensors.beam_mrad * 1e-3,
            "noise_m": sensors.noise_mm * 1e-3,
            "dropout": sensors.dropout,
            "merge_m": sensors.merge_m,
            "range_at_10_percent_m": sensors.range_at_10_percent_m,
            "max_range_m": sensors.max_range_m,
            "grazing_rad": math.radians(sensors.grazing_deg),
            "incidence_bias_m": sensors.incidence_bias_mm * 1e-3,
            "faint_bias_m": sensors.faint_bias_mm * 1e-3,
            "retro_bias_m": sensors.retro_bias_mm * 1e-3,
            "noise_freedom": sensors.noise_freedom,
        },
        "network": network | {"jitter_s": scene.network.jitter_us * 1e-6},
    }


def _lasts_s(scene: Scene) -> float:
    """Return the duration of a fatigue test: hold, growth and cycles."""
    fatigue = scene.fatigue
    if fatigue is None:
        return scene.loading.hold_s
    return scene.loading.hold_s + fatigue.growth_s + fatigue.cycles / fatigue.frequency_hz


def _swings(scene: Scene) -> list[dict[str, Any]]:
    fatigue = scene.fatigue
    if fatigue is None:
        return []
    return [
        {
            "direction": swing.direction,
            "order": swing.order,
            "frequency_hz": fatigue.frequency_hz,
            "amplitude_m": swing.amplitude_m,
            "phase_rad": math.radians(swing.phase_deg),
            "driven_s": (scene.loading.hold_s, fatigue.growth_s),
        }
        for swing in fatigue.swings
    ]


def _lidar_plan(scene: Scene, lidar: Lidar) -> dict[str, Any]:
    kick = lidar.kick
    return {
        "model": lidar.model,
        "address": [int(part) for part in lidar.address.split(".")],
        "port": lidar.port,
        "position_m": lidar.position_m,
        "axes": [lidar.axes.x, lidar.axes.y, lidar.axes.z],
        "tilt_rad": math.radians(scene.sensors.tilt_deg),
        "rpm": lidar.rpm,
        "clock_offset_ns": round(lidar.clock.offset_ms * 1e6),
        "clock_drift": lidar.clock.drift_ppm * 1e-6,
        "clock_locked": lidar.clock.locked,
        "channel_offset_m": scene.sensors.channel_offset_mm * 1e-3,
        "unit_offset_m": scene.sensors.unit_offset_mm * 1e-3,
        "elevation_u_rad": math.radians(scene.sensors.elevation_deg),
        "kick": None
        if kick is None
        else {
            "at_s": kick.at_s,
            "turn_rad": [angle * 1e-3 for angle in kick.turn_mrad],
            "shift_m": [shift * 1e-3 for shift in kick.shift_mm],
        },
        "silent_s": lidar.silent_s,
    }


def start_ns(scene: Scene) -> int:
    """Return UTC of the scene's start, ns."""
    return int(scene.start.timestamp()) * 1_000_000_000 + scene.start.microsecond * 1000


def anchor(scene: Scene, native: _native.Simulation, s_m: float) -> list[float]:
    """Where a winch or draw wire stands that belongs to arc length `s_m`, metres."""
    return _winch(scene, s_m, native.ground_m([_winch_place(scene, s_m)])[0])


def _winch_place(scene: Scene, s_m: float) -> tuple[float, float]:
    direction = scene.loading.direction
    return direction[0] * scene.loading.winch_m, s_m + direction[2] * scene.loading.winch_m


def _winch(scene: Scene, s_m: float, ground_m: float) -> list[float]:
    x, z = _winch_place(scene, s_m)
    return [round(x, 3), round(ground_m + scene.loading.winch_height_m, 3), round(z, 3)]


def plane_m(scene: Scene, x: float, z: float) -> float:
    """Return the height of the ground's plane, metres."""
    return scene.ground.height_m + scene.ground.slope_x * x + scene.ground.slope_z * z
