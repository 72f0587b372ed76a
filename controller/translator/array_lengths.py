"""Lengths of arrays: numbers, lengths that are fixed when a call is bound, and those that C computes."""

# The text requires of fixed lengths that they are equal, or that a slice of constant bounds lies within its axis. A
# call passes these requirements on to its caller, and the program to its exported function, where they are checked once
# when a call is bound. Arrays of records that stand under one name must be equally long, too. Of lengths that C
# computes the smaller one counts: Python requires equal ones. A slice
# [i : i + n] counts as n elements where these are needed, as does an index that is computed: C does not check it.

from __future__ import annotations

import ast
import math
from collections.abc import Sequence

from controller.translator.function_code import FunctionCode
from controller.translator.operands import Length, Requirement, Value, View
from controller.translator.types import MaxLength

Index = tuple[str, ...]


class ArrayLengths(FunctionCode):
    """Lengths of the arrays of one function."""

    parameters: list[str]
    where: str
    bounds: dict[str, float]  # maximum of lengths that C computes, by their C expressions
    fixed: dict[str, Length]  # lengths that are fixed when a call is bound, by their C expressions
    fixed_lengths: dict[str, tuple[Length | None, ...]]  # of variables, and of fields of records that are made
    requirements: dict[Requirement, None]

    def length(self, size: str) -> Length | None:
        """Return a length if it is known, or fixed when a call is bound."""
        return Length("", int(size)) if size.isdigit() else self.fixed.get(size)

    def extent(self, size: str) -> int | MaxLength | None:
        """Return what a type states of a length."""
        return int(size) if size.isdigit() else None if size in self.fixed else MaxLength(self.max_size(size))

    def max_size(self, size: str) -> float:
        """Return the maximum number of elements along an axis."""
        return int(size) if size.isdigit() else self.bounds.get(size, math.inf)

    def note_max_size(self, size: str, bound: float) -> str:
        """Return a length that C computes, and note its maximum."""
        if not size.isdigit():
            self.bounds[size] = bound
        return size

    def add_to_length(self, size: str, number: int) -> str:
        """Return the sum of a fixed length and a number."""
        if not number:
            return size
        code = f"{size} - {-number}" if number < 0 else f"{size} + {number}"
        self.fixed[code] = Length(self.fixed[size].path, self.fixed[size].offset + number)
        return code

    def axis_length(self, paths: Sequence[str], axis: int) -> Length | None:
        """Return a fixed length of an array, by the paths of what its name stands for: of equal lengths."""
        lengths = [self._own_length(path, axis) for path in paths]
        if not lengths or None in lengths:
            return None
        first, *others = [length for length in lengths if length]
        for other in others:
            self.require(first, "==", other, self.current)
        return first

    def _own_length(self, path: str, axis: int) -> Length | None:
        if path in self.fixed_lengths:
            return self.fixed_lengths[path][axis]
        name, *items = path.split(".")
        if name not in self.parameters:
            return None
        return Length(".".join([str(self.parameters.index(name)), *items, str(axis)]))

    def note_lengths(self, path: str, value: Value, again: bool = False) -> None:
        """Note the lengths of an array that a variable, or a field, holds; again: among others."""
        if isinstance(value, View):
            lengths = tuple(map(self.length, value.sizes))
            if again and (path in self.fixed_lengths or path in self.parameters):
                lengths = tuple(n if n == self._own_length(path, axis) else None for axis, n in enumerate(lengths))
            self.fixed_lengths[path] = lengths

    def require(self, left: Length, sign: str, right: Length, node: ast.AST, where: str = "") -> None:
        """Require a relation of two lengths; refuse one that never holds."""
        if left == right or (sign == ">=" and left.offset >= right.offset):
            return
        if left.path == right.path:
            one, other = (length.text(self.parameters) for length in (left, right))
            self.fail(
                node, f"lengths {one} and {other}" if sign == "==" else f"length {one}, expected at least {other}"
            )
        left, right = (left, right) if left.path else (right, left)
        self.requirements[Requirement(left, sign, right, where or self.where)] = None

    def common_length(self, one: str, other: str, node: ast.AST) -> str:
        """Return the length of two axes that belong together."""
        a, b = self.length(one), self.length(other)
        if one == other:
            return one
        if a and b:
            self.require(a, "==", b, node)
            return other if other.isdigit() else one
        if (self.max_size(one) == 1) != (self.max_size(other) == 1):
            self.fail(node, f"lengths {one} and {other}, of which one may be 1")
        for known, computed in ((one, other), (other, one)):
            if known.isdigit() and self.max_size(computed) <= int(known):
                return known if self.max_size(computed) == int(known) else computed
        return self.note_max_size(f"min_i64({one}, {other})", min(self.max_size(one), self.max_size(other)))
