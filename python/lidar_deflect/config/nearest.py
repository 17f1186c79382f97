"""Walks the models by key: what a key means, which known key is nearest to a misspelt one."""

import difflib
import types
from collections.abc import Iterator, Mapping, Sequence
from typing import Any, get_args

from pydantic import BaseModel
from pydantic.fields import FieldInfo

Location = Sequence[int | str]


def _models_in(annotation: Any) -> Iterator[type[BaseModel]]:
    if isinstance(annotation, type) and not isinstance(annotation, types.GenericAlias):
        if issubclass(annotation, BaseModel):
            yield annotation
        return
    for argument in get_args(annotation):
        yield from _models_in(argument)


def table_model(field: FieldInfo) -> type[BaseModel] | None:
    """Return the model of a key that is a table or a list of tables."""
    return next(_models_in(field.annotation), None)


def _fields(root: type[BaseModel], location: Location) -> Iterator[FieldInfo]:
    """Yield the fields along a location for as long as it is known; list indices are skipped."""
    model: type[BaseModel] | None = root
    for part in location:
        if isinstance(part, int):
            continue
        field = model.model_fields.get(part) if model else None
        if field is None:
            return
        yield field
        model = table_model(field)


def meaning_of(root: type[BaseModel], location: Location) -> str:
    """Return the description of the innermost known key of a location."""
    fields = list(_fields(root, location))
    return fields[-1].description or "" if fields else ""


def nearest_key(root: type[BaseModel], location: Location) -> str:
    """Say which known key may have been meant by the unknown one at the end of a location."""
    *tables, unknown = location
    parents = list(_fields(root, tables))
    model = table_model(parents[-1]) if parents else root
    known = list(model.model_fields) if model else []
    near = difflib.get_close_matches(str(unknown), known, n=1, cutoff=0.5)
    if near:
        return f"did you mean {near[0]}?"
    elsewhere = [key for key in _all_keys(root) if key.split(".")[-1] == unknown]
    if elsewhere:
        return f"{unknown} belongs to {elsewhere[0].rpartition('.')[0] or 'the top level'}"
    return "known here: " + ", ".join(known)


def _all_keys(model: type[BaseModel], prefix: str = "") -> Iterator[str]:
    for name, field in model.model_fields.items():
        yield prefix + name
        inner = table_model(field)
        if inner is not None:
            yield from _all_keys(inner, f"{prefix}{name}.")


def place_of(
    root: type[BaseModel], location: Location, document: Mapping[str, Any]
) -> tuple[str, Any]:
    """Name a location as a user would (``lidars.L1.source``) and return what stands there.

    Parts of the location that pydantic adds for the alternatives of a union are left out.
    """
    names: list[str] = []
    value: Any = document
    for part in location:
        inner = _inner(value, part)
        if inner is None and not _is_key(root, names, part):
            continue
        names.append(_entry_name(inner, part))
        value = inner
    return ".".join(names), value


def _inner(value: Any, part: int | str) -> Any:
    if isinstance(value, Mapping):
        return value.get(part)
    if isinstance(value, list | tuple) and isinstance(part, int) and part < len(value):
        return value[part]
    return None


def _is_key(root: type[BaseModel], names: Sequence[str], part: int | str) -> bool:
    """Tell a key that is merely absent from a part that names an alternative of a union."""
    if isinstance(part, int):
        return True
    parents = list(_fields(root, [name for name in names if not name.isdigit()]))
    model = table_model(parents[-1]) if parents else root
    return model is not None and part in model.model_fields


def _entry_name(entry: Any, part: int | str) -> str:
    if isinstance(part, int) and isinstance(entry, Mapping):
        name = entry.get("id", entry.get("name"))
        return str(name) if isinstance(name, str) and name else str(part)
    return str(part)
