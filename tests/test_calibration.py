"""Does a calibration come back from its file, and is a wrong file refused?"""

from pathlib import Path

import numpy as np
import pytest

from lidar_deflect.calibration import Calibration, Pose, with_reference
from lidar_deflect.errors import CalibrationError, OutputError


@pytest.fixture
def calibration() -> Calibration:
    pose = np.eye(4)
    pose[:3, 3] = [3.0, -6.8, 86.0]
    first = Pose("L1", "192.168.1.201", pose, {"ground_rms_m": np.float64(0.012), "yaw_deg": None})
    second = Pose("L2", "192.168.1.202", pose, {}, np.diag([1e-8] * 3 + [1e-6] * 3))
    return Calibration((first, second), "closed_form", ("no surveyed wall",))


def test_the_file_gives_the_same_poses(calibration: Calibration, tmp_path: Path) -> None:
    path = with_reference(calibration, "paper", {"state": {"s_m": np.array([84.0])}}).save(
        tmp_path / "calibration.toml"
    )
    again = Calibration.load(path)
    assert np.array_equal(
        again.pose("L1").world_from_sensor, calibration.pose("L1").world_from_sensor
    )
    assert np.array_equal(again.pose("L2").covariance, calibration.pose("L2").covariance)
    assert again.pose("L1").evidence == {"ground_rms_m": 0.012}
    assert again.warnings == calibration.warnings
    assert again.reference["paper"]["state"]["s_m"] == [84.0]


def test_a_file_is_not_overwritten_unasked(calibration: Calibration, tmp_path: Path) -> None:
    path = calibration.save(tmp_path / "calibration.toml")
    before = path.read_bytes()
    with pytest.raises(OutputError, match="exists already"):
        calibration.save(path)
    assert path.read_bytes() == before
    assert [entry.name for entry in tmp_path.iterdir()] == ["calibration.toml"]


@pytest.mark.parametrize(
    ("text", "found"),
    [
        ("", "no or another schema"),
        ("no toml", "Expected '='"),
        ('schema = "lidar-deflect.calibration/1"\nlidars = [{id = "L1"}]', "no or another source"),
    ],
)
def test_another_file_is_refused_with_the_reason(tmp_path: Path, text: str, found: str) -> None:
    path = tmp_path / "calibration.toml"
    path.write_text(text)
    with pytest.raises(CalibrationError) as caught:
        Calibration.load(path)
    assert found in dict(caught.value.facts)["found"]


def test_an_unknown_lidar_is_named_with_the_known_ones(calibration: Calibration) -> None:
    with pytest.raises(CalibrationError, match="'L9'") as caught:
        calibration.pose("L9")
    assert dict(caught.value.facts) == {"lidars": "L1, L2"}
