"""Changes to a configuration from the command line: ``key.sub=value``."""

import difflib
import tomllib
from typing import Any

from lidar_deflect.errors import ConfigError


def apply_override(document: dict[str, Any], text: str) -> None:
    """Change one key of a parsed TOML document in place.

    Entries of a list of tables are named by their ``id`` or ``name``, or by their index. What is
    no TOML value is taken as text, so that a shell needs no second pair of quotes.
    """
    key, equals, value = text.partition("=")
    parts = _parts(key.strip()) if equals else None
    if not parts:
        raise _refused(text, "expected key=value, such as paper.mu=2 or lidars.L1.model=vlp16")
    _assign(document, parts, _value(value.strip()), text)


def _parts(key: str) -> list[str] | None:
    """Split a dotted key as TOML does, so that a quoted part may hold dots."""
    try:
        inner: Any = tomllib.loads(f"{key} = 0")
    except tomllib.TOMLDecodeError:
        return None
    parts: list[str] = []
    while isinstance(inner, dict):
        if len(inner) != 1:
            return None
        name, inner = next(iter(inner.items()))
        parts.append(name)
    return parts


def _value(text: str) -> Any:
    try:
        document = tomllib.loads(f"value = {text}")
    except tomllib.TOMLDecodeError:
        return text
    return document["value"] if len(document) == 1 else text


def _assign(document: dict[str, Any], parts: list[str], value: Any, text: str) -> None:
    target: Any = document
    for part, following in zip(parts, [*parts[1:], None], strict=True):
        if isinstance(target, list):
            index = _index(target, part, text)
            if following is None:
                target[index] = value
                return
            target = target[index]
        elif isinstance(target, dict):
            if following is None:
                target[part] = value
                return
            target = target.setdefault(part, {})
        else:
            raise _refused(text, f"nothing can be set inside {target!r}")


def _index(entries: list[Any], part: str, text: str) -> int:
    names = [_name(entry) for entry in entries]
    if part in names:
        return names.index(part)
    if part.isdecimal() and int(part) < len(entries):
        return int(part)
    known = [name for name in names if name is not None]
    near = difflib.get_close_matches(part, known, n=1, cutoff=0.5)
    numbers = f"0 to {len(entries) - 1}" if entries else "nothing: the list is empty"
    expected = "one of " + ", ".join([*known, numbers])
    hint = f"did you mean {near[0]}?" if near else None
    raise _refused(text, f"no entry {part!r}; {expected}", hint)


def _name(entry: Any) -> str | None:
    name = entry.get("id", entry.get("name")) if isinstance(entry, dict) else None
    return name if isinstance(name, str) else None


def _refused(text: str, why: str, hint: str | None = None) -> ConfigError:
    return ConfigError(f"--set {text}: {why}", code="config.override", hint=hint)
