"""Files that appear whole or not at all, by way of one that nobody else has and no link stands for."""

from __future__ import annotations

import errno
import secrets
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import BinaryIO


@contextmanager
def atomic_file(path: Path) -> Iterator[BinaryIO]:
    """Open a file that takes its place once the block has ended well.

    What is written meanwhile has a name that cannot be foreseen, and is new: a link that somebody left in a folder is
    not followed, and two processes do not write into one file.

    Parameters
    ----------
    path : Path
        The file; what was there is replaced, a link itself rather than what it leads to.

    Yields
    ------
    binary file
        To be written.

    Raises
    ------
    FileExistsError
        If it is there and is no file, such as a folder or a device.
    OSError
        If it cannot be written; nothing is left then.
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
    """Write a file whole or not at all.

    Parameters
    ----------
    path : Path
        The file; what was there is replaced.
    content : bytes or str
        All of it; text becomes UTF-8.

    Returns
    -------
    Path
        The file.

    Raises
    ------
    OSError
        As `atomic_file`.
    """
    with atomic_file(path) as file:
        file.write(content.encode() if isinstance(content, str) else content)
    return path
