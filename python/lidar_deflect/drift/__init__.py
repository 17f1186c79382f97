"""Tripods that move during a test: every lidar's static surfaces, watched window by window."""

from lidar_deflect.drift.change import Change, estimate
from lidar_deflect.drift.watch import Drift, watch

__all__ = ["Change", "Drift", "estimate", "watch"]
