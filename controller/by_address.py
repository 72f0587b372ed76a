"""Compiled functions called by their address, so that who calls them is compiled without them.

Numba compiles what a function calls into the function itself, again for each of its callers. What is long and called
from many places takes most of the time until a first run; by address it is compiled once, and only when it is needed.
Addresses come as integers in arguments: captured ones would defeat Numba's cache on disk.
"""

from __future__ import annotations

from typing import Any

import numba
from llvmlite import ir
from numba import types
from numba.core import cgutils
from numba.extending import intrinsic

# what a function that is called by address may be given: whole numbers, and where arrays begin
INTEGER: Any = types.int64
INTEGERS: Any = types.CPointer(types.int64)  # type: ignore[no-untyped-call]
NUMBERS: Any = types.CPointer(types.float64)  # type: ignore[no-untyped-call]

array_at: Any = numba.carray  # type: ignore[attr-defined]

_I64 = ir.IntType(64)


def address_of(function: Any, arguments: tuple[Any, ...]) -> int:
    """Compile a function that returns an int64, and return its address.

    Parameters
    ----------
    function : callable
        As `compiled` or `lean` give it; alive as long as the address is used.
    arguments : tuple of Numba types
        Each `INTEGER`, `INTEGERS` or `NUMBERS`; of the last two `array_at` makes arrays.

    Returns
    -------
    int
        For `call_at`.
    """
    function.compile(arguments)
    result = function.overloads[arguments]
    address: int = result.library.get_pointer_to_function(result.fndesc.llvm_cfunc_wrapper_name)
    return address


def _call_code(_context: Any, _address: Any, arguments: Any) -> Any:
    """Call a C function of so many int64, pointers among them, which returns an int64."""

    def generate(_: Any, builder: Any, _signature: Any, values: Any) -> Any:
        address, packed = values
        unpack: Any = cgutils.unpack_tuple
        function = ir.FunctionType(_I64, [_I64] * len(arguments))
        return builder.call(builder.inttoptr(address, function.as_pointer()), unpack(builder, packed))

    return types.int64(types.int64, arguments), generate


call_at: Any = intrinsic(_call_code)
