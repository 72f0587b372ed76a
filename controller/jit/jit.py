"""How functions of this package are compiled."""

from __future__ import annotations

import contextlib
import functools
import hashlib
import io
import logging
import os
import stat
import types
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any, TypeVar

import numba
from numba.core.caching import IndexDataCacheFile
from numba.core.registry import CPUDispatcher

log = logging.getLogger(__name__)

F = TypeVar("F", bound=Callable[..., object])

_PACKAGE = Path(__file__).parents[1]
_NumbasCacheFile: Any = IndexDataCacheFile  # which has no types


@functools.cache
def _sources(folder: Path, *others: Path) -> str:
    """Return the mark of all sources of this package, of those in the folder of who compiles with it, and of others."""
    files = sorted(
        {*_PACKAGE.rglob("*.py"), *folder.glob("*.py"), *(f for other in others for f in other.rglob("*.py"))}
    )
    return hashlib.sha256(b"".join(path.read_bytes() for path in files)).hexdigest()


def compiled(function: F, *others: Path) -> F:
    """Compile a plain function on float64 arrays with Numba, and keep the result on disk.

    Rounding follows IEEE 754 (no fast-math), so that a run repeats bit for bit; dividing by zero gives infinity or NaN
    as in NumPy.

    Parameters
    ----------
    function : callable
        Written in the part of Python and NumPy that Numba compiles.
    *others : Path
        Folders of what else it calls or reads: beside this package and the function's own folder, on whose sources
        what is kept depends in any case.

    Returns
    -------
    callable
        The same, compiled at its first call.
    """
    return _kept_on_disk(function, others, counting=True)


def jit_noalloc(function: F, *others: Path) -> F:
    """Compile as `compiled` does a function that makes no array, and calls none that returns one.

    It does not count references to the arrays that it is given. In a loop that takes a microsecond a turn, the counting
    would take three.

    Parameters
    ----------
    function : callable
        Views of arrays it may take; where it would make one, Numba refuses it.
    *others : Path
        As for `compiled`.

    Returns
    -------
    callable
        The same, compiled at its first call.
    """
    return _kept_on_disk(function, others, counting=False)


def jit_internal(function: F) -> F:
    """Compile as `jit_noalloc` does what compiled functions call.

    What Python needs to call a function takes as long to compile as a short function does. It has that only where
    Python calls it, as tests do.

    Parameters
    ----------
    function : callable
        As for `jit_noalloc`.

    Returns
    -------
    callable
        The same, compiled at its first call.
    """
    return _kept_on_disk(function, (), counting=False, no_cpython_wrapper=True, no_cfunc_wrapper=True)


class _Internal(CPUDispatcher):
    """A compiled function without what Python needs to call it: Numba would crash where Python does."""

    def __call__(self, *arguments: Any) -> Any:
        """Call its twin that has all that is needed, which is made now."""
        return _callable(self)(*arguments)


@functools.cache
def _callable(internal: _Internal) -> Any:
    """Return the same function compiled for Python, too, under a name of its own on disk."""
    function = internal.py_func
    twin = types.FunctionType(
        function.__code__, function.__globals__, function.__name__, function.__defaults__, function.__closure__
    )
    twin.__qualname__ = f"{function.__qualname__}_for_python"
    twin.__module__ = function.__module__
    return jit_noalloc(twin)


def _kept_on_disk(function: F, others: tuple[Path, ...], *, counting: bool, **without: bool) -> F:
    # whether references are counted is said in both cases: else a callee inherits it
    options: dict[str, Any] = {"error_model": "numpy", "_nrt": counting, **without}
    try:
        jitted: Any = numba.njit(cache=True, **options)(function)
    except RuntimeError:  # there is no place to keep it
        jitted = numba.njit(**options)(function)
    # Numba takes a cached function for current while its own file is, although what it calls may stand in another one.
    # Stamp it with all sources of the package; should Numba's insides move, rather keep nothing on disk than old code.
    stamp = _sources(Path(function.__code__.co_filename).parent, *others)
    try:
        cache = jitted._cache
        cache._cache_file._source_stamp  # noqa: B018 - raises where it is gone
        kept = Path(cache.cache_path)
        cache._cache_file = _CacheFile(str(kept), f"{cache._impl.filename_base}.summed", stamp)
        cache.save_overload = _if_there_is_room(cache.save_overload)
        if not _is_ours(kept, Path(function.__code__.co_filename)):
            log.warning("Numba's cache %s: others can write there; compiled for this process alone", kept)
            jitted = numba.njit(**options)(function)
    except AttributeError:
        jitted = numba.njit(**options)(function)
    if without and isinstance(jitted, CPUDispatcher):
        jitted.__class__ = _Internal
    result: F = jitted
    return result


class _CacheFile(_NumbasCacheFile):  # type: ignore[misc]
    """Numba's files of one function, each with the checksum of what is in it: one that is damaged is made anew.

    Code that is damaged could do anything, so it is never loaded. The checksum of code has the stamp of its sources
    with it, so that an index that was written before a kill never stands for the code of older sources.
    """

    def _load_index(self) -> Any:
        try:
            return super()._load_index() if self._is_whole(self._index_path) else {}
        except (AttributeError, ImportError):  # an index of older sources, of which a class has gone
            return {}

    def _load_data(self, name: str) -> Any:
        if not self._is_whole(self._data_path(name)):
            raise OSError(f"{name} is damaged")  # which Numba takes for a file that is gone
        return super()._load_data(name)

    @contextlib.contextmanager
    def _open_for_write(self, path: str) -> Iterator[Any]:
        content = io.BytesIO()
        yield content
        with super()._open_for_write(path) as file:
            file.write(content.getvalue() + self._sum(path, content.getvalue()))

    def _sum(self, path: str, content: bytes) -> bytes:
        stamp = "" if path == self._index_path else self._source_stamp
        return hashlib.sha256(stamp.encode() + content).digest()

    def _is_whole(self, path: str) -> bool:
        try:
            content = Path(path).read_bytes()
        except FileNotFoundError:
            return False
        except OSError as error:  # such as one that others alone may read, or a folder in its place
            log.debug("%s: %s", path, error.strerror or error)
            content = b""
        n = hashlib.sha256().digest_size
        whole = content[-n:] == self._sum(path, content[:-n])
        if not whole:
            _tell_of_damage(os.path.dirname(path))
        return whole


@functools.cache
def _tell_of_damage(folder: str) -> None:
    """Say it once, however many files there are."""
    log.warning("Numba's cache %s: a file in it is damaged; what it held is compiled anew", folder)


def _is_ours(folder: Path, source: Path) -> bool:
    """Return whether none but who may change the code itself may change what is kept of it: loading that runs it."""
    try:
        about, trusted = folder.stat(), {source.stat().st_uid}
    except OSError:  # not made yet: it will be this user's
        return True
    if os.name == "posix":
        trusted.add(os.geteuid())
        return about.st_uid in trusted and not about.st_mode & stat.S_IWOTH
    return True


def _if_there_is_room(save: Callable[..., None]) -> Callable[..., None]:
    """Return what keeps code on disk, for which a full disk is no reason not to run it."""

    def kept(*arguments: Any) -> None:
        try:
            save(*arguments)
        except OSError as error:
            log.warning("Numba's cache: %s; compiled for this process alone", error.strerror or error)

    return kept


def inlined(function: F) -> F:
    """Compile a short function into each of its compiled callers.

    A call that passes named tuples of arrays costs a tenth of a microsecond, of which most is counting references.

    Parameters
    ----------
    function : callable
        Without branches: Numba inlines what follows from one as if it always came.

    Returns
    -------
    callable
        The same, compiled at its first call.
    """
    jitted: Any = numba.njit(error_model="numpy", inline="always")(function)
    result: F = jitted
    return result
