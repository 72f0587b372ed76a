"""Find or compile the C library of a text: in the package, in the user's cache, or compiled now."""

# A library's name is a digest of the C text that it is made from, so that it is unique. Beside it is a file with its
# checksum: loading half of one could end the process.

from __future__ import annotations

import atexit
import contextlib
import ctypes
import functools
import hashlib
import logging
import os
import platform
import shutil
import stat
import sys
import tempfile
import time
from collections.abc import Callable, Iterable, Iterator
from pathlib import Path

import platformdirs

from controller.compiling.compiler import FLAGS, compiling

try:
    import fcntl
except ModuleNotFoundError:  # on Windows
    fcntl = None  # type: ignore[assignment]

log = logging.getLogger(__name__)
first_use = logging.getLogger("controller.compiling.first_use")  # logs at INFO before something is compiled
first_use.propagate = False  # only for listeners by its name

PREBUILT = Path(__file__).parents[1] / "prebuilt"  # one folder a platform in a wheel; missing in a checkout
_STALE_AGE = 3600.0  # s; no process needs so long to write a library
_TEMP_PREFIX = "subreach-functions-"  # beginning of the name of a process's temporary folder
_MACHINE = {"amd64": "x86_64", "arm64": "aarch64"}
_SYSTEM = {"win32": "windows"}
_SUFFIX = {"win32": ".dll", "darwin": ".dylib"}.get(sys.platform, ".so")


@functools.cache
def load_library(text: str) -> ctypes.PyDLL:
    """Return the library of a C text, loaded; it is compiled where neither the package nor the cache has it."""
    return load_libraries([text])[0]


def load_libraries(texts: Iterable[str]) -> list[ctypes.PyDLL]:
    """Return the libraries of C texts, loaded; missing ones are compiled at the same time, while texts are made."""
    with contextlib.ExitStack() as compilers:
        libraries = [_find(text) or compilers.enter_context(_compiling(text)) for text in texts]
        return [library if isinstance(library, ctypes.PyDLL) else library() for library in libraries]


def _find(text: str) -> ctypes.PyDLL | None:
    """Return the library of a text from the package or the cache."""
    for folder in (PREBUILT / _platform(), cache_folder()):
        path = folder / f"{library_name(text)}{_SUFFIX}"
        if is_trusted(folder) and has_valid_checksum(path):
            with contextlib.suppress(OSError):  # the library may be for another C library
                return ctypes.PyDLL(str(path))
    return None


def library_name(text: str) -> str:
    """Return the name of the library of a C text, without the system's suffix."""
    return hashlib.sha256("\n".join((*FLAGS, text)).encode()).hexdigest()[:32]


def checksum_path(path: Path) -> Path:
    """Return the path of a library's checksum file, which is beside the library."""
    return path.with_name(f"{path.name}.sha256")


def checksum(library: bytes) -> str:
    """Return the checksum of a library's bytes."""
    return hashlib.sha256(library).hexdigest()


def _platform() -> str:
    """Return the name of this machine and system in FMI 3.0."""
    machine = platform.machine().lower()
    return f"{_MACHINE.get(machine, machine)}-{_SYSTEM.get(sys.platform, sys.platform)}"


def cache_folder() -> Path:
    """Return the folder of the user's cache."""
    return Path(platformdirs.user_cache_dir("subreach")) / "functions"


def has_valid_checksum(path: Path) -> bool:
    """Return True if a library exists and has its checksum: loading half of one can end the process."""
    try:
        expected, library = checksum_path(path).read_bytes(), path.read_bytes()
    except OSError:
        return False
    is_valid = expected == checksum(library).encode()
    if not is_valid:
        log.warning("%s: damaged; compiled anew", path)
    return is_valid


def is_trusted(folder: Path) -> bool:
    """Return True if only the user, or the owner of the package, can write in a folder of libraries."""
    try:
        status, trusted = folder.stat(), {Path(__file__).stat().st_uid}
    except OSError:
        return False
    if os.name != "posix":
        return True
    if status.st_uid in trusted | {os.geteuid()} and not status.st_mode & stat.S_IWOTH:
        return True
    _warn_of_others(folder)
    return False


@functools.cache
def _warn_of_others(folder: Path) -> None:
    """Log the warning once, however many libraries there are."""
    log.warning("%s: others can write there; compiled for this process alone", folder)


@contextlib.contextmanager
def _compiling(text: str) -> Iterator[Callable[[], ctypes.PyDLL]]:
    """Compile a library while a block runs, which receives the function that waits for it, keeps it and loads it."""
    name = library_name(text)
    first_use.info("compiling %s", name)
    started = time.perf_counter()
    own = Path(tempfile.mkdtemp(dir=_temporary_folder()))
    source, built = own / f"{name}.c", own / f"{name}{_SUFFIX}"
    source.write_text(text, encoding="utf-8")
    with compiling(source, built) as finish:

        def load() -> ctypes.PyDLL:
            finish()
            log.debug("%s: compiled in %.2f s", name, time.perf_counter() - started)
            return ctypes.PyDLL(str(cache_library(built, cache_folder())))

        yield load


def cache_library(built: Path, folder: Path) -> Path:
    """Copy a library with its checksum into a folder of the cache, atomically."""
    cached = folder / built.name
    try:
        folder.mkdir(parents=True, exist_ok=True, mode=0o700)
        if not is_trusted(folder):
            return built
        _remove_old_parts(folder)
        library = built.read_bytes()
        write_atomic(checksum_path(cached), checksum(library).encode())
        write_atomic(cached, library)
    except OSError as error:
        log.warning("cache %s: %s; compiled for this process alone", folder, error.strerror or error)
        return built
    return cached


def _remove_old_parts(folder: Path) -> None:
    """Remove what processes that were killed while they wrote have left in the cache, which only its user can write."""
    for part in folder.glob(".*.part"):
        with contextlib.suppress(OSError):
            if time.time() - part.stat().st_mtime > _STALE_AGE:
                part.unlink()


def write_atomic(path: Path, data: bytes) -> None:
    """Write a file atomically."""
    handle, scratch = tempfile.mkstemp(dir=path.parent, prefix=".", suffix=".part")
    try:
        with open(handle, "wb") as file:
            file.write(data)
        os.replace(scratch, path)
    except BaseException:
        Path(scratch).unlink(missing_ok=True)
        raise


@functools.cache
def _temporary_folder() -> Path:
    """Return a temporary folder that is removed with the process, or by a later one if the process is killed."""
    _remove_abandoned(Path(tempfile.gettempdir()))
    folder = tempfile.mkdtemp(prefix=_TEMP_PREFIX)
    atexit.register(shutil.rmtree, folder, ignore_errors=True)
    if fcntl is not None:  # the lock ends with the process, however it ends
        fcntl.flock(os.open(folder, os.O_RDONLY), fcntl.LOCK_SH)
    return Path(folder)


def _remove_abandoned(parent: Path) -> None:
    """Remove the folders of killed processes of this user."""
    if fcntl is None:
        return
    for folder in parent.glob(f"{_TEMP_PREFIX}*"):
        with contextlib.suppress(OSError):  # in use, or another process removes it
            descriptor = os.open(folder, os.O_RDONLY | os.O_NOFOLLOW | os.O_DIRECTORY)
            try:
                status = os.fstat(descriptor)
                if status.st_uid == os.geteuid() and time.time() - status.st_mtime > _STALE_AGE:
                    fcntl.flock(descriptor, fcntl.LOCK_EX | fcntl.LOCK_NB)
                    shutil.rmtree(folder, ignore_errors=True)
            finally:
                os.close(descriptor)
