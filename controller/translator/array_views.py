"""Arrays as views of storage: data, offset, lengths and strides, and which of them may overlap."""

# An array is a view: its elements are data[offset + sum of index times stride]. Two arrays overlap only if they have a
# root in common: a root is a parameter, with a field of it, or storage of this function. Parameters share a root where
# a call passes them arrays that do.

from __future__ import annotations

import ast
import itertools
import math
from collections.abc import Iterable, Sequence
from dataclasses import replace

from controller.translator.array_lengths import ArrayLengths, Index
from controller.translator.operands import LazyArray, Operand, Value, View
from controller.translator.types import DOUBLE, Array, MaxLength, Scalar, Type

ANY = "*"  # root of an array of which nothing is known


def times(a: str, b: str) -> str:
    """Return the C product of two indices."""
    if a.isdigit() and b.isdigit():
        return str(int(a) * int(b))
    if "0" in (a, b):
        return "0"
    return b if a == "1" else a if b == "1" else f"{_factor(a)} * {_factor(b)}"


def plus(terms: Iterable[str]) -> str:
    """Return the C sum of indices."""
    known, codes = 0, []
    for term in terms:
        if term.isdigit():
            known += int(term)
        else:
            codes.append(term)
    return " + ".join([*codes, *([str(known)] if known or not codes else [])])


def _factor(code: str) -> str:
    return code if code.replace("_", "").replace(".", "").replace("->", "").isalnum() else f"({code})"


def known_shape(sizes: Sequence[str]) -> tuple[int, ...] | None:
    """Return the shape if all lengths are known at translation."""
    return tuple(map(int, sizes)) if all(n.isdigit() for n in sizes) else None


class ArrayViews(ArrayLengths):
    """Arrays of one function."""

    aliases: frozenset[frozenset[str]]  # pairs of parameters that may overlap
    roots: dict[str, frozenset[str]]  # roots of the arrays and records of each name
    made: dict[str, frozenset[str]]  # roots of the fields of records that the function made, by path
    writes_arguments: bool  # if the function writes into an array that it did not make

    def view(
        self, item: Scalar, data: str, offset: str, sizes: Index, strides: Index, roots: frozenset[str], code: str = ""
    ) -> View:
        """Return an array by the place of its elements; code is that of a variable which holds it."""
        whole = [self.product(sizes[k + 1 :]) for k in range(len(sizes))]
        kind = Array(item, tuple(map(self.extent, sizes)), list(strides) == whole)
        view = View(kind, code, True, roots, (), data, offset, sizes, strides)
        return view if code else replace(view, code=self.literal(view, kind), simple=False)

    def literal(self, view: View, kind: Array) -> str:
        """Return the C expression of an array's struct, of a type that holds it."""
        assert isinstance(view.type, Array)
        if view.code and view.type.c == kind.c:
            return view.code
        place = view.data if view.offset == "0" else f"{view.data} + {view.offset}"
        return f"({self.c(kind)}){{{', '.join([place, *view.sizes, *(() if kind.contiguous else view.strides)])}}}"

    def view_of(self, kind: Array, code: str, roots: frozenset[str], paths: Sequence[str]) -> View:
        """Return the array of a variable, or of a field."""
        sizes = tuple(str(n) if isinstance(n, int) else f"{code}.n{i}" for i, n in enumerate(kind.shape))
        for i, (size, n) in enumerate(zip(sizes, kind.shape, strict=True)):
            if isinstance(n, MaxLength):
                self.bounds[size] = n.n
            elif n is None and (length := self.axis_length(paths, i)):
                self.fixed[size] = length
        kind = replace(kind, shape=tuple(map(self.extent, sizes)))
        if kind.contiguous:
            strides = tuple(self.product(sizes[k + 1 :]) for k in range(kind.ndim))
        else:
            strides = tuple(f"{code}.s{i}" for i in range(kind.ndim))
        box, axes = tuple(("0", n) for n in sizes), tuple(range(kind.ndim))
        return View(kind, code, True, roots, (), f"{code}.data", "0", sizes, strides, False, box, axes)

    def product(self, sizes: Iterable[str]) -> str:
        """Return the C product of lengths."""
        result = "1"
        for n in sizes:
            result = times(result, n)
        return result

    def view_of_storage(self, data: str, item: Scalar, shape: Sequence[int | str]) -> View:
        """Return the array in storage on the stack."""
        sizes = tuple(map(str, shape))
        strides = tuple(self.product(sizes[k + 1 :]) for k in range(len(sizes)))
        return replace(self.view(item, data, "0", sizes, strides, frozenset([data.partition(".")[0]])), fresh=True)

    def element_of(self, view: View, index: Sequence[str]) -> Value:
        """Return an element of an array."""
        assert isinstance(view.type, Array)
        place = plus([view.offset, *map(times, index, view.strides)])
        return Value(view.type.item, f"{view.data}[{place}]")

    def is_array(self, operand: Operand) -> bool:
        """Return True for an array or an expression of arrays."""
        return isinstance(operand, View | LazyArray)

    def is_local(self, roots: frozenset[str]) -> bool:
        """Return True if an array is storage of this function."""
        return all(root in self.declared for root in roots)

    def may_overlap(self, some: frozenset[str], others: frozenset[str]) -> bool:
        """Return True unless two arrays are known to have no element in common."""
        for one, other in itertools.product(some, others):
            if one == other or ANY in (one, other):
                return True
            owners = frozenset([one.partition(".")[0], other.partition(".")[0]])
            if owners in self.aliases:
                return True
        return False

    def subarray(self, view: View, index: str) -> View:
        """Return the part of an array at an index of its first axis."""
        assert isinstance(view.type, Array)
        offset = plus([view.offset, times(index, view.strides[0])])
        return self.view(view.type.item, view.data, offset, view.sizes[1:], view.strides[1:], view.roots)

    def temporary(self, kind: Type, code: str) -> Value:
        """Assign a value to a new variable, and return that."""
        name = self.new_name("t")
        self.declared[name] = self.definition(kind, name)
        if code:
            self.lines.append(f"{name} = {code};")
        return self.variable_value(kind, name, True, frozenset([ANY]), ())

    def new_variable(self, kind: Type, code: str, *values: Value) -> Value:
        """Assign one of some values to a new variable, and return that."""
        name = self.temporary(kind, code).code
        for i, value in enumerate(values):
            self.note_lengths(name, value, again=i > 0)
        return self.variable_value(kind, name, True, frozenset().union(*(value.roots for value in values)), (name,))

    def variable_value(
        self, kind: Type, code: str, simple: bool, roots: frozenset[str], paths: tuple[str, ...]
    ) -> Value:
        """Return what a C variable or member holds; its lengths are known by paths."""
        if isinstance(kind, Array):
            return self.view_of(kind, code, roots, paths) if kind.ndim else Value(kind.item, f"{code}.data[0]")
        return Value(kind, code, simple, frozenset() if isinstance(kind, Scalar) else roots, paths)

    def make_zeros(self, shape: tuple[int, ...], node: ast.AST) -> Value:
        """Return a new array of zeros on the stack."""
        name = self.storage("zeros", node, DOUBLE, math.prod(shape))
        self.lines.append(f"memset({name}, 0, sizeof {name});")
        return self.view_of_storage(name, DOUBLE, shape)
