"""Read text files, and write files atomically."""

from __future__ import annotations

import contextlib
import os
import secrets
import sys
import warnings
from pathlib import Path

from fuzzy_arbiter.errors import FormatError


def read_text(path: str | Path, max_size: int, requires_utf8: bool) -> str:
    """Read a text file; decode lines that are not UTF-8 as Windows-1252 or Latin-1 unless `requires_utf8`."""
    try:
        if Path(path).exists() and not (Path(path).is_file() or Path(path).is_dir()):  # to open a pipe would wait
            raise FormatError(f"{path}: is a pipe or a device, expected a file")
        with Path(path).open("rb") as file:
            data = file.read(max_size + 1)
    except (OSError, ValueError) as error:  # ValueError: a name with a null character
        raise FormatError(f"{path}: {getattr(error, 'strerror', None) or error}") from None
    if len(data) > max_size:
        raise FormatError(f"{path}: file too large, expected at most {max_size} bytes")
    if data.startswith((b"\xff\xfe", b"\xfe\xff")):
        raise FormatError(f"{path}: is UTF-16, expected UTF-8")
    try:
        return data.decode()
    except UnicodeDecodeError as error:
        if requires_utf8 or b"\0" in data:
            raise FormatError(f"{path}: byte {error.start} is no UTF-8, expected text in UTF-8") from None
        line = data.count(b"\n", 0, error.start) + 1
        what = f"{path}: line {line} is no UTF-8, so it and others like it are taken as Windows-1252"
        level, frame = 1, sys._getframe()
        while frame.f_back and frame.f_globals["__name__"].startswith("fuzzy_arbiter"):
            level, frame = level + 1, frame.f_back
        warnings.warn(what, stacklevel=level)
        return "".join(map(_decoded, data.splitlines(keepends=True)))


def _decoded(line: bytes) -> str:
    for encoding in ("utf-8", "cp1252"):
        with contextlib.suppress(UnicodeDecodeError):
            return line.decode(encoding)
    return line.decode("latin-1")


def write_atomic(path: str | Path, data: bytes) -> None:
    """Write a file atomically, and replace an older one."""
    scratch = None
    try:
        out = Path(path).resolve()
        if out.is_dir():
            raise FormatError(f"{path}: Is a directory, expected a file")
        if out.exists() and not out.is_file():  # a device, a pipe: written to, not replaced
            out.write_bytes(data)
            return
        # not by `tempfile`, whose files are for their owner alone
        with open(out.with_name(f".{out.name}-{secrets.token_hex(4)}"), "xb") as scratch:
            scratch.write(data)
        os.replace(scratch.name, out)
    except (OSError, ValueError) as error:  # ValueError: a name with a null character
        raise FormatError(f"{path}: {getattr(error, 'strerror', None) or error}") from None
    finally:
        if scratch:
            Path(scratch.name).unlink(missing_ok=True)
