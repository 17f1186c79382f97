"""A result folder as a document: verdict, then chapters in the order in which they are read."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING

from lidar_deflect import words
from lidar_deflect.report import (
    against,
    budget,
    checks,
    curves,
    digits,
    evidence,
    key,
    tested,
    verdict,
)
from lidar_deflect.report.checks import flat, label
from lidar_deflect.report.document import (
    Block,
    Chapter,
    Code,
    Document,
    Facts,
    Fold,
    Heading,
    Text,
)

if TYPE_CHECKING:
    from lidar_deflect.folder import Folder


def document(folder: Folder) -> Document:
    """Return the report of a result folder."""
    chapters = (
        ("result", key.blocks(folder)),
        ("tested", tested.blocks(folder)),
        ("curves", curves.curves(folder)),
        ("replay", curves.in_space(folder)),
        ("load", curves.load(folder)),
        ("shapes", curves.shapes(folder)),
        ("fatigue", curves.cycles(folder)),
        ("comparison", against.blocks(folder)),
        ("calibration", evidence.calibration(folder)),
        ("health", evidence.health(folder)),
        ("checks", (checks.check_table(folder), Text((_length_why(),), quiet=True))),
        ("method", _method(folder)),
        ("left_out", evidence.left_out(folder)),
        ("configuration", _configuration(folder)),
    )
    name = str(folder.run.get("method", ""))
    return Document(
        title=tested.title(folder),
        kicker=f"{words.KICKER}, method “{name}”" if name else words.KICKER,
        cover=tested.cover(folder),
        verdict=verdict.verdict(folder),
        headlines=verdict.headlines(folder),
        chapters=tuple(
            Chapter(id, words.HEADINGS[id], blocks) for id, blocks in chapters if blocks
        ),
        facts={
            "version": folder.metadata.get("lidar_deflect.program_version", ""),
            "hash": folder.metadata.get("configuration_hash", ""),
            "folder": folder.path.resolve().name,
        },
    ).numbered()


def _length_why() -> str:
    share = digits.percent(100.0 * checks.LENGTH_SHARE, 2)
    return words.LENGTH_WHY.format(limit=share)


def _method(folder: Folder) -> tuple[Block, ...]:
    name = str(folder.run.get("method", ""))
    known = words.METHODS.get(name) or (words.METHOD_UNKNOWN.format(method=name),)
    found: list[Block] = [Text(known), Heading(words.BUDGET_HEADING)]
    found += [Text(words.BUDGET[name])] if name in words.BUDGET else []
    table = budget.table(folder)
    found += [table] if table is not None else []
    found += [Text((words.NOT_CLAIMED,)), Text(words.DEFINITIONS, quiet=True)]
    given = folder.run.get("evidence") or {}
    if isinstance(given, Mapping) and given:
        pairs = tuple((label(str(k)), flat(v)) for k, v in given.items())
        found.append(Fold(words.EVIDENCE, (Facts(pairs),)))
    return tuple(found)


def _configuration(folder: Folder) -> tuple[Block, ...]:
    path = folder.path / "test.toml"
    if not path.is_file():
        return (Text((words.NO_CONFIGURATION,)),)
    text = path.read_text(encoding="utf-8")
    sentence = words.CONFIGURATION.format(hash=folder.metadata.get("configuration_hash", ""))
    return (Text((sentence,)), Fold(words.HEADINGS["configuration"], (Code(text),)))
