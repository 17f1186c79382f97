"""What a report is made of: chapters of sentences, tables and figures, without any markup.

The page, the PDF, the spreadsheet and the CSV files are made from the same blocks.
"""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING, Any, TypeAlias

if TYPE_CHECKING:
    from collections.abc import Iterator, Sequence

    import plotly.graph_objects as go

Value: TypeAlias = float | int | str | None


@dataclass(frozen=True)
class Column:
    """Head of a column: what it holds, its unit, and whether its cells are numbers."""

    label: str
    unit: str = ""
    numeric: bool = True

    @property
    def head(self) -> str:
        """Label with the unit in brackets."""
        return f"{self.label} ({self.unit})" if self.unit else self.label


@dataclass(frozen=True)
class Cell:
    """One cell: how it is shown, the number behind it, its interval, and what marks it.

    Parameters
    ----------
    text
        As people read it.
    value
        As programs read it, in the unit of its column; the text itself where it is no number.
    interval
        ``±`` and the expanded uncertainty, empty where there is none.
    mark
        ``good``, ``bad``, ``open`` (cannot be told) or empty.
    u
        The number behind `interval`.
    """

    text: str
    value: Value = None
    interval: str = ""
    mark: str = ""
    u: float | None = None


Row: TypeAlias = "tuple[Cell, ...]"


@dataclass(frozen=True)
class Table:
    """A table with its caption; `groups` are blocks of rows that belong together."""

    name: str
    caption: str
    columns: tuple[Column, ...]
    groups: tuple[tuple[Row, ...], ...]
    number: int = 0
    head_columns: int = 1

    @property
    def rows(self) -> tuple[Row, ...]:
        """All rows in order."""
        return tuple(row for group in self.groups for row in group)


@dataclass(frozen=True)
class Figure:
    """A plotly figure with the sentence that says what it shows.

    `link` names the figures that zoom together.
    """

    name: str
    caption: str
    figure: go.Figure
    link: str = ""
    number: int = 0


@dataclass(frozen=True)
class Text:
    """Sentences; `quiet` ones are set smaller."""

    paragraphs: tuple[str, ...]
    quiet: bool = False


@dataclass(frozen=True)
class Bullets:
    """Sentences of equal rank; `tone` is ``plain``, ``warn`` or ``bad``."""

    items: tuple[str, ...]
    tone: str = "plain"


@dataclass(frozen=True)
class Facts:
    """Names and values."""

    pairs: tuple[tuple[str, str], ...]
    code: bool = False


@dataclass(frozen=True)
class Heading:
    """A heading within a chapter."""

    text: str


@dataclass(frozen=True)
class Code:
    """Text to be shown as it stands."""

    text: str


@dataclass(frozen=True)
class Replay:
    """The blade in space over time, for screens."""

    caption: str
    data: dict[str, Any]
    number: int = 0


@dataclass(frozen=True)
class Fold:
    """Blocks that are shown on demand; print shows them."""

    summary: str
    blocks: tuple[Block, ...]


Block: TypeAlias = Table | Figure | Text | Bullets | Facts | Heading | Code | Replay | Fold


@dataclass(frozen=True)
class Chapter:
    """A chapter with its place in the address bar."""

    id: str
    title: str
    blocks: tuple[Block, ...]


@dataclass(frozen=True)
class Verdict:
    """The report in one line: ``good``, ``bad``, ``open`` or ``none``, in words.

    `alarms` are sentences that nobody may miss.
    """

    mark: str
    title: str
    sentences: tuple[str, ...] = ()
    alarms: tuple[str, ...] = ()


@dataclass(frozen=True)
class Headline:
    """One number to see first."""

    value: str
    what: str
    where: str


@dataclass(frozen=True)
class Document:
    """A whole report."""

    title: str
    kicker: str
    cover: tuple[tuple[str, str], ...]
    verdict: Verdict
    headlines: tuple[Headline, ...]
    chapters: tuple[Chapter, ...]
    facts: dict[str, str] = field(default_factory=dict)

    def numbered(self) -> Document:
        """Return the document with its tables and figures numbered in reading order."""
        count = _Count()
        chapters = tuple(
            replace(chapter, blocks=count.over(chapter.blocks)) for chapter in self.chapters
        )
        return replace(self, chapters=chapters)

    def blocks(self) -> Iterator[Block]:
        """Yield every block in reading order, those within folds as well."""
        for chapter in self.chapters:
            yield from _flat(chapter.blocks)

    def tables(self) -> list[Table]:
        """Return every table."""
        return [block for block in self.blocks() if isinstance(block, Table)]

    def figures(self) -> list[Figure]:
        """Return every figure."""
        return [block for block in self.blocks() if isinstance(block, Figure)]


def _flat(blocks: Sequence[Block]) -> Iterator[Block]:
    for block in blocks:
        yield block
        if isinstance(block, Fold):
            yield from _flat(block.blocks)


class _Count:
    def __init__(self) -> None:
        self._tables = 0
        self._figures = 0

    def over(self, blocks: Sequence[Block]) -> tuple[Block, ...]:
        return tuple(self._one(block) for block in blocks)

    def _one(self, block: Block) -> Block:
        if isinstance(block, Fold):
            return replace(block, blocks=self.over(block.blocks))
        if isinstance(block, Table):
            self._tables += 1
            return replace(block, number=self._tables)
        if isinstance(block, Figure | Replay):
            self._figures += 1
            return replace(block, number=self._figures)
        return block


def words(text: str, mark: str = "") -> Cell:
    """Return a cell of words."""
    return Cell(text, text, mark=mark)
