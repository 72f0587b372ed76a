"""Call C functions by address, from translated functions."""

from __future__ import annotations

import ctypes
from typing import Any

import numpy as np

# types of arguments, as C writes them
POINTER, SIZE, INT, DOUBLE, BOOL = "void *", "size_t", "int", "double", "bool"

_TYPES = {
    POINTER: ctypes.c_void_p,
    SIZE: ctypes.c_size_t,
    INT: ctypes.c_int,
    DOUBLE: ctypes.c_double,
    BOOL: ctypes.c_bool,
}


def call_c(address: int, kinds: tuple[str, ...], *arguments: Any) -> int:
    """Call a C function that returns an int, by its address."""
    function = ctypes.PYFUNCTYPE(ctypes.c_int, *(_TYPES[kind] for kind in kinds))(int(address))
    return_type: int = function(*map(_plain, arguments))
    return return_type


def _plain(argument: Any) -> Any:
    """Return an argument as ctypes takes it."""
    if isinstance(argument, np.ndarray):
        return argument.ctypes
    return argument.item() if isinstance(argument, np.generic) else argument
