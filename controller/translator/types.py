"""Types of translated code: numbers, arrays, tuples and named tuples, and the C type of each."""

from __future__ import annotations

import functools
import math
import sys
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from controller.stack_array import Shape
from controller.state import State


@dataclass(frozen=True)
class Scalar:
    """A number or a truth value."""

    c: str  # name in C


DOUBLE, INT, UINT, BOOL = Scalar("double"), Scalar("int64_t"), Scalar("uint64_t"), Scalar("bool")
REFERENCE = Scalar("uint32_t")  # value reference of an FMU's variable
_ITEMS = {np.dtype(n): c for n, c in (("f8", DOUBLE), ("i8", INT), ("u8", UINT), ("u4", REFERENCE), ("?", BOOL))}
_SHORT = {DOUBLE: "f64", INT: "i64", UINT: "u64", REFERENCE: "u32", BOOL: "b8"}


@dataclass(frozen=True)
class MaxLength:
    """The maximum of a length that C computes, or inf."""

    n: float


@dataclass(frozen=True)
class Array:
    """A view of an array: a pointer, its shape, and its strides where it is not contiguous."""

    item: Scalar
    shape: tuple[
        int | MaxLength | None, ...
    ]  # a length that is known at translation, that C computes, or that a call has
    contiguous: bool = True

    @property
    def ndim(self) -> int:
        """Number of axes."""
        return len(self.shape)

    @property
    def c(self) -> str:
        """Name of the array's struct in C."""
        return f"{_SHORT[self.item]}{'' if self.contiguous else 's'}_{self.ndim}"


@dataclass(frozen=True)
class Tuple:
    """A tuple whose items are known by their places; passed by value."""

    items: tuple[Type, ...]

    @property
    def uniform(self) -> bool:
        """True if all items are numbers of one type: then an index in it may be computed."""
        return isinstance(self.items[0], Scalar) and len(set(self.items)) == 1

    def item(self, place: int) -> str:
        """Return the C member of an item."""
        return f"f[{place}]" if self.uniform else f"f{place}"


@dataclass(frozen=True)
class Record:
    """A named tuple, or a `State` whose fields can be set; passed by pointer."""

    python: type
    items: tuple[Type, ...]

    @property
    def fields(self) -> tuple[str, ...]:
        """Names of the items."""
        names: tuple[str, ...] = self.python._fields  # type: ignore[attr-defined]
        return names

    @property
    def mutable(self) -> bool:
        """True if its fields can be set."""
        return issubclass(self.python, State)


@dataclass(frozen=True)
class Nothing:
    """The result type of a function without a result."""


Type = Scalar | Array | Tuple | Record | Nothing


@functools.cache
def annotated_shapes(owner: Any) -> dict[str, tuple[int | None, ...]]:
    """Return the shapes that annotations of a function's parameters, or of a record's fields, state."""
    shapes: dict[str, tuple[int | None, ...]] = {}
    for part in reversed(owner.__mro__) if isinstance(owner, type) else [owner]:
        names = getattr(part, "__globals__", None) or vars(sys.modules[part.__module__])
        for name, annotation in getattr(part, "__annotations__", {}).items():
            text = getattr(annotation, "__forward_arg__", annotation)
            kind = names.get(text) if isinstance(text, str) else annotation
            for extra in getattr(kind, "__metadata__", ()):
                if isinstance(extra, Shape):
                    shapes[name] = tuple(n if isinstance(n, int) else None for n in extra.lengths)
    return shapes


def type_with_shape(owner: Any, name: str, kind: Type) -> Type:
    """Return the type of a parameter or field for a value: with the shape of the annotation, which it has to have."""
    if not isinstance(kind, Array):
        return kind
    computed = (n if isinstance(n, MaxLength) else None for n in kind.shape)
    shape = zip(_annotated_shape(owner, name, kind.shape), computed, strict=True)
    return Array(kind.item, tuple(n if n is not None else m for n, m in shape), kind.contiguous)


def _annotated_shape(owner: Any, name: str, shape: Sequence[int | MaxLength | None]) -> tuple[int | None, ...]:
    """Return the shape that an annotation states, which a shape has to fit."""
    expected = annotated_shapes(owner).get(name) or (None,) * len(shape)
    if len(expected) != len(shape) or any(
        a is not None and isinstance(b, int) and a != b for a, b in zip(expected, shape, strict=True)
    ):
        raise TypeError(f"{owner.__name__}: {name} has shape {_lengths(shape)}, expected {_lengths(expected)}")
    return expected


def check_shapes(function: Any, arguments: Sequence[Any]) -> None:
    """Check the shapes of arguments against the annotations of a function."""
    for name, argument in zip(function.__code__.co_varnames, arguments, strict=False):
        if isinstance(argument, np.ndarray):
            _annotated_shape(function, name, argument.shape)


def _lengths(shape: Sequence[int | MaxLength | None]) -> str:
    return f"({', '.join(str(n) if isinstance(n, int) else 'any' for n in shape)}{',' if len(shape) == 1 else ''})"


def type_of(value: Any) -> Type:
    """Return the type of an argument."""
    if isinstance(value, np.ndarray):
        item = _ITEMS.get(value.dtype)
        if item is not None and value.flags.c_contiguous:
            return Array(item, (None,) * value.ndim)
    elif isinstance(value, tuple):
        if not hasattr(value, "_fields"):
            return Tuple(tuple(map(type_of, value)))
        kinds = []
        for name, item in zip(value._fields, value, strict=True):
            kind = type_of(item)
            if isinstance(kind, Array):
                kind = replace(kind, shape=_annotated_shape(type(value), name, item.shape))
            kinds.append(kind)
        return Record(type(value), tuple(kinds))
    elif isinstance(value, float):
        return DOUBLE
    elif isinstance(value, int | np.int64):  # truth values too: each takes a word
        return INT
    given = f"an array of {value.dtype}" if isinstance(value, np.ndarray) else type(value).__name__
    raise TypeError(f"argument is {given}, expected a number, a contiguous array of numbers, or a tuple of such")


def common_type(one: Type, other: Type) -> Type:
    """Return the type that holds values of both: the wider one of two numbers."""
    if one == other:
        return one
    rank = [BOOL, INT, DOUBLE]
    if isinstance(one, Scalar) and isinstance(other, Scalar) and one in rank and other in rank:
        return max(one, other, key=rank.index)
    if isinstance(one, Tuple) and isinstance(other, Tuple) and len(one.items) == len(other.items):
        return Tuple(tuple(map(common_type, one.items, other.items)))
    if isinstance(one, Array) and isinstance(other, Array) and (one.item, one.ndim) == (other.item, other.ndim):
        lengths = zip(one.shape, other.shape, strict=True)
        shape = tuple(a if a == b else MaxLength(max(_max_size(a), _max_size(b))) for a, b in lengths)
        return Array(one.item, shape, one.contiguous and other.contiguous)
    raise TypeError(f"{name_of(one)} and {name_of(other)} in the same place")


def return_type(kind: Type) -> Type:
    """Return the type by which C returns a value: for an array, a tuple of its numbers."""
    return Tuple((kind.item,) * math.prod(known_lengths(kind))) if isinstance(kind, Array) else kind


def known_lengths(kind: Array) -> list[int]:
    """Return the lengths that are known at translation."""
    return [n for n in kind.shape if isinstance(n, int)]


def _max_size(length: int | MaxLength | None) -> float:
    return math.inf if length is None else length.n if isinstance(length, MaxLength) else length


def name_of(kind: Type) -> str:
    """Describe a type in a few words, for errors."""
    match kind:
        case Scalar():
            return kind.c
        case Array():
            return f"an array of {kind.ndim} dimensions"
        case Tuple():
            return f"a tuple of {len(kind.items)}"
        case Record():
            return kind.python.__name__
        case Nothing():
            return "no value"
