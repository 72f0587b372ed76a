"""Operands of expressions: C values, values known at translation, and tuples known by their items."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

from controller.translator.types import Scalar, Type


@dataclass(frozen=True)
class Value:
    """A value that C computes: for a record, its pointer."""

    type: Type
    code: str
    simple: bool = False  # a name or a number: it may be written twice, and no later statement changes it
    roots: frozenset[str] = frozenset()  # of arrays and records: two may overlap only if they have one in common
    paths: tuple[str, ...] = ()  # what a tuple stands for, as far as lengths of its arrays are known by it


@dataclass(frozen=True)
class Known:
    """A value that is known at translation: a number, a tuple of such, a function, a module, a class."""

    value: Any


@dataclass(frozen=True)
class Items:
    """A tuple that is not stored, but known by its items."""

    items: tuple[Operand, ...]


@dataclass(frozen=True)
class View(Value):
    """An array: its element at an index is data[offset + sum of index times stride]."""

    data: str = ""  # C pointer
    offset: str = "0"
    sizes: tuple[str, ...] = ()  # C expressions; those that are known at translation are numbers
    strides: tuple[str, ...] = ()
    fresh: bool = False  # True if it was just made, and has no name yet
    box: tuple[tuple[str, str], ...] = ()  # first index and length along each axis of what `data` points to
    axes: tuple[int, ...] = ()  # its own axes among these


@dataclass(frozen=True)
class LazyArray:
    """An array expression, whose elements are computed where they are stored or added up."""

    item: Scalar
    sizes: tuple[str, ...]
    at: Callable[[tuple[str, ...]], Value]  # an element by its index
    reads: tuple[tuple[View, bool], ...]  # what it reads, and if at the same index
    adds: bool = False  # True if an element is a sum
    factors: tuple[LazyArray, LazyArray] | None = None  # of a product of matrices


@dataclass(frozen=True)
class Length:
    """A number, or with a path the length of an axis of an argument, such as "0.numbers.0", plus a number."""

    path: str
    offset: int = 0

    def text(self, parameters: Sequence[str] | None = None) -> str:
        """Return it in Python, with the names of the parameters, else in C."""
        if not self.path:
            return str(self.offset)
        index, *items, axis = self.path.split(".")
        item_format = "[{}]" if parameters else ".f{}"
        inside = "".join(item_format.format(item) if item.isdigit() else f".{item}" for item in items)
        code = f"{parameters[int(index)]}{inside}.shape[{axis}]" if parameters else f"w->a{index}{inside}.n{axis}"
        return code + (f" {'-' if self.offset < 0 else '+'} {abs(self.offset)}" if self.offset else "")


@dataclass(frozen=True)
class Requirement:
    """A relation of two lengths, of which the first one has a path."""

    left: Length
    sign: str  # == or >=
    right: Length
    where: str  # module and function


Operand = Value | Known | Items | LazyArray


def number(x: float) -> str:
    """Format a number in C."""
    if math.isnan(x):
        return "NAN"
    if math.isinf(x):
        return "INFINITY" if x > 0.0 else "(-INFINITY)"
    return repr(float(x)) if x >= 0.0 and math.copysign(1.0, x) > 0.0 else f"({float(x)!r})"


def in_brackets(value: Value, kind: Type | None = None) -> str:
    """Return a value's C expression as an operand: in brackets unless it is a name, a number or a call."""
    code = value.code
    if kind is not None and kind != value.type and isinstance(kind, Scalar):
        return f"({kind.c})({code})"
    plain = code.replace("_", "").replace(".", "").replace("->", "")
    return code if plain.isalnum() else f"({code})"
