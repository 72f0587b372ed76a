"""Translate items of tuples, elements of arrays, and views of arrays."""

from __future__ import annotations

import ast
from collections.abc import Sequence
from dataclasses import replace

from controller.translator.array_views import plus, times
from controller.translator.expressions import Expressions
from controller.translator.operands import Grid, Items, Known, Operand, Value, View
from controller.translator.types import INT, Array, Tuple, name_of


class Subscripts(Expressions):
    """Translate subscripts."""

    def _subscript(self, node: ast.Subscript) -> Operand:
        owner = self.expression(node.value)
        places = list(node.slice.elts) if isinstance(node.slice, ast.Tuple) else [node.slice]
        owner = self.materialized(owner, node) if isinstance(owner, Grid) else owner
        if isinstance(owner, View):
            return self.element(owner, places, node)
        items = self.items_of(owner, node)
        if not isinstance(node.slice, ast.Slice):
            place = self.expression(node.slice)
            if isinstance(place, Value):
                return self._computed_item(owner, place, node)
        if isinstance(node.slice, ast.Slice):
            bounds = (node.slice.lower, node.slice.upper, node.slice.step)
            low, high, step = (None if n is None else self._known_int(n) for n in bounds)
            return Items(tuple(items[low:high:step]))
        return items[self._known_int(node.slice)]

    def _computed_item(self, owner: Operand, place: Value, node: ast.AST) -> Value:
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
        if all(map(_is_whole, places)):
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
                box[k] = plus([box[k][0], begin]), size
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
        return self._integer(operand, node)

    def _integer(self, operand: Operand, node: ast.AST) -> str:
        value = self.scalar(operand, node)
        if value.type != INT:
            self.fail(node, f"an index of type {name_of(value.type)}")
        is_simple = not any(sign in value.code for sign in "[?")  # it is written where other operators stand beside it
        return value.code if is_simple else self.temporary(INT, value.code).code

    def _bounds(self, size: str, node: ast.Slice) -> tuple[str, str]:
        """Return the beginning and the length of a slice of an axis."""
        # Python clips bounds to the axis. So does C, but for a slice of constant length whose axis has an unknown one:
        # there Python's result has another shape if it does not fit.
        if node.step is not None:
            self.fail(node, "a slice with a step")
        if node.lower is None and node.upper is None:
            return "0", size
        low, high = (Known(None) if bound is None else self.expression(bound) for bound in (node.lower, node.upper))
        if isinstance(low, Known) and isinstance(high, Known):
            if size.isdigit():
                first, end, _ = slice(low.value, high.value).indices(int(size))
                return str(first), str(max(end - first, 0))
            first, end = low.value or 0, high.value
            if first >= 0 and end is not None and end >= 0:
                return str(first), str(max(end - first, 0))
        length = self._length_of(node)
        if length is not None:
            begin = str(low.value) if isinstance(low, Known) else self._integer(low, node)
            return begin, str(length.value) if isinstance(length, Known) else self._integer(length, node)
        bounds = []
        for bound, default in ((low, "0"), (high, size)):
            if isinstance(bound, Known) and bound.value is None:
                bounds.append(default)
            else:
                bounds.append(self.temporary(INT, f"clipped({self._integer(bound, node)}, {size})").code)
        return bounds[0], self.temporary(INT, f"max_i64({bounds[1]} - {bounds[0]}, 0)").code

    def _length_of(self, node: ast.Slice) -> Operand | None:
        """Return n of a slice [i : i + n], else None."""
        low, high = node.lower, node.upper
        if low is None or not isinstance(high, ast.BinOp) or not isinstance(high.op, ast.Add):
            return None
        return self.expression(high.right) if ast.dump(high.left) == ast.dump(low) else None


def _is_whole(node: ast.expr) -> bool:
    return isinstance(node, ast.Slice) and node.lower is None and node.upper is None and node.step is None
