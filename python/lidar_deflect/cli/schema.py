"""``lidar-deflect schema``: JSON schemas of the configuration and of the tables."""

from enum import StrEnum
from typing import Annotated, Any

import typer

from lidar_deflect.cli.talk import Talk, to_json


class What(StrEnum):
    """What a schema is wanted of."""

    CONFIG = "config"
    TABLES = "tables"


def schema(
    what: Annotated[What, typer.Argument(help="config, or tables.")],
) -> None:
    """Print a JSON schema."""
    document = _config() if what is What.CONFIG else _tables()
    Talk().result(document, to_json(document))


def _config() -> dict[str, Any]:
    from lidar_deflect.config import json_schema

    return json_schema()


def _tables() -> dict[str, Any]:
    from lidar_deflect import tables

    return tables.json_schema()
