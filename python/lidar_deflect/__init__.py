"""Large 3D deflections of wind turbine blades from the raw packets of several lidars.

>>> import lidar_deflect as ld
>>> test = ld.Test.load("test.toml")  # doctest: +SKIP
>>> result = test.measure("run7.pcapng")  # doctest: +SKIP
>>> result.deflection  # doctest: +SKIP
"""

from importlib import import_module
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from lidar_deflect.calibration import Calibration as Calibration
    from lidar_deflect.capture import Capture as Capture
    from lidar_deflect.capture import Sweep as Sweep
    from lidar_deflect.capture import open as open  # noqa: A004  # ld.open, as in gzip.open
    from lidar_deflect.clustering import RadiusModel as RadiusModel
    from lidar_deflect.clustering import dbscan as dbscan
    from lidar_deflect.errors import LidarDeflectError as LidarDeflectError
    from lidar_deflect.explanation import explain as explain
    from lidar_deflect.pipeline import Test as Test
    from lidar_deflect.result import Result as Result
    from lidar_deflect.scene import Scene as Scene
    from lidar_deflect.simulation import simulate as simulate

_HOME = {
    "Calibration": "calibration",
    "Capture": "capture",
    "LidarDeflectError": "errors",
    "RadiusModel": "clustering",
    "Result": "result",
    "Scene": "scene",
    "Sweep": "capture",
    "Test": "pipeline",
    "dbscan": "clustering",
    "explain": "explanation",
    "open": "capture",
    "simulate": "simulation",
}
"""Which module each public name lives in; it is imported when the name is first used."""

__all__ = ["__version__", *sorted(_HOME)]  # all are strings


def __getattr__(name: str) -> Any:
    if name == "__version__":
        from importlib.metadata import version

        return version("lidar-deflect")
    if name in _HOME:
        return getattr(import_module(f"lidar_deflect.{_HOME[name]}"), name)
    raise AttributeError(f"module 'lidar_deflect' has no attribute {name!r}")


def __dir__() -> list[str]:
    return sorted(__all__)
