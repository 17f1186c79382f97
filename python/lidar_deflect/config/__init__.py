"""The configuration of a test: TOML in, checked and frozen models out. Defaults live here only.

One file per stage: `blade` (test, blade, sections), `lidars`, `survey` (control points, targets,
distances, priors), `channels` (wires, root, reference, load, prediction), `measure` (method,
the paper's parameters, gates); `model` joins them and checks what they must agree on; `read`,
`override` and `write` carry them in and out.
"""

from lidar_deflect.config.base import AXES, split_source
from lidar_deflect.config.blade import Blade, Section, TestInfo
from lidar_deflect.config.channels import Load, Prediction, Reference, Root, Wire
from lidar_deflect.config.lidars import Lidar, SensorAxes
from lidar_deflect.config.measure import Box, Degrees, Gates, Measure, Paper
from lidar_deflect.config.model import Config
from lidar_deflect.config.read import from_document, load
from lidar_deflect.config.survey import Calibrate, ControlPoint, Distance, Target
from lidar_deflect.config.write import config_hash, dump, json_schema

__all__ = [
    "AXES",
    "Blade",
    "Box",
    "Calibrate",
    "Config",
    "ControlPoint",
    "Degrees",
    "Distance",
    "Gates",
    "Lidar",
    "Load",
    "Measure",
    "Paper",
    "Prediction",
    "Reference",
    "Root",
    "Section",
    "SensorAxes",
    "Target",
    "TestInfo",
    "Wire",
    "config_hash",
    "dump",
    "from_document",
    "json_schema",
    "load",
    "split_source",
]
