"""Do the examples in the documentation of the library hold?"""

import doctest
from importlib import import_module

import pytest


@pytest.mark.parametrize("name", ["clustering", "fitting"])
def test_examples_hold(name: str) -> None:
    module = import_module(f"lidar_deflect.{name}")
    result = doctest.testmod(module)
    assert result.attempted > 0
    assert result.failed == 0
