"""Tripods that move during a test: found, named, and followed to where they stand then."""

from lidar_deflect.drift.change import Change, estimate
from lidar_deflect.drift.marked import marked
from lidar_deflect.drift.move import Move
from lidar_deflect.drift.watch import Drift, static_cells, watch

__all__ = ["Change", "Drift", "Move", "estimate", "marked", "static_cells", "watch"]
