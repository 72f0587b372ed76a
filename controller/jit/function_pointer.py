"""Compiled functions called by their address, so that who calls them is compiled without them.

Numba compiles what a function calls into the function itself, again for each of its callers. What is long and called
from many places takes most of the time until a first run; by address it is compiled once, and only when it is needed.
Addresses come as integers in arguments: captured ones would defeat Numba's cache on disk.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, NewType

import numba
from numba import types
from numba.core import cgutils, config, errors
from numba.core.typing import templates
from numba.extending import lower_builtin

Address = NewType("Address", int)  # of a compiled function in this process; 0 for none

_templates: Any = templates
_lower: Any = lower_builtin
_typeof: Any = numba.typeof
_unliteral: Any = types.unliteral
_DISABLED: Any = config.DISABLE_JIT  # type: ignore[attr-defined]
_signatures: dict[Any, tuple[tuple[Any, ...], Any]] = {}  # types of arguments and result of what `call` may call


def declare(function: Any, arguments: tuple[Any, ...], result: Any) -> None:
    """Say how a function is called by its address, so that callers are compiled without compiling it.

    Parameters
    ----------
    function : callable
        As `jit_internal`, `jit_noalloc` or `compiled` give it.
    arguments : tuple of Numba types
        Which it takes, and no others.
    result : Numba type
        Of what it returns.

    Raises
    ------
    TypeError
        If it was said otherwise before.
    """
    if _signatures.setdefault(function, (arguments, result)) != (arguments, result):
        raise TypeError(f"{function.__name__} is called by address with {arguments}, expected {_signatures[function]}")


def pointer_to(function: Any, arguments: tuple[Any, ...] | None = None) -> Address:
    """Compile a function, and return its address.

    Parameters
    ----------
    function : callable
        As `jit_internal`, `jit_noalloc` or `compiled` give it; alive as long as the address is used.
    arguments : tuple, optional
        Such as it will be given; where not, it is declared.

    Returns
    -------
    Address
        For `call`; 0 where nothing is compiled.

    Raises
    ------
    TypeError
        If it is declared for arguments of other types.
    """
    if _DISABLED:
        return Address(0)
    kinds = _signatures[function][0] if arguments is None else tuple(_typeof(argument) for argument in arguments)
    function.compile(kinds)
    compiled = function.overloads[kinds]
    declare(function, kinds, compiled.signature.return_type)
    return address_of(compiled)


def address_of(overload: Any) -> Address:
    """Return the address of a function as compiled for arguments of some types.

    Parameters
    ----------
    overload : object
        One of its ``overloads``.

    Returns
    -------
    Address
        Where `called` finds it.
    """
    address: Address = overload.library.get_pointer_to_function(overload.fndesc.llvm_func_name)
    return address


def call(_address: int, function: Callable[..., Any], arguments: tuple[Any, ...]) -> Any:
    """Call a function; in compiled code by its address, so that its code is not compiled into the caller.

    Parameters
    ----------
    _address : int
        Of `pointer_to`.
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
        expected, result = _signatures.get(function.dispatcher, (None, None))
        if kinds != expected:
            raise errors.TypingError(f"{function} by address: {kinds}, expected {expected}")
        return _templates.signature(result, types.intp, function, arguments)


def _lowered(context: Any, builder: Any, sig: Any, values: Any) -> Any:
    address, _, packed = values
    unpack: Any = cgutils.unpack_tuple
    return called(context, builder, address, sig.return_type, sig.args[2].types, unpack(builder, packed))


def called(context: Any, builder: Any, address: Any, result_kind: Any, kinds: Any, arguments: Any) -> Any:
    """Write the code of a call by Numba's own convention, which passes on what goes wrong.

    Parameters
    ----------
    context, builder : object
        Of the function that is being compiled.
    address : LLVM value
        Of `address_of`, as an integer.
    result_kind, kinds : Numba type, sequence of Numba types
        Of what it returns and takes.
    arguments : sequence of LLVM values
        As many.

    Returns
    -------
    LLVM value
        What it returns.
    """
    convention = context.call_conv
    function = builder.inttoptr(address, convention.get_function_type(result_kind, kinds).as_pointer())
    status, result = convention.call_function(builder, function, result_kind, kinds, arguments)
    with cgutils.if_unlikely(builder, status.is_error):  # type: ignore[no-untyped-call]
        convention.return_status_propagate(builder, status)
    return result


_lower(call, types.intp, types.Dispatcher, types.BaseTuple)(_lowered)
