"""Result folders as the beam method leaves them, of an invented blade: no lidar was involved."""

import json
from collections.abc import Mapping
from pathlib import Path

import numpy as np
import polars as pl

import folders
from lidar_deflect import comparison, holds, tables, wires

LENGTH_M = 110.0
SECTIONS = {"S84": 84.0, "S100": 100.0, "尖端 tip": 110.0}
LEVELS = ((0.0, 0.0), (6.0, 0.0), (10.0, 40.0), (18.0, 40.0), (22.0, 100.0), (32.0, 100.0))
LEVELS += ((36.0, 40.0), (44.0, 40.0), (48.0, 0.0), (60.0, 0.0))
TIP_TURN_RAD = 0.11
U_TIP_M = 0.0043
CONFIG = f"""[test]
id = "edge-110"
kind = "static"
customer = "Blade works"
operator = "Test hall 3"
blade_serial = "B-0042"
[blade]
length_m = {LENGTH_M}
[[lidars]]
id = "L1"
source = "192.168.1.201"
position_m = [3.0, -6.8, 86.0]
[[lidars]]
id = "L2"
source = "192.168.1.202"
position_m = [3.0, -7.0, 102.0]
[[control]]
on = "ground"
xyz_m = [-15.0, -8.2, 78.0]
[[wires]]
name = "W84"
section = "S84"
anchor_m = [42.0, -7.1, 84.0]
[[wires]]
name = "V100"
section = "S100"
anchor_m = [42.0, -7.1, 100.0]
[load]
direction = "+x"
saddles_s_m = [33.0, 57.2, 75.0]
[prediction]
file = "theory.csv"
value = "deflection_mm_at_100_percent"
tolerance_percent = 7.0
[measure]
method = "beam"
"""


def load_percent(at_s: np.ndarray, stretch: float = 1.0) -> np.ndarray:
    times, levels = zip(*LEVELS, strict=True)
    return np.interp(at_s, stretch * np.array(times), levels)


def shape(s_m: np.ndarray, share: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Points (n, m, 3), turns about y (n, m) and twist in degrees of a beam that keeps its length.

    The turn grows as (s/L)^1.5, so that nothing bends back; twist is a degree at the tip.
    """
    fine = np.linspace(0.0, LENGTH_M, 441)
    turn = TIP_TURN_RAD * share[:, None] * (fine / LENGTH_M)[None, :] ** 1.5
    step = fine[1] - fine[0]
    middle = 0.5 * (turn[:, 1:] + turn[:, :-1])
    zero = np.zeros((share.size, 1))
    x = np.hstack([zero, np.cumsum(np.sin(middle) * step, axis=1)])
    z = np.hstack([zero, np.cumsum(np.cos(middle) * step, axis=1)])
    at = np.clip(np.searchsorted(fine, s_m), 0, fine.size - 1)
    y = np.broadcast_to(-0.02 * s_m[None, :] * share[:, None] * 0.5, (share.size, s_m.size))
    points = np.stack([x[:, at], y, z[:, at]], axis=-1)
    twist = -1.0 * share[:, None] * (s_m / LENGTH_M)[None, :]
    return points, turn[:, at], twist


def deflection(
    sections: Mapping[str, float] = SECTIONS,
    *,
    duration_s: float = 60.0,
    rate_hz: float = 10.0,
    load: bool = True,
    seed: int = 5,
) -> pl.DataFrame:
    """Deflection table with sway of some millimetres, creep in the 100 % hold, and a residual."""
    at_s = np.arange(0.0, duration_s, 1.0 / rate_hz)
    stretch = duration_s / 60.0
    percent = load_percent(at_s, stretch)
    rising = np.clip((at_s - 22.0 * stretch) / (10.0 * stretch), 0.0, 1.0)
    share = percent / 100.0 + 0.002 * rising  # creep at 100 % that stays
    share = share + 4e-4 * np.sin(2.0 * np.pi * 0.6 * at_s)
    s_m = np.array(list(sections.values()))
    points, _, twist = shape(s_m, share)
    rest, _, _ = shape(s_m, np.zeros(1))
    rng = np.random.default_rng(seed)
    points = points + rng.normal(0.0, 0.001, points.shape)
    time_ns = folders.EPOCH_NS + folders.ns(at_s)
    found = holds.from_load(time_ns, percent) if load else ()
    names = list(sections)
    count, wide = at_s.size, len(names)
    columns: dict[str, tables.Values] = dict.fromkeys(tables.SCHEMAS["deflection"].names)
    columns |= {"time": np.repeat(time_ns, wide), "t_s": np.repeat(at_s, wide)}
    steps_of = holds.steps_at(found, time_ns)
    columns |= {"step": [each for each in steps_of for _ in names]}
    columns |= {"load": np.repeat(percent, wide) if load else None}
    columns |= {"section": names * count, "s_m": np.tile(s_m, count)}
    moved = points - rest
    u = np.tile(U_TIP_M * (s_m / LENGTH_M) ** 2, count)
    for k, axis in enumerate("xyz"):
        columns |= {f"{axis}_m": points[..., k].ravel(), f"d{axis}_m": moved[..., k].ravel()}
        columns |= {f"u{axis}_m": 1.2 * u, f"ud{axis}_m": u * (1.0, 1.6, 0.4)[k]}
    columns |= {"d_m": np.linalg.norm(moved, axis=-1).ravel(), "ud_m": u}
    columns |= {"twist_deg": twist.ravel(), "utwist_deg": np.full(u.size, 0.06)}
    columns |= {"n_points": np.full(u.size, 3300), "lidars": ["L1+L2"] * u.size}
    columns |= {"status": ["ok"] * u.size, "reason": None}
    return tables.build("deflection", columns)


def contour(frame: pl.DataFrame, stations: int = 56) -> pl.DataFrame:
    """Blade line once a second, with rotations."""
    states = frame.filter(pl.col("section") == frame["section"][0]).sort("time")
    states = states.gather_every(10)
    s_m = np.linspace(0.0, LENGTH_M, stations)
    loads = states["load"].cast(pl.Float64).fill_null(0.0).to_numpy() / 100.0
    points, turn, twist = shape(s_m, loads)
    columns: dict[str, tables.Values] = dict.fromkeys(tables.SCHEMAS["contour"].names)
    columns |= {"time": states["time"].cast(pl.Int64).to_numpy().repeat(stations)}
    columns |= {"t_s": states["t_s"].to_numpy().repeat(stations)}
    columns |= {"s_m": np.tile(s_m, states.height), "status": ["ok"] * (stations * states.height)}
    columns |= {f"{axis}_m": points[..., k].ravel() for k, axis in enumerate("xyz")}
    columns |= {f"u{axis}_m": np.full(points[..., 0].size, 0.004) for axis in "xyz"}
    columns |= {"ry_rad": turn.ravel(), "rx_rad": 0.1 * turn.ravel()}
    columns |= {"urx_rad": np.full(turn.size, 2e-4), "ury_rad": np.full(turn.size, 3e-4)}
    columns |= {"twist_deg": twist.ravel(), "utwist_deg": np.full(twist.size, 0.06)}
    return tables.build("contour", columns)


def points(line: pl.DataFrame, seed: int = 7) -> pl.DataFrame:
    """Echoes about the outer blade in every third state of the line."""
    rng = np.random.default_rng(seed)
    times = line["t_s"].unique().sort().to_list()[::3]
    part = line.filter(pl.col("t_s").is_in(times), pl.col("s_m") > 76.0).sort("t_s", "s_m")
    part = part[np.repeat(np.arange(part.height), 12)]
    half = 0.02 * (LENGTH_M + 20.0 - part["s_m"].to_numpy())
    columns: dict[str, tables.Values] = {"time": part["time"], "t_s": part["t_s"]}
    columns |= {"lidar": ["L1" if s < 96.0 else "L2" for s in part["s_m"]]}
    columns |= {"ring": rng.integers(0, 16, part.height), "s_m": part["s_m"]}
    columns |= {"x_m": part["x_m"].to_numpy() + half * rng.uniform(-1.0, 1.0, part.height)}
    columns |= {"y_m": part["y_m"] - 0.3, "z_m": part["z_m"]}
    columns |= {"residual_m": rng.normal(0.0, 0.012, part.height)}
    columns |= {"chord": -rng.uniform(0.0, 1.0, part.height)}
    return tables.build("points", columns)


def outline(steps: pl.DataFrame, count: int = 40) -> pl.DataFrame:
    """Ellipses of 2 m by 0.4 m about the sections, across z."""
    angle = np.linspace(np.pi, -np.pi, count, endpoint=False)
    parts = []
    for row in steps.drop_nulls("x_m").iter_rows(named=True):
        columns: dict[str, tables.Values] = {"time": [row["time"]] * count}
        columns |= {name: [row[name]] * count for name in ("t_s", "step", "section", "s_m")}
        columns |= {"place": np.arange(count), "x_m": row["x_m"] + np.cos(angle)}
        columns |= {"y_m": row["y_m"] + 0.2 * np.sin(angle), "z_m": [row["z_m"]] * count}
        parts.append(tables.build("outline", columns | {"u_m": np.full(count, 0.003)}))
    return pl.concat(parts)


def poses() -> pl.DataFrame:
    at_s = np.arange(0.0, 60.0, 5.0)
    parts = []
    for k, lidar in enumerate(("L1", "L2")):
        columns: dict[str, tables.Values] = {"time": folders.EPOCH_NS + folders.ns(at_s)}
        columns |= {"t_s": at_s, "lidar": [lidar] * at_s.size}
        for axis in "xyz":
            columns |= {f"r{axis}_mrad": 0.02 * k * at_s / 60.0, f"ur{axis}_mrad": None}
            columns |= {f"t{axis}_mm": 0.3 * k * at_s / 60.0, f"ut{axis}_mm": None}
        columns |= {"moved": [False] * at_s.size, "followed": [False] * at_s.size}
        parts.append(tables.build("poses", columns))
    return pl.concat(parts)


def cycles(sections: Mapping[str, float] = SECTIONS, count: int = 40) -> pl.DataFrame:
    parts = []
    for name, s_m in sections.items():
        columns: dict[str, tables.Values] = dict.fromkeys(tables.SCHEMAS["cycles"].names)
        columns |= {"time": folders.EPOCH_NS + folders.ns(np.arange(count) * 1.5)}
        columns |= {"t_s": np.arange(count) * 1.5, "section": [name] * count}
        columns |= {"s_m": [s_m] * count, "cycle": np.arange(count)}
        for k, axis in enumerate("xyz"):
            size = (s_m / LENGTH_M) ** 2 * (1.0, 0.2, 0.05)[k]
            columns |= {f"amplitude_{axis}_m": np.full(count, size)}
            columns |= {f"uamplitude_{axis}_m": np.full(count, 0.004)}
        columns |= {"frequency_hz": np.full(count, 0.66), "ufrequency_hz": np.full(count, 0.001)}
        parts.append(tables.build("cycles", columns))
    return pl.concat(parts)


def channels(frame: pl.DataFrame, config: Mapping[str, object]) -> pl.DataFrame:
    """Load, one real wire that reads what it should but 3 mm, and what both would have read."""
    from lidar_deflect import channels as read

    first = frame.filter(pl.col("section") == frame["section"][0]).sort("time")
    times = first["time"].cast(pl.Int64).to_numpy()
    given = []
    if first["load"].null_count() == 0:
        given.append(read.Channel("load", times, first["load"].to_numpy(), "percent"))
    predicted = wires.predicted(frame, config)
    given += [read.Channel("W84", w.time_ns, w.value + 0.003, "m") for w in predicted[:1]]
    return read.to_table([*given, *predicted], folders.EPOCH_NS)


def run_facts() -> dict[str, object]:
    return folders.run_facts() | {
        "method": "beam",
        "versions": {"lidar-deflect": "0.1.0", "python": "3.11.7"},
        "capture": {"streams": [stream("L1", 201), stream("L2", 202)], "drops": []},
        "timings_s": {"scan": 0.4, "measure": 12.1},
        "gates": {"failed": []},
        "self_check": [
            {"name": "length kept", "value": "0.011 %", "limit": "0.05 %", "passed": True},
            {"name": "common_roll_pull", "value": 0.4, "limit": 2.0, "passed": True},
            {
                "name": "largest pull of surface",
                "value": "+4.1",
                "where": "hold 0 %",
                "limit": "3.4 of 48",
                "passed": False,
                "only_warns": True,
            },
        ],
        "budget": [
            {"contribution": "range noise", "U_x_mm": 0.6, "U_y_mm": 0.9},
            {"contribution": "poses", "U_x_mm": 3.1, "U_y_mm": 7.4},
        ],
        "warnings": [],
    }


def stream(lidar: str, host: int) -> dict[str, object]:
    return {
        "lidar": lidar,
        "source": f"192.168.1.{host}",
        "port": 2368,
        "model": "vlp16",
        "title": "Velodyne VLP-16",
        "return_mode": "strongest",
        "rpm": 600.0,
        "beams": "factory table",
        "clock": {"kind": "utc", "offset_s": 2e-4, "drift_ppm": 0.01, "jumps": 0},
    }


def calibration() -> str:
    """Calibration of two lidars with covariances: 0.15 mrad about z, 3 mm."""
    parts = ['schema = "lidar-deflect.calibration/1"\nmethod = "network"\nwarnings = []']
    sigma = [2e-4, 1.2e-4, 1.5e-4, 0.002, 0.002, 0.003]
    covariance = np.diag(np.square(sigma)).tolist()
    for k, (lidar, z) in enumerate((("L1", 86.0), ("L2", 102.0))):
        pose = [[-1.0, 0.0, 0.0, 3.0], [0.0, -1.0, 0.0, -6.8], [0.0, 0.0, 1.0, z]]
        pose.append([0.0, 0.0, 0.0, 1.0])
        parts.append(
            f'[[lidars]]\nid = "{lidar}"\nsource = "192.168.1.{201 + k}"\n'
            f"world_from_sensor = {pose}\ncovariance = {covariance}\n"
            "[lidars.evidence]\nground_points = 23456\nground_rms_m = 0.0123"
        )
    return "\n\n".join(parts) + "\n"


def write(
    folder: Path,
    sections: Mapping[str, float] = SECTIONS,
    *,
    load: bool = True,
    compared: bool = True,
    config: str = CONFIG,
    run: Mapping[str, object] | None = None,
    **options: float,
) -> Path:
    """Write a complete result folder of the beam method."""
    import tomllib

    settings = tomllib.loads(config)
    frame = deflection(sections, load=load, **options)  # type: ignore[arg-type]
    line = contour(frame)
    extra = {"contour": line, "points": points(line), "poses": poses()}
    steps = folders.step_table(frame)
    if steps.height:
        extra["outline"] = outline(steps)
    extra |= {"health": folders.health(), "channels": channels(frame, settings)}
    written = folders.write(
        folder, frame, config=config, run=run_facts() if run is None else run, **extra
    )
    (written / "calibration.toml").write_text(calibration(), encoding="utf-8")
    if compared and load:
        theory = folder.parent / "theory.csv"
        lines = [f"{s_m},{1e3 * predicted(s_m):.1f}" for s_m in sections.values()]
        theory.write_text("section_m,deflection_mm_at_100_percent\n" + "\n".join(lines) + "\n")
        comparison.save(written, comparison.compare(written, theory))
    return written


def predicted(s_m: float) -> float:
    """Total deflection at 100 %, a percent and a half too large."""
    loaded, _, _ = shape(np.array([s_m]), np.ones(1))
    rest, _, _ = shape(np.array([s_m]), np.zeros(1))
    return 1.015 * float(np.linalg.norm(loaded - rest))


def facts(folder: Path) -> dict[str, object]:
    found: dict[str, object] = json.loads((folder / "run.json").read_text())
    return found
