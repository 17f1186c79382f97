"""One yard: simulated, registered, held against the truth."""

from __future__ import annotations

import json
import tempfile
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from benches.accuracy.one import failure, pose_error
from benches.accuracy.registration import yards
from lidar_deflect.pipeline import Test
from lidar_deflect.simulation import simulate

if TYPE_CHECKING:
    from lidar_deflect.calibration import Calibration


def run(case: yards.Case) -> dict[str, Any]:
    """Register a yard; what fails is part of the record."""
    record: dict[str, Any] = {
        "number": case.number,
        "yard": case.yard,
        "sensor": case.sensor,
        "seed": case.seed,
    }
    with tempfile.TemporaryDirectory(prefix="yard-") as scratch:
        folder = simulate(yards.scene(case), Path(scratch) / "yard", threads=1)
        try:
            test = Test.load(folder / "test.toml")
            bare = Test(test.config.model_copy(update={"sections": ()}), test.path)
            calibration = bare.calibrate(folder / "capture.pcap", threads=1)
        except Exception as error:
            return record | failure(error)
        truth = json.loads((folder / "truth_lidars.json").read_text())
    return record | judged(calibration, [np.array(t["world_from_sensor"]) for t in truth])


def judged(calibration: Calibration, true: list[np.ndarray]) -> dict[str, Any]:
    """Return errors of the poses and their distance in the metric of the stated covariance."""
    names = [pose.id for pose in calibration.poses]
    errors = {
        pose.id: pose_error(truth, np.asarray(pose.world_from_sensor))
        for pose, truth in zip(calibration.poses, true, strict=True)
    }
    record: dict[str, Any] = {"errors": [errors[name].tolist() for name in names]}
    joint = getattr(calibration, "joint", None)
    if joint is not None:
        stacked = np.concatenate([errors[name] for name in joint.lidars])
        record["joint"] = distance(stacked, np.asarray(joint.covariance))
    blocks = [
        distance(errors[pose.id], np.asarray(pose.covariance))
        for pose in calibration.poses
        if pose.covariance is not None
    ]
    return record | {"single": blocks}


def distance(error: np.ndarray, covariance: np.ndarray) -> tuple[float, int]:
    """Return the squared distance and its degrees of freedom.

    Whitened by the standard deviations first: radians and metres differ by orders.
    """
    sigma = np.sqrt(np.diag(covariance))
    correlation = covariance / np.outer(sigma, sigma)
    whitened = error / sigma
    return float(whitened @ np.linalg.solve(correlation, whitened)), len(error)
