"""Write files atomically, and zip files that are the same bytes each time."""

from __future__ import annotations

import io
import tempfile
import zipfile
from collections.abc import Mapping
from pathlib import Path

from plant_fmu.errors import BuildError
from plant_fmu.temporary import atomic_file

_DATE = (1980, 1, 1, 0, 0, 0)  # the earliest that the format knows
_UNIX = 3  # else the byte for the system of origin would differ between systems


def require_place(out: Path) -> None:
    """Require that a file can be written, before the work that goes into it.

    Raises
    ------
    BuildError
        If it exists and is not a file, or its folder cannot be written to.
    """
    try:
        if out.is_dir() or (out.exists() and not out.is_file()):
            raise BuildError(f"{out}: exists and is no file; expected the name of a new one")
        with tempfile.TemporaryFile(dir=out.parent):
            pass
    except OSError as error:
        raise BuildError(f"{out}: {error.strerror or error}") from error


def write_atomic(out: Path, data: bytes) -> None:
    """Write a file atomically, and replace an older one.

    Raises
    ------
    BuildError
        If `out` cannot be written, or is there and is no file.
    """
    require_place(out)
    try:
        with atomic_file(out) as file:
            file.write(data)
    except OSError as error:
        raise BuildError(f"{out}: {error.strerror or error}") from error


def write_archive(out: Path, members: Mapping[str, bytes]) -> None:
    """Write a zip file atomically.

    Parameters
    ----------
    out : Path
        Path of the file; an older one is replaced.
    members : mapping of str to bytes
        Contents by name, with forward slashes.

    Raises
    ------
    BuildError
        If `out` cannot be written, or is there and is no file.
    """
    write_atomic(out, archive_of(members))


def archive_of(members: Mapping[str, bytes]) -> bytes:
    """Return the bytes of a zip file.

    Parameters
    ----------
    members : mapping of str to bytes
        Contents by name, with forward slashes.

    Returns
    -------
    bytes
        The archive; equal members give equal bytes.
    """
    data = io.BytesIO()
    with zipfile.ZipFile(data, "w", zipfile.ZIP_DEFLATED) as archive:
        for name, content in sorted(members.items()):
            info = zipfile.ZipInfo(name, _DATE)
            info.compress_type = zipfile.ZIP_DEFLATED
            info.create_system = _UNIX
            info.external_attr = 0o644 << 16
            archive.writestr(info, content)
    return data.getvalue()
