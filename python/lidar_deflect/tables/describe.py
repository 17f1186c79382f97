"""Declared tables for readers and programs: docs/tables.md and `schema tables`."""

import polars as pl

from lidar_deflect.tables.catalogue import SCHEMA_VERSION, SCHEMAS
from lidar_deflect.tables.schema import Column, Table

_INTRODUCTION = """# Tables

Made from the declarations in `lidar_deflect.tables`; a test keeps this page current.
Missing is null, never 0, -1 or NaN. Times are `datetime[ns, UTC]`; `t_s` is seconds since the
first accepted lidar packet. Lengths are metres in the world frame. Every file carries
`lidar_deflect.schema_version`, `lidar_deflect.program_version`, `lidar_deflect.table` and
`configuration_hash` in its parquet metadata.
"""


def markdown() -> str:
    """Return docs/tables.md."""
    return "\n".join([_INTRODUCTION, *(_section(table) for table in SCHEMAS.values())])


def _section(table: Table) -> str:
    head = ["| column | type | unit | null | meaning |", "|---|---|---|---|---|"]
    rows = [_row(column) for column in table.columns]
    return "\n".join([f"## {table.name}", "", f"One row per {table.row}.", "", *head, *rows, ""])


def _row(column: Column) -> str:
    null = "yes" if column.nullable else ""
    kind = _type_words(column.dtype)
    return f"| `{column.name}` | {kind} | {column.unit} | {null} | {column.meaning} |"


def _type_words(dtype: pl.DataType) -> str:
    if isinstance(dtype, pl.Datetime):
        return "datetime[ns, UTC]"
    if isinstance(dtype, pl.Enum):
        return "enum"
    names = {"Float64": "f64", "Float32": "f32", "String": "str", "Boolean": "bool"}
    return names.get(str(dtype), str(dtype).lower().replace("uint", "u").replace("int", "i"))


def json_schema() -> dict[str, object]:
    """Return the JSON schema of rows of every table, as `schema tables` prints it."""
    return {
        "$schema": "https://json-schema.org/draft/2020-12/schema",
        "title": "Tables of lidar-deflect",
        "schema": f"lidar-deflect/tables/{SCHEMA_VERSION}",
        "$defs": {name: _rows(table) for name, table in SCHEMAS.items()},
    }


def _rows(table: Table) -> dict[str, object]:
    return {
        "type": "array",
        "description": f"one row per {table.row}",
        "items": {
            "type": "object",
            "properties": {column.name: _property(column) for column in table.columns},
            "required": list(table.names),
            "additionalProperties": False,
        },
    }


def _property(column: Column) -> dict[str, object]:
    facts = _json_type(column.dtype)
    if column.nullable:
        facts["type"] = [facts["type"], "null"]
    return {**facts, "description": column.meaning, "x-unit": column.unit}


def _json_type(dtype: pl.DataType) -> dict[str, object]:
    if isinstance(dtype, pl.Datetime):
        return {"type": "string", "format": "date-time"}
    if isinstance(dtype, pl.Enum):
        return {"type": "string", "enum": dtype.categories.to_list()}
    if isinstance(dtype, pl.Boolean):
        return {"type": "boolean"}
    if dtype.is_unsigned_integer():
        return {"type": "integer", "minimum": 0}
    if dtype.is_integer():
        return {"type": "integer"}
    return {"type": "number" if dtype.is_float() else "string"}
