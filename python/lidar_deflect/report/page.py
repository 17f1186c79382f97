"""A document as one HTML page; style, scripts and the figure library stand in the file itself."""

import hashlib
import json
from base64 import b64decode, b64encode
from importlib.resources import files
from typing import Any

import jinja2
import numpy as np
from markupsafe import Markup
from plotly.io import to_json
from plotly.offline import get_plotlyjs

from lidar_deflect import words
from lidar_deflect.report.document import (
    Bullets,
    Code,
    Document,
    Facts,
    Figure,
    Fold,
    Heading,
    Replay,
    Table,
    Text,
)

_KINDS = {
    Text: "text",
    Table: "table",
    Figure: "figure",
    Replay: "replay",
    Bullets: "bullets",
    Facts: "facts",
    Heading: "heading",
    Code: "code",
    Fold: "fold",
}


def render(document: Document) -> str:
    """Return the page as text; names and numbers of the document stay text in it."""
    environment = jinja2.Environment(
        autoescape=True,
        undefined=jinja2.StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
        finalize=_unbroken,
    )
    environment.filters |= {"kind": _kind, "data": _figure_data, "json": _json}
    template = environment.from_string(_beside("template.html"))
    scripts = [get_plotlyjs(), _beside("figures.js")]
    if any(isinstance(block, Replay) for block in document.blocks()):
        scripts.append(_beside("replay.js"))
    wrapped = [f"\n{script}\n" for script in scripts]
    return template.render(
        words=words,
        document=document,
        style=Markup(_beside("style.css")),  # our own file
        scripts=[Markup(script) for script in wrapped],  # our own files and the library's
        script_hashes=" ".join(map(_source_hash, wrapped)),
    )


def _unbroken(value: Any) -> Any:
    """Keep a number and what belongs to it on one line."""
    if type(value) is not str:
        return value
    return value.replace("k = 2", "k\u00a0=\u00a02").replace("95 %", "95\u00a0%")


def _kind(block: Any) -> str:
    return _KINDS[type(block)]


def _figure_data(figure: Figure) -> Markup:
    """Return the figure as data that cannot close the script it stands in."""
    halved = _halved(figure.figure.to_dict())
    return _safe(to_json(halved, validate=False))  # plotly writes <, > and / as \u escapes


def _halved(value: Any) -> Any:
    """Return a figure whose arrays are f32: a screen shows no more, and the file is half."""
    if isinstance(value, list | tuple):
        return [_halved(each) for each in value]
    if not isinstance(value, dict):
        return value
    if value.get("dtype") == "f8" and "bdata" in value:
        numbers = np.frombuffer(b64decode(value["bdata"]), dtype="<f8").astype("<f4")
        return value | {"dtype": "f4", "bdata": b64encode(numbers.tobytes()).decode("ascii")}
    return {key: _halved(each) for key, each in value.items()}


def _json(value: Any) -> Markup:
    text = json.dumps(value, ensure_ascii=True, allow_nan=False, separators=(",", ":"))
    return _safe(text.replace("<", "\\u003c").replace(">", "\\u003e"))


def _safe(text: str) -> Markup:
    if "<" in text:
        raise AssertionError("data could close its script")
    return Markup(text)


def _source_hash(script: str) -> str:
    """Hash by which the content security policy lets a script run, and no other."""
    return f"'sha256-{b64encode(hashlib.sha256(script.encode()).digest()).decode()}'"


def _beside(name: str) -> str:
    return files(__package__).joinpath(name).read_text(encoding="utf-8")
