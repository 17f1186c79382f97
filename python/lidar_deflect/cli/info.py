"""``lidar-deflect info``: what a capture holds."""

from collections.abc import Mapping
from typing import Annotated, Any

import typer

from lidar_deflect.cli.options import (
    Beams,
    Captures,
    Json,
    Quiet,
    Sensors,
    Verbose,
    beam_files,
    sensor_models,
)
from lidar_deflect.cli.talk import Talk, grouped, table

COUNTS = ("packets", "lost", "duplicated", "late", "foreign")


def info(
    captures: Captures,
    quick: Annotated[bool, typer.Option("--quick", help="Read only the head and tail.")] = False,
    sensor: Sensors = None,
    beams: Beams = None,
    json: Json = False,
    quiet: Quiet = False,
    verbose: Verbose = False,
) -> None:
    """Tell what a capture holds.

    Sensors, packets, losses, time span, clocks.
    """
    talk = Talk(as_json=json, quiet=quiet, verbose=verbose)
    models, files = sensor_models(sensor), beam_files(beams)
    from lidar_deflect import capture

    with talk.progress("reading") as progress:
        opened = capture.open(captures, sensors=models, beams=files)
        document = opened.info(quick=quick, progress=progress.amount)
    talk.result(document, describe(document))


def describe(document: Mapping[str, Any]) -> str:
    """Lay out the document of ``info --json`` for people."""
    parts = [_captures(document), _streams(document), _notes(document), _drops(document)]
    return "\n\n".join(part for part in parts if part)


def _captures(document: Mapping[str, Any]) -> str:
    lines = [_capture(entry) for entry in document.get("captures", ())]
    return "\n".join(lines)


def _capture(entry: Any) -> str:
    if not isinstance(entry, Mapping):
        return str(entry)
    name = entry.get("path") or entry.get("name") or "capture"
    numbers = [f"{grouped(value)} {key}" for key, value in entry.items() if _is_count(value)]
    return f"{name}: " + ", ".join(numbers)


def _is_count(value: Any) -> bool:
    return isinstance(value, int) and not isinstance(value, bool)


def _streams(document: Mapping[str, Any]) -> str:
    header = ["source", "port", "model", "return", "rpm", *COUNTS, "from", "seconds", "clock"]
    return table(header, [_stream(stream) for stream in document.get("streams", ())])


def _stream(stream: Mapping[str, Any]) -> list[str]:
    first, last = stream.get("first_utc"), stream.get("last_utc")
    return [
        _said(stream.get("source")),
        _said(stream.get("port")),
        _said(stream.get("model")),
        _said(stream.get("return_mode")),
        _rounded(stream.get("rpm")),
        *(grouped(stream[key]) if stream.get(key) is not None else "-" for key in COUNTS),
        _said(first)[:19],
        _seconds(first, last),
        _said(stream.get("clock")),
    ]


def _said(value: Any) -> str:
    if value in (None, "", [], ()):
        return "-"
    if isinstance(value, Mapping):
        return ", ".join(f"{key} {_said(inner)}" for key, inner in value.items())
    return f"{value:.3f}" if isinstance(value, float) else str(value)


def _rounded(value: Any) -> str:
    return "-" if value is None else f"{value:.0f}"


def _seconds(first: Any, last: Any) -> str:
    if not (isinstance(first, str) and isinstance(last, str)):
        return "-"
    return f"{(_ns(last) - _ns(first)) / 1e9:.1f}"


def _ns(text: str) -> int:
    import numpy as np

    return int(np.datetime64(text.removesuffix("Z").removesuffix("+00:00"), "ns").astype("int64"))


def _notes(document: Mapping[str, Any]) -> str:
    lines = []
    for stream in document.get("streams", ()):
        name = f"{_said(stream.get('source'))}:{_said(stream.get('port'))}"
        if stream.get("candidates"):
            lines.append(f"{name}: could also be {', '.join(stream['candidates'])}")
        if stream.get("beams"):
            lines.append(f"{name}: beams {_said(stream['beams'])}")
        lines += [f"{name}: {note}" for note in stream.get("notes") or ()]
    return "\n".join(lines)


def _drops(document: Mapping[str, Any]) -> str:
    rows = [[grouped(drop["count"]), drop["reason"]] for drop in document.get("drops", ())]
    return table(["dropped", "reason"], rows) if rows else ""
