"""How far is the beam method from the truth where no drawing of the blade is given (simulated)?"""

import numpy as np
import pytest

import lidar_deflect as ld
from lidar_deflect.result import Result
from scenes import SCENES, configuration, needs_scenes
from test_beam import SEED, calibration, errors, hold_means

pytestmark = needs_scenes

HOLD_M = {"edge": 0.020, "flap": 0.0375}
"""Largest error of any component of the deflection averaged over a hold."""


@pytest.fixture(scope="module", params=["edge", "flap"])
def measured(request: pytest.FixtureRequest, tmp_path_factory: pytest.TempPathFactory) -> Result:
    name = request.param
    lines = configuration(name).splitlines()
    path = tmp_path_factory.mktemp(name) / "test.toml"
    path.write_text("\n".join(x for x in lines if not x.startswith(("geometry", "contours"))))
    poses = calibration(name, SEED)
    return ld.Test.load(path).measure(SCENES / name / "capture.pcap.gz", calibration=poses)


def test_holds_are_right_to_centimetres(measured: Result) -> None:
    means = hold_means(errors(measured))
    worst = float(np.abs(means.select("x", "y", "z").to_numpy()).max())
    assert worst <= HOLD_M[measured.config.test.id]


def test_the_run_says_that_the_shape_was_learned(measured: Result) -> None:
    assert any("no drawing" in text for text in measured.run["warnings"])
