"""The one way in which functions of this package are compiled."""

from __future__ import annotations

from collections.abc import Callable
from typing import TypeVar

import numba

F = TypeVar("F", bound=Callable[..., object])


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
    jitted: F = numba.njit(cache=True, error_model="numpy")(function)
    return jitted
