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


class PlantFmuError(Exception):
    """Base of all errors of this package; its text is one line meant for the user."""

    def __str__(self) -> str:
        """Return the line."""
        return one_line(super().__str__())


class TableError(PlantFmuError):
    """Raised for a TOML file that cannot be read, or has a key that is missing, unknown or of the wrong type."""


class VehicleError(TableError):
    """Raised for an unknown vehicle, or for a vehicle file with an invalid key or numbers that contradict physics."""


class BuildError(PlantFmuError):
    """Raised where no compiler is found, a compiler fails, or a file cannot be written."""


class PlantError(PlantFmuError):
    """Raised for an FMU that cannot be loaded, or refuses a value or a step; the message quotes the FMU."""


class StepError(PlantError):
    """Raised for a step that fails: when [s], and why."""

    def __init__(self, time: float, reason: str) -> None:
        super().__init__(f"t = {time:.6g} s: {reason}")
        self.time, self.reason = time, reason

    def __reduce__(self) -> tuple[object, ...]:
        return StepError, (self.time, self.reason)


class FmuFileError(PlantFmuError):
    """Raised for a file that is no FMU, or that is unsafe to extract."""


class TaskError(PlantFmuError):
    """Raised for an impossible simulation: times that do not fit, or variables that the FMU does not have."""


class ImporterError(PlantFmuError):
    """Raised for an importer that refuses an FMU, or fails with it."""


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
