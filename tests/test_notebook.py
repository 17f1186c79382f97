"""Is what a notebook shows small, right and harmless?"""

import re

import numpy as np

from lidar_deflect.calibration import Calibration, Pose
from lidar_deflect.notebook import card
from lidar_deflect.pipeline import Test
from lidar_deflect.result import Result

BAD = "<script>alert(1)</script>"


def test_cells_are_text() -> None:
    shown = card(BAD, (BAD,), [(BAD, 1.25, None)], BAD)
    assert "<script" not in shown
    assert shown.count("&lt;script") == 4
    assert "1.250" in shown


def test_a_calibration_shows_where_its_lidars_stand() -> None:
    pose = np.eye(4)
    pose[:3, 3] = (3.0, -6.8, 86.0)
    covariance = np.diag(np.square([1e-4, 2e-4, 3e-4, 0.001, 0.002, 0.004]))
    found = Calibration((Pose(BAD, "", pose, covariance=covariance),), "network", (BAD,))
    shown = found._repr_html_()
    assert "<script" not in shown
    # twice the largest sigma: 4 mm and 0.3 mrad
    for number in ("86.000", "8.000", "0.600"):
        assert number in shown


def test_a_result_shows_its_largest_step(short_test) -> None:  # type: ignore[no-untyped-def]
    test = Test.load(short_test / "test.toml")
    result = test.measure(short_test / "capture.pcap", method="paper")
    assert isinstance(result, Result)
    shown = result._repr_html_()
    assert len(re.findall("<tr>", shown)) == 1 + len(test.config.sections)
    assert "at 100 %" in shown
    assert len(shown) < 20_000
