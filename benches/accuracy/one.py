"""One simulated test from nothing to a record: simulate, calibrate, measure with every method."""

from __future__ import annotations

import json
import tempfile
import time
import tomllib
import traceback
from importlib.metadata import version
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
import polars as pl

from benches.accuracy import judge, yards
from lidar_deflect.errors import LidarDeflectError
from lidar_deflect.measurement import METHODS
from lidar_deflect.pipeline import Test
from lidar_deflect.simulation import simulate

if TYPE_CHECKING:
    from collections.abc import Sequence

    from benches.accuracy.kinds import Case
    from lidar_deflect.calibration import Calibration


def known_methods() -> tuple[str, ...]:
    """Return the methods of this version."""
    return tuple(METHODS)


def run(case: Case, methods: Sequence[str], *, hold_s: float = yards.HOLD_S) -> dict[str, Any]:
    """Run a case; what fails is part of the record."""
    record: dict[str, Any] = {
        "id": case.id,
        "kind": case.kind.name,
        "load": case.kind.load,
        "sensors": list(case.kind.sensors),
        "blade": case.blade,
        "yard": case.yard,
        "level": case.level,
        "seed": case.seed,
        "version": version("lidar-deflect"),
        "methods": {},
        "seconds": {},
    }
    with tempfile.TemporaryDirectory(prefix="accuracy-") as scratch:
        _run(case, methods, record, Path(scratch), hold_s)
    return record


def _run(
    case: Case, methods: Sequence[str], record: dict[str, Any], scratch: Path, hold_s: float
) -> None:
    watch = time.perf_counter()

    def lap(name: str) -> None:
        nonlocal watch
        record["seconds"][name] = round(time.perf_counter() - watch, 2)
        watch = time.perf_counter()

    scene = yards.scene(case, hold_s=hold_s)
    record["disturbances"] = disturbances(scene.model_dump())
    folder = simulate(scene, scratch / "test", threads=1)
    lap("simulate")
    truth = judge.Truth(pl.read_parquet(folder / "truth.parquet"))
    test = Test.load(folder / "test.toml", ["gates.max_lost_percent=100"])
    capture = folder / "capture.pcap"
    try:
        # Poses alone: whether a method finds its unloaded state is that method's matter.
        bare = Test(test.config.model_copy(update={"sections": ()}), test.path)
        calibration = bare.calibrate(capture, threads=1)
    except Exception as error:
        record["calibration"] = failure(error)
        lap("calibrate")
        return
    record["calibration"] = registered(calibration, folder)
    lap("calibrate")
    for method in methods:
        try:
            result = test.measure(capture, calibration=calibration, method=method, threads=1)
            record["methods"][method] = judge.judge(result, truth)
        except Exception as error:
            record["methods"][method] = failure(error)
        lap(method)


def failure(error: Exception) -> dict[str, Any]:
    """Return what failed: the code of a named error, or where a bug is."""
    if isinstance(error, LidarDeflectError):
        return {"failed": getattr(error, "code", None) or type(error).__name__, "why": str(error)}
    place = traceback.extract_tb(error.__traceback__)[-1]
    where = f"{Path(place.filename).name}:{place.lineno}"
    return {"failed": f"bug: {type(error).__name__}", "why": f"{error} ({where})"[:300]}


def disturbances(scene: dict[str, Any]) -> list[str]:
    """Name what is out of the ordinary in a scene."""
    found = []
    for lidar in scene["lidars"]:
        if lidar.get("kick"):
            found.append(f"{lidar['id']} kicked")
        if lidar.get("silent_s"):
            found.append(f"{lidar['id']} lost")
    if scene["network"]["loss"] > 0.05:
        found.append("packets lost in bursts")
    sensors = scene["sensors"]
    if sensors["incidence_bias_mm"]:
        found.append(f"incidence {sensors['incidence_bias_mm']:+.1f} mm")
    if sensors["faint_bias_mm"]:
        found.append(f"faint {sensors['faint_bias_mm']:+.1f} mm")
    return found


def registered(calibration: Calibration, folder: Path) -> dict[str, Any]:
    """Errors of the poses against the truth, world axes, and how many sigmas they are."""
    truth = json.loads((folder / "truth_lidars.json").read_text())
    names = [lidar["id"] for lidar in tomllib.loads((folder / "test.toml").read_text())["lidars"]]
    known = {pose.id: pose for pose in calibration.poses}
    errors, distances = [], []
    for name, entry in zip(names, truth, strict=True):
        lidar = known.get(name)
        if lidar is None:
            continue
        true = np.array(entry["world_from_sensor"])
        found = np.asarray(lidar.world_from_sensor)
        error = pose_error(true, found)
        errors.append([float(v) for v in error])
        covariance = lidar.covariance
        if covariance is not None and np.linalg.matrix_rank(covariance) == 6:
            distances.append(float(error @ np.linalg.solve(covariance, error)))
    return {"errors": errors, "chi2": distances}


def pose_error(true: np.ndarray, found: np.ndarray) -> np.ndarray:
    """Return wx wy wz tx ty tz with R_true = Exp(w) R and t_true = t + dt."""
    turn = true[:3, :3] @ found[:3, :3].T
    skew = 0.5 * (turn - turn.T)
    w = np.array([skew[2, 1], skew[0, 2], skew[1, 0]])
    return np.concatenate([w, true[:3, 3] - found[:3, 3]])
