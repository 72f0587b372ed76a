"""Files that are written whole or not at all."""

from __future__ import annotations

import os
import tempfile
from pathlib import Path

from fuzzy_arbiter.errors import FormatError


def write_whole(path: str | Path, data: bytes) -> None:
    """Write a file that appears whole or not at all, and replaces an older one.

    Parameters
    ----------
    path : str or Path
        The file; a device or a pipe is written to as it is.
    data : bytes
        What is to be in it.

    Raises
    ------
    FormatError
        If it cannot be written.
    """
    out = Path(path)
    scratch = None
    try:
        if out.is_dir():
            raise FormatError(f"{path}: is a folder, expected a file")
        if out.exists() and not out.is_file():
            out.write_bytes(data)
            return
        with tempfile.NamedTemporaryFile(dir=out.parent, prefix=f".{out.name}-", delete=False) as scratch:
            scratch.write(data)
        os.chmod(scratch.name, 0o644)
        os.replace(scratch.name, out)
    except (OSError, ValueError) as error:  # the latter for a name with a null in it
        raise FormatError(f"{path}: {getattr(error, 'strerror', None) or error}") from None
    finally:
        if scratch:
            Path(scratch.name).unlink(missing_ok=True)
