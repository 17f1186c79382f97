"""Do the poses of complete simulated tests come back, with a covariance that is true?

All figures are of simulated data. The limits are those that a registration of a test yard is asked
for; the survey of the scenes has 5 mm sigma per coordinate.
"""

import json
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

import lidar_deflect as ld
from lidar_deflect.calibrate import calibrate
from lidar_deflect.calibration import Calibration
from lidar_deflect.config import SensorAxes
from lidar_deflect.errors import CalibrationError
from lidar_deflect.measurement import unloaded
from lidar_deflect.opened import OpenedTest
from scenes import SCENES, configuration, needs_scenes

if TYPE_CHECKING:
    from lidar_deflect.config import Config
    from lidar_deflect.measurement.unloaded import HoldCloud

pytestmark = needs_scenes

TURN_RAD, ACROSS_M, ALONG_M = 1e-3, 6e-3, 15e-3
NEIGHBOUR_ACROSS_M = 4e-3
CHI2_95_OF_6 = 12.59


class Scene:
    """One scene: its configuration and what its lidars saw unloaded."""

    def __init__(self, name: str, folder: Path) -> None:
        path = folder / f"{name}.toml"
        path.write_text(configuration(name))
        self.config: Config = ld.Test.load(path).config
        capture = SCENES / name / "capture.pcap.gz"
        opened = OpenedTest.of(self.config, [capture], progress=None, threads=None)
        window = opened.unloaded_ns(None, None)
        self.clouds: dict[str, HoldCloud] = dict(
            unloaded.collect_all(opened.capture, opened.lidars, window)
        )
        truth = json.loads((SCENES / name / "truth_lidars.json").read_text())
        self.truth = [np.array(lidar["world_from_sensor"]) for lidar in truth]

    def errors(self, calibration: Calibration) -> NDArray[np.float64]:
        """Truth minus estimate, shape (lidars, 6): wx wy wz tx ty tz."""
        pairs = zip(self.truth, calibration.poses, strict=True)
        return np.array([_error(true, pose.world_from_sensor) for true, pose in pairs])


def _error(true: NDArray[np.float64], found: NDArray[np.float64]) -> NDArray[np.float64]:
    turn = true[:3, :3] @ found[:3, :3].T
    skew = turn - turn.T
    return np.r_[skew[2, 1], skew[0, 2], skew[1, 0], 2.0 * (true - found)[:3, 3]] / 2.0


@pytest.fixture(scope="module")
def scenes(tmp_path_factory: pytest.TempPathFactory) -> dict[str, Scene]:
    folder = tmp_path_factory.mktemp("registration")
    return {name: Scene(name, folder) for name in ("edge", "flap")}


@pytest.fixture(scope="module")
def found(scenes: dict[str, Scene]) -> dict[str, Calibration]:
    return {name: calibrate(scene.config, scene.clouds) for name, scene in scenes.items()}


@pytest.mark.parametrize("name", ["edge", "flap"])
def test_every_pose_is_within_a_milliradian_and_six_millimetres(
    scenes: dict[str, Scene], found: dict[str, Calibration], name: str
) -> None:
    errors = np.abs(scenes[name].errors(found[name]))
    assert errors[:, :3].max() < TURN_RAD
    assert errors[:, 3:5].max() < ACROSS_M
    assert errors[:, 5].max() < ALONG_M
    between = np.abs(np.diff(scenes[name].errors(found[name]), axis=0))
    assert between[:, 3:5].max() < NEIGHBOUR_ACROSS_M


def test_the_joint_regions_hold_the_truth(
    scenes: dict[str, Scene], found: dict[str, Calibration]
) -> None:
    inside = 0
    for name, scene in scenes.items():
        for pose, error in zip(found[name].poses, scene.errors(found[name]), strict=True):
            assert pose.covariance is not None
            inside += error @ np.linalg.solve(pose.covariance, error) < CHI2_95_OF_6
    assert inside >= 7  # of 8


def test_the_file_carries_the_joint_covariance(
    found: dict[str, Calibration], tmp_path: Path
) -> None:
    calibration = found["edge"]
    again = Calibration.load(calibration.save(tmp_path / "calibration.toml"))
    assert calibration.joint is not None
    assert again.joint is not None
    assert again.joint.lidars == ("L1", "L2", "L3", "L4")
    assert np.array_equal(again.joint.covariance, calibration.joint.covariance)
    assert again.joint.full_covariance.shape == (4 * (8 + 16), 4 * (8 + 16))
    # The full covariance holds the poses' at the first six places of every lidar.
    places = np.concatenate([24 * k + np.arange(6) for k in range(4)])
    inner = again.joint.full_covariance[np.ix_(places, places)]
    assert np.array_equal(inner, again.joint.covariance)
    for own, kept in zip(calibration.joint.nuisances, again.joint.nuisances, strict=True):
        assert np.array_equal(own.channel_offset_m, kept.channel_offset_m)


def test_without_a_wall_yaw_is_named(scenes: dict[str, Scene]) -> None:
    config = scenes["edge"].config
    ground = tuple(point for point in config.control if point.on == "ground")
    calibration = calibrate(config.model_copy(update={"control": ground}), scenes["edge"].clouds)
    assert any("about the vertical (yaw)" in warning for warning in calibration.warnings)
    assert calibration.evidence["verdict"].startswith("poor")


@pytest.mark.parametrize(("number", "axis"), [(3, 1), (26, 0)])
def test_a_control_point_off_by_a_hand_is_left_out_by_name(
    scenes: dict[str, Scene], number: int, axis: int
) -> None:
    config = scenes["edge"].config
    points = list(config.control)
    xyz = list(points[number].xyz_m)
    xyz[axis] += 0.2
    points[number] = points[number].model_copy(update={"xyz_m": tuple(xyz)})
    calibration = calibrate(
        config.model_copy(update={"control": tuple(points)}), scenes["edge"].clouds
    )
    said = [w for w in calibration.warnings if "was left out" in w]
    assert len(said) == 1
    assert f"control point {number + 1} on" in said[0]
    errors = np.abs(scenes["edge"].errors(calibration))
    assert errors[:, :3].max() < 1.5 * TURN_RAD


def leaning(lidar: Any, turn_rad: NDArray[np.float64]) -> Any:
    """Give a lidar axes that are off by a turn."""
    turned = Rotation.from_rotvec(turn_rad).as_matrix() @ np.array(lidar.nominal_rotation())
    axes = {name: tuple(map(float, turned[:, k])) for k, name in enumerate("xyz")}
    return lidar.model_copy(update={"axes": SensorAxes.model_validate(axes)})


@pytest.mark.parametrize("name", ["edge", "flap"])
def test_axes_off_by_twenty_degrees_suffice(scenes: dict[str, Scene], name: str) -> None:
    scene, random = scenes[name], np.random.default_rng(3)
    turns = [random.normal(size=3) for _ in scene.config.lidars]
    lidars = tuple(
        leaning(lidar, np.radians(20.0) * turn / np.linalg.norm(turn))
        for lidar, turn in zip(scene.config.lidars, turns, strict=True)
    )
    calibration = calibrate(scene.config.model_copy(update={"lidars": lidars}), scene.clouds)
    errors = np.abs(scene.errors(calibration))
    assert errors[:, :3].max() < TURN_RAD
    assert errors[:, 3:5].max() < ACROSS_M


@pytest.mark.parametrize("name", ["edge", "flap"])
def test_without_axes_ground_and_wall_tell_how_a_lidar_stands(
    scenes: dict[str, Scene], name: str
) -> None:
    scene = scenes[name]
    lidars = tuple(lidar.model_copy(update={"axes": None}) for lidar in scene.config.lidars)
    calibration = calibrate(scene.config.model_copy(update={"lidars": lidars}), scene.clouds)
    errors = np.abs(scene.errors(calibration))
    assert errors[:, :3].max() < TURN_RAD
    assert errors[:, 3:5].max() < ACROSS_M


def test_what_is_missing_is_said_where_nothing_tells_how_a_lidar_stands(
    scenes: dict[str, Scene],
) -> None:
    scene = scenes["edge"]
    lidars = tuple(lidar.model_copy(update={"axes": None}) for lidar in scene.config.lidars)
    ground = tuple(point for point in scene.config.control if point.on == "ground")
    config = scene.config.model_copy(update={"lidars": lidars, "control": ground})
    with pytest.raises(CalibrationError, match="lidar L1 has no axes") as caught:
        calibrate(config, scene.clouds)
    assert caught.value.code == "calibration.no_start"
    assert ("surveyed", "ground") in caught.value.facts
    assert "with position_m two of ground, walls and targets" in str(caught.value.hint)


def test_two_lidars_that_are_exchanged_are_refused(scenes: dict[str, Scene]) -> None:
    scene = scenes["edge"]
    exchanged: dict[str, Any] = dict(scene.clouds)
    exchanged["L1"], exchanged["L3"] = scene.clouds["L3"], scene.clouds["L1"]
    with pytest.raises(CalibrationError) as caught:
        calibrate(scene.config, exchanged)
    assert caught.value.code == "calibration.exchanged"
    assert {"L1", "L3"} <= {name for name, _ in caught.value.facts}


def test_the_order_of_the_echoes_does_not_matter(
    scenes: dict[str, Scene], found: dict[str, Calibration]
) -> None:
    order = np.random.default_rng(1).permutation(len(scenes["edge"].clouds["L1"].xyz))
    cloud = scenes["edge"].clouds["L1"]
    mixed = replace(
        cloud, xyz=cloud.xyz[order], ring=cloud.ring[order], azimuth_deg=cloud.azimuth_deg[order]
    )
    again = calibrate(scenes["edge"].config, scenes["edge"].clouds | {"L1": mixed})
    for pose, before in zip(again.poses, found["edge"].poses, strict=True):
        # Sums in another order differ in their last bits only.
        assert np.allclose(pose.world_from_sensor, before.world_from_sensor, atol=2e-5)
