"""Arguments and options that several commands share, and how their texts are read."""

from __future__ import annotations

from dataclasses import dataclass
from datetime import UTC, datetime
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from lidar_deflect.errors import OutputError

if TYPE_CHECKING:
    from collections.abc import Sequence

Captures = Annotated[
    list[Path],
    typer.Argument(
        metavar="CAPTURE...",
        help="pcap or pcapng, plain, .gz or .zst, or ROS bags; one file or many.",
    ),
]
ConfigFile = Annotated[
    Path, typer.Option("--config", "-c", metavar="TOML", help="Configuration of the test.")
]
Set = Annotated[
    list[str] | None,
    typer.Option(
        "--set", metavar="KEY=VALUE", help="Change one key of the configuration; repeatable."
    ),
]
Json = Annotated[bool, typer.Option("--json", help="One JSON document on stdout.")]
Quiet = Annotated[bool, typer.Option("--quiet", "-q", help="No progress and no notes.")]
Verbose = Annotated[bool, typer.Option("--verbose", "-v", help="Details, and tracebacks of bugs.")]
Timings = Annotated[bool, typer.Option("--timings", help="How long each stage took.")]
Threads = Annotated[
    int | None,
    typer.Option("--threads", "-j", min=1, metavar="N", help="Threads; default: all processors."),
]
Overwrite = Annotated[bool, typer.Option("--overwrite", help="Replace what exists already.")]
From = Annotated[
    str | None,
    typer.Option(
        "--from",
        metavar="TIME",
        help="Start: seconds since the first lidar packet, or an ISO time in UTC.",
    ),
]
To = Annotated[
    str | None, typer.Option("--to", metavar="TIME", help="End, on the same scale as --from.")
]
Sensors = Annotated[
    list[str] | None,
    typer.Option(
        "--sensor", metavar="SOURCE=MODEL", help="Name the model of a source; repeatable."
    ),
]
Beams = Annotated[
    list[str] | None,
    typer.Option(
        "--beams",
        metavar="[SOURCE=]FILE",
        help="A unit's own angle, fire-time, channel or metadata file; repeatable.",
    ),
]
Lidars = Annotated[
    list[str] | None,
    typer.Option("--lidar", metavar="LIDAR", help="Only this lidar, by id or source; repeatable."),
]
Sections = Annotated[
    list[str] | None,
    typer.Option("--section", metavar="NAME", help="Only this section; repeatable."),
]


def sensor_models(texts: Sequence[str] | None) -> dict[str, str]:
    """Read ``SOURCE=MODEL`` texts."""
    return pairs(texts, "--sensor", "SOURCE=MODEL")


def pairs(texts: Sequence[str] | None, option: str, form: str) -> dict[str, str]:
    """Read texts with a name before and a value behind the last equals sign."""
    found: dict[str, str] = {}
    for text in texts or ():
        name, equals, value = text.rpartition("=")
        if not (equals and name and value):
            raise typer.BadParameter(f"{option} {text}: expected {form}")
        found[name] = value
    return found


def beam_files(texts: Sequence[str] | None) -> dict[str, list[Path]]:
    """Read ``[SOURCE=]FILE`` texts; a file without a source stands under the empty text."""
    files: dict[str, list[Path]] = {}
    for text in texts or ():
        source, equals, name = text.partition("=")
        if not equals or Path(text).exists():
            source, name = "", text
        files.setdefault(source, []).append(Path(name))
    return files


@dataclass(frozen=True)
class Moment:
    """A time on the command line: seconds since the first lidar packet, or UTC."""

    seconds: float | None
    utc_ns: int | None

    def since(self, first_ns: int) -> float:
        """Express it in seconds since the first packet."""
        if self.seconds is not None:
            return self.seconds
        return ((self.utc_ns or 0) - first_ns) / 1e9


def moment(text: str | None, option: str) -> Moment | None:
    """Read the text of ``--from`` or ``--to``."""
    if text is None:
        return None
    try:
        return Moment(float(text), None)
    except ValueError:
        pass
    try:
        time = datetime.fromisoformat(text)
    except ValueError:
        raise typer.BadParameter(
            f"{option} {text}: expected seconds, or a time such as 2026-05-04T10:20:30Z"
        ) from None
    time = time.replace(tzinfo=UTC) if time.tzinfo is None else time.astimezone(UTC)
    whole = int(time.replace(microsecond=0).timestamp())
    return Moment(None, whole * 1_000_000_000 + time.microsecond * 1000)


def span(
    start: str | None, stop: str | None, captures: Sequence[Path]
) -> tuple[float | None, float | None]:
    """Read ``--from`` and ``--to``; the captures are opened only where UTC asks for it."""
    moments = moment(start, "--from"), moment(stop, "--to")
    first_ns = 0
    if any(each is not None and each.utc_ns is not None for each in moments):
        from lidar_deflect import capture

        first_ns = capture.open(list(captures)).first_time_ns
    start_s, stop_s = (each.since(first_ns) if each else None for each in moments)
    if start_s is not None and stop_s is not None and stop_s <= start_s:
        raise typer.BadParameter(f"--to {stop} is not after --from {start}")
    return start_s, stop_s


def free(path: Path, overwrite: bool) -> Path:
    """Return an output path, refusing one that exists before any work is done for it.

    An empty folder counts as free.
    """
    taken = path.exists() and (not path.is_dir() or any(path.iterdir()))
    if taken and not overwrite:
        raise OutputError(
            f"{path} exists already",
            code="output.exists",
            hint="choose another name with -o, or allow it with --overwrite",
        )
    return path
