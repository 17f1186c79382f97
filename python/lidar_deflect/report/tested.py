"""What was tested and with what: blade, lidars, files, programs."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import TYPE_CHECKING, Any

import numpy as np

from lidar_deflect import words
from lidar_deflect.plots.source import sections
from lidar_deflect.report import digits
from lidar_deflect.report.checks import flat
from lidar_deflect.report.document import Block, Bullets, Cell, Column, Facts, Row, Table, Text
from lidar_deflect.report.document import words as said

if TYPE_CHECKING:
    from lidar_deflect.folder import Folder


def title(folder: Folder) -> str:
    """Name of the test, else of its folder."""
    return str(folder.config.get("test", {}).get("id") or folder.path.resolve().name)


def cover(folder: Folder) -> tuple[tuple[str, str], ...]:
    """Facts under the title."""
    test = folder.config.get("test", {})
    facts = [(label, str(test[key])) for key, label in words.COVER.items() if test.get(key)]
    blade = folder.config.get("blade", {})
    more = words.COVER_MORE
    if blade.get("length_m"):
        facts.append((more["length"], f"{blade['length_m']:g} m"))
    first, last = folder.deflection["time"].min(), folder.deflection["time"].max()
    facts += [(more["start"], digits.instant(first)), (more["end"], digits.instant(last))]  # type: ignore[arg-type]
    span = folder.deflection["t_s"]
    if len(span) > 1:
        length = float(span.max()) - float(span.min())  # type: ignore[arg-type]
        facts.append((more["duration"], digits.duration(length)))
    return tuple(facts)


def blocks(folder: Folder) -> tuple[Block, ...]:
    """Return the chapter."""
    found: list[Block] = [Facts(tuple(_blade(folder)))]
    absent = folder.run.get("absent_lidars") or ()
    if absent:
        items = tuple(words.NEVER_SENT.format(id=each) for each in absent)
        found.append(Bullets(items, "bad"))
    found += [table for table in (_lidars(folder), _inputs(folder)) if table is not None]
    if not folder.run.get("inputs"):
        found.append(Text((words.NO_INPUTS,)))
    found.append(_software(folder))
    return tuple(found)


def _blade(folder: Folder) -> Iterator[tuple[str, str]]:
    more = words.COVER_MORE
    known = sections(folder.deflection)
    if len(known) > 12:
        text = words.ALL_SECTIONS.format(
            count=len(known), first=f"{known[0][1]:g}", last=f"{known[-1][1]:g}"
        )
    else:
        text = ", ".join(f"{name} ({s_m:g} m)" for name, s_m in known)
    yield more["sections"], text
    direction = (folder.config.get("load") or {}).get("direction")
    if direction is not None:
        yield more["direction"], flat(direction)
    blade = folder.config.get("blade", {})
    drawn = [str(blade[name]) for name in ("geometry", "contours") if blade.get(name)]
    if drawn:
        yield more["geometry"], ", ".join(_name(path) for path in drawn)


def _name(path: str) -> str:
    return path.replace("\\", "/").rsplit("/", 1)[-1]


def _streams(folder: Folder) -> list[Mapping[str, Any]]:
    capture = folder.run.get("capture") or {}
    given = capture.get("streams") or () if isinstance(capture, Mapping) else ()
    return [each for each in given if isinstance(each, Mapping)]


def _lidars(folder: Folder) -> Table | None:
    streams = _streams(folder)
    poses = {str(each.get("id")): each for each in folder.calibration.get("lidars", ())}
    rows = tuple(_lidar(each, poses) for each in streams)
    if not rows:
        return None
    heads = ("lidar", "model", "source", "returns")
    columns = [Column(words.HEADS[head], numeric=False) for head in heads]
    columns += [
        Column("x", "m"),
        Column("y", "m"),
        Column("z", "m"),
        Column(words.HEADS["rate"], "1/min"),
    ]
    columns += [
        Column(words.HEADS["clock"], numeric=False),
        Column(words.HEADS["beams"], numeric=False),
    ]
    return Table("lidars", words.LIDARS_CAPTION, tuple(columns), (rows,))


def _lidar(stream: Mapping[str, Any], poses: Mapping[str, Any]) -> Row:
    name = str(stream.get("lidar") or stream.get("source") or digits.NONE)
    port = stream.get("port")
    source = str(stream.get("source") or digits.NONE) + ("" if port is None else f":{port}")
    pose = poses.get(name)
    place: list[float | None] = [None] * 3
    if pose is not None:
        place = [float(v) for v in np.asarray(pose["world_from_sensor"], dtype=float)[:3, 3]]
    cells = [said(name), said(str(stream.get("title") or stream.get("model") or digits.NONE))]
    cells += [said(source), said(str(stream.get("return_mode") or digits.NONE))]
    cells += [digits.number(value, 3) for value in place]
    cells += [digits.number(stream.get("rpm"), 1), said(_clock(stream.get("clock")))]
    return (*cells, said(_name(str(stream.get("beams") or digits.NONE))))


def _clock(clock: Any) -> str:
    if not isinstance(clock, Mapping):
        return flat(clock)
    kind = str(clock.get("kind", ""))
    drift = clock.get("drift_ppm")
    return kind if drift is None else f"{kind}, drift {float(drift):.2f} ppm"


def _inputs(folder: Folder) -> Table | None:
    given = folder.run.get("inputs") or ()
    rows = tuple(
        (
            said(str(each.get("file") or each.get("path") or digits.NONE)),
            Cell(digits.size(each.get("bytes")), each.get("bytes")),
            said(str(each.get("sha256", digits.NONE))),
        )
        for each in given
        if isinstance(each, Mapping)
    )
    if not rows:
        return None
    columns = (
        Column(words.HEADS["input"], numeric=False),
        Column(words.HEADS["size"]),
        Column("SHA-256", numeric=False),
    )
    return Table("inputs", words.INPUTS_CAPTION, columns, (rows,))


def _software(folder: Folder) -> Table:
    run = folder.run
    pairs = [(str(k), str(v)) for k, v in (run.get("versions") or {}).items()]
    pairs.append(("configuration hash", folder.metadata.get("configuration_hash", digits.NONE)))
    program = folder.metadata.get("lidar_deflect.program_version", digits.NONE)
    pairs.append(("tables written by lidar-deflect", program))
    timings = run.get("timings_s") or {}
    pairs += [(f"time for {stage}", f"{float(value):.1f} s") for stage, value in timings.items()]
    rows = tuple((said(name), said(value)) for name, value in pairs)
    columns = (
        Column(words.HEADS["what"], numeric=False),
        Column(words.HEADS["value"], numeric=False),
    )
    return Table("software", words.SOFTWARE_CAPTION, columns, (rows,))
