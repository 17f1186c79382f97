"""Simulated tests: a scene in, a capture with everything an engineer would have, and truth out."""

from __future__ import annotations

import json
import math
from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
import polars as pl

from lidar_deflect import _native
from lidar_deflect.errors import InvalidValueError
from lidar_deflect.files import keep_interrupts_from_polars, whole_folder
from lidar_deflect.scene_plan import anchor, plan, start_ns
from lidar_deflect.scene_survey import configuration, is_loaded, unit_name, wire_column

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from lidar_deflect.scene import Scene

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
        wire.csv, theory.csv, truth.parquet, truth_lidars.json and scene.toml, all or none of them;
        root.csv where the root turns, truth_cycles.json of a fatigue test, and what describes
        units whose packets mean nothing without.
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
    native = _native.Simulation(plan(scene))
    _check_sections(scene, native)
    with whole_folder(out, overwrite=overwrite) as folder:
        _write_capture(native, folder / "capture.pcap", progress, threads)
        _write_truth(scene, native, folder, threads)
        _write_drawing(native, folder)
        _write_channels(scene, native, folder, threads)
        _write_units(scene, native, folder)
        if scene.fatigue is not None:
            write_cycles(scene, folder)
        (folder / "test.toml").write_text(configuration(scene, native), encoding="utf-8")
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


def _write_truth(
    scene: Scene, native: _native.Simulation, folder: Path, threads: int | None
) -> None:
    offsets_ns = np.arange(0, round(native.duration_s * 1e9) + 1, TRUTH_STEP_NS)
    times_s = np.asarray(offsets_ns * 1e-9, dtype=np.float64)
    rows = native.truth(scene.sections_m, times_s, threads=threads).reshape(-1, 13)
    count = len(scene.sections_m)
    time = pl.Series(np.repeat(start_ns(scene) + offsets_ns, count))
    columns = {
        "time": time.cast(pl.Datetime("ns", "UTC")),
        "s_m": np.tile(np.asarray(scene.sections_m, dtype=float), len(times_s)),
        "load": np.repeat(native.load(times_s), count),
        **{name: rows[:, i] for i, name in enumerate(TRUTH_COLUMNS)},
        "twist_deg": np.degrees(rows[:, 12]),
    }
    truth = pl.DataFrame(columns).sort("s_m", "time")
    keep_interrupts_from_polars()
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
    for entry, lidar, moved in zip(lidars, scene.lidars, native.last_poses(), strict=True):
        if lidar.kick is not None:
            entry |= {"moved_s": lidar.kick.at_s, "moved_world_from_sensor": moved}
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
    utc = [f"{start_ns(scene) // 1_000_000_000 + t:.3f}" for t in times_s]
    load = 100.0 * native.load(times_s) + scene.survey.load_percent * random.normal(
        size=len(times_s)
    )
    rows = [f"{time},{value:.2f}" for time, value in zip(utc, load, strict=True)]
    (folder / "load.csv").write_text("\n".join(["time_utc_s,load_percent", *rows]) + "\n")

    middle_m = native.truth(scene.sections_m, times_s, threads=threads)[:, :, :3]
    anchors_m = np.array([anchor(scene, native, s) for s in scene.sections_m])
    distance_mm = 1e3 * np.linalg.norm(middle_m - anchors_m, axis=2)
    at_rest = times_s <= scene.loading.hold_s
    reading = distance_mm[at_rest].mean(axis=0) - distance_mm
    reading += scene.survey.wire_mm * random.normal(size=reading.shape)
    names = [wire_column(s) for s in scene.sections_m]
    rows = [
        ",".join([time, *(f"{v:.1f}" for v in values)])
        for time, values in zip(utc, reading, strict=True)
    ]
    (folder / "wire.csv").write_text("\n".join([",".join(["time_utc_s", *names]), *rows]) + "\n")
    if is_loaded(scene):
        _write_prediction(scene, native, middle_m, times_s, folder)
    if any(scene.loading.root_mrad):
        _write_root(scene, native, times_s, utc, folder)


def _write_root(
    scene: Scene,
    native: _native.Simulation,
    times_s: NDArray[np.float64],
    utc: list[str],
    folder: Path,
) -> None:
    """Write what an inclinometer at the root tells: it cannot see a turn about the vertical."""
    random = np.random.default_rng([scene.seed, 4])
    turned = native.load(times_s)[:, None] * np.array([scene.loading.root_mrad])
    turned += scene.survey.root_mrad * random.normal(size=turned.shape)
    rows = [f"{time},{rx:.4f},{rz:.4f}" for time, (rx, _, rz) in zip(utc, turned, strict=True)]
    (folder / "root.csv").write_text("\n".join(["time_utc_s,rx_mrad,rz_mrad", *rows]) + "\n")


def _write_units(scene: Scene, native: _native.Simulation, folder: Path) -> None:
    for lidar, (_, files) in zip(scene.lidars, native.units(), strict=True):
        for name, content in files:
            (folder / unit_name(lidar, name)).write_bytes(content)


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


def write_cycles(scene: Scene, folder: Path) -> None:
    """Write frequency, cycles and, by section and axis, mean, amplitude and phase of the truth.

    A sine at the exact frequency is fitted to truth.parquet over the cycles at full amplitude;
    harmonics that bending far brings about are not in it.
    """
    fatigue = scene.fatigue
    if fatigue is None:
        return
    start_s = scene.loading.hold_s + fatigue.growth_s
    truth = pl.read_parquet(folder / "truth.parquet")
    sections = []
    for (s_m,), rows in truth.group_by("s_m", maintain_order=True):
        time_s = (rows["time"].cast(pl.Int64).to_numpy() - start_ns(scene)) * 1e-9
        steady = time_s >= start_s
        angle = 2 * math.pi * fatigue.frequency_hz * (time_s[steady] - scene.loading.hold_s)
        basis = np.column_stack([np.ones_like(angle), np.sin(angle), np.cos(angle)])
        xyz_m = rows.select("x_m", "y_m", "z_m").to_numpy()[steady]
        mean, sine, cosine = np.linalg.lstsq(basis, xyz_m, rcond=None)[0]
        sections.append(
            {
                "s_m": s_m,
                "mean_m": mean.tolist(),
                "amplitude_m": np.hypot(sine, cosine).tolist(),
                "phase_deg": np.degrees(np.arctan2(cosine, sine)).tolist(),
            }
        )
    document = {
        "frequency_hz": fatigue.frequency_hz,
        "cycles": fatigue.cycles,
        "swings_from_s": scene.loading.hold_s,
        "full_from_s": start_s,
        "sections": sections,
    }
    (folder / "truth_cycles.json").write_text(json.dumps(document, indent=1) + "\n")
