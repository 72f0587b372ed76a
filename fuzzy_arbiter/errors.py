"""What can go wrong when an arbiter is defined, read, or asked."""

import os
import re

MAX_QUOTED = 80  # characters that a message quotes at a time
MAX_WORDS = 280  # characters of a message, beside
MAX_WHERE = 250  # those of the file before it

_SEP = re.escape(f"/{os.sep}")  # paths are kept whole
_QUOTED = re.compile(
    rf"""'[^'{_SEP}]{{80,}}'|"[^"{_SEP}]{{80,}}"|[\[({{][^\[\](){{}}{_SEP}]{{80,}}[\])}}]|[^\s'"{_SEP}]{{80,}}"""
)
_FILE = re.compile(rf"""(?!--)[^'"]*[{_SEP}][^'"]*""")  # before the first colon


class ArbiterError(Exception):
    """Base of all errors of this package; its text is one line meant for the user."""

    def __str__(self) -> str:
        """Return the line."""
        return one_line(super().__str__())


class DefinitionError(ArbiterError):
    """A definition that cannot be: an unknown term in a rule, two variables of one name, a shape that turns back."""


class EngineError(DefinitionError):
    """An engine that does not exist, or that cannot evaluate this system."""


class FormatError(ArbiterError):
    """A text that is not of its format, or says what this package does not know."""


class UnsupportedError(ArbiterError):
    """A definition that the wished format cannot say."""


class PictureError(ArbiterError):
    """Pictures where Matplotlib is not installed."""


class InputError(ArbiterError):
    """An input that is missing, unknown, not a number, or outside its universe."""


def one_line(said: object) -> str:
    """Return what is said as one printable line, with the middle cut out of what is quoted at length.

    Parameters
    ----------
    said : object
        Such as ``FILE: key is VALUE, expected ...``.

    Returns
    -------
    str
        The file before the first colon as a whole, unless it is absurdly long.
    """
    line = _QUOTED.sub(lambda quoted: _cut(quoted[0], MAX_QUOTED), printable(said))
    where, colon, what = line.partition(": ")
    if not (colon and _FILE.fullmatch(where)):
        return _cut(line, MAX_WORDS)
    return _cut(where, MAX_WHERE) + colon + _cut(what, MAX_WORDS)


def printable(said: object) -> str:
    """Return what is said as one line that a terminal only shows.

    Parameters
    ----------
    said : object
        Anything.

    Returns
    -------
    str
        What is not printable, such as the escape of a terminal's orders, is as Python writes it.
    """
    line = " ".join(str(said).splitlines())
    return line if line.isprintable() else "".join(c if c.isprintable() else ascii(c)[1:-1] for c in line)


def _cut(text: str, most: int) -> str:
    half = (most - 5) // 2
    return text if len(text) <= most else f"{text[:half]} ... {text[-half:]}"
