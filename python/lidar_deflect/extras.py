"""Optional parts: importing one that is not installed says how to get it."""

from __future__ import annotations

from importlib import import_module
from typing import Any

from lidar_deflect.errors import MissingExtraError


def need(module: str, extra: str, what: str) -> Any:
    """Import a module of an optional part.

    Parameters
    ----------
    module
        Name of the module.
    extra
        Name of the part as ``pip install 'lidar-deflect[EXTRA]'`` takes it.
    what
        What it is needed for, for people.

    Raises
    ------
    MissingExtraError
        If it is not installed.
    """
    try:
        return import_module(module)
    except ImportError as error:
        raise MissingExtraError(
            f"{what} needs {module.partition('.')[0]}, which is not installed",
            hint=f"pip install 'lidar-deflect[{extra}]'",
        ) from error
