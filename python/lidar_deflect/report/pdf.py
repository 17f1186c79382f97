"""The report on paper: PDF/A by typst, figures drawn by matplotlib, fonts embedded."""

from __future__ import annotations

import json
import tempfile
from importlib.resources import files
from pathlib import Path
from typing import TYPE_CHECKING, Any

from lidar_deflect import words
from lidar_deflect.extras import need
from lidar_deflect.files import whole_file
from lidar_deflect.folder import Folder
from lidar_deflect.report import drawn, fonts
from lidar_deflect.report.build import document
from lidar_deflect.report.document import (
    Block,
    Bullets,
    Cell,
    Code,
    Column,
    Document,
    Facts,
    Figure,
    Fold,
    Heading,
    Replay,
    Table,
    Text,
)

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator

    from lidar_deflect.report.fonts import Fonts

STANDARD = "a-2a"
"""PDF/A-2, accessible: fonts embedded, text that can be read out, nothing outside of the file."""

_MOST_ROWS = 400
_MOST_FIGURES = 12
_LONG_WORD = 24


def write(
    folder: str | Path,
    out: str | Path,
    *,
    overwrite: bool = True,
    warn: Callable[[str], None] | None = None,
) -> Path:
    """Write the report of a result folder as PDF/A.

    Parameters
    ----------
    folder
        Result folder.
    out
        File to write.
    overwrite
        Whether a file of that name may be replaced.
    warn
        Called with a sentence where characters cannot be shown.

    Raises
    ------
    MissingExtraError
        If typst or matplotlib is not installed.
    ResultNotFoundError, ResultError
        If `folder` is no result folder or cannot be read.
    OutputError
        If the file cannot be written.
    """
    path = Path(out)
    with whole_file(path, overwrite=overwrite) as temporary:
        temporary.write_bytes(render(document(Folder(folder)), warn=warn))
    return path


def render(report: Document, *, warn: Callable[[str], None] | None = None) -> bytes:
    """Return the PDF of a document."""
    typst = need("typst", "pdf", "a PDF")
    plain = _plain(report)
    chosen = fonts.choose([*_texts(plain), *_figure_words(report)])
    if chosen.missing and warn is not None:
        warn(words.NO_FONT.format(characters=" ".join(sorted(chosen.missing)[:12])))
    with tempfile.TemporaryDirectory(prefix="lidar-deflect-pdf-") as name:
        place = Path(name)
        for figure in report.figures():
            image = chosen.shown(drawn.svg(figure.figure, chosen.families, chosen.files).decode())
            (place / f"figure-{figure.number}.svg").write_text(image, encoding="utf-8")
        data = json.dumps(_shown(plain, chosen), ensure_ascii=False)
        (place / "data.json").write_text(data, encoding="utf-8")
        source = files(__package__).joinpath("report.typ").read_text(encoding="utf-8")
        (place / "report.typ").write_text(source, encoding="utf-8")
        made: bytes = typst.compile(
            str(place / "report.typ"),
            root=str(place),
            font_paths=[str(chosen.folder)],
            pdf_standards=[STANDARD],
        )
    return made


def _plain(report: Document) -> dict[str, Any]:
    """Everything that the template sets, as plain lists and texts."""
    return {
        "language": words.LANGUAGE,
        "title": report.title,
        "kicker": report.kicker,
        "cover": [list(pair) for pair in report.cover],
        "verdict": {
            "mark": report.verdict.mark,
            "title": report.verdict.title,
            "alarms": list(report.verdict.alarms),
            "sentences": list(report.verdict.sentences),
        },
        "headlines": [[each.value, each.what, each.where] for each in report.headlines],
        "chapters": [
            {"title": each.title, "blocks": list(_blocks(each.blocks))} for each in report.chapters
        ],
        "labels": {
            "table": words.TABLE,
            "figure": words.FIGURE,
            "page": words.PAGE,
            "signatures": words.HEADINGS["signatures"],
        },
        "signatures": list(words.SIGNATURES),
        "fields": list(words.SIGNATURE_FIELDS),
        "made": words.MADE.format(
            version=report.facts.get("version", ""), folder=report.facts.get("folder", "")
        ),
    }


def _blocks(blocks: tuple[Block, ...]) -> Iterator[dict[str, Any]]:
    for block in blocks:
        if isinstance(block, Fold):
            yield from _fold(block)
        else:
            yield _block(block)


def _fold(fold: Fold) -> Iterator[dict[str, Any]]:
    """Paper has no folds: their blocks follow, unless they would fill a book."""
    figures = sum(isinstance(each, Figure) for each in fold.blocks)
    rows = max((len(each.rows) for each in fold.blocks if isinstance(each, Table)), default=0)
    yield {"kind": "heading", "text": fold.summary}
    if figures > _MOST_FIGURES or rows > _MOST_ROWS:
        yield {"kind": "text", "paragraphs": [words.TOO_LONG], "quiet": True}
    else:
        yield from _blocks(fold.blocks)


def _block(block: Block) -> dict[str, Any]:
    if isinstance(block, Table):
        return _table(block)
    if isinstance(block, Figure):
        number = block.number
        return {"kind": "figure", "number": number, "caption": block.caption}
    if isinstance(block, Text):
        return {"kind": "text", "paragraphs": list(block.paragraphs), "quiet": block.quiet}
    if isinstance(block, Bullets):
        return {"kind": "bullets", "items": list(block.items), "tone": block.tone}
    if isinstance(block, Facts):
        return {"kind": "facts", "pairs": [list(pair) for pair in block.pairs]}
    if isinstance(block, Heading):
        return {"kind": "heading", "text": block.text}
    if isinstance(block, Code):
        return {"kind": "code", "text": block.text}
    assert isinstance(block, Replay)
    return {"kind": "text", "paragraphs": [words.ON_SCREEN.format(number=block.number)]}


def _table(table: Table) -> dict[str, Any]:
    groups = [
        [[[_breakable(cell.text), cell.interval, cell.mark] for cell in row] for row in group]
        for group in table.groups
    ]
    widths = [
        max([len(row[k].text) for row in table.rows], default=0) for k in range(len(table.columns))
    ]
    return {
        "kind": "table",
        "number": table.number,
        "caption": table.caption,
        "columns": [[c.label, c.unit, c.numeric] for c in table.columns],
        "groups": groups,
        "flexible": [k for k, width in enumerate(widths) if width > _LONG_WORD],
    }


def _cell(cell: Cell, column: Column) -> list[str]:
    mark = "number" if cell.mark and column.numeric else cell.mark
    return [_breakable(cell.text), cell.interval, mark]


def _breakable(text: str) -> str:
    """Let a word that is longer than a column break; nothing is seen of it otherwise."""
    parts = text.split(" ")
    if all(len(part) <= _LONG_WORD for part in parts):
        return text
    step = _LONG_WORD // 2
    return " ".join(
        "\u200b".join(part[k : k + step] for k in range(0, len(part), step)) for part in parts
    )


def _texts(value: Any) -> Iterator[str]:
    if isinstance(value, str):
        yield value
    elif isinstance(value, dict):
        for each in value.values():
            yield from _texts(each)
    elif isinstance(value, list | tuple):
        for each in value:
            yield from _texts(each)


def _figure_words(report: Document) -> Iterator[str]:
    for figure in report.figures():
        for trace in figure.figure.data:
            yield str(trace.name or "")
            if trace.type == "bar":
                yield from map(str, trace.x)


def _shown(value: Any, chosen: Fonts) -> Any:
    if isinstance(value, str):
        return chosen.shown(value)
    if isinstance(value, dict):
        return {key: _shown(each, chosen) for key, each in value.items()} | (
            {"families": list(chosen.families)} if "chapters" in value else {}
        )
    return [_shown(each, chosen) for each in value] if isinstance(value, list) else value
