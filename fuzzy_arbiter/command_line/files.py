"""Read input files, and check the suffixes of output files."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TextIO

from fuzzy_arbiter.errors import FormatError, InputError


def read_text(path: str, stdin: TextIO | None) -> tuple[str, str]:
    """Read a text from a file or from standard input."""
    where = "standard input" if path == "-" else path
    try:
        if path != "-":
            return Path(path).read_bytes().decode(), where
        if stdin is None:
            raise InputError(f"{where}: is closed")
        return stdin.read(), where
    except UnicodeDecodeError:
        raise InputError(f"{where}: not UTF-8 text") from None
    except OSError as error:
        raise InputError(f"{where}: {error.strerror or error}") from None


def require_suffix(out: str, expected: Sequence[str]) -> None:
    """Require that a file has one of the known suffixes."""
    if Path(out).suffix[1:].lower() not in expected:
        raise FormatError(f"{out}: suffix is {Path(out).suffix!r}, expected .{', .'.join(expected)}")
