"""Atomic writes of whole contents, and the reason of an error of writing."""

from __future__ import annotations

import os
from pathlib import Path

from plant_fmu.temporary import atomic_file


def write_atomic(path: Path, content: bytes | str) -> Path:
    """Write a file atomically: an error leaves the old one.

    Parameters
    ----------
    path : Path
        The file; an existing one is replaced.
    content : bytes or str
        The content; text is encoded as UTF-8.

    Returns
    -------
    Path
        The file.

    Raises
    ------
    OSError
        If the file cannot be written, as for `plant_fmu.temporary.atomic_file`.
    """
    with atomic_file(path) as file:
        file.write(content.encode() if isinstance(content, str) else content)
    return path


def reason(error: OSError) -> str:
    """Return the system's words for an error; Parquet's library hides them in a text of its own."""
    return os.strerror(error.errno) if error.errno else str(error)
