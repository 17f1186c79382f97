"""Schemas, builders and files of every table.

`SCHEMAS` declares them, `build` makes a checked frame, `write` and `read` keep it on disk.
"""

from lidar_deflect.tables.build import Values, build, check, empty
from lidar_deflect.tables.catalogue import RETURN_KINDS, SCHEMA_VERSION, SCHEMAS, STATUSES
from lidar_deflect.tables.describe import json_schema, markdown
from lidar_deflect.tables.files import HASH_KEY, metadata, own_metadata, read, write
from lidar_deflect.tables.schema import UTC_NS, Column, Table, nearest_hint

__all__ = [
    "HASH_KEY",
    "RETURN_KINDS",
    "SCHEMAS",
    "SCHEMA_VERSION",
    "STATUSES",
    "UTC_NS",
    "Column",
    "Table",
    "Values",
    "build",
    "check",
    "empty",
    "json_schema",
    "markdown",
    "metadata",
    "nearest_hint",
    "own_metadata",
    "read",
    "write",
]
