"""Translate items of tuples, elements of arrays, and views of arrays."""

from __future__ import annotations

import ast
import math
from collections.abc import Sequence
from dataclasses import replace

from controller.translator.array_views import plus, times
from controller.translator.expressions import Expressions
from controller.translator.operands import Items, Known, LazyArray, Length, Operand, Value, View
from controller.translator.types import INT, Array, Tuple, name_of


class Subscripts(Expressions):
    """Translate subscripts."""

    def _subscript(self, node: ast.Subscript) -> Operand:
        owner = self.expression(node.value)
        places = list(node.slice.elts) if isinstance(node.slice, ast.Tuple) else [node.slice]
        owner = self.materialize(owner, node) if isinstance(owner, LazyArray) else owner
        if isinstance(owner, View):
            return self.element(owner, places, node)
        items = self.items_of(owner, node)
        if not isinstance(node.slice, ast.Slice):
            place = self.expression(node.slice)
            if isinstance(place, Value):
                return self._item_by_index(owner, place, node)
        if isinstance(node.slice, ast.Slice):
            bounds = (node.slice.lower, node.slice.upper, node.slice.step)
            low, high, step = (None if n is None else self._known_int(n) for n in bounds)
            return Items(tuple(items[low:high:step]))
        return items[self._known_int(node.slice)]

    def _item_by_index(self, owner: Operand, place: Value, node: ast.AST) -> Value:
        values = self.value(owner, node)
        kind = values.type
        if not isinstance(kind, Tuple) or not kind.uniform or place.type != INT:
            self.fail(node, "a computed place in a tuple whose items are not all numbers of one type")
        held = values if values.simple else self.temporary(kind, values.code)
        return Value(kind.items[0], f"{held.code}.f[{place.code}]")

    def _known_int(self, node: ast.expr) -> int:
        operand = self.expression(node)
        if isinstance(operand, Known) and isinstance(operand.value, int):
            return operand.value
        return self.fail(node, "a place in a tuple has to be a constant")

    def element(self, array: View, places: Sequence[ast.expr], node: ast.AST) -> Value:
        """Return an element of an array, or a view of it."""
        assert isinstance(array.type, Array)
        if len(places) > array.type.ndim:
            self.fail(node, f"{len(places)} indices of {name_of(array.type)}")
        if all(map(_is_full_slice, places)):
            return array
        axes: list[int] = []
        terms, sizes, strides, box = [array.offset], [], [], list(array.box)
        for axis, stride in enumerate(array.strides):
            place = places[axis] if axis < len(places) else ast.Slice()
            if isinstance(place, ast.Slice):
                begin, size = self._bounds(array.sizes[axis], place)
                sizes.append(size)
                strides.append(stride)
                axes += array.axes[axis : axis + 1]
            else:
                begin, size = self.index(array.sizes[axis], place), "1"
            terms.append(times(begin, stride))
            for k in array.axes[axis : axis + 1]:
                limit = self.max_size(size)
                box[k] = plus([box[k][0], begin]), str(limit) if limit < math.inf else size
        if not sizes:
            return Value(array.type.item, f"{array.data}[{plus(terms)}]")
        view = self.view(array.type.item, array.data, plus(terms), tuple(sizes), tuple(strides), array.roots)
        return replace(view, box=tuple(box), axes=tuple(axes))

    def index(self, size: str, node: ast.expr) -> str:
        """Return an index of an axis; one that is a negative constant counts from the end."""
        operand = self.expression(node)
        if isinstance(operand, Known) and isinstance(operand.value, int):
            n = operand.value
            if size.isdigit() and not -int(size) <= n < int(size):
                self.fail(node, f"index {n} of an axis of length {size}")
            return str(n) if n >= 0 else str(int(size) + n) if size.isdigit() else f"({size} - {-n})"
        return self._integer_index(operand, node)

    def _integer_index(self, operand: Operand, node: ast.AST) -> str:
        value = self.scalar(operand, node)
        if value.type != INT:
            self.fail(node, f"an index of type {name_of(value.type)}")
        is_simple = not any(sign in value.code for sign in "[?")  # it is written where other operators stand beside it
        return value.code if is_simple else self.temporary(INT, value.code).code

    def _bounds(self, size: str, node: ast.Slice) -> tuple[str, str]:
        """Return the beginning and the length of a slice of an axis."""
        # Python clips bounds to the axis, and so does C where it computes a bound or the axis' length. Constant bounds
        # of a fixed length must lie within it, which is checked when a call is bound.
        if node.step is not None:
            self.fail(node, "a slice with a step")
        n_writes = self.n_writes
        operands = iter(self.in_order([bound for bound in (node.lower, node.upper) if bound is not None]))
        low, high = (Known(None) if bound is None else next(operands) for bound in (node.lower, node.upper))
        if isinstance(low, Known) and isinstance(high, Known):
            if size.isdigit():
                first, last, _ = slice(low.value, high.value).indices(int(size))
                return str(first), str(max(last - first, 0))
            length, start = self.length(size), low.value or 0
            if length and not (start < 0 and high.value is not None and high.value >= 0):
                return self._constant_bounds(size, length, start, high.value, node)
        begin = "0" if low == Known(None) else self._clip(low, size, node)
        end = size if high == Known(None) else self._clip(high, size, node)
        constant_length = self._constant_length(node) if self.n_writes == n_writes else math.inf
        max_size = min(self.max_size(size), constant_length)
        return begin, self.note_max_size(end if begin == "0" else f"max_i64({end} - {begin}, 0)", max_size)

    def _constant_bounds(self, size: str, length: Length, low: int, high: int | None, node: ast.AST) -> tuple[str, str]:
        """Return the beginning and the length of a slice of an axis of fixed length, which has to be long enough."""
        end = high or 0
        if low >= 0 and (high is None or high < 0):
            self.require(length, ">=", Length("", low - end), node)
            return str(low), self.add_to_length(size, end - low)
        number = max(end - low, 0)
        self.require(length, ">=", Length("", max(end, -low) if number else 0), node)
        return "0" if not number else str(low) if low >= 0 else self.add_to_length(size, low), str(number)

    def _clip(self, operand: Operand, size: str, node: ast.AST) -> str:
        """Return a bound of a slice in C, within the axis."""
        index = str(operand.value) if isinstance(operand, Known) else self._integer_index(operand, node)
        return self.temporary(INT, f"clipped({index}, {size})").code

    def _constant_length(self, node: ast.Slice) -> float:
        """Return n of a slice [i : i + n] or [i : n + i], else infinity."""
        if node.lower is not None and isinstance(node.upper, ast.BinOp) and isinstance(node.upper.op, ast.Add):
            for same, other in ((node.upper.left, node.upper.right), (node.upper.right, node.upper.left)):
                if ast.dump(same) == ast.dump(node.lower) and isinstance(other, ast.Constant | ast.Name):
                    length = self.expression(other)
                    return max(length.value, 0) if isinstance(length, Known) else math.inf
        return math.inf


def _is_full_slice(node: ast.expr) -> bool:
    return isinstance(node, ast.Slice) and node.lower is None and node.upper is None and node.step is None
