"""Translate items of tuples, elements of arrays, and views of arrays."""

from __future__ import annotations

import ast
from collections.abc import Sequence

from controller.translator.expressions import Expressions
from controller.translator.operands import Items, Known, Operand, Value, bracketed
from controller.translator.types import BOOL, INT, Array, Tuple, name_of


class Subscripts(Expressions):
    """Translate subscripts."""

    def _subscript(self, node: ast.Subscript) -> Operand:
        owner = self.expression(node.value)
        places = list(node.slice.elts) if isinstance(node.slice, ast.Tuple) else [node.slice]
        if isinstance(owner, Value) and isinstance(owner.type, Array):
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

    def element(self, array: Value, places: Sequence[ast.expr], node: ast.AST) -> Value:
        """Return an element of an array, or a view of it."""
        kind = array.type
        assert isinstance(kind, Array)
        if len(places) > kind.ndim:
            self.fail(node, f"{len(places)} indices of {name_of(kind)}")
        if isinstance(places[0], ast.Slice) and len(places) == 1 and (kind.contiguous or kind.ndim == 1):
            return self._sliced(array, places[0])
        if all(isinstance(place, ast.Slice) for place in places) and all(map(_is_whole, places)):
            return array
        indices = [None if isinstance(place, ast.Slice) else place for place in places]
        indices += [None] * (kind.ndim - len(indices))
        if any(isinstance(place, ast.Slice) and not _is_whole(place) for place in places):
            self.fail(node, "a slice of one of several dimensions")
        offsets = [None if n is None else self.index(array, axis, n) for axis, n in enumerate(indices)]
        strides = [self._stride(array, axis) for axis in range(kind.ndim)]
        offset = " + ".join(_product(n, stride) for n, stride in zip(offsets, strides, strict=True) if n is not None)
        free_axes = [axis for axis, n in enumerate(offsets) if n is None]
        if not free_axes:
            return Value(kind.item, f"{array.code}.data[{offset}]")
        contiguous = kind.contiguous and free_axes == list(range(kind.ndim - len(free_axes), kind.ndim))
        view = Array(kind.item, len(free_axes), contiguous)
        sizes = [f"{array.code}.n{axis}" for axis in free_axes] + (
            [] if contiguous else [strides[axis] for axis in free_axes]
        )
        return Value(view, f"({self.c(view)}){{{array.code}.data + {offset}, {', '.join(sizes)}}}")

    def index(self, array: Value, axis: int, node: ast.expr) -> str:
        """Return an index of an array; one that is a negative constant counts from the end."""
        operand = self.expression(node)
        if isinstance(operand, Known) and isinstance(operand.value, int) and operand.value < 0:
            return f"({array.code}.n{axis} - {-operand.value})"
        value = self.scalar(operand, node)
        if value.type not in (INT, BOOL):
            self.fail(node, f"an index of type {name_of(value.type)}")
        return bracketed(value)

    def _stride(self, array: Value, axis: int) -> str:
        kind = array.type
        assert isinstance(kind, Array)
        if not kind.contiguous:
            return f"{array.code}.s{axis}"
        return " * ".join(f"{array.code}.n{k}" for k in range(axis + 1, kind.ndim)) or "1"

    def _sliced(self, array: Value, node: ast.Slice) -> Value:
        if node.step is not None:
            self.fail(node, "a slice with a step")
        bounds = []
        for bound, default in ((node.lower, "0"), (node.upper, f"{array.code}.n0")):
            bounds.append(default if bound is None else self.index(array, 0, bound))
        if bounds == ["0", f"{array.code}.n0"]:
            return array
        assert isinstance(array.type, Array)
        return Value(array.type, f"{array.type.c}_slice({array.code}, {bounds[0]}, {bounds[1]})")


def _product(index: str, stride: str) -> str:
    return index if stride == "1" else f"{index} * ({stride})" if " " in stride else f"{index} * {stride}"


def _is_whole(node: ast.expr) -> bool:
    return isinstance(node, ast.Slice) and node.lower is None and node.upper is None and node.step is None
