"""The one way in which functions of this package are compiled."""

from __future__ import annotations

import hashlib
from collections.abc import Callable
from pathlib import Path
from typing import Any, TypeVar

import numba

F = TypeVar("F", bound=Callable[..., object])


def _sources() -> str:
    folder = Path(__file__).parent
    return hashlib.sha256(b"".join(path.read_bytes() for path in sorted(folder.rglob("*.py")))).hexdigest()


_SOURCES = _sources()


def compiled(function: F) -> F:
    """Compile a plain function on float64 arrays with Numba, and keep the result on disk.

    Rounding follows IEEE 754 (no fast-math), so that a run repeats bit for bit; dividing by zero gives infinity or NaN
    as in NumPy.

    Parameters
    ----------
    function : callable
        Written in the part of Python and NumPy that Numba compiles.

    Returns
    -------
    callable
        The same, compiled at its first call.
    """
    try:
        jitted: Any = numba.njit(cache=True, error_model="numpy")(function)
    except RuntimeError:  # there is no place to keep it
        jitted = numba.njit(error_model="numpy")(function)
    # Numba takes a cached function for current while its own file is, although what it calls may stand in another one.
    # Stamp it with all sources of the package; should Numba's insides move, rather keep nothing on disk than old code.
    try:
        cache_file = jitted._cache._cache_file
        cache_file._source_stamp  # noqa: B018 - raises where it is gone
        cache_file._source_stamp = _SOURCES
    except AttributeError:
        jitted = numba.njit(error_model="numpy")(function)
    result: F = jitted
    return result
