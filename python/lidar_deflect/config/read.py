"""From TOML to a checked configuration, and errors that name file, key, found and expected."""

import re
import tomllib
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any

from pydantic import BaseModel, ValidationError

from lidar_deflect.config.model import Config
from lidar_deflect.config.nearest import meaning_of, nearest_key, place_of
from lidar_deflect.config.override import apply_override
from lidar_deflect.errors import ConfigError, ConfigNotFoundError

MOST_SHOWN = 6
# Where pydantic speaks of Python's types, in the words of TOML.
WORDS = {
    "bool_type": "should be true or false",
    "float_type": "should be a number",
    "int_type": "should be a whole number",
    "model_type": "should be a table",
    "path_type": "should be the path of a file",
    "string_type": "should be text in quotes",
    "too_short": "should have at least one entry",
    "tuple_type": "should be a list",
}


def load(path: str | Path, overrides: Sequence[str] = (), *, check_files: bool = True) -> Config:
    """Read a configuration file.

    Parameters
    ----------
    path
        A TOML file. Relative paths in it, and in the overrides, are taken from its folder.
    overrides
        Changes on top of the file, ``key=value`` with a TOML value: ``paper.mu=2``,
        ``lidars.L1.model="vlp16"``, ``lidars.0.model=vlp16``.
    check_files
        Whether the files that it names must exist.

    Raises
    ------
    ConfigError
        With the file, the key, what was found and what was expected.
    ConfigNotFoundError
        If the file, or one that it names, is missing.
    """
    path = Path(path)
    document = _parsed(path)
    for override in overrides:
        apply_override(document, override)
    config = from_document(document, path.resolve().parent, str(path))
    if check_files:
        _check_files(config, str(path))
    return config


def from_document(
    document: Mapping[str, Any], folder: Path | None = None, origin: str = "configuration"
) -> Config:
    """Check a parsed TOML document; relative paths are taken from `folder` where it is given."""
    try:
        return Config.model_validate(document, context={"folder": folder})
    except ValidationError as error:
        raise _told(error, document, origin) from None


def _parsed(path: Path) -> dict[str, Any]:
    try:
        return tomllib.loads(path.read_bytes().decode("utf-8-sig"))
    except FileNotFoundError:
        hint = "lidar-deflect init CAPTURE... -o test.toml writes one"
        raise ConfigNotFoundError(f"no configuration {path}", hint=hint) from None
    except OSError as error:
        raise ConfigError(
            f"{path} cannot be read: {error.strerror}", code="config.unreadable"
        ) from None
    except UnicodeDecodeError as error:
        raise ConfigError(
            f"{path} is not UTF-8 text, at byte {error.start}", code="config.syntax"
        ) from None
    except tomllib.TOMLDecodeError as error:
        raise ConfigError(
            f"{path} is not TOML: {error}",
            code="config.syntax",
            facts=[("file", str(path))],
            hint="text stands in quotes, tables in [brackets], lists of tables in [[brackets]]",
        ) from None


def _told(error: ValidationError, document: Mapping[str, Any], origin: str) -> ConfigError:
    """Make one error of pydantic's list: unknown keys first, since they often explain the rest."""
    issues = error.errors(include_url=False)
    issues.sort(key=lambda issue: issue["type"] != "extra_forbidden")
    first, others = issues[0], issues[1:]
    place, found = _place_and_found(first, document)
    facts = [("file", origin), ("key", place), ("found", found), *_expected(first)]
    facts += [("also", _line(issue, document)) for issue in others[:MOST_SHOWN]]
    if len(others) > MOST_SHOWN:
        facts.append(("also", f"{len(others) - MOST_SHOWN} more"))
    code = {"extra_forbidden": "config.unknown_key", "missing": "config.missing_key"}
    return ConfigError(
        _message(first, place),
        code=code.get(first["type"], "config.value"),
        facts=[fact for fact in facts if fact[1]],
        hint=_hint(first),
    )


def _line(issue: Any, document: Mapping[str, Any]) -> str:
    place, _ = _place_and_found(issue, document)
    return _message(issue, place)


def _message(issue: Any, place: str) -> str:
    if issue["type"] == "extra_forbidden":
        return f"unknown key {place}"
    if issue["type"] == "missing":
        return f"{place} is missing"
    if issue["type"] == "contradiction":
        return f"{place}: {issue['msg']}"
    return f"{place}: {_requirement(issue)}"


def _requirement(issue: Any) -> str:
    text = WORDS.get(issue["type"], str(issue["msg"]))
    text = re.sub(r"^Input should (be )?", "should be ", text)
    return re.sub(r"^should be (have|hold) ", r"should \1 ", text)


def _expected(issue: Any) -> Iterator[tuple[str, str]]:
    if issue["type"] == "extra_forbidden":
        return
    context = issue.get("ctx", {})
    if issue["type"] == "contradiction":
        yield "expected", str(context["expected"])
        return
    if issue["type"] != "missing":
        yield "expected", re.sub(r"^should (be )?", "", _requirement(issue))
    yield "meaning", meaning_of(Config, issue["loc"])


def _hint(issue: Any) -> str | None:
    if issue["type"] == "extra_forbidden":
        return nearest_key(Config, issue["loc"])
    hint = issue.get("ctx", {}).get("hint")
    return str(hint) if hint else None


def _place_and_found(issue: Any, document: Mapping[str, Any]) -> tuple[str, str]:
    """Name the key as a user would write it, and show what stands there."""
    location = list(issue["loc"])
    if issue["type"] == "contradiction":
        inner = str(issue["ctx"]["key"])
        location += [int(part) if part.isdigit() else part for part in inner.split(".") if part]
    place, value = place_of(Config, location, document)
    return place, "" if issue["type"] == "missing" else _short(value)


def _short(value: object) -> str:
    text = "" if value is None else repr(value)
    return text if len(text) <= 80 else text[:77] + "..."


def _check_files(config: Config, origin: str) -> None:
    for key, path in _named_files(config):
        if key != "reference.capture" and not path.is_file():
            raise ConfigNotFoundError(
                f"{key} names a file that is not there",
                facts=[("file", origin), ("key", key), ("found", str(path))],
                hint="paths are relative to the configuration's folder",
            )


def _named_files(model: BaseModel, prefix: str = "") -> Iterator[tuple[str, Path]]:
    for name, value in model:
        for index, item in enumerate(value if isinstance(value, tuple) else (value,)):
            key = f"{prefix}{name}" + (f".{index}" if isinstance(value, tuple) else "")
            if isinstance(item, BaseModel):
                yield from _named_files(item, f"{key}.")
            elif isinstance(item, Path):
                yield key, item
