"""Small HTML for notebooks: a line, and a table whose cells are text, whatever stands in them."""

from __future__ import annotations

from html import escape
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from collections.abc import Iterable, Sequence

_TABLE = "border-collapse:collapse;font-variant-numeric:tabular-nums"
_CELL = "padding:.15rem .6rem;text-align:{side};border-bottom:1px solid rgba(128,128,128,.3)"


def card(title: str, head: Sequence[str], rows: Iterable[Sequence[object]], note: str = "") -> str:
    """Return a title, a table and a note as HTML; numbers to the right."""
    body = "".join(f"<tr>{''.join(map(_cell, row))}</tr>" for row in rows)
    top = "".join(_wrapped("th", escape(name), "left") for name in head)
    table = f'<table style="{_TABLE}"><tr>{top}</tr>{body}</table>' if head else ""
    tail = f"<p><small>{escape(note)}</small></p>" if note else ""
    return f"<div><p><b>{escape(title)}</b></p>{table}{tail}</div>"


def _cell(value: object) -> str:
    shown = "–" if value is None else f"{value:.3f}" if isinstance(value, float) else str(value)  # noqa: RUF001
    side = "right" if isinstance(value, int | float) else "left"
    return _wrapped("td", escape(shown), side)


def _wrapped(tag: str, content: str, side: str) -> str:
    return f'<{tag} style="{_CELL.format(side=side)}">{content}</{tag}>'
