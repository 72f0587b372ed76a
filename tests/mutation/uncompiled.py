"""What `controller.by_address` does with compiled functions, done with plain ones, for Numba switched off."""

from __future__ import annotations

import ctypes
import types
from collections.abc import Callable
from typing import Any

import numba

INTEGER, INTEGERS, NUMBERS = "integer", ctypes.POINTER(ctypes.c_int64), ctypes.POINTER(ctypes.c_double)

_functions: list[tuple[Callable[..., int], tuple[Any, ...]]] = []


def address_of(function: Callable[..., int], arguments: tuple[Any, ...]) -> int:
    """Return a number by which `call_at` finds a function."""
    _functions.append((function, arguments))
    return len(_functions)


def call_at(address: int, values: tuple[int, ...]) -> int:
    """Call the function of this number, with pointers where it wants them."""
    function, arguments = _functions[address - 1]
    given = [
        value if kind == INTEGER else ctypes.cast(ctypes.c_void_p(int(value)), kind)
        for kind, value in zip(arguments, values, strict=True)
    ]
    return function(*given)


def by_address() -> types.ModuleType:
    """Return a module in the place of `controller.by_address`."""
    module = types.ModuleType("controller.by_address")
    names = {"INTEGER": INTEGER, "INTEGERS": INTEGERS, "NUMBERS": NUMBERS, "array_at": numba.carray}
    vars(module).update(names, address_of=address_of, call_at=call_at)
    return module
