"""Is the root's own motion taken off exactly?"""

import numpy as np
from scipy.spatial.transform import Rotation

from lidar_deflect.channels import Channel
from lidar_deflect.measurement import root


def test_a_turned_root_leaves_no_deflection():
    still = np.array([[[0.4, 1.2, 84.0], [0.2, 1.9, 110.0]]])
    rotation = np.array([[2e-3, -1e-3, 4e-3]])
    moved = Rotation.from_rotvec(rotation[0]).apply(still[0])[None]
    # Third order: |w|^3 / 6 x 110 m is below 2 um.
    assert np.abs(root.taken_off(moved, rotation) - still).max() < 2e-6
    assert np.abs(moved - still).max() > 0.1


def test_an_axis_without_a_channel_counts_as_still():
    time_ns = np.array([0, 1_000_000_000])
    channel = Channel("root_rz", time_ns, np.array([0.0, 1e-3]), "rad")
    assert root.rotation_rad([channel], time_ns).tolist() == [[0, 0, 0], [0, 0, 1e-3]]
    assert root.rotation_rad([], time_ns) is None
