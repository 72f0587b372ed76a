"""Where lines of text break."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cache
from typing import TYPE_CHECKING

from matplotlib.font_manager import FontProperties, findfont, get_font
from matplotlib.ft2font import FT2Font

if TYPE_CHECKING:
    from matplotlib.ft2font import GlyphIndexType

_LARGE = 1000.0  # pt, at which letters are measured: hinting, which rounds to points, hardly counts


@dataclass(frozen=True)
class Face:
    """A font that comes with Matplotlib."""

    family: str
    weight: str = "normal"


_UNKNOWN = "\ufffd"
PLAIN, BOLD, MONO = Face("DejaVu Serif"), Face("DejaVu Serif", "bold"), Face("DejaVu Sans Mono")


def wrapped(text: str, width: float, size: float, face: Face) -> list[str]:
    """Return a text in lines, with a sign for every letter that the font lacks.

    Parameters
    ----------
    text : str
        In one line.
    width : float
        Of the lines [inch].
    size : float
        Of the letters [pt].
    face : Face
        The font.

    Returns
    -------
    list of str
        At least one. Words that are wider than a line are broken.
    """
    text = "".join(letter if _index(letter, face) else _UNKNOWN for letter in text)
    indent = text[: len(text) - len(text.lstrip())]
    lines, line = [], indent
    for word in text.split():
        longer = f"{line} {word}" if line.strip() else f"{indent}{word}"
        if _width(longer, size, face) <= width:
            line = longer
            continue
        if line.strip():
            lines.append(line)
        while _width(word, size, face) > width:
            fitting = max(1, next(n for n in range(len(word)) if _width(word[: n + 1], size, face) > width))
            lines.append(word[:fitting])
            word = word[fitting:]
        line = word
    return [*lines, line]


def _width(text: str, size: float, face: Face) -> float:
    return sum(_letter(letter, face) for letter in text) * size / 72.0


@cache
def _letter(letter: str, face: Face) -> float:
    """Return how wide a letter is, in sizes of the font."""
    font = _font(face)
    font.set_size(_LARGE, 72.0)
    return float(font.load_glyph(_index(letter, face)).linearHoriAdvance) / 65536.0 / _LARGE


@cache
def _index(letter: str, face: Face) -> GlyphIndexType:
    return _font(face).get_char_index(ord(letter))


def _font(face: Face) -> FT2Font:
    return get_font(findfont(FontProperties(family=face.family, weight=face.weight)))
