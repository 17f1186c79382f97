"""Simulated tests: a scene in, a capture with everything an engineer would have, and truth out."""

from __future__ import annotations

import json
import math
from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
import polars as pl
import tomlkit

from lidar_deflect import _native
from lidar_deflect.errors import InvalidValueError
from lidar_deflect.files import uninterrupted, whole_folder

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from lidar_deflect.scene import Lidar, Scene

Progress = Callable[[int, int], None]

TRUTH_STEP_NS = 10_000_000
TRUTH_COLUMNS = (
    *("x_m", "y_m", "z_m", "le_x_m", "le_y_m", "le_z_m", "te_x_m", "te_y_m", "te_z_m"),
    *("chord_x", "chord_y", "chord_z"),
)
"""Of truth.parquet, between `load` and `twist_deg`."""


def simulate(
    scene: Scene,
    out_folder: str | Path,
    *,
    overwrite: bool = False,
    progress: Progress | None = None,
    threads: int | None = None,
) -> Path:
    """Simulate a test: packets, channels, survey, drawing, configuration and truth.

    Parameters
    ----------
    scene
        What to simulate. The same scene gives the same bytes, for any number of threads.
    out_folder
        Gets capture.pcap, test.toml (ready for `measure`), blade.csv, contours.csv, load.csv,
        wire.csv, theory.csv, truth.parquet, truth_lidars.json and scene.toml, all or none of them.
    overwrite
        Whether a folder that is there may be replaced.
    progress
        Called with milliseconds of the test that are done, and all of them.
    threads
        Number of threads; default: all processors.

    Returns
    -------
    Path
        The folder.

    Raises
    ------
    InvalidValueError
        If the blade cannot be clamped or bent as the scene says, or a section is not on it.
    OutputError
        If the folder is there and may not be replaced, or cannot be written.
    """
    out = Path(out_folder)
    native = _native.Simulation(_plan(scene))
    _check_sections(scene, native)
    with whole_folder(out, overwrite=overwrite) as folder:
        _write_capture(native, folder / "capture.pcap", progress, threads)
        _write_truth(scene, native, folder, threads)
        _write_drawing(native, folder)
        _write_channels(scene, native, folder, threads)
        (folder / "test.toml").write_text(_configuration(scene, native), encoding="utf-8")
        (folder / "scene.toml").write_text(scene.dump(), encoding="utf-8")
    return out


def _check_sections(scene: Scene, native: _native.Simulation) -> None:
    length_m = float(native.nominal()["s_m"][-1])
    beyond = [s for s in scene.sections_m if s > length_m + 1e-9]
    if beyond:
        raise InvalidValueError(f"sections_m: expected up to {length_m:g} m, found {beyond[0]:g}")


def _write_capture(
    native: _native.Simulation, path: Path, progress: Progress | None, threads: int | None
) -> None:
    native.create(path)
    total = round(native.duration_s * 1e3)
    goes_on = True
    while goes_on:
        goes_on = native.advance(threads=threads)
        if progress is not None:
            progress(round(native.done_s * 1e3), total)


def _start_ns(scene: Scene) -> int:
    return int(scene.start.timestamp()) * 1_000_000_000 + scene.start.microsecond * 1000


def _write_truth(
    scene: Scene, native: _native.Simulation, folder: Path, threads: int | None
) -> None:
    offsets_ns = np.arange(0, round(native.duration_s * 1e9) + 1, TRUTH_STEP_NS)
    times_s = np.asarray(offsets_ns * 1e-9, dtype=np.float64)
    rows = native.truth(scene.sections_m, times_s, threads=threads).reshape(-1, 13)
    count = len(scene.sections_m)
    time = pl.Series(np.repeat(_start_ns(scene) + offsets_ns, count))
    columns = {
        "time": time.cast(pl.Datetime("ns", "UTC")),
        "s_m": np.tile(np.asarray(scene.sections_m, dtype=float), len(times_s)),
        "load": np.repeat(native.load(times_s), count),
        **{name: rows[:, i] for i, name in enumerate(TRUTH_COLUMNS)},
        "twist_deg": np.degrees(rows[:, 12]),
    }
    truth = pl.DataFrame(columns).sort("s_m", "time")
    with uninterrupted():
        truth.write_parquet(folder / "truth.parquet")
    lidars = [
        {
            "source": lidar.address,
            "world_from_sensor": pose,
            "packets_sent": sent,
            "packets_lost": lost,
        }
        for lidar, pose, (sent, lost) in zip(
            scene.lidars, native.poses(), native.packets(), strict=True
        )
    ]
    (folder / "truth_lidars.json").write_text(json.dumps(lidars, indent=1) + "\n")


def _write_drawing(native: _native.Simulation, folder: Path) -> None:
    nominal = dict(native.nominal())
    decimals = {"s_m": 3, "chord_m": 4, "twist_deg": 3, "rel_thickness": 4, "prebend_m": 4}
    nominal["twist_deg"] = np.degrees(nominal.pop("twist_rad"))
    names = [*decimals, "axis_fraction", "ei_edge_nm2", "ei_flap_nm2", "gj_nm2"]
    lines = [",".join(names)]
    for row in zip(*(nominal[name] for name in names), strict=True):
        cells = [
            f"{value:.4e}" if name.endswith("_nm2") else f"{value:.{decimals.get(name, 4)}f}"
            for name, value in zip(names, row, strict=True)
        ]
        lines.append(",".join(cells))
    (folder / "blade.csv").write_text("\n".join(lines) + "\n")
    contours = (f"{s:.3f},{x:.5f},{y:.5f}" for s, x, y in native.contours())
    (folder / "contours.csv").write_text("\n".join(["s_m,x_c,y_c", *contours]) + "\n")


def _write_channels(
    scene: Scene, native: _native.Simulation, folder: Path, threads: int | None
) -> None:
    random = np.random.default_rng([scene.seed, 1])
    times_s = np.arange(0.0, native.duration_s, 1.0 / scene.survey.rate_hz)
    utc = [f"{_start_ns(scene) // 1_000_000_000 + t:.3f}" for t in times_s]
    load = 100.0 * native.load(times_s) + scene.survey.load_percent * random.normal(
        size=len(times_s)
    )
    rows = [f"{time},{value:.2f}" for time, value in zip(utc, load, strict=True)]
    (folder / "load.csv").write_text("\n".join(["time_utc_s,load_percent", *rows]) + "\n")

    middle_m = native.truth(scene.sections_m, times_s, threads=threads)[:, :, :3]
    anchors_m = np.array([_anchor(scene, native, s) for s in scene.sections_m])
    distance_mm = 1e3 * np.linalg.norm(middle_m - anchors_m, axis=2)
    at_rest = times_s <= scene.loading.hold_s
    reading = distance_mm[at_rest].mean(axis=0) - distance_mm
    reading += scene.survey.wire_mm * random.normal(size=reading.shape)
    names = [_wire_column(s) for s in scene.sections_m]
    rows = [
        ",".join([time, *(f"{v:.1f}" for v in values)])
        for time, values in zip(utc, reading, strict=True)
    ]
    (folder / "wire.csv").write_text("\n".join([",".join(["time_utc_s", *names]), *rows]) + "\n")
    _write_prediction(scene, native, middle_m, times_s, folder)


def _write_prediction(
    scene: Scene,
    native: _native.Simulation,
    middle_m: NDArray[np.float64],
    times_s: NDArray[np.float64],
    folder: Path,
) -> None:
    """Write what a calculation would have said for 100 %: true deflection, off by its own error."""
    random = np.random.default_rng([scene.seed, 2])
    share = native.load(times_s)
    peak = share >= share.max() - 1e-9
    rest = times_s <= scene.loading.hold_s
    moved_m = middle_m[peak].mean(axis=0) - middle_m[rest].mean(axis=0)
    off = 1.0 + 1e-2 * scene.survey.prediction_percent * random.normal()
    total_mm = 1e3 * off * np.linalg.norm(moved_m, axis=1) / max(float(share.max()), 1e-9)
    rows = [f"{s:g},{v:.0f}" for s, v in zip(scene.sections_m, total_mm, strict=True)]
    header = "section_m,deflection_mm_at_100_percent"
    (folder / "theory.csv").write_text("\n".join([header, *rows]) + "\n")


def _wire_column(s_m: float) -> str:
    return f"s{s_m:g}_mm".replace(".", "_")


def _anchor(scene: Scene, native: _native.Simulation, s_m: float) -> list[float]:
    """Where a winch or draw wire stands that belongs to arc length `s_m`, metres."""
    return _winch(scene, s_m, native.ground_m([_winch_place(scene, s_m)])[0])


def _winch_place(scene: Scene, s_m: float) -> tuple[float, float]:
    direction = scene.loading.direction
    return direction[0] * scene.loading.winch_m, s_m + direction[2] * scene.loading.winch_m


def _winch(scene: Scene, s_m: float, ground_m: float) -> list[float]:
    x, z = _winch_place(scene, s_m)
    return [round(x, 3), round(ground_m + scene.loading.winch_height_m, 3), round(z, 3)]


def _plane_m(scene: Scene, x: float, z: float) -> float:
    return scene.ground.height_m + scene.ground.slope_x * x + scene.ground.slope_z * z


def _plan(scene: Scene) -> dict[str, Any]:
    """Put a scene into SI units, as the compiled part takes it."""
    blade, loading, sensors = scene.blade, scene.loading, scene.sensors
    network = scene.network.model_dump(exclude={"jitter_us"})
    return {
        "seed": scene.seed,
        "start_ns": _start_ns(scene),
        "blade": {
            "reference": blade.reference,
            "length_m": blade.length_m,
            "leading_edge": blade.leading_edge,
            "suction_side": blade.suction_side,
            "chord_u": blade.chord_percent * 1e-2,
            "setting_u_rad": math.radians(blade.setting_deg),
            "prebend_u": blade.prebend_percent * 1e-2,
            "stiffness_u": blade.stiffness_percent * 1e-2,
            "waves_m": blade.waves_mm * 1e-3,
        },
        "direction": loading.direction,
        "follower": loading.follower,
        "saddles": [
            {
                "s_m": saddle.s_m,
                "force_n": saddle.force_kn * 1e3,
                "lever_m": saddle.lever_m,
                "anchor_m": _winch(
                    scene, saddle.s_m, _plane_m(scene, *_winch_place(scene, saddle.s_m))
                ),
            }
            for saddle in scene.saddles
        ],
        "show_saddles": scene.show_saddles,
        "cable_radius_m": scene.cable_mm * 0.5e-3,
        "levels": [level * 1e-2 for level in loading.levels_percent],
        "hold_s": loading.hold_s,
        "ramp_s": loading.ramp_s,
        "sways": [
            {
                "direction": sway.direction,
                "order": sway.order,
                "frequency_hz": sway.frequency_hz,
                "amplitude_m": sway.amplitude_mm * 1e-3,
                "phase_rad": math.radians(sway.phase_deg),
            }
            for sway in scene.sways
        ],
        "root_turn_rad": [turn * 1e-3 for turn in loading.root_mrad],
        "ground": {
            "height_m": scene.ground.height_m,
            "slope": (scene.ground.slope_x, scene.ground.slope_z),
            "roughness_m": scene.ground.roughness_mm * 1e-3,
            "correlation_m": scene.ground.correlation_m,
        },
        "wall": scene.wall.model_dump() if scene.wall else None,
        "boxes": [box.model_dump() for box in scene.boxes],
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
        },
        "network": network | {"jitter_s": scene.network.jitter_us * 1e-6},
    }


def _lidar_plan(scene: Scene, lidar: Lidar) -> dict[str, Any]:
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
    }


def _configuration(scene: Scene, native: _native.Simulation) -> str:
    """Write the configuration that a test engineer would have written for this test."""
    random = np.random.default_rng([scene.seed, 3])
    sigma_m = scene.survey.position_mm * 1e-3

    def surveyed(xyz_m: Any) -> list[float]:
        return [round(float(v + sigma_m * random.normal()), 4) for v in xyz_m]

    loading = scene.loading
    document: dict[str, Any] = {
        "test": {"id": scene.id, "kind": "static", "notes": f"simulated, seed {scene.seed}"},
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
                "model": lidar.model,
                "source": lidar.address,
                "position_m": surveyed(lidar.position_m),
                "position_u_m": max(sigma_m, 1e-4),
                "axes": {
                    "x": list(lidar.axes.x),
                    "y": list(lidar.axes.y),
                    "z": list(lidar.axes.z),
                },
            }
            for lidar in scene.lidars
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
                "anchor_m": _anchor(scene, native, s),
                "file": "wire.csv",
                "column": _wire_column(s),
            }
            for s in scene.sections_m
        ],
    }
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
        low = _plane_m(scene, px, float(pz)) + 0.8
        points.append(("wall", (px, float(random.uniform(low, scene.wall.top_m - 0.8)), float(pz))))
    return points
