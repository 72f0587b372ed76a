"""Atomic writes of whole contents, and the reason of an error of writing."""

from __future__ import annotations

import contextlib
import os
from collections.abc import Mapping
from pathlib import Path

from plant_fmu.archive import atomic_file


def write_atomic(path: Path, content: bytes | str) -> Path:
    """Write a file atomically: an error leaves the old one."""
    with atomic_file(path) as file:
        file.write(content.encode() if isinstance(content, str) else content)
    return path


def write_together(contents: Mapping[Path, str]) -> None:
    """Write files that belong together: whenever an error or a kill comes, those that exist are of one call."""
    # All are written to temporary files first. Then the old ones are removed, except the first, and each is renamed.
    _, *others = contents
    with contextlib.ExitStack() as renames:
        for path in reversed([*contents]):  # the first is the last that is opened, and so the first that is renamed
            file = renames.enter_context(atomic_file(path))
            file.write(contents[path].encode())
            file.flush()
        for path in others:
            path.unlink(missing_ok=True)


def reason(error: OSError) -> str:
    """Return the system's words for an error; Parquet's library hides them in a text of its own."""
    return os.strerror(error.errno) if error.errno else str(error)
