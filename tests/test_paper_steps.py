"""Do the paper's steps, called one by one, do what the paper says?"""

import numpy as np
import pytest

from lidar_deflect import paper
from lidar_deflect.errors import InvalidValueError, MeasurementError
from lidar_deflect.registration import Wall

UP = np.array([0.0, 1.0, 0.0])


def rotation(axis, angle):
    x, y, z = axis
    cross = np.array([[0, -z, y], [z, 0, -x], [-y, x, 0]])
    return np.eye(3) + np.sin(angle) * cross + (1 - np.cos(angle)) * cross @ cross


def test_the_corrected_rotation_is_one_and_the_printed_is_not():
    normal = np.array([np.sin(0.1), np.cos(0.1), 0.0])
    turn = paper.rotation_onto(normal, UP)
    assert np.allclose(turn @ normal, UP, atol=1e-12)
    assert np.isclose(np.linalg.det(turn), 1.0, atol=1e-12)
    assert np.allclose(paper.rotation_onto(-UP, UP) @ -UP, UP)
    with pytest.raises(InvalidValueError, match="direction of finite length"):
        paper.rotation_onto(np.zeros(3), UP)


def yard(tilt):
    """Ground 1.3 m below a tilted lidar and a wall 20 m beside it, as that lidar sees them."""
    rng = np.random.default_rng(7)
    ground = np.column_stack(
        [rng.uniform(-6, 6, 20_000), np.full(20_000, -1.3), rng.uniform(-2, 2, 20_000)]
    )
    wall = np.column_stack(
        [np.full(8_000, -20.0), rng.uniform(-1, 6, 8_000), rng.uniform(-5, 5, 8_000)]
    )
    blade = np.column_stack(
        [rng.uniform(-1, 1, 2_000), np.full(2_000, 7.0), rng.uniform(-2, 2, 2_000)]
    )
    points = np.concatenate([ground, wall, blade]) + rng.normal(0, 0.01, (30_000, 3))
    return (points @ tilt).astype(np.float32)


def test_a_tilted_lidar_finds_its_pose_from_ground_and_wall():
    tilt = rotation(UP, 0.06) @ rotation((1, 0, 0), 0.05) @ rotation((0, 0, 1), -0.08)
    position = np.array([3.0, -6.8, 86.0])
    found = paper.register(
        yard(tilt),
        position_m=position,
        mounting=np.eye(3),
        mounting_u_deg=10.0,
        wall=Wall(np.array([-17.0, 0.0, 100.0]), np.array([1.0, 0.0, 0.0]), 0.0),
        ground_range_m=None,
    )
    # Ground: 10 mm over 20 000 points and +-2 m along z gives some 0.1 mrad.
    assert np.abs(found.world_from_sensor[:3, :3] - tilt).max() < 5e-4
    assert np.array_equal(found.world_from_sensor[:3, 3], position)
    assert found.ground_range_m[1] == pytest.approx(0.9 * 7.0, abs=0.1)


def test_without_a_wall_the_yaw_of_the_mounting_stays():
    tilt = rotation((0, 0, 1), -0.08)
    found = paper.register(
        yard(tilt),
        position_m=np.zeros(3),
        mounting=np.eye(3),
        mounting_u_deg=10.0,
        wall=None,
        ground_range_m=(0.0, 5.0),
    )
    assert found.yaw is None
    assert np.abs(found.world_from_sensor[:3, :3] - tilt).max() < 5e-4


def test_pass_through_keeps_the_faces():
    kept = paper.pass_through([[0, 0, 0], [1, 1, 1], [1.01, 0, 0]], [[0, 0, 0], [1, 1, 1]])
    assert kept.tolist() == [True, True, False]
    with pytest.raises(InvalidValueError, match="box_m"):
        paper.pass_through([[0, 0, 0]], [[0, 0, 0], [1, 0, 1]])


def test_extremes_are_the_ends_of_each_line():
    xyz = [[0, 0, 80], [2, 0, 80], [-1, 1, 80], [5, 0, 81]]
    lines = paper.line_extremes(xyz, [3, 3, 3, 4], [-1, 0, 0])
    assert lines.ring.tolist() == [3, 4]
    assert lines.leading_m.tolist() == [[-1, 1, 80], [5, 0, 81]]
    assert lines.trailing_m.tolist() == [[2, 0, 80], [5, 0, 81]]


def wedge(tip_m):
    """Samples of both edges of a straight blade whose chord falls linearly to nothing."""
    z_m = np.linspace(80.0, 105.0, 40)
    edge = np.column_stack([0.05 * (tip_m - z_m), np.full(40, 0.5), z_m])
    return edge * [-1, 1, 1], edge


def test_the_tip_and_the_sections_of_a_wedge():
    contours = paper.Contours(*wedge(110.0))
    assert contours.tip("xoz") == pytest.approx([0.0, 0.5, 110.0], abs=1e-6)
    assert contours.length(84.0, 110.0) == pytest.approx(26.0, abs=1e-6)
    assert contours.before_tip(110.0, 26.0) == pytest.approx([0.0, 0.5, 84.0], abs=1e-3)
    assert contours.leading(100.0)[0] == pytest.approx([-0.5, 0.5, 100.0])
    with pytest.raises(MeasurementError) as caught:
        contours.tip("yoz")  # both edges lie at one height: they coincide there
    assert caught.value.code in ("measurement.ill_posed", "measurement.no_intersection")
    with pytest.raises(MeasurementError) as caught:
        paper.Contours(*wedge(500.0)).tip("xoz")
    assert caught.value.code == "measurement.no_intersection"
