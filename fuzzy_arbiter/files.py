"""Write files atomically."""

from __future__ import annotations

import os
import secrets
from pathlib import Path

from fuzzy_arbiter.errors import FormatError


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
