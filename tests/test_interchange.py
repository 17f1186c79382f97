"""Do poses come back from every format as they went in, and are broken files told?"""

import contextlib
import json
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from conftest import command_line
from lidar_deflect import config as configs
from lidar_deflect import interchange
from lidar_deflect.calibration import Calibration, Pose
from lidar_deflect.errors import InvalidValueError
from lidar_deflect.interchange import Placed
from lidar_deflect.interchange.placed import Place, of_quaternion, quaternion
from lidar_deflect.interchange.yaml_subset import documents

SUFFIXES = (".toml", ".json", ".yaml", ".kitti", ".tum", ".txt")
HERE = Place(Path("here"), "top")


def some(count: int = 4, seed: int = 1) -> list[Placed]:
    random = np.random.default_rng(seed)
    return [Placed(f"L{n + 1}", pose(random)) for n in range(count)]


def pose(random: np.random.Generator) -> NDArray[np.float64]:
    matrix = np.eye(4)
    matrix[:3, :3] = Rotation.random(random_state=random).as_matrix()
    matrix[:3, 3] = random.uniform(-100, 100, 3)
    return matrix


@pytest.mark.parametrize("suffix", SUFFIXES)
def test_poses_come_back(suffix: str, tmp_path: Path) -> None:
    poses = some()
    path = interchange.write(tmp_path / f"poses{suffix}", poses)
    back = interchange.read(path)
    assert [one.name for one in back] == ["L1", "L2", "L3", "L4"]
    for one, other in zip(poses, back, strict=True):
        # Numbers are written in full: a quaternion costs some last digits.
        np.testing.assert_allclose(one.world_from_sensor, other.world_from_sensor, atol=1e-14)
        np.testing.assert_array_equal(one.world_from_sensor[:3, 3], other.world_from_sensor[:3, 3])


@settings(max_examples=300, deadline=None)
@given(st.lists(st.floats(-1, 1), min_size=4, max_size=4).filter(lambda q: np.linalg.norm(q) > 0.1))
def test_quaternions_are_scipy_s(xyzw: list[float]) -> None:
    rotation = Rotation.from_quat(xyzw)
    unit = np.array(xyzw) / np.linalg.norm(xyzw)
    matrix = of_quaternion((1, 2, 3), unit, HERE)
    np.testing.assert_allclose(matrix[:3, :3], rotation.as_matrix(), atol=1e-14)
    found = np.array(quaternion(matrix))
    assert found[3] >= 0
    assert min(np.abs(found - unit).max(), np.abs(found + unit).max()) < 1e-14


def test_half_turns_have_quaternions() -> None:
    for axis in np.vstack([np.eye(3), [0.6, 0.8, 0.0]]):
        matrix = np.eye(4)
        matrix[:3, :3] = Rotation.from_rotvec(np.pi * axis).as_matrix()
        found = quaternion(matrix)
        np.testing.assert_allclose(of_quaternion((0, 0, 0), found, HERE), matrix, atol=1e-14)


def test_kitti_and_4x4_are_read_by_numpy_and_yaml_by_another_reader(tmp_path: Path) -> None:
    from ruamel.yaml import YAML

    poses = some(2)
    stacked = np.array([one.world_from_sensor for one in poses])
    kitti = np.loadtxt(interchange.write(tmp_path / "p.kitti", poses))
    np.testing.assert_array_equal(kitti, stacked[:, :3].reshape(2, 12))
    plain = np.loadtxt(interchange.write(tmp_path / "p.txt", poses))
    np.testing.assert_array_equal(plain, stacked.reshape(8, 4))
    tum = np.loadtxt(interchange.write(tmp_path / "p.tum", poses))
    np.testing.assert_allclose(
        Rotation.from_quat(tum[:, 4:]).as_matrix(), stacked[:, :3, :3], atol=1e-14
    )
    text = interchange.write(tmp_path / "p.yaml", poses).read_text(encoding="utf-8")
    message = YAML(typ="safe").load(text)
    assert message == next(documents(tmp_path / "p.yaml", text))
    entry = message["transforms"][1]
    assert (entry["header"]["frame_id"], entry["child_frame_id"]) == ("world", "L2")
    turned = Rotation.from_quat([entry["transform"]["rotation"][key] for key in "xyzw"])
    np.testing.assert_allclose(turned.as_matrix(), stacked[1, :3, :3], atol=1e-14)


ECHO = """\
# ros2 topic echo /tf_static
transforms:
- header:
    stamp:
      sec: 1718000000
      nanosec: 5
    frame_id: map            # the yard
  child_frame_id: stand
  transform:
    translation:
      x: 10.0
      y: 0.0
      z: 0.0
    rotation:
      x: 0.0
      y: 0.0
      z: 0.7071067811865476
      w: 0.7071067811865476
---
transforms:
  - header: {frame_id: 'stand', stamp: {sec: 0, nanosec: 0}}
    child_frame_id: "os_sensor"
    transform:
      translation: {x: 1, y: 0.0, z: 2.5e0}
      rotation: {x: 0, y: 0, z: 0, w: 1}
---
"""


def test_transforms_of_a_tree_are_followed_to_the_world(tmp_path: Path) -> None:
    path = tmp_path / "tf.yaml"
    path.write_text(ECHO, encoding="utf-8")
    (found,) = interchange.read(path)
    assert found.name == "os_sensor"
    # A quarter turn to the left: one metre ahead of the stand is one to the left in the map.
    expected = [[0, -1, 0, 10], [1, 0, 0, 1], [0, 0, 1, 2.5], [0, 0, 0, 1]]
    np.testing.assert_allclose(found.world_from_sensor, expected, atol=1e-12)
    (own,) = interchange.read(path, world="stand")
    np.testing.assert_allclose(own.world_from_sensor[:3, 3], [1, 0, 2.5])
    with pytest.raises(InvalidValueError, match="frames under 'moon'"):
        interchange.read(path, world="moon")


def test_extrinsics_as_ouster_cli_writes_them(tmp_path: Path) -> None:
    path = tmp_path / "extrinsics.json"
    entry = {"source_frame": "122150000150", "destination_frame": "world"}
    entry |= {"p_x": 1.5, "p_y": -2, "p_z": 0, "q_w": 0, "q_x": 1, "q_y": 0, "q_z": 0}
    path.write_text(json.dumps({"transforms": [entry]}), encoding="utf-8")
    (found,) = interchange.read(path)
    assert found.name == "122150000150"
    np.testing.assert_array_equal(np.diag(found.world_from_sensor), [1, -1, -1, 1])
    np.testing.assert_array_equal(found.world_from_sensor[:3, 3], [1.5, -2, 0])


def test_the_command_goes_there_and_back(tmp_path: Path) -> None:
    poses = tuple(Pose(one.name, "10.0.0.1", one.world_from_sensor) for one in some(2))
    calibration = Calibration(poses, "closed_form").save(tmp_path / "calibration.toml")
    out = tmp_path / "extrinsics.json"
    done = command_line("poses", calibration, "-o", out, "--name", "L1=122150000150")
    assert done.code == 0, done.err
    frames = [entry["source_frame"] for entry in json.loads(out.read_text())["transforms"]]
    assert frames == ["122150000150", "L2"]
    back = tmp_path / "back.toml"
    done = command_line("poses", out, "-o", back, "--name", "122150000150=L1", "--json")
    assert [entry["name"] for entry in json.loads(done.out)["poses"]] == ["L1", "L2"]
    for one, other in zip(poses, Calibration.load(back).poses, strict=True):
        np.testing.assert_allclose(one.world_from_sensor, other.world_from_sensor, atol=1e-14)
    assert command_line("poses", out, "-o", back).code == 7  # exists
    assert command_line("poses", out).out.split()[:4] == ["sensor", "x", "m", "y"]


def test_poses_become_the_start_of_a_configuration(short_test: Path, tmp_path: Path) -> None:
    poses = [Placed(f"L{n}", one.world_from_sensor) for n, one in enumerate(some(4), 1)]
    extrinsics = interchange.write(tmp_path / "tf.yaml", poses[:2])
    test, out = short_test / "test.toml", tmp_path / "started.toml"
    done = command_line("poses", extrinsics, "-c", test, "-o", out)
    assert done.code == 0, done.err
    written = configs.load(out, check_files=False)
    for lidar, one in zip(written.lidars, poses, strict=True):
        if lidar.id in ("L1", "L2"):
            np.testing.assert_allclose(lidar.world_from_sensor, one.world_from_sensor, atol=1e-14)
        else:
            assert lidar.world_from_sensor == ()
    others = command_line("poses", extrinsics, "-c", test, "-o", tmp_path / "x.toml", *NAMES)
    assert others.code == 2
    assert "expected a lidar named A or B" in others.err


NAMES = ("--name", "L1=A", "--name", "L2=B")

MIRROR = "1 0 0 0\n0 1 0 0\n0 0 -1 0\n0 0 0 1\n"
SHEARED = "1 0.1 0 0\n0 1 0 0\n0 0 1 0\n0 0 0 1\n"
ROS_BAD = "header: {frame_id: a}\nchild_frame_id: b\ntransform:\n  translation: {x: 1, y: 2}\n"


@pytest.mark.parametrize(
    ("name", "text", "said"),
    [
        ("p.txt", MIRROR, "line 1: expected a rotation, found a mirror image"),
        ("p.txt", SHEARED, "line 1: expected a rotation, found a matrix whose axes are off by 0.1"),
        ("p.txt", "1 0 0\n", "line 1: expected 4 (4 x 4), 8 (TUM) or 12 (KITTI) numbers, found 3"),
        ("p.txt", "1 0 0 0\n0 1 0 0\n", "line 2: expected four rows for each sensor, found 2"),
        ("p.txt", "", "expected rows of numbers, found none"),
        ("p.txt", MIRROR.replace("0 0 0 1", "0 0 1 1"), "expected 0 0 0 1 as the last row"),
        ("p.kitti", "1 0 0 0 0 1 0 x 0 0 1 0\n", "line 1: expected a number, found 'x'"),
        ("p.kitti", "1 0 0 0 0 1 0 nan 0 0 1 0\n", "line 1: expected a finite number, found 'nan'"),
        ("p.tum", "0 1 2 3 0 0 0 2\n", "line 1: expected a quaternion of length 1, found length 2"),
        ("p.json", "{", "line 1: expected JSON"),
        ("p.json", "[]", 'top level: expected {"transforms": [...]}, found list'),
        ("p.json", '{"transforms": [{"source_frame": "a"}]}', "a name 'destination_frame'"),
        ("p.json", '{"a": [1, 2]}', "a: expected 4 x 4 numbers"),
        ("p.yaml", "a: [1, 2\n", "line 1: expected a comma or ]"),
        ("p.yaml", "a: 1\na: 2\n", "line 2: expected every key once, found 'a'"),
        ("p.yaml", "a: &x 1\n", "line 1: expected a plain value, found '&x 1'"),
        ("p.yaml", "- 1\n   - 2\n", "line 2: expected the indent of the lines before"),
        ("p.yaml", ROS_BAD, "transform 1: expected a mapping 'rotation'"),
        ("p.yaml", "# nothing\n", "expected transforms, found none"),
    ],
)
def test_broken_files_are_told_by_place_found_and_expected(
    name: str, text: str, said: str, tmp_path: Path
) -> None:
    path = tmp_path / name
    path.write_text(text, encoding="utf-8")
    with pytest.raises(InvalidValueError) as caught:
        interchange.read(path)
    assert said in str(caught.value)
    assert str(caught.value).startswith(str(path))
    assert caught.value.code == "poses.malformed"


def test_rings_and_two_parents_are_told(tmp_path: Path) -> None:
    def entry(parent: str, child: str) -> dict[str, object]:
        place = {"p_x": 0, "p_y": 0, "p_z": 0, "q_w": 1, "q_x": 0, "q_y": 0, "q_z": 0}
        return {"source_frame": child, "destination_frame": parent, **place}

    path = tmp_path / "p.json"
    cases = {
        "a ring through": [("b", "a"), ("a", "b"), ("a", "leaf")],
        "one parent of 'a'": [("x", "a"), ("y", "a")],
        "one world frame, found x, y": [("x", "a"), ("y", "b")],
    }
    for said, edges in cases.items():
        document = {"transforms": [entry(*edge) for edge in edges]}
        path.write_text(json.dumps(document), encoding="utf-8")
        with pytest.raises(InvalidValueError, match=said):
            interchange.read(path)


@settings(max_examples=400, deadline=None)
@given(st.text(alphabet=" -:{}[],#'\"\nab1.x&\t", max_size=60))
def test_any_text_is_read_or_told(text: str) -> None:
    with contextlib.suppress(InvalidValueError):
        list(documents(Path("any"), text))
