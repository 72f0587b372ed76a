"""Compiled functions called by their address, so that who calls them is compiled without them.

Numba compiles what a function calls into the function itself, again for each of its callers. What is long and called
from many places takes most of the time until a first run; by address it is compiled once, and only when it is needed.
Addresses come as integers in arguments: captured ones would defeat Numba's cache on disk.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numba
from llvmlite import ir
from numba import types
from numba.core import cgutils, config, errors
from numba.core.typing import templates
from numba.extending import intrinsic, lower_builtin

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


_templates: Any = templates
_lower: Any = lower_builtin
_typeof: Any = numba.typeof
_unliteral: Any = types.unliteral
_DISABLED: Any = config.DISABLE_JIT  # type: ignore[attr-defined]
_signatures: dict[Any, tuple[Any, ...]] = {}  # of each function that is called by `call`: the types of its arguments


def entry_of(function: Any, arguments: tuple[Any, ...]) -> int:
    """Compile a function for arguments such as these, and return its address.

    Parameters
    ----------
    function : callable
        As `compiled` or `lean` give it; alive as long as the address is used.
    arguments : tuple
        Any of their types: a function is called by address with one kind of arguments alone.

    Returns
    -------
    int
        For `call`; 0 where nothing is compiled.
    """
    if _DISABLED:
        return 0
    kinds = tuple(_typeof(argument) for argument in arguments)
    if _signatures.setdefault(function, kinds) != kinds:
        raise TypeError(f"{function.__name__} is called by address with {kinds}, expected {_signatures[function]}")
    function.compile(kinds)
    result = function.overloads[kinds]
    address: int = result.library.get_pointer_to_function(result.fndesc.llvm_func_name)
    return address


def call(_address: int, function: Callable[..., Any], arguments: tuple[Any, ...]) -> Any:
    """Call a function; in compiled code by its address, so that its code is not compiled into the caller.

    Parameters
    ----------
    _address : int
        Of `entry_of`.
    function : callable
        The same as there.
    arguments : tuple
        Of the types that were given there.

    Returns
    -------
    object
        What the function does.
    """
    return function(*arguments)


@_templates.infer_global(call)
class _Call(_templates.AbstractTemplate):  # type: ignore[misc]
    """What `call` returns."""

    def generic(self, args: Any, _kws: Any) -> Any:
        _, function, arguments = args
        kinds = tuple(_unliteral(kind) for kind in arguments)
        if kinds != _signatures.get(function.dispatcher):
            raise errors.TypingError(f"{function} by address: {kinds}, expected {_signatures.get(function.dispatcher)}")
        result = function.dispatcher.overloads[kinds].signature.return_type
        return _templates.signature(result, types.intp, function, arguments)


def _lowered(context: Any, builder: Any, sig: Any, values: Any) -> Any:
    """Call by Numba's own convention, and pass on what goes wrong."""
    address, _, packed = values
    _, _, arguments = sig.args
    unpack: Any = cgutils.unpack_tuple
    kind = context.call_conv.get_function_type(sig.return_type, arguments.types)
    function = builder.inttoptr(address, kind.as_pointer())
    status, result = context.call_conv.call_function(
        builder, function, sig.return_type, arguments.types, unpack(builder, packed)
    )
    with cgutils.if_unlikely(builder, status.is_error):  # type: ignore[no-untyped-call]
        context.call_conv.return_status_propagate(builder, status)
    return result


_lower(call, types.intp, types.Dispatcher, types.BaseTuple)(_lowered)
