"""Translate array expressions to C loops that compute one element at a time, in written order."""

# Where an expression reads what its target overlaps, other than at the same indices, it is computed in storage on the
# stack first; that needs a shape that is known at translation.

from __future__ import annotations

import ast
import functools
import itertools
import math
from collections.abc import Callable, Iterable, Sequence
from dataclasses import replace

from controller.translator.array_lengths import Index
from controller.translator.array_views import known_shape, plus
from controller.translator.operand_values import OperandValues
from controller.translator.operands import Items, Known, LazyArray, Length, Operand, Value, View, in_brackets
from controller.translator.types import BOOL, DOUBLE, INT, Array, Scalar, Type, common_type, name_of

_UNROLLED = 9  # maximum number of elements that are written out


class ArrayExpressions(OperandValues):
    """Translate array expressions of one function."""

    def arithmetic(self, op: ast.operator, left: Operand, right: Operand, node: ast.AST) -> Operand:
        """Return the result of an operator."""
        raise NotImplementedError

    def grid(self, operand: Operand, node: ast.AST) -> LazyArray:
        """Return an operand as an array expression: a number as one without axes."""
        if isinstance(operand, LazyArray):
            return operand
        if isinstance(operand, View):
            assert isinstance(operand.type, Array)
            item, reads = operand.type.item, ((operand, True),)
            return LazyArray(item, operand.sizes, lambda index: self.element_of(operand, index), reads)
        value = self.scalar(operand, node)
        held = value if value.simple else self.temporary(value.type, value.code)
        assert isinstance(held.type, Scalar)
        return LazyArray(held.type, (), lambda _: held, ())

    def broadcast_shapes(self, one: Index, other: Index, node: ast.AST) -> Index:
        """Return the lengths of two shapes that belong together, broadcast by their last axes."""
        if len(one) < len(other):
            one, other = other, one
        sizes = list(one)
        for k, n in enumerate(other, len(one) - len(other)):
            if n.isdigit() and sizes[k].isdigit() and n != sizes[k]:
                self.fail(node, f"shapes ({', '.join(one)}) and ({', '.join(other)}) in one expression")
            sizes[k] = self.common_length(sizes[k], n, node)
        return tuple(sizes)

    def elementwise(
        self, function: Callable[[list[Value]], Operand], operands: Sequence[Operand], item: Type, node: ast.AST
    ) -> LazyArray:
        """Return a function of numbers, applied to each element."""
        grids = [self.grid(operand, node) for operand in operands]
        sizes: Index = ()
        for grid in grids:
            sizes = self.broadcast_shapes(sizes, grid.sizes, node)
        reads = [read for grid in grids for read in grid.reads]

        def at(index: Index) -> Value:
            return self.scalar(function([grid.at(index[len(index) - len(grid.sizes) :]) for grid in grids]), node)

        assert isinstance(item, Scalar)
        return LazyArray(item, sizes, at, tuple(reads), any(grid.adds for grid in grids))

    def apply_operator(self, op: ast.operator, left: Operand, right: Operand, node: ast.AST) -> Operand:
        """Return the result of an operator with an array."""
        if isinstance(op, ast.MatMult):
            return self._multiply(left, right, node)
        if isinstance(op, ast.Pow) and not (isinstance(right, Known) and right.value == 2):
            self.fail(node, "a power of an array other than 2")
        a, b = self.grid(left, node), self.grid(right, node)
        item = DOUBLE if isinstance(op, ast.Div) else common_type(common_type(a.item, b.item), INT)
        if isinstance(op, ast.Mult) and a.item == b.item == BOOL:
            item = BOOL
        if isinstance(op, ast.Pow):
            return self.elementwise(lambda x: self.arithmetic(op, x[0], right, node), [a], item, node)
        return self.elementwise(lambda x: self.arithmetic(op, x[0], x[1], node), [a, b], item, node)

    def _multiply(self, left: Operand, right: Operand, node: ast.AST) -> Operand:
        """Return the product of matrices or vectors."""
        a, b = self.grid(left, node), self.grid(right, node)
        if not (1 <= len(a.sizes) <= 2 and 1 <= len(b.sizes) <= 2) or a.item == b.item == BOOL:
            self.fail(node, "a product @ of what are no vectors or matrices of numbers")
        length = self.broadcast_shapes(a.sizes[-1:], b.sizes[:1], node)[0]
        if len(b.sizes) == 2:  # each element of `a` is read again and again
            a = self._materialize_if_reused(left, a, node)
        if len(a.sizes) == 2:
            b = self._materialize_if_reused(right, b, node)
        rows = len(a.sizes) - 1

        def at(index: Index) -> Value:
            def term(k: str) -> Value:
                factors = a.at((*index[:rows], k)), b.at((k, *index[rows:]))
                return self.scalar(self.arithmetic(ast.Mult(), *factors, node), node)

            return self._sum_terms(length, term, node)

        if not rows and len(b.sizes) == 1:
            value = at(())
            return self.temporary(value.type, value.code)
        factors = (a, b) if len(a.sizes) == len(b.sizes) == 2 else None
        return LazyArray(
            DOUBLE, (*a.sizes[:rows], *b.sizes[1:]), at, (*_at_other_indices(a), *_at_other_indices(b)), True, factors
        )

    def _materialize_if_reused(self, operand: Operand, grid: LazyArray, node: ast.AST) -> LazyArray:
        if isinstance(operand, LazyArray) and all(self.max_size(n) < math.inf for n in grid.sizes):
            return self.grid(self.materialize(operand, node), node)
        if grid.adds:
            self.fail(node, "a product of a length that is known only at run time within a product")
        return grid

    def _sum_terms(self, length: str, term: Callable[[str], Value], node: ast.AST) -> Value:
        """Return the sum of terms, added to 0 one after the other."""
        if length.isdigit() and int(length) <= _UNROLLED:
            codes = [in_brackets(term(str(k)), DOUBLE) for k in range(int(length))]
            return Value(DOUBLE, " + ".join(["0.0", *codes]))
        total = self.temporary(DOUBLE, "0.0")
        self._loop(length, lambda k: self.lines.append(f"{total.code} += {self.convert(term(k), DOUBLE)};"))
        return total

    def reduce(self, name: str, operand: Operand, node: ast.AST) -> Value:
        """Return the sum, minimum, maximum of all elements, or if any or all are true."""
        grid = self.grid(operand, node)
        if name in ("min", "max"):
            self._require_elements(name, grid, node)
            if grid.item == BOOL:
                name = "all" if name == "min" else "any"
        if name in ("sum", "any", "all"):
            kind, start = (BOOL, "true" if name == "all" else "false") if name != "sum" else (DOUBLE, "0.0")
        else:
            kind, first = grid.item, {"min": ("INFINITY", "INT64_MAX"), "max": ("-INFINITY", "INT64_MIN")}[name]
            start = first[kind == INT]
        if name == "sum" and grid.item == BOOL:
            kind, start = INT, "0"
        total = self.temporary(kind, start)
        codes = {"sum": "{0} + {1}", "any": "{0} || {1}", "all": "{0} && {1}"}
        functions = {"min": ("minimum_f64", "min_i64"), "max": ("maximum_f64", "max_i64")}
        template = codes.get(name) or f"{functions[name][kind == INT]}({{0}}, {{1}})"

        def add(index: Index) -> None:
            value = grid.at(index)
            code = in_brackets(value, kind) if name in codes else self.convert(value, kind)
            self.lines.append(f"{total.code} = {template.format(total.code, code)};")

        self.each(grid.sizes, add)
        return total

    def _require_elements(self, name: str, grid: LazyArray, node: ast.AST) -> None:
        """Refuse min and max of an empty array; of floats whose length only C knows, the result is then infinite."""
        if "0" in grid.sizes:
            self.fail(node, f"{name} of an empty array")
        if grid.item not in (DOUBLE, INT, BOOL):
            self.fail(node, f"{name} of {name_of(grid.item)}")
        for length in map(self.length, grid.sizes if grid.item != DOUBLE else ()):
            if length is None:
                self.fail(node, f"{name} of {name_of(grid.item)}, of a length that C computes")
            self.require(length, ">=", Length("", 1), node)

    def _loop(self, length: str, body: Callable[[str], None]) -> None:
        k = self.new_name("i")
        length = self.temporary(INT, length).code if "(" in length else length
        self.lines.append(f"for (int64_t {k} = 0; {k} < {length}; {k}++) {{")
        body(k)
        self.lines.append("}")

    def each(self, sizes: Index, body: Callable[[Index], None], index: Index = ()) -> None:
        """Call `body` for each index: written out if these are few, else within loops."""
        shape = known_shape(sizes)
        if shape is not None and math.prod(shape) <= _UNROLLED:
            for rest in itertools.product(*map(range, shape)):
                body((*index, *map(str, rest)))
        else:
            self._loop(sizes[0], lambda k: self.each(sizes[1:], body, (*index, k)))

    def store(self, target: View, operand: Operand, node: ast.AST, op: ast.operator | None = None) -> None:
        """Store an array, or a number, in all elements of an array; with an operator, add to it or the like."""
        grid = self.grid(operand, node)
        if len(grid.sizes) > len(target.sizes):
            self.fail(node, f"{len(grid.sizes)} axes stored in {len(target.sizes)}")
        sizes = self.broadcast_shapes(target.sizes, grid.sizes, node)
        if self._overlaps(target, grid):
            grid = self.grid(self.materialize(grid, node), node)
        if not self.is_local(target.roots):
            self.writes_arguments = True

        def write(index: Index) -> None:
            element = self.element_of(target, index)
            value = grid.at(index[len(index) - len(grid.sizes) :])
            if op is not None:
                value = self.scalar(self.arithmetic(op, element, value, node), node)
            assert isinstance(target.type, Array)
            self.lines.append(f"{element.code} = {self.convert(value, target.type.item)};")

        if grid.factors and op is None and not known_shape([*sizes, *grid.factors[1].sizes]):
            self._store_product(target, sizes, *grid.factors, node)
        else:
            self.each(sizes, write)

    def _store_product(self, target: View, sizes: Index, a: LazyArray, b: LazyArray, node: ast.AST) -> None:
        """Store a product of matrices row by row, in the same order of sums: fast along rows."""

        def add(i: str, k: str) -> None:
            factor = self.temporary(a.item, a.at((i, k)).code)
            self._loop(sizes[1], lambda j: self.lines.append(f"{at(i, j)} += {times_of(factor, b.at((k, j)))};"))

        def row(i: str) -> None:
            self._loop(sizes[1], lambda j: self.lines.append(f"{at(i, j)} = 0.0;"))
            self._loop(self.common_length(a.sizes[1], b.sizes[0], node), lambda k: add(i, k))

        def at(*index: str) -> str:
            return self.element_of(target, index).code

        def times_of(one: Value, other: Value) -> str:
            return self.convert(self.scalar(self.arithmetic(ast.Mult(), one, other, node), node), DOUBLE)

        self._loop(sizes[0], row)

    def _overlaps(self, target: View, grid: LazyArray) -> bool:
        """Return True if an element may be read after it was written."""
        own = target.data, target.offset, target.sizes, target.strides
        for view, same_index in grid.reads:
            same = same_index and (view.data, view.offset, view.sizes, view.strides) == own
            is_disjoint = view.data == target.data and any(map(_are_disjoint, view.box, target.box))
            if not same and not is_disjoint and self.may_overlap(view.roots, target.roots):
                return True
        return False

    def materialize(self, operand: Operand, node: ast.AST, stem: str = "a") -> View:
        """Compute an array expression into storage on the stack."""
        grid = self.grid(operand, node)
        view = self._new_array(stem, node, grid.item, grid.sizes)
        self.store(view, replace(grid, sizes=view.sizes), node)
        return view

    def _new_array(self, stem: str, node: ast.AST, item: Scalar, sizes: Index) -> View:
        """Return a new array in storage for its maximum lengths."""
        size = math.prod(map(self.max_size, sizes))
        if not size < math.inf:
            self.fail(node, "an array of a length that is known only at run time, and no target")
        sizes = tuple(
            n if n.isdigit() else self.note_max_size(self.temporary(INT, n).code, self.max_size(n)) for n in sizes
        )
        name = self.storage(stem, node, item, int(size))
        if known_shape(sizes) is None:  # so that no number is undefined where the array is shorter
            self.declared[name] = self.declared[name].replace(";", " = {0};")
        return self.view_of_storage(name, item, sizes)

    def array_of(self, items: Sequence[Operand], node: ast.AST) -> View:
        """Return a new array of numbers or rows."""
        if any(isinstance(item, Items) for item in items):
            items = [self.array_of(self.items_of(item, node), node) for item in items]
        shapes = [item.sizes if isinstance(item, View | LazyArray) else () for item in items]
        if len(set(map(len, shapes))) != 1:
            self.fail(node, "an array of numbers and rows")
        shape = functools.reduce(lambda one, other: self.broadcast_shapes(one, other, node), shapes)
        target = self._new_array("a", node, DOUBLE, (str(len(items)), *shape))
        for i, item in enumerate(self._copy_overlapping(items, target, node)):
            if shape:
                self.store(self.subarray(target, str(i)), item, node)
            else:
                self.lines.append(f"{target.data}[{i}] = {self.convert(self.scalar(item, node), DOUBLE)};")
        return target

    def concatenate(self, parts: Sequence[Operand], node: ast.AST) -> View:
        """Return a new vector of vectors, one after the other."""
        shapes = [self.grid(part, node).sizes for part in parts]
        if any(len(shape) != 1 for shape in shapes):
            self.fail(node, "arrays of several dimensions, or numbers, in one")
        ends = list(itertools.accumulate([n for (n,) in shapes], lambda *terms: plus(terms), initial="0"))
        total = self.note_max_size(ends[-1], sum(self.max_size(n) for (n,) in shapes))
        target = self._new_array("a", node, DOUBLE, (total,))
        for part, begin, (n,) in zip(self._copy_overlapping(parts, target, node), ends, shapes, strict=False):
            piece = self.view(DOUBLE, target.data, begin, (n,), ("1",), target.roots)
            self.store(piece, part, node)
        return target

    def _copy_overlapping(self, items: Sequence[Operand], target: View, node: ast.AST) -> list[Operand]:
        """Return items that do not change while others are stored in a target."""
        copies: list[Operand] = []
        for item in items:
            if self.is_array(item):
                overlaps = any(self.may_overlap(view.roots, target.roots) for view, _ in self.grid(item, node).reads)
                copies.append(self.materialize(item, node) if overlaps else item)
            else:
                value = self.scalar(item, node)
                copies.append(value if value.simple else self.temporary(value.type, value.code))
        return copies

    def transpose(self, operand: Operand, node: ast.AST) -> View:
        """Return an array with its axes reversed."""
        view = operand if isinstance(operand, View) else self.materialize(operand, node)
        assert isinstance(view.type, Array)
        turned = self.view(view.type.item, view.data, view.offset, view.sizes[::-1], view.strides[::-1], view.roots)
        return replace(turned, box=view.box, axes=view.axes[::-1])


def _at_other_indices(grid: LazyArray) -> Iterable[tuple[View, bool]]:
    return [(view, False) for view, _ in grid.reads]


def _are_disjoint(one: tuple[str, str], other: tuple[str, str]) -> bool:
    """Return True if two ranges of indices, first and length, are known to have none in common."""
    for (begin, _), (first, length) in ((one, other), (other, one)):
        if begin.isdigit() and first.isdigit() and length.isdigit() and int(begin) >= int(first) + int(length):
            return True
    return False
