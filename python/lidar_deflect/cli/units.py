"""What options say of single lidars and sections, as changes to a configuration."""

from __future__ import annotations

import json
from pathlib import Path
from typing import TYPE_CHECKING

import typer

from lidar_deflect.cli.options import beam_files, sensor_models

if TYPE_CHECKING:
    from collections.abc import Sequence

    from lidar_deflect.config import Config, Lidar


def overrides(
    path: Path,
    sets: Sequence[str] | None,
    sensors: Sequence[str] | None = None,
    beams: Sequence[str] | None = None,
) -> list[str]:
    """Join ``--set``, ``--sensor`` and ``--beams`` to overrides of the configuration at `path`."""
    changes = list(sets or ())
    models, files = sensor_models(sensors), beam_files(beams)
    if not models and not files:
        return changes
    from lidar_deflect import config as configs

    config = configs.load(path, changes)
    for source, model in models.items():
        changes.append(f"lidars.{_index(config, source)}.model={json.dumps(model)}")
    for source, names in files.items():
        paths = json.dumps([str(Path(name).resolve()) for name in names])
        changes.append(f"lidars.{_index(config, source)}.beams={paths}")
    return changes


def _index(config: Config, source: str) -> int:
    """Find the one lidar that an id, an address or ``address:port`` names."""
    if not source and len(config.lidars) == 1:
        return 0
    found = [index for index, lidar in enumerate(config.lidars) if _is(lidar, source)]
    if len(found) != 1:
        known = ", ".join(f"{lidar.id} ({lidar.source})" for lidar in config.lidars)
        name = source or "a file without a source"
        raise typer.BadParameter(f"{name} names no lidar of the configuration; known: {known}")
    return found[0]


def _is(lidar: Lidar, source: str) -> bool:
    from lidar_deflect.config import split_source

    if source in (lidar.id, lidar.source):
        return True
    try:
        return lidar.source is not None and split_source(source)[0] == split_source(lidar.source)[0]
    except ValueError:
        return False


def narrowed(
    config: Config, lidars: Sequence[str] | None, sections: Sequence[str] | None
) -> Config:
    """Keep only the named lidars and sections, and what belongs to them."""
    kept = {config.lidars[_index(config, source)].id for source in lidars or ()}
    kept = kept or {lidar.id for lidar in config.lidars}
    names = set(sections or [section.name for section in config.sections])
    unknown = names - {section.name for section in config.sections}
    if unknown:
        known = ", ".join(section.name for section in config.sections)
        raise typer.BadParameter(f"--section {min(unknown)}: expected one of {known}")
    return config.model_copy(
        update={
            "lidars": tuple(lidar for lidar in config.lidars if lidar.id in kept),
            "distance": tuple(each for each in config.distance if kept.issuperset(each.between)),
            "sections": tuple(each for each in config.sections if each.name in names),
            "wires": tuple(wire for wire in config.wires if wire.section in names),
        }
    )
