"""Compiled functions that are called again and again with the same arrays, in which the numbers change.

At each call Numba looks at each array of each argument. A law is given about forty, which takes ten times as long as
its mathematics. Here they are looked at once, and kept in words that compiled code makes the arguments of again.
"""

from __future__ import annotations

import functools
import hashlib
import operator
from collections.abc import Callable, Iterator
from types import FunctionType
from typing import Any, NamedTuple

import numba
import numpy as np
from llvmlite import ir
from numba import types
from numba.extending import intrinsic
from numba.np import arrayobj
from numpy.typing import NDArray

from controller.jit.function_pointer import address_of, called
from controller.jit.jit import jit_noalloc

_MOST = 8  # sets of arguments that are kept
_NONE = (None,) * 7
_intrinsic: Any = intrinsic
_typeof: Any = numba.typeof
_arrays: Any = arrayobj
_tuples: Any = types.BaseTuple
_WORD = ir.IntType(64)


class _Bound(NamedTuple):
    """A function with arguments, which stay alive, and where they are, as long as it can be called."""

    call: Callable[[], None]
    arguments: tuple[Any, ...]
    words: NDArray[np.uint64]


class BoundCall:
    """A compiled function, faster from the third call on that is given the same objects.

    Parameters
    ----------
    function : callable
        As `jit_noalloc` or `compiled` give it, which returns nothing; a plain one is called as it is. It takes at most
        seven arguments: arrays, numbers, and tuples of them; no array is resized in place.
    """

    def __init__(self, function: Any) -> None:
        self._function, self._is_compiled = function, hasattr(function, "overloads")
        self._met: dict[tuple[int, ...], tuple[Any, ...]] = {}  # arguments by their ids, which are theirs while kept
        self._bound: dict[tuple[int, ...], _Bound] = {}
        self._last: tuple[Any, ...] = (_nothing, *_NONE)  # the last bound call, and the seven arguments it is for

    def __call__(
        self, a: Any, b: Any = None, c: Any = None, d: Any = None, e: Any = None, f: Any = None, g: Any = None
    ) -> None:
        """Call it.

        Parameters
        ----------
        a, b, c, d, e, f, g : object
            Arguments of the function; None for those that it has not.
        """
        # one by one: to compare two tuples item by item takes twice as long
        call, a0, b0, c0, d0, e0, f0, g0 = self._last
        if a is a0 and b is b0 and c is c0 and d is d0 and e is e0 and f is f0 and g is g0:
            call()
        else:
            self._call_anew(tuple(argument for argument in (a, b, c, d, e, f, g) if argument is not None))

    def _call_anew(self, arguments: tuple[Any, ...]) -> None:
        key = tuple(map(id, arguments))
        bound = self._bound.get(key)
        if bound is not None:
            self._last = (bound.call, *arguments, *_NONE[len(arguments) :])
            bound.call()
            return
        self._function(*arguments)
        if key in self._met and self._is_compiled:
            self._bound[key] = _bind(self._function, arguments)
        elif len(self._met) < _MOST:
            self._met[key] = arguments
        else:
            self._met, self._bound, self._last = {key: arguments}, {}, (_nothing, *_NONE)

    def __reduce__(self) -> tuple[Any, ...]:
        """Leave out, of a copy, what is kept of these very arrays."""
        return BoundCall, (self._function,)


def _nothing() -> None:
    raise TypeError("called without arguments")


def _bind(function: Any, arguments: tuple[Any, ...]) -> _Bound:
    """Bind a function, as compiled for such arguments, to them."""
    kinds = tuple(_typeof(argument) for argument in arguments)
    entry = address_of(function.overloads[kinds])
    words = np.array(list(_words(arguments)), dtype=np.uint64)
    return _Bound(functools.partial(_invoker(kinds), entry, words.ctypes.data), arguments, words)


def _words(value: Any) -> Iterator[int]:
    """Yield what a value is made of, in words of eight bytes."""
    if isinstance(value, tuple):
        for item in value:
            yield from _words(item)
    elif isinstance(value, np.ndarray):
        yield value.ctypes.data
        yield from value.shape
        yield from (stride % 2**64 for stride in value.strides)
    elif isinstance(value, float):
        yield int(np.float64(value).view(np.uint64))
    else:
        yield operator.index(value) % 2**64


@functools.cache
def _invoker(kinds: tuple[Any, ...]) -> Any:
    """Return what calls functions of arguments of such types, which it makes of words.

    Numba keeps it on disk under its name, which therefore tells the types.
    """

    def call(_context: Any, _entry: Any, _words: Any) -> Any:
        return types.none(types.intp, types.intp), functools.partial(_call, kinds)

    name = f"invoke_{hashlib.sha256(repr(kinds).encode()).hexdigest()[:16]}"
    copy = FunctionType(_invoke.__code__, {"_call": _intrinsic(call), "__name__": __name__}, name)
    copy.__qualname__ = name
    return jit_noalloc(copy)


def _invoke(entry: int, words: int) -> None:
    _call(entry, words)  # type: ignore[call-arg, arg-type] # the intrinsic, in each copy


def _call(kinds: tuple[Any, ...], context: Any, builder: Any, _signature: Any, values: Any) -> Any:
    """Write the code that makes the arguments, and calls."""
    entry, words = values
    at = builder.inttoptr(words, _WORD.as_pointer())
    count = iter(range(2**31))

    def word() -> Any:
        return builder.load(builder.gep(at, [ir.Constant(_WORD, next(count))]))

    def made(kind: Any) -> Any:
        if isinstance(kind, _tuples):
            return context.make_tuple(builder, kind, [made(item) for item in kind.types])
        if isinstance(kind, types.Array):
            array = _arrays.make_array(kind)(context, builder)
            data = builder.inttoptr(word(), array.data.type)
            shape, strides = [word() for _ in range(kind.ndim)], [word() for _ in range(kind.ndim)]
            size = context.get_constant(types.intp, context.get_abi_sizeof(context.get_data_type(kind.dtype)))
            _arrays.populate_array(array, data, shape, strides, size, None)
            return array._getvalue()
        expected = context.get_value_type(kind)
        if isinstance(kind, types.Float):
            return builder.bitcast(word(), expected)
        return word() if expected == _WORD else builder.trunc(word(), expected)

    return called(context, builder, entry, types.none, kinds, [made(kind) for kind in kinds])
