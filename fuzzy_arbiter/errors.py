"""Errors of the package, and the format of their messages."""

import os
import re

MAX_QUOTED = 80  # characters that a message quotes at a time
MAX_WORDS = 280  # characters of the rest of a message
MAX_WHERE = 250  # characters of the file's name before it

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
    """Raised for an invalid definition: an unknown term in a rule, two variables of one name."""


class EngineError(DefinitionError):
    """Raised for an engine that does not exist, or that cannot evaluate this system."""


class FormatError(ArbiterError):
    """Raised for a text that is not of its format, or uses an unsupported part of it."""


class UnsupportedError(ArbiterError):
    """Raised for a definition that the format cannot represent."""


class PictureError(ArbiterError):
    """Raised for a picture where Matplotlib is not installed."""


class InputError(ArbiterError):
    """Raised for an input that is missing, unknown, not a number, or outside its universe."""


def one_line(message: object) -> str:
    """Format a message as one printable line, and cut the middle out of long quotations."""
    line = _QUOTED.sub(lambda quoted: _cut(quoted[0], MAX_QUOTED), printable(message))
    file, colon, rest = line.partition(": ")
    if not (colon and _FILE.fullmatch(file)):
        return _cut(line, MAX_WORDS)
    return _cut(file, MAX_WHERE) + colon + _cut(rest, MAX_WORDS)


def printable(message: object) -> str:
    """Format a message as one line without control characters."""
    line = " ".join(str(message).splitlines())
    return line if line.isprintable() else "".join(c if c.isprintable() else ascii(c)[1:-1] for c in line)


def _cut(text: str, max_length: int) -> str:
    half = (max_length - 5) // 2
    return text if len(text) <= max_length else f"{text[:half]} ... {text[-half:]}"
