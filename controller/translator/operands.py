"""Operands of expressions: C values, values known at translation, and tuples known by their items."""

from __future__ import annotations

import ast
import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any, NoReturn

import numpy as np

from controller.translator.types import BOOL, DOUBLE, INT, UINT, Array, Scalar, Tuple, Type, name_of


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
class Grid:
    """An array expression, whose elements are computed where they are stored or added up."""

    item: Scalar
    sizes: tuple[str, ...]
    at: Callable[[tuple[str, ...]], Value]  # an element by its index
    reads: tuple[tuple[View, bool], ...]  # what it reads, and if at the same index
    adds: bool = False  # True if an element is a sum
    factors: tuple[Grid, Grid] | None = None  # of a product of matrices


Operand = Value | Known | Items | Grid


class Operands:
    """Compute the operands of one function; statements that they need first go to `lines`."""

    names: dict[str, Type]  # types of variables by name, as far as they are known
    globals: dict[str, Any]
    lines: list[str]
    n_writes: int  # number of calls so far that write into arrays

    def fail(self, node: ast.AST, what: str) -> NoReturn:
        """Refuse a construct, with its file and line."""
        raise NotImplementedError

    def global_value(self, name: str) -> Any:
        """Return what the function uses from its module, or has captured."""
        raise NotImplementedError

    def temporary(self, kind: Type, code: str) -> Value:
        """Assign a value to a new variable, and return that."""
        raise NotImplementedError

    def new_variable(self, kind: Type, code: str, *values: Value) -> Value:
        """Assign one of some values to a new variable, and return that."""
        raise NotImplementedError

    def call_translated(self, function: Callable[..., Any], arguments: Sequence[Operand], node: ast.AST) -> Operand:
        """Call a function of Python that is translated too."""
        raise NotImplementedError

    def materialized(self, operand: Operand, node: ast.AST, stem: str = "a") -> View:
        """Compute an array expression into storage on the stack."""
        raise NotImplementedError

    def make_zeros(self, shape: tuple[int, ...], node: ast.AST) -> Value:
        """Return a new array of zeros on the stack."""
        raise NotImplementedError

    def make_record(self, kind: type, items: Sequence[Value], node: ast.AST) -> Value:
        """Return a new named tuple on the stack."""
        raise NotImplementedError

    def expression(self, node: ast.expr) -> Operand:
        """Return the operand of an expression."""
        raise NotImplementedError

    def variable(self, name: str) -> str:
        """Return the C name of a variable."""
        raise NotImplementedError

    def in_order(self, nodes: Sequence[ast.expr]) -> list[Operand]:
        """Return operands, each evaluated before the statements that the next ones need."""
        operands: list[Operand] = []
        for node in nodes:
            mark, n_writes = len(self.lines), self.n_writes
            operand = self.expression(node)
            if len(self.lines) > mark:
                later, self.lines[mark:] = self.lines[mark:], []
                operands = [self.kept(operand, node, self.n_writes > n_writes) for operand in operands]
                self.lines += later
            operands.append(operand)
        return operands

    def kept(self, operand: Operand, node: ast.AST, written: bool = True) -> Operand:
        """Return an operand as it is now: an array expression is computed only if arrays are written later."""
        if isinstance(operand, Items):
            return Items(tuple(self.kept(item, node, written) for item in operand.items))
        if isinstance(operand, Grid) and written:
            return self.materialized(operand, node)
        if isinstance(operand, Value) and not operand.simple and isinstance(operand.type, Scalar):
            return self.temporary(operand.type, operand.code)
        return operand

    def value(self, operand: Operand, node: ast.AST) -> Value:
        """Return an operand as a C value."""
        if isinstance(operand, Value):
            return operand
        if isinstance(operand, Grid):
            return self.materialized(operand, node)
        known = operand.value if isinstance(operand, Known) else None
        if isinstance(known, bool | np.bool_):
            return Value(BOOL, "true" if known else "false", True)
        if isinstance(known, np.uint64):
            return Value(UINT, f"UINT64_C({int(known)})", True)
        if isinstance(known, int | np.integer):
            return Value(INT, f"INT64_C({int(known)})" if abs(int(known)) > 2**31 else f"{int(known)}", True)
        if isinstance(known, float):
            return Value(DOUBLE, number(known), True)
        if isinstance(operand, Items) or isinstance(known, tuple):
            values = [self.value(item, node) for item in self.items_of(operand, node)]
            kind, roots = Tuple(tuple(value.type for value in values)), [value.roots for value in values]
            return Value(kind, self.compound(kind, [v.code for v in values]), False, frozenset().union(*roots))
        return self.fail(node, "not a value")

    def compound(self, kind: Type, codes: Sequence[str]) -> str:
        """Return the C expression of a tuple from its items."""
        inside = ", ".join(codes)
        braces = f"{{{inside}}}" if isinstance(kind, Tuple) and kind.uniform else inside
        return f"({self.c(kind)}){{{braces}}}"

    def c(self, kind: Type) -> str:
        """Return the C name of a type."""
        raise NotImplementedError

    def literal(self, view: View, kind: Array) -> str:
        """Return the C expression of an array's struct, of a type that holds it."""
        raise NotImplementedError

    def element_of(self, view: View, index: Sequence[str]) -> Value:
        """Return an element of an array."""
        raise NotImplementedError

    def held(self, kind: Type, code: str, simple: bool, roots: frozenset[str], paths: tuple[str, ...]) -> Value:
        """Return what a C variable or member holds; its lengths are known by paths."""
        raise NotImplementedError

    def scalar(self, operand: Operand, node: ast.AST) -> Value:
        """Return an operand as a number; refuse another type."""
        value = self.value(operand, node)
        if not isinstance(value.type, Scalar):
            self.fail(node, f"{name_of(value.type)}, expected a number")
        return value

    def converted(self, value: Value, kind: Type) -> str:
        """Return the C expression of a number, converted to another type of number."""
        if isinstance(value, View) and isinstance(kind, Array):
            return self.literal(value, kind)
        if value.type == kind or not isinstance(kind, Scalar):
            return value.code
        return f"({kind.c}){bracketed(value)}"

    def items_of(self, operand: Operand, node: ast.AST) -> list[Operand]:
        """Return the items of a tuple."""
        match operand:
            case Items(items):
                return list(items)
            case Known(tuple(items)):
                return [Known(item) for item in items]
            case Value(Tuple() as kind, code):
                paths = [tuple(f"{path}.{i}" for path in operand.paths) for i in range(len(kind.items))]
                codes = [f"{code}.{kind.item(i)}" for i in range(len(kind.items))]
                each = zip(kind.items, codes, paths, strict=True)
                return [self.held(k, c, operand.simple, operand.roots, p) for k, c, p in each]
            case View() if len(operand.sizes) == 1 and operand.sizes[0].isdigit():
                return [self.element_of(operand, (str(i),)) for i in range(int(operand.sizes[0]))]
            case Grid():
                return self.items_of(self.materialized(operand, node), node)
        return self.fail(node, "expected a tuple")


def number(x: float) -> str:
    """Format a number in C."""
    if math.isnan(x):
        return "NAN"
    if math.isinf(x):
        return "INFINITY" if x > 0.0 else "(-INFINITY)"
    return repr(float(x)) if x >= 0.0 and math.copysign(1.0, x) > 0.0 else f"({float(x)!r})"


def bracketed(value: Value, kind: Type | None = None) -> str:
    """Return a value's C expression as an operand: in brackets unless it is a name, a number or a call."""
    code = value.code
    if kind is not None and kind != value.type and isinstance(kind, Scalar):
        return f"({kind.c})({code})"
    plain = code.replace("_", "").replace(".", "").replace("->", "")
    return code if plain.isalnum() else f"({code})"
