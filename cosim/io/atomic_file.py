"""Atomic writes: a temporary file of a random name, which replaces the target once it is complete."""

from __future__ import annotations

import errno
import secrets
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import BinaryIO


@contextmanager
def atomic_file(path: Path) -> Iterator[BinaryIO]:
    """Open a temporary file that replaces `path` once the block has ended without an error.

    The temporary file is new and has a random name: a link in a shared folder is not followed, and two processes do not
    write into one file.

    Parameters
    ----------
    path : Path
        The file. An existing one is replaced; a link is replaced itself, not its target.

    Yields
    ------
    binary file
        The temporary file, open for writing.

    Raises
    ------
    FileExistsError
        If `path` exists and is not a file, such as a folder or a device.
    OSError
        If the file cannot be written; the temporary file is removed.
    """
    if path.exists() and not path.is_file():
        raise FileExistsError(errno.EEXIST, "exists and is no file", str(path))
    scratch = path.with_name(f".{path.name}-{secrets.token_hex(8)}")
    try:
        with scratch.open("xb") as file:
            yield file
        scratch.replace(path)
    finally:
        scratch.unlink(missing_ok=True)


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
        If the file cannot be written, as for `atomic_file`.
    """
    with atomic_file(path) as file:
        file.write(content.encode() if isinstance(content, str) else content)
    return path
