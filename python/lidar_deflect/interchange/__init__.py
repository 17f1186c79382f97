"""Poses to and from the files of other tools: every pose is ``world_from_sensor``, metres."""

from lidar_deflect.interchange.convert import FORMATS, convert, read, renamed, started, write
from lidar_deflect.interchange.placed import Placed

__all__ = ["FORMATS", "Placed", "convert", "read", "renamed", "started", "write"]
