"""Result folders of an invented test, made from the declared tables: no lidar was involved."""

import hashlib
import json
from collections.abc import Mapping, Sequence
from pathlib import Path

import numpy as np
import polars as pl

from lidar_deflect import holds, steps, tables

EPOCH_NS = 1_718_000_000_000_000_000
SHAPE = {"S84": (84.0, 3.28, -0.52, -0.09), "S100": (100.0, 4.99, -0.72, -0.16)}
"""Sections of the invented blade: arc length and deflection at 100 %, x, y, z, metres."""
TIP = {"tip": (110.0, 6.07, -0.71, -0.21)}
CONFIG = """[test]
id = "edge-110"
kind = "static"
[blade]
length_m = 110.0
[measure]
method = "paper"
"""


def time_s(duration_s: float = 20.0, rate_hz: float = 10.0) -> np.ndarray:
    return np.arange(0.0, duration_s, 1.0 / rate_hz)


def load_percent(at_s: np.ndarray) -> np.ndarray:
    """0 % to 4 s, 40 % from 7 to 10 s, 100 % from 14 s."""
    return np.interp(at_s, [4.0, 7.0, 10.0, 14.0], [0.0, 40.0, 40.0, 100.0])


def deflection(
    shape: Mapping[str, tuple[float, float, float, float]] = SHAPE | TIP,
    *,
    load: bool = True,
    overhead_s: tuple[float, float] | None = (11.0, 12.0),
    u_m: float | None = None,
) -> pl.DataFrame:
    """Deflection table of the invented test, with a stretch of overhead frames."""
    at_s = time_s()
    found = holds.from_load(EPOCH_NS + ns(at_s), load_percent(at_s)) if load else ()
    parts = [
        _section(name, facts, at_s, found, load, overhead_s, u_m) for name, facts in shape.items()
    ]
    return pl.concat(parts).sort("time", maintain_order=True)


def ns(at_s: np.ndarray) -> np.ndarray:
    return np.round(at_s * 1e9).astype(np.int64)


def _section(
    name: str,
    facts: tuple[float, float, float, float],
    at_s: np.ndarray,
    found: Sequence[holds.Hold],
    load: bool,
    overhead_s: tuple[float, float] | None,
    u_m: float | None,
) -> pl.DataFrame:
    share = load_percent(at_s) / 100.0
    vector = share[:, None] * np.array(facts[1:])
    place = vector + np.array([0.0, 1.0, facts[0]])
    hidden = np.zeros(at_s.size, dtype=bool)
    if overhead_s is not None:
        hidden = (at_s >= overhead_s[0]) & (at_s <= overhead_s[1])
    gone = hidden & (at_s > np.mean(overhead_s or 0.0))
    for values in (vector, place):
        values[gone] = np.nan
    status = np.where(gone, "missing", np.where(hidden, "interpolated", "ok"))
    columns: dict[str, tables.Values] = dict.fromkeys(tables.SCHEMAS["deflection"].names)
    columns |= {"time": EPOCH_NS + ns(at_s), "t_s": at_s, "section": [name] * at_s.size}
    columns |= {"step": holds.steps_at(found, EPOCH_NS + ns(at_s))}
    columns |= {"load": 100.0 * share if load else None, "s_m": [facts[0]] * at_s.size}
    columns |= {f"{axis}_m": place[:, k] for k, axis in enumerate("xyz")}
    columns |= {f"d{axis}_m": vector[:, k] for k, axis in enumerate("xyz")}
    columns |= {"d_m": np.linalg.norm(vector, axis=1), "n_points": np.where(gone, 0, 120)}
    if u_m is not None:
        names = [n for n in columns if n.startswith("u") and n.endswith("_m")]
        columns |= {each: np.full(at_s.size, u_m) for each in names}
    columns |= {"lidars": np.where(gone, "", "L1+L2").tolist(), "status": status.tolist()}
    columns |= {"reason": ["overhead" if each else None for each in hidden]}
    return tables.build("deflection", columns)


def step_table(frame: pl.DataFrame) -> pl.DataFrame:
    """Steps of a deflection table, from its load or else from its last section."""
    last = frame.filter(pl.col("section") == frame["section"][-1])
    times = last["time"].cast(pl.Int64).to_numpy()
    if last["load"].null_count() == last.height:
        found = holds.from_deflection(times, last.select("dx_m", "dy_m", "dz_m").to_numpy())
    else:
        found = holds.from_load(times, last["load"].to_numpy())
    return steps.average(frame, found)


def health(lidars: Sequence[str] = ("L1", "L2")) -> pl.DataFrame:
    """Health of an invented test; the second lidar loses packets from 5 s to 7 s."""
    second = np.arange(20)
    parts = []
    for k, lidar in enumerate(lidars):
        lost = np.where((second >= 5) & (second < 7) & (k == 1), 75, 0)
        columns: dict[str, tables.Values] = dict.fromkeys(tables.SCHEMAS["health"].names)
        columns |= {"time": EPOCH_NS + ns(second * 1.0), "t_s": second * 1.0, "lost": lost}
        columns |= {"lidar": [lidar] * 20, "packets": 754 - lost, "rpm": np.full(20, 600.0)}
        columns |= {"duplicated": [0] * 20, "late": [0] * 20, "points": [280_000] * 20}
        columns |= {"coverage": 1.0 - lost / 754}
        parts.append(tables.build("health", columns))
    return pl.concat(parts)


def run_facts() -> dict[str, object]:
    """A run.json as a measurement leaves it."""
    return {
        "schema": "lidar-deflect/run/1",
        "version": "0.1.0",
        "method": "paper",
        "versions": {"python": "3.11", "polars": "2.1"},
        "inputs": [{"path": "run7.pcapng", "bytes": 1234567, "sha256": "ab" * 32}],
        "drops": [{"reason": "not_udp", "count": 3}],
        "warnings": ["yaw comes from the mounting"],
    }


def write(
    folder: Path,
    frame: pl.DataFrame | None = None,
    *,
    config: str = CONFIG,
    run: Mapping[str, object] | None = None,
    **more: pl.DataFrame,
) -> Path:
    """Write a result folder; `more` are further tables by name."""
    folder.mkdir(parents=True, exist_ok=True)
    frame = deflection() if frame is None else frame
    metadata = {tables.HASH_KEY: hashlib.sha256(config.encode()).hexdigest()}
    parts = {"deflection": frame, "steps": step_table(frame)} | more
    for name, part in parts.items():
        tables.write(part, folder / f"{name}.parquet", metadata)
    (folder / "test.toml").write_text(config, encoding="utf-8")
    (folder / "run.json").write_text(json.dumps(run_facts() if run is None else run))
    return folder
