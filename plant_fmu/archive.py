"""Zip files that appear whole or not at all, the same bytes each time."""

from __future__ import annotations

import os
import tempfile
import zipfile
from collections.abc import Mapping
from pathlib import Path

from plant_fmu.errors import BuildError

_DATE = (1980, 1, 1, 0, 0, 0)  # the earliest that the format knows
_UNIX = 3  # else the byte that says where the archive was made would differ between systems


def write_archive(out: Path, members: Mapping[str, bytes]) -> None:
    """Write a zip file.

    Parameters
    ----------
    out : Path
        The file; it appears whole or not at all, and replaces an older one.
    members : mapping of str to bytes
        Contents by name, with forward slashes.

    Raises
    ------
    BuildError
        If `out` cannot be written, or is there and is no file.
    """
    try:
        if out.is_dir() or (out.exists() and not out.is_file()):
            raise BuildError(f"{out}: exists and is no file; expected the name of a new one")
        with tempfile.NamedTemporaryFile(dir=out.parent, prefix=f".{out.name}-", delete=False) as scratch:
            pass
    except OSError as error:
        raise BuildError(f"{out}: {error.strerror or error}") from error
    try:
        with zipfile.ZipFile(scratch.name, "w", zipfile.ZIP_DEFLATED) as archive:
            for name, data in sorted(members.items()):
                info = zipfile.ZipInfo(name, _DATE)
                info.compress_type = zipfile.ZIP_DEFLATED
                info.create_system = _UNIX
                info.external_attr = 0o644 << 16
                archive.writestr(info, data)
        os.chmod(scratch.name, 0o644)
        os.replace(scratch.name, out)
    except OSError as error:
        raise BuildError(f"{out}: {error.strerror or error}") from error
    finally:
        Path(scratch.name).unlink(missing_ok=True)
