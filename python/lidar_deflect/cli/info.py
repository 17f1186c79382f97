"""``lidar-deflect info``: what a capture holds."""

from collections.abc import Iterator, Mapping
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
    return "\n".join(line for entry in document["captures"] for line in _capture(entry))


def _capture(entry: Mapping[str, Any]) -> Iterator[str]:
    size_mb = entry["size_bytes"] / 1e6
    kind, count = entry["format"], grouped(entry["records"])
    yield f"{entry['path']}: {kind}, {size_mb:.1f} MB, {count} records"
    yield from (f"  warning: {text}" for text in entry["warnings"])


def _streams(document: Mapping[str, Any]) -> str:
    header = [
        "source",
        "port",
        "model",
        "return",
        "rpm",
        *COUNTS,
        "first (UTC)",
        "seconds",
        "clock",
    ]
    return table(header, [_stream(stream) for stream in document["streams"]])


def _stream(stream: Mapping[str, Any]) -> list[str]:
    return [
        stream["source"],
        "" if stream["port"] is None else str(stream["port"]),
        stream["model"],
        stream["return_mode"],
        "-" if stream["rpm"] is None else f"{stream['rpm']:.0f}",
        *(grouped(stream[key]) for key in COUNTS),
        stream["first_utc"][:19],
        f"{_seconds(stream['first_utc'], stream['last_utc']):.1f}",
        _clock(stream["clock"]),
    ]


def _clock(clock: Mapping[str, Any]) -> str:
    """Say what the device clock is worth: locked, agreeing with the host, or free running."""
    text = f"{clock['kind']}, offset {clock['offset_s']:.3f} s, drift {clock['drift_ppm']:.1f} ppm"
    return text.replace("_", " ") + (f", {clock['jumps']} jumps" if clock["jumps"] else "")


def _seconds(first: str, last: str) -> float:
    import numpy as np

    start, stop = (np.datetime64(text.removesuffix("Z"), "ns") for text in (first, last))
    return float((stop - start) / np.timedelta64(1, "s"))


def _notes(document: Mapping[str, Any]) -> str:
    """List remarks, each once with the streams that it holds for."""
    remarks: dict[str, list[str]] = {}
    for stream in document["streams"]:
        for remark in _remarks(stream):
            remarks.setdefault(remark, []).append(stream["source"])
    for start, stop in document.get("pauses", ()):
        remarks.setdefault(f"nothing was recorded from {start} to {stop}", [])
    for entry in document["unused_files"]:
        remark = f"{entry['file']} lies beside the capture and is of no lidar in it"
        remarks.setdefault(f"{remark}: {entry['content']}", [])
    return "\n".join(
        ": ".join([", ".join(who), what] if who else [what]) for what, who in remarks.items()
    )


def _remarks(stream: Mapping[str, Any]) -> Iterator[str]:
    if stream["candidates"]:
        yield f"{stream['model']} could also be {', '.join(stream['candidates'])}"
    yield f"beams: {stream['beams']}"
    yield from stream["notes"]


def _drops(document: Mapping[str, Any]) -> str:
    rows = [[grouped(drop["count"]), drop["reason"]] for drop in document["drops"]]
    return table(["dropped", "reason"], rows) if rows else ""
