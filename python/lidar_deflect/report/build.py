"""A result folder as a document: verdict, then chapters in the order in which they are read."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

from lidar_deflect import words
from lidar_deflect.report import (
    against,
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
    Cell,
    Chapter,
    Code,
    Column,
    Document,
    Facts,
    Fold,
    Heading,
    Table,
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
    table = _budget(folder)
    found += [table] if table is not None else []
    found += [Text((words.NOT_CLAIMED,)), Text(words.DEFINITIONS, quiet=True)]
    given = folder.run.get("evidence") or {}
    if isinstance(given, Mapping) and given:
        pairs = tuple((label(str(k)), flat(v)) for k, v in given.items())
        found.append(Fold(words.EVIDENCE, (Facts(pairs),)))
    return tuple(found)


def _budget(folder: Folder) -> Table | None:
    """Return ``budget`` of run.json: a list of contributions with the columns that they have."""
    given = folder.run.get("budget") or folder.run.get("uncertainty_budget") or ()
    if isinstance(given, Mapping):
        given = [
            {"contribution": k, **(v if isinstance(v, Mapping) else {"u": v})}
            for k, v in given.items()
        ]
    rows = [each for each in given if isinstance(each, Mapping)]
    if not rows:
        return None
    names = list(dict.fromkeys(str(name) for row in rows for name in row))
    cells = tuple(tuple(_cell(row.get(name)) for name in names) for row in rows)
    columns = tuple(
        Column(label(name), numeric=isinstance(rows[0].get(name), int | float)) for name in names
    )
    return Table("budget", words.BUDGET_CAPTION, columns, (cells,))


def _cell(value: Any) -> Cell:
    if isinstance(value, float):
        return Cell(f"{value:.3g}", value)
    return Cell(digits.NONE if value is None else flat(value), flat(value))


def _configuration(folder: Folder) -> tuple[Block, ...]:
    path = folder.path / "test.toml"
    if not path.is_file():
        return (Text((words.NO_CONFIGURATION,)),)
    text = path.read_text(encoding="utf-8")
    sentence = words.CONFIGURATION.format(hash=folder.metadata.get("configuration_hash", ""))
    return (Text((sentence,)), Fold(words.HEADINGS["configuration"], (Code(text),)))
