"""Lengths of arrays: numbers, lengths that are fixed when a call is bound, and those that C computes."""

# The text requires of fixed lengths that they are equal, or that a slice of constant bounds lies within its axis. A
# call passes these requirements on to its caller, and the program to its exported function, where they are checked once
# when a call is bound. Of lengths that C computes the smaller one counts: Python requires equal ones. A slice
# [i : i + n] counts as n elements where these are needed, as does an index that is computed: C does not check it.

from __future__ import annotations

import ast
import math
import re
from collections.abc import Sequence
from dataclasses import dataclass

from controller.translator.operands import Operands, Value, View
from controller.translator.types import Array, Record

Index = tuple[str, ...]


@dataclass(frozen=True)
class Length:
    """A number, or with a path the length of an axis of an argument, such as "0.numbers.n0", plus a number."""

    path: str
    offset: int = 0

    def text(self, root: str) -> str:
        """Return it in C or Python, with a name of the arguments."""
        if not self.path:
            return str(self.offset)
        return f"{root}{self.path}" + (f" {self.offset:+}".replace("+", "+ ").replace("-", "- ") if self.offset else "")


@dataclass(frozen=True)
class Requirement:
    """A relation of two lengths, of which the first one has a path."""

    left: Length
    sign: str  # == or >=
    right: Length
    where: str  # module and function
    is_conditional: bool  # True if arrays without elements meet it, too: these stand for what a run does not use


class ArrayLengths(Operands):
    """Lengths of the arrays of one function."""

    parameters: list[str]
    where: str
    bounds: dict[str, float]  # maximum of lengths that C computes, by their C expressions
    fixed: dict[str, Length]  # lengths that are fixed when a call is bound, by their C expressions
    fixed_lengths: dict[str, tuple[Length | None, ...]]  # of variables, and of fields of records that the function made
    record_paths: dict[str, str]  # what a variable, or a field, that holds a record stands for; "" if for several
    requirements: dict[Requirement, None]
    branches: int  # number of conditions that decide on whether C gets here

    def length(self, size: str) -> Length | None:
        """Return a length if it is known, or fixed when a call is bound."""
        return Length("", int(size)) if size.isdigit() else self.fixed.get(size)

    def bound(self, size: str) -> float | None:
        """Return the maximum of a length that C computes; None if it is fixed."""
        return None if self.length(size) else self.bounds.get(size, math.inf)

    def max_length(self, size: str) -> float:
        """Return the maximum of a length."""
        return int(size) if size.isdigit() else self.bounds.get(size, math.inf)

    def bounded(self, size: str, bound: float) -> str:
        """Return a length that C computes, and note its maximum."""
        if not size.isdigit():
            self.bounds[size] = bound
        return size

    def longer(self, size: str, number: int) -> str:
        """Return the sum of a fixed length and a number."""
        length = self.length(size)
        assert length is not None
        if not number or not length.path:
            return str(int(size) + number) if not length.path else size
        code = f"{size} - {-number}" if number < 0 else f"{size} + {number}"
        self.fixed[code] = Length(length.path, length.offset + number)
        return code

    def axis_length(self, path: str, axis: int) -> Length | None:
        """Return a fixed length of an array by its path."""
        if path in self.fixed_lengths:
            return self.fixed_lengths[path][axis]
        parts = path.split(".")
        for k in range(len(parts), 0, -1):
            record = self.record_paths.get(".".join(parts[:k]))
            if record is not None:
                return self.axis_length(".".join([record, *parts[k:]]), axis) if record else None
        if parts[0] in self.parameters:
            return Length(".".join([str(self.parameters.index(parts[0])), *parts[1:], f"n{axis}"]))
        return None

    def note_lengths(self, name: str, value: Value, again: bool = False) -> None:
        """Note the lengths of a value that a variable, or a field, holds; again: among other values."""
        if isinstance(value, View):
            lengths = tuple(map(self.length, value.sizes))
            if again and isinstance(value.type, Array) and (name in self.fixed_lengths or name in self.parameters):
                before = tuple(self.axis_length(name, k) for k in range(len(lengths)))
                lengths = tuple(a if a == b else None for a, b in zip(before, lengths, strict=False))
            self.fixed_lengths[name] = lengths
        elif isinstance(value.type, Record):
            path = path_of(value.code)
            before_path = self.record_paths.get(name, name if name in self.parameters else path)
            if path != name and not (again and before_path == path == name):
                self.record_paths[name] = path if not again or before_path == path else ""

    def require(self, left: Length, sign: str, right: Length, node: ast.AST, origin: Requirement | None = None) -> None:
        """Require a relation of two lengths; refuse one that never holds."""
        if left.path == right.path:
            if not (left.offset == right.offset if sign == "==" else left.offset >= right.offset):
                of_axis = " more than another" if left.path else ""
                self.fail(node, f"a length {left.offset}{of_axis}, expected {sign} {right.offset}{of_axis}")
            return
        if not left.path:
            left, right = right, left
        is_conditional = self.branches > 0 or (origin is not None and origin.is_conditional)
        where = origin.where if origin else self.where
        self.requirements[Requirement(left, sign, right, where, is_conditional)] = None

    def common_length(self, one: str, other: str, node: ast.AST) -> str:
        """Return the length of two axes that belong together."""
        a, b = self.length(one), self.length(other)
        if one == other:
            return one
        if a and b:
            self.require(a, "==", b, node)
            return other if other.isdigit() else one
        if (self.max_length(one) == 1) != (self.max_length(other) == 1):
            self.fail(node, f"lengths {one} and {other}, of which one may be 1")
        for known, computed in ((one, other), (other, one)):
            if known.isdigit() and self.max_length(computed) <= int(known):
                return known if self.max_length(computed) == int(known) else computed
        return self.bounded(f"min_i64({one}, {other})", min(self.max_length(one), self.max_length(other)))

    def require_of_call(self, requirement: Requirement, values: Sequence[Value], node: ast.AST) -> None:
        """Require of a call's arguments what the called function requires of its parameters."""
        lengths = [self._of_argument(length, values) for length in (requirement.left, requirement.right)]
        if lengths[0] is None or lengths[1] is None:
            self.fail(node, f"arrays of lengths that C computes, in {requirement.where}")
        self.require(lengths[0], requirement.sign, lengths[1], node, requirement)

    def _of_argument(self, length: Length, values: Sequence[Value]) -> Length | None:
        if not length.path:
            return length
        index, *fields, last = length.path.split(".")
        value, axis = values[int(index)], int(last[1:])
        if isinstance(value, View):
            own = self.length(value.sizes[axis])
        else:
            own = self.axis_length(".".join([path_of(value.code), *fields]), axis)
        return own and Length(own.path, own.offset + length.offset)


def path_of(code: str) -> str:
    """Return the C expression of a record or field without its pointers."""
    return re.sub(r"[(&)]", "", code).replace("->", ".")
