"""Fonts of the PDF: what has which characters; what none has is said and replaced."""

from __future__ import annotations

import unicodedata
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

from lidar_deflect.extras import need

if TYPE_CHECKING:
    from collections.abc import Iterable

BODY = "DejaVu Sans"
"""Comes with matplotlib; Latin, Greek, Cyrillic and the signs of mathematics."""

REPLACEMENT = "\ufffd"
PREFERRED = ("Noto Sans CJK SC",)
_FIRST = ("SansCJK-Regular", "CJK-Regular", "wqy", "Sans-Regular", "Regular")
_REFUSED = ("Cc", "Cn", "Co", "Cs")  # what PDF/A refuses: private, unassigned, control
_IGNORED = {"\n", "\t", "\u200b"}


@dataclass(frozen=True)
class Fonts:
    """What a document is set in.

    Attributes
    ----------
    families
        Families in the order in which a character is looked for.
    folder
        Folder of the font that comes with the extra.
    files
        Fonts of this machine that are needed beside it.
    missing
        Characters that no font of this machine has.
    """

    families: tuple[str, ...]
    folder: Path
    files: tuple[Path, ...]
    missing: frozenset[str]

    def shown(self, text: str) -> str:
        """Return text with what no font has replaced."""
        return "".join(REPLACEMENT if each in self.missing else each for each in text)


def choose(texts: Iterable[str]) -> Fonts:
    """Choose fonts that have every character of the texts, as far as this machine has any.

    Raises
    ------
    MissingExtraError
        If matplotlib is not installed.
    """
    matplotlib = need("matplotlib", "pdf", "a PDF")
    folder = Path(matplotlib.get_data_path()) / "fonts" / "ttf"
    wanted = {each for text in texts for each in text} - _IGNORED
    missing = wanted - _characters(folder / "DejaVuSans.ttf")
    families, files = [BODY], []
    for path in _system() if missing else ():
        has = missing & _characters(path)
        if has:
            name = _family(path)
            families += [*(PREFERRED if "CJK" in name else ()), name]
            files.append(path)
            missing -= has
        if not missing:
            break
    refused = {each for each in wanted if unicodedata.category(each) in _REFUSED}
    names = tuple(dict.fromkeys(families))
    return Fonts(names, folder, tuple(files), frozenset(missing | refused))


def _system() -> list[Path]:
    """Fonts of this machine, upright and regular ones first, those for Chinese before others."""
    from matplotlib.font_manager import findSystemFonts

    found = sorted(map(Path, findSystemFonts()))
    return sorted(found, key=lambda path: [word not in path.name for word in _FIRST])


def _family(path: Path) -> str:
    from matplotlib.ft2font import FT2Font

    name: str = FT2Font(str(path)).family_name
    return name


def _characters(path: Path) -> set[str]:
    from matplotlib.ft2font import FT2Font

    try:
        return {chr(code) for code in FT2Font(str(path)).get_charmap()}
    except (OSError, RuntimeError):
        return set()
