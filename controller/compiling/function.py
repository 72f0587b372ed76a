"""Call plain functions as C many times with the same arrays, in which the numbers change."""

# A law has about forty arrays; to validate each at each call would take several times as long as its mathematics. Here
# they are validated once, and stored as the words from which the C function makes its arguments.

from __future__ import annotations

import ctypes
import functools
import os
import re
from collections.abc import Callable, Generator, Iterable
from types import FunctionType
from typing import Any

import numpy as np

from controller.compiling.library import load_libraries
from controller.compiling.text_cache import c_text_of
from controller.stack_array import interpret
from controller.translator.arguments import argument_words
from controller.translator.types import Type, check_shapes, type_of

INTERPRETED = "SUBREACH_INTERPRETED"  # environment variable: if set, Python runs all functions, without a compiler
Described = dict[int, tuple[Any, Type, list[int]]]  # arguments with their types and words, by their ids

_MAX_CACHED = 8  # maximum number of sets of arguments in the cache
_NONE = (None,) * 7
_Key = tuple[FunctionType, tuple[Type, ...]]  # a function, and the types of its arguments
_libraries: dict[_Key, Any] = {}  # libraries of functions that have been loaded
_CALLBACK = ctypes.PYFUNCTYPE(None, ctypes.c_void_p)


def c_text(function: Callable[..., None], arguments: tuple[Any, ...]) -> str:
    """Translate a function to C for arguments of these types, as its library is compiled from it."""
    return c_text_of(function, tuple(map(type_of, arguments)))


def load_functions(*calls: tuple[Callable[..., None], tuple[Any, ...]]) -> None:
    """Translate and load plain functions for some arguments; missing libraries are compiled at the same time."""
    if not os.environ.get(INTERPRETED):
        _load([(f, tuple(map(type_of, arguments))) for f, arguments in calls if isinstance(f, FunctionType)])


def _load(keys: Iterable[_Key]) -> None:
    missing = [key for key in dict.fromkeys(keys) if key not in _libraries]
    for key, library in zip(missing, load_libraries(c_text_of(*key) for key in missing), strict=True):
        library.entry.argtypes, library.entry.restype = [ctypes.c_void_p], None
        library.entry_check_shapes.argtypes, library.entry_check_shapes.restype = [ctypes.c_void_p], ctypes.c_char_p
        _libraries[key] = library


def _described(argument: Any, known: Described) -> tuple[Any, Type, list[int]]:
    description = known.get(id(argument))
    if description is None:
        description = known[id(argument)] = argument, type_of(argument), argument_words(argument)
    return description


def _shape_error(function: FunctionType, arguments: tuple[Any, ...], expected: str) -> str:
    """Return the message of lengths that are not as expected, such as "x.shape[0] == y[1].shape[0]"."""
    named, given = dict(zip(function.__code__.co_varnames, arguments, strict=False)), []
    for length in re.findall(r"[\w.\[\]]+\.shape\[\d+\]", expected):
        name, *items = re.findall(r"\w+", length)
        given.append(f"{length} is {functools.reduce(_part, items, named[name])}")
    return f"{function.__name__}: {' and '.join(given)}, expected {expected}"


def _part(value: Any, item: str) -> Any:
    return value[int(item)] if item.isdigit() else getattr(value, item)


class BoundCall:
    """A function with its arguments, which stay alive as long as it, or its `call`, does."""

    def __init__(self, function: Any, arguments: tuple[Any, ...], known: Described | None = None) -> None:
        self._raised: BaseException | None = None
        self.on_error: Callable[[], None] | None = None  # called where a call by address raises an error
        if isinstance(function, FunctionType) and not os.environ.get(INTERPRETED):
            check_shapes(function, arguments)
            described = [_described(argument, {} if known is None else known) for argument in arguments]
            key = function, tuple(kind for _, kind, _ in described)
            _load([key])
            library = _libraries[key]
            self._entry = library.entry
            self._words = np.array([word for _, _, words in described for word in words], dtype=np.uint64)
            self.words: int = self._words.ctypes.data
            expected = library.entry_check_shapes(self.words)
            if expected is not None:
                raise TypeError(_shape_error(function, arguments, expected.decode()))
            call: Any = functools.partial(self._entry, self.words)
            call.kept = self._words, arguments  # so that `call` works without this object
            self.call: Callable[[], None] = call
        else:
            plain = isinstance(function, FunctionType)  # others, such as a law of a user, get the arrays as they are
            self.call = (
                functools.partial(interpret, function, arguments) if plain else functools.partial(function, *arguments)
            )
            self.words = 0
            served = self._serve()
            next(served)
            self._entry = _CALLBACK(served.send)
        self.address: int = ctypes.cast(self._entry, ctypes.c_void_p).value or 0

    def _serve(self) -> Generator[None, int | None, None]:
        """Call the function each time that the generator is resumed, until it raises an error."""
        # a signal's error, such as that of Ctrl-C, arises as soon as Python resumes: C would lose it outside of `try`
        while True:
            try:
                while True:
                    yield
                    if self._raised is None:
                        self.call()
            except GeneratorExit:
                return
            except BaseException as error:  # noqa: BLE001 -- C cannot pass it on; `raise_error` does
                self._raised = error
                if self.on_error is not None:
                    self.on_error()

    def raise_error(self) -> None:
        """Raise the error of the function's last call by address, if there was one, once."""
        error, self._raised = self._raised, None
        if error is not None:
            raise error


class CompiledFunction:
    """A plain function, run as C: compiled when it is first called, fast when it is called with the same objects."""

    def __init__(self, function: Any) -> None:
        self._function = function
        self._bound: dict[tuple[int, ...], BoundCall] = {}  # calls by the ids of their arguments, which they keep alive
        self._known: Described = {}
        self._last: tuple[Any, ...] = (_nothing, *_NONE)  # the last call, and the seven arguments it is for

    def __call__(
        self, a: Any, b: Any = None, c: Any = None, d: Any = None, e: Any = None, f: Any = None, g: Any = None
    ) -> None:
        """Call the function."""
        # one by one: a comparison of two tuples item by item takes twice as long
        call, a0, b0, c0, d0, e0, f0, g0 = self._last
        if not (a is a0 and b is b0 and c is c0 and d is d0 and e is e0 and f is f0 and g is g0):
            call = self._call_of(tuple(argument for argument in (a, b, c, d, e, f, g) if argument is not None))
        call()

    def _call_of(self, arguments: tuple[Any, ...]) -> Callable[[], None]:
        key = tuple(map(id, arguments))
        bound = self._bound.get(key)
        if bound is None:
            if len(self._bound) == _MAX_CACHED:
                self._bound, self._known = {}, {}
            bound = self._bound[key] = BoundCall(self._function, arguments, self._known)
        self._last = (bound.call, *arguments, *_NONE[len(arguments) :])
        return bound.call

    def __reduce__(self) -> tuple[Any, ...]:
        """Leave the cache of arrays out of a copy."""
        return CompiledFunction, (self._function,)


def _nothing() -> None:
    raise TypeError("called without arguments")
