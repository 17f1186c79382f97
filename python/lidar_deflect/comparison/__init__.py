"""Measured deflections against draw wires, predictions, truth and other runs.

`compare` makes the table, `save` keeps it, `table1` and `table2` set the paper's tables as text;
`recognise` says what a reference was taken for.
"""

from lidar_deflect.comparison.compare import ComparisonWarning, compare, configured, save
from lidar_deflect.comparison.error import error_percent
from lidar_deflect.comparison.methods import LIDAR, by_method, largest_step, wire_names
from lidar_deflect.comparison.reference import KINDS, Kind, Reference, recognise
from lidar_deflect.comparison.text import aligned, table1, table2

__all__ = [
    "KINDS",
    "LIDAR",
    "ComparisonWarning",
    "Kind",
    "Reference",
    "aligned",
    "by_method",
    "compare",
    "configured",
    "error_percent",
    "largest_step",
    "recognise",
    "save",
    "table1",
    "table2",
    "wire_names",
]
