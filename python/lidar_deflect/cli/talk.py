"""What a command says: its result on stdout; warnings, notes and progress on stderr."""

from __future__ import annotations

import json
import math
import os
import sys
import warnings
from collections.abc import Iterable, Mapping, Sequence
from contextlib import contextmanager
from datetime import date, timedelta
from pathlib import Path
from typing import TYPE_CHECKING, Any

from lidar_deflect.cli.interrupt import INTERRUPT

if TYPE_CHECKING:
    from collections.abc import Iterator


class Talk:
    """How much a command says, and where.

    Parameters
    ----------
    as_json
        One JSON document on stdout instead of text.
    quiet, verbose
        Less, or more, on stderr.
    """

    def __init__(
        self, *, as_json: bool = False, quiet: bool = False, verbose: bool = False
    ) -> None:
        self.as_json = as_json
        self.quiet = quiet
        self.verbose = verbose
        warnings.showwarning = self._show_warning
        if not verbose:
            warnings.simplefilter("ignore", DeprecationWarning)

    def result(self, document: Mapping[str, Any], text: str) -> None:
        """Print the result: the document with ``--json``, else the text."""
        shown = to_json(document) if self.as_json else text
        if not shown:
            return
        try:
            print(shown, flush=True)
        except BrokenPipeError:  # the reader has seen enough, as `head` does
            quiet_stdout()

    def note(self, text: str) -> None:
        """Say something by the way."""
        if not self.quiet:
            print(text, file=sys.stderr)

    def detail(self, text: str) -> None:
        """Say something that only ``-v`` asks for."""
        if self.verbose:
            print(text, file=sys.stderr)

    def warn(self, text: str) -> None:
        """Say what a reader of the result should know; ``-q`` does not silence it."""
        print(f"warning: {text}", file=sys.stderr)

    def timings(
        self, wanted: bool, seconds: Mapping[str, float], run: Mapping[str, Any] | None = None
    ) -> None:
        """Print how long each stage took, and how fast it got through the capture of a run."""
        if not (wanted and seconds):
            return
        amounts = _amounts(run or {})
        rows = [
            [stage, f"{value:.2f}", *(f"{amount / max(value, 1e-3):.3g}" for _, amount in amounts)]
            for stage, value in seconds.items()
        ]
        print(table(["stage", "seconds", *(name for name, _ in amounts)], rows), file=sys.stderr)

    @contextmanager
    def progress(self, label: str) -> Iterator[Progress]:
        """Show a bar on stderr while the block runs, where somebody sees it."""
        if self.quiet or not sys.stderr.isatty():
            yield Progress()
            return
        bar = _Bar(label)
        try:
            yield bar
        finally:
            bar.stop()

    def _show_warning(self, message: Warning | str, *_: Any, **__: Any) -> None:
        self.warn(str(message))


def _amounts(run: Mapping[str, Any]) -> list[tuple[str, float]]:
    """Return what a run had to get through: names of rates, and millions of bytes and points."""
    if "inputs" not in run:
        return []
    megabytes = sum(file["bytes"] for file in run["inputs"]) / 1e6
    points = sum(lidar["points"] for lidar in run["capture"]["streams"]) / 1e6
    return [("MB/s", megabytes), ("million points/s", points)]


class Progress:
    """The callbacks that long calls take; this one shows nothing, and lets Ctrl-C through."""

    def amount(self, done: int, total: int) -> None:
        """Take progress in bytes."""
        INTERRUPT.check()
        self._show(None, done, total)

    def stage(self, stage: str, done: int, total: int) -> None:
        """Take progress of a named stage."""
        INTERRUPT.check()
        self._show(stage, done, total)

    def _show(self, stage: str | None, done: int, total: int) -> None:
        """Show it, where somebody sees it."""


class _Bar(Progress):
    """A bar of rich on stderr that vanishes at the end."""

    def __init__(self, label: str) -> None:
        from rich.console import Console
        from rich.progress import BarColumn, TaskProgressColumn, TextColumn, TimeRemainingColumn
        from rich.progress import Progress as RichProgress

        self._label = label
        self._bar = RichProgress(
            TextColumn("{task.description}"),
            BarColumn(),
            TaskProgressColumn(),
            TimeRemainingColumn(),
            console=Console(stderr=True),
            transient=True,
        )
        self._task = self._bar.add_task(label, total=None)
        self._bar.start()

    def _show(self, stage: str | None, done: int, total: int) -> None:
        self._bar.update(
            self._task, description=stage or self._label, completed=done, total=total or None
        )

    def stop(self) -> None:
        self._bar.stop()


def quiet_stdout() -> None:
    """Point stdout nowhere, so that its last flush cannot complain about a closed pipe."""
    nowhere = os.open(os.devnull, os.O_WRONLY)
    os.dup2(nowhere, sys.stdout.fileno())


def table(header: Sequence[str], rows: Iterable[Sequence[str]]) -> str:
    """Lay out columns, numbers to the right, words to the left."""
    cells = [list(header), *(list(row) for row in rows)]
    widths = [max(len(row[i]) for row in cells) for i in range(len(header))]
    numeric = [
        len(cells) > 1 and all(_is_number(row[i]) for row in cells[1:]) for i in range(len(header))
    ]
    lines = (
        "  ".join(
            cell.rjust(width) if right else cell.ljust(width)
            for cell, width, right in zip(row, widths, numeric, strict=True)
        ).rstrip()
        for row in cells
    )
    return "\n".join(lines)


def _is_number(text: str) -> bool:
    return not text.strip("-") or not text.strip("+-0123456789.,% ")


def grouped(value: int) -> str:
    """Write a whole number with thin gaps between thousands."""
    return f"{value:,}".replace(",", " ")


def to_json(document: Any) -> str:
    """Write one JSON document; what is not finite becomes null."""
    return json.dumps(plain(document), indent=2, ensure_ascii=False, allow_nan=False)


def plain(value: Any) -> Any:
    """Reduce a value to what JSON knows."""
    if isinstance(value, Mapping):
        return {str(key): plain(inner) for key, inner in value.items()}
    if isinstance(value, str | bool | int | None):
        return value
    if isinstance(value, float):
        return value if math.isfinite(value) else None
    if isinstance(value, date):
        return value.isoformat()
    if isinstance(value, timedelta):
        return value.total_seconds()
    if isinstance(value, Path):
        return str(value)
    if hasattr(value, "tolist"):  # numpy
        return plain(value.tolist())
    if isinstance(value, Iterable):
        return [plain(inner) for inner in value]
    return str(value)
