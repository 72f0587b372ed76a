"""Convert operands to C values, and tuples to their items."""

from __future__ import annotations

import ast
from collections.abc import Sequence

import numpy as np

from controller.translator.array_views import ArrayViews
from controller.translator.operands import Items, Known, LazyArray, Operand, Value, View, in_brackets, number
from controller.translator.types import BOOL, DOUBLE, INT, UINT, Array, Record, Scalar, Tuple, Type, name_of


class OperandValues(ArrayViews):
    """Compute the operands of one function; statements that they need first go to `lines`."""

    def materialize(self, operand: Operand, node: ast.AST, stem: str = "a") -> View:
        """Compute an array expression into storage on the stack."""
        raise NotImplementedError

    def expression(self, node: ast.expr) -> Operand:
        """Return the operand of an expression."""
        raise NotImplementedError

    def in_order(self, nodes: Sequence[ast.expr]) -> list[Operand]:
        """Return operands, each evaluated before the statements that the next ones need."""
        operands: list[Operand] = []
        for node in nodes:
            operand, needed, writes = self.evaluate_separately(self.expression, node)
            operands = [self.freeze(operand, node, writes) if needed else operand for operand in operands]
            self.lines += needed
            operands.append(operand)
        return operands

    def freeze(self, operand: Operand, node: ast.AST, written: bool = True) -> Operand:
        """Return an operand as it is now: an array expression is computed only if arrays are written later."""
        if isinstance(operand, Items):
            return Items(tuple(self.freeze(item, node, written) for item in operand.items))
        if isinstance(operand, LazyArray) and written:
            return self.materialize(operand, node)
        if isinstance(operand, Value) and not operand.simple and isinstance(operand.type, Scalar):
            return self.temporary(operand.type, operand.code)
        return operand

    def value(self, operand: Operand, node: ast.AST) -> Value:
        """Return an operand as a C value."""
        if isinstance(operand, Value):
            return operand
        if isinstance(operand, LazyArray):
            return self.materialize(operand, node)
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
            if any(isinstance(value.type, Record) for value in values):
                self.fail(node, "a record in a tuple")
            kind, roots = Tuple(tuple(value.type for value in values)), [value.roots for value in values]
            return Value(kind, self.tuple_expression(kind, [v.code for v in values]), False, frozenset().union(*roots))
        return self.fail(node, "not a value")

    def tuple_expression(self, kind: Type, codes: Sequence[str]) -> str:
        """Return the C expression of a tuple from its items."""
        inside = ", ".join(codes)
        braces = f"{{{inside}}}" if isinstance(kind, Tuple) and kind.uniform else inside
        return f"({self.c(kind)}){{{braces}}}"

    def scalar(self, operand: Operand, node: ast.AST) -> Value:
        """Return an operand as a number; refuse another type."""
        value = self.value(operand, node)
        if not isinstance(value.type, Scalar):
            self.fail(node, f"{name_of(value.type)}, expected a number")
        return value

    def convert(self, value: Value, kind: Type) -> str:
        """Return the C expression of a number, converted to another type of number."""
        if isinstance(value, View) and isinstance(kind, Array):
            return self.literal(value, kind)
        if value.type == kind or not isinstance(kind, Scalar):
            return value.code
        return f"({kind.c}){in_brackets(value)}"

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
                return [self.variable_value(k, c, operand.simple, operand.roots, p) for k, c, p in each]
            case View() if len(operand.sizes) == 1 and operand.sizes[0].isdigit():
                return [self.element_of(operand, (str(i),)) for i in range(int(operand.sizes[0]))]
            case LazyArray():
                return self.items_of(self.materialize(operand, node), node)
        return self.fail(node, "expected a tuple")
