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


class ControllerError(Exception):
    """Base of all errors of this package; its text is one line meant for the user."""

    def __str__(self) -> str:
        """Return the line."""
        return one_line(super().__str__())


class RegionError(ControllerError):
    """Raised for an invalid region: a radius below zero, a polygon with two corners."""


class LawError(ControllerError):
    """Raised for invalid gains or limits."""


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


class TranslationError(ControllerError):
    """Raised for Python that is not translated to C; the message names file and line."""


class CompilationError(ControllerError):
    """Raised where a C compiler is needed, but missing, or where it fails."""
