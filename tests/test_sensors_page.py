"""Is the page of sensors what the code says?"""

import subprocess
import sys
from pathlib import Path

import pytest

from lidar_deflect import capture

ROOT = Path(__file__).parents[1]
TOOL = ROOT / "tools" / "sensors.py"


def test_the_page_is_current() -> None:
    if not TOOL.is_file():
        pytest.skip("the tools are not beside the tests")
    done = subprocess.run([sys.executable, TOOL, "--check"], check=False)
    assert done.returncode == 0, "run: python tools/sensors.py"


def test_the_page_names_every_model() -> None:
    page = (ROOT / "docs" / "sensors.md").read_text(encoding="utf-8")
    for name, title in capture.sensor_models():
        assert f"| `{name}` | {title} |" in page
