"""Temporary files and folders, atomic writes, and zip files that are the same bytes each time."""

# Temporary ones are locked while they are in use, and the system drops the lock when the process ends, however it ends:
# later processes remove those of killed ones.

from __future__ import annotations

import contextlib
import errno
import io
import os
import re
import secrets
import shutil
import sys
import tempfile
import time
import zipfile
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import BinaryIO

from plant_fmu.errors import BuildError

_MIN_AGE = 3600.0  # s since the last change, so that one that is not locked yet is never removed
_RANDOM = "[0-9a-f]{16}"  # pattern of the random end of a name
_DATE = (1980, 1, 1, 0, 0, 0)  # the earliest that the format knows
_UNIX = 3  # else the byte for the system of origin would differ between systems


@contextlib.contextmanager
def temporary_folder(prefix: str, parent: Path | None = None) -> Iterator[Path]:
    """Create a folder for a block, below `parent` or the system's temporary folder, and remove it afterwards."""
    parent = Path(tempfile.gettempdir()) if parent is None else parent
    remove_abandoned(parent, prefix)
    folder = parent / f"{prefix}{secrets.token_hex(8)}"
    try:
        folder.mkdir(mode=0o700)
        with _opened(folder) as descriptor:
            _lock(descriptor)
            yield folder
    finally:
        shutil.rmtree(folder, ignore_errors=True)


@contextlib.contextmanager
def atomic_file(path: Path) -> Iterator[BinaryIO]:
    """Open a temporary file that replaces `path` once the block has ended without an error."""
    # The temporary file is new and has a random name: a link in a shared folder is not followed, and two processes do
    # not write into one file.
    if path.exists() and not path.is_file():
        raise FileExistsError(errno.EEXIST, "exists and is no file", str(path))
    remove_abandoned(path.parent, f".{path.name}-")
    scratch = path.with_name(f".{path.name}-{secrets.token_hex(8)}")
    try:
        with scratch.open("xb") as file:
            _lock(file.fileno())
            yield file
        scratch.replace(path)
    except OSError as error:
        if error.filename in (None, str(scratch)):  # no write names its file, and nobody knows the temporary one
            error.filename, error.filename2 = str(path), None
        raise
    finally:
        scratch.unlink(missing_ok=True)


def is_temporary(name: str) -> bool:
    """Return True if a hidden file or folder has the name of a temporary one."""
    return re.fullmatch(rf"\..+-{_RANDOM}", name) is not None


def remove_abandoned(parent: Path, prefix: str) -> None:
    """Remove temporary files and folders of the user whose process was killed; needs locks, which Windows lacks."""
    if sys.platform == "win32":
        return
    with contextlib.suppress(OSError):
        for entry in list(os.scandir(parent)):
            if re.fullmatch(re.escape(prefix) + _RANDOM, entry.name):
                with contextlib.suppress(OSError):  # in use, or another process removes it
                    _remove_abandoned(entry)


def _remove_abandoned(entry: os.DirEntry[str]) -> None:
    status = entry.stat(follow_symlinks=False)
    if entry.is_symlink() or status.st_uid != os.geteuid() or time.time() - status.st_mtime < _MIN_AGE:
        return
    with _opened(Path(entry.path)) as descriptor:
        if descriptor is not None and _lock(descriptor):
            if entry.is_dir(follow_symlinks=False):
                shutil.rmtree(entry.path, ignore_errors=True)
            else:
                os.unlink(entry.path)


@contextlib.contextmanager
def _opened(path: Path) -> Iterator[int | None]:
    """Open a file or folder for its lock; yield None on Windows, which has no locks of folders."""
    if sys.platform == "win32":
        yield None
        return
    descriptor = os.open(path, os.O_RDONLY | os.O_NOFOLLOW | os.O_NONBLOCK)
    try:
        yield descriptor
    finally:
        os.close(descriptor)


def _lock(descriptor: int | None) -> bool:
    """Lock a file or folder until it is closed; return False if another process has locked it, or locks are missing."""
    if sys.platform == "win32" or descriptor is None:
        return False
    import fcntl

    try:
        fcntl.flock(descriptor, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except OSError:
        return False
    return True


def require_writable(out: Path) -> None:
    """Require that a file can be written, before the work that goes into it."""
    try:
        if out.is_dir() or (out.exists() and not out.is_file()):
            raise BuildError(f"{out}: exists and is no file; expected the name of a new one")
        with tempfile.TemporaryFile(dir=out.parent):
            pass
    except OSError as error:
        raise BuildError(f"{out}: {error.strerror or error}") from error


def write_atomic(out: Path, data: bytes) -> None:
    """Write a file atomically, and replace an older one."""
    require_writable(out)
    try:
        with atomic_file(out) as file:
            file.write(data)
    except OSError as error:
        raise BuildError(f"{out}: {error.strerror or error}") from error


def write_archive(out: Path, members: Mapping[str, bytes]) -> None:
    """Write a zip file atomically."""
    write_atomic(out, make_archive(members))


def make_archive(members: Mapping[str, bytes]) -> bytes:
    """Return the bytes of a zip file."""
    data = io.BytesIO()
    with zipfile.ZipFile(data, "w", zipfile.ZIP_DEFLATED) as archive:
        for name, content in sorted(members.items()):
            info = zipfile.ZipInfo(name, _DATE)
            info.compress_type = zipfile.ZIP_DEFLATED
            info.create_system = _UNIX
            info.external_attr = 0o644 << 16
            archive.writestr(info, content)
    return data.getvalue()
