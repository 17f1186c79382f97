"""The part of YAML that tools write transforms in: block and flow collections of scalars.

No anchors, tags or texts over several lines; those are told as errors, never misread.
"""

from __future__ import annotations

import json
import re
from typing import TYPE_CHECKING, Any

from lidar_deflect.interchange.placed import Place

if TYPE_CHECKING:
    from collections.abc import Iterator
    from pathlib import Path

__all__ = ["documents"]

KEY = re.compile(r"""("(?:[^"\\]|\\.)*"|'[^']*'|[^\s'"\[\]{},#&*!|>%@`][^:#]*?)\s*:(?:\s+|$)""")
COMMENT = re.compile(r"""((?:[^'"#]|"(?:[^"\\]|\\.)*"|'[^']*'|(?<=\S)#)*?)(?:(?:^|\s)#.*)?""")
INTEGER = re.compile(r"[-+]?\d+")
FLOAT = re.compile(r"[-+]?(\d+\.?\d*|\.\d+)([eE][-+]?\d+)?")
REFUSED = ("&", "*", "!", "|", ">", "%", "@", "`", "?")
DEEPEST = 30


def documents(path: Path, text: str) -> Iterator[Any]:
    """Give the documents of a text.

    Raises
    ------
    InvalidValueError
        That names the line that is not understood.
    """
    lines: list[_Line] = []
    for count, raw in enumerate(text.removeprefix("\ufeff").splitlines(), 1):
        if raw.startswith(("---", "...")):
            if lines:
                yield _Block(path, lines).whole()
            lines = []
            continue
        place = Place(path, f"line {count}")
        match = COMMENT.fullmatch(raw)
        content = (match[1] if match else raw).rstrip()
        if content.strip():
            indent = len(content) - len(content.lstrip(" "))
            if content[indent] == "\t":
                raise place.refuse("blanks before the text", "a tab")
            lines.append(_Line(indent, content[indent:], place))
    if lines:
        yield _Block(path, lines).whole()


class _Line:
    """A line without its comment; `indent` grows where a list item opens a mapping."""

    def __init__(self, indent: int, text: str, place: Place) -> None:
        self.indent, self.text, self.place = indent, text, place


class _Block:
    """Lines being read from the top."""

    def __init__(self, path: Path, lines: list[_Line]) -> None:
        self.path, self.lines, self.next = path, lines, 0

    def whole(self) -> Any:
        value = self._value(self.lines[0].indent, 0)
        if self.next < len(self.lines):
            line = self.lines[self.next]
            raise line.place.refuse("the indent of the lines before", repr(line.text[:40]))
        return value

    def _line(self, indent: int) -> _Line | None:
        """Give the next line, if it stands at this indent."""
        if self.next < len(self.lines) and self.lines[self.next].indent == indent:
            return self.lines[self.next]
        return None

    def _value(self, indent: int, depth: int) -> Any:
        line = self.lines[self.next]
        if depth > DEEPEST:
            raise line.place.refuse(f"at most {DEEPEST} levels", "more")
        if _is_item(line.text):
            return self._list(indent, depth)
        if KEY.match(line.text):
            return self._mapping(indent, depth)
        self.next += 1
        return _scalar(line.text, line.place)

    def _list(self, indent: int, depth: int) -> list[Any]:
        items = []
        while (line := self._line(indent)) and _is_item(line.text):
            rest = line.text[1:].lstrip(" ")
            if rest:
                line.indent += len(line.text) - len(rest)
                line.text = rest
                items.append(self._value(line.indent, depth + 1))
            else:
                self.next += 1
                items.append(self._nested(indent, depth, is_item=True))
        return items

    def _mapping(self, indent: int, depth: int) -> dict[str, Any]:
        found: dict[str, Any] = {}
        while (line := self._line(indent)) and not _is_item(line.text):
            match = KEY.match(line.text)
            if match is None:
                raise line.place.refuse("KEY: VALUE", repr(line.text[:40]))
            key, rest = str(_scalar(match[1], line.place)), line.text[match.end() :]
            if key in found:
                raise line.place.refuse("every key once", repr(key))
            self.next += 1
            found[key] = (
                _scalar(rest, line.place) if rest else self._nested(indent, depth, is_item=False)
            )
        return found

    def _nested(self, indent: int, depth: int, *, is_item: bool) -> Any:
        if self.next >= len(self.lines):
            return None
        line = self.lines[self.next]
        # A list may stand at the indent of the key that it belongs to.
        is_own = line.indent > indent or (
            not is_item and line.indent == indent and _is_item(line.text)
        )
        return self._value(line.indent, depth + 1) if is_own else None


def _is_item(text: str) -> bool:
    return text == "-" or text.startswith("- ")


def _scalar(text: str, place: Place) -> Any:
    """Read a scalar or a flow collection that ends with the line."""
    flow = _Flow(text, place)
    value = flow.value(0) if text[0] in "[{" else _plain(text, place)
    if text[0] in "[{" and flow.rest().strip():
        raise place.refuse("the end of the line", repr(flow.rest()[:40]))
    return value


def _plain(text: str, place: Place) -> Any:
    text = text.strip()
    if text.startswith('"'):
        try:
            return json.loads(text)
        except json.JSONDecodeError:
            raise place.refuse("a quoted text", repr(text[:40])) from None
    if text.startswith("'"):
        if len(text) < 2 or not text.endswith("'"):
            raise place.refuse("a quoted text", repr(text[:40]))
        return text[1:-1].replace("''", "'")
    if text.startswith(REFUSED):
        raise place.refuse("a plain value", repr(text[:40]))
    if INTEGER.fullmatch(text):
        return int(text[:400])
    if FLOAT.fullmatch(text):
        return float(text)
    words = {"null": None, "~": None, "true": True, "false": False}
    return words.get(text.lower(), text)


class _Flow:
    """A flow collection being read."""

    def __init__(self, text: str, place: Place) -> None:
        self.text, self.place, self.next = text, place, 0

    def rest(self) -> str:
        return self.text[self.next :]

    def value(self, depth: int) -> Any:
        self._blanks()
        if depth > DEEPEST:
            raise self.place.refuse(f"at most {DEEPEST} levels", "more")
        if self.rest().startswith("["):
            return self._list(depth)
        if self.rest().startswith("{"):
            return self._mapping(depth)
        match = re.match(r"""\s*("(?:[^"\\]|\\.)*"|'[^']*'|[^,\[\]{}:]+)""", self.rest())
        if match is None:
            raise self.place.refuse("a value", repr(self.rest()[:40]))
        self.next += match.end()
        return _plain(match[1], self.place)

    def _list(self, depth: int) -> list[Any]:
        self.next += 1
        items: list[Any] = []
        while not self._ends("]"):
            items.append(self.value(depth + 1))
            self._comma("]")
        return items

    def _mapping(self, depth: int) -> dict[str, Any]:
        self.next += 1
        found: dict[str, Any] = {}
        while not self._ends("}"):
            key = str(self.value(depth + 1))
            self._blanks()
            if not self.rest().startswith(":"):
                raise self.place.refuse("a colon", repr(self.rest()[:40]))
            self.next += 1
            found[key] = self.value(depth + 1)
            self._comma("}")
        return found

    def _blanks(self) -> None:
        self.next += len(self.rest()) - len(self.rest().lstrip())

    def _ends(self, bracket: str) -> bool:
        self._blanks()
        is_end = self.rest().startswith(bracket)
        self.next += is_end
        return is_end

    def _comma(self, bracket: str) -> None:
        self._blanks()
        if self.rest().startswith(","):
            self.next += 1
        elif not self.rest().startswith(bracket):
            raise self.place.refuse(f"a comma or {bracket}", repr(self.rest()[:40]))
