"""From a configuration to TOML, to its hash and to its JSON schema."""

import hashlib
from pathlib import Path
from typing import Any

import tomlkit
from pydantic import BaseModel
from tomlkit.items import AoT, Array

from lidar_deflect.config.base import AXES
from lidar_deflect.config.model import Config

AXIS_OF_VECTOR = {vector: name for name, vector in AXES.items()}
DIRECTIONS = {"leading_edge", "suction_side", "direction", "x", "y", "z"}


def dump(config: Config) -> str:
    """Write the resolved configuration as TOML: every key that has a value, paths absolute.

    ``load`` of the text gives a configuration equal to this one.
    """
    document = tomlkit.document()
    for name, value in config:
        if isinstance(value, BaseModel):
            document.add(name, _table(value))
        elif value:
            document.add(name, _tables(value))
    return tomlkit.dumps(document)


def config_hash(config: Config) -> str:
    """Hash what a configuration says, wherever its files lie: SHA-256 in hexadecimal."""
    return hashlib.sha256(dump(_without_folders(config)).encode()).hexdigest()


def json_schema() -> dict[str, Any]:
    """Return the JSON schema of the configuration."""
    schema = Config.model_json_schema()
    schema["$schema"] = "https://json-schema.org/draft/2020-12/schema"
    schema["title"] = "Configuration of lidar-deflect"
    return schema


def _table(model: BaseModel) -> Any:
    table = tomlkit.table()
    for name, value in model:
        if value is not None:
            table.add(name, _item(name, value))
    return table


def _tables(models: tuple[BaseModel, ...]) -> AoT:
    tables = tomlkit.aot()
    for model in models:
        tables.append(_table(model))
    return tables


def _item(name: str, value: Any) -> Any:
    if isinstance(value, BaseModel):
        inline = tomlkit.inline_table()
        for key, inner in value:
            inline.add(key, _item(key, inner))
        return inline
    if name in DIRECTIONS and value in AXIS_OF_VECTOR:
        return AXIS_OF_VECTOR[value]
    return _array(value) if isinstance(value, tuple) else _scalar(value)


def _array(values: tuple[Any, ...]) -> Array:
    array = tomlkit.array()
    for value in values:
        array.append(_array(value) if isinstance(value, tuple) else _scalar(value))
    return array


def _scalar(value: Any) -> Any:
    return value.as_posix() if isinstance(value, Path) else value


def _without_folders(model: Any) -> Any:
    """Copy a configuration with every path cut down to the name of its file."""
    if isinstance(model, BaseModel):
        return model.model_copy(update={name: _without_folders(value) for name, value in model})
    if isinstance(model, tuple):
        return tuple(_without_folders(value) for value in model)
    return Path(model.name) if isinstance(model, Path) else model
