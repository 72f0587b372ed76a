"""Translate calls: of Python's built-in functions, of `math` and NumPy, and of translated functions."""

from __future__ import annotations

import ast
import math
import types as python_types
from collections.abc import Sequence
from typing import Any

import numpy as np

from controller.stack_array import array, zeros
from controller.translator.foreign import POINTER, call_c
from controller.translator.operands import Known, Operand, Value, bracketed
from controller.translator.subscripts import Subscripts
from controller.translator.types import BOOL, DOUBLE, INT, UINT, Array, Record, name_of, unified

_MATH = {
    "sqrt": "sqrt", "cos": "cos", "sin": "sin", "acos": "acos", "atan2": "atan2", "hypot": "hypot",
    "copysign": "copysign", "tan": "tan", "exp": "exp", "log": "log",
    "arccos": "acos", "arctan2": "atan2",
}  # fmt: skip
_TESTS = {"isnan": "isnan", "isfinite": "isfinite", "isinf": "isinf"}
_CAST = {float: DOUBLE, int: INT, bool: BOOL, np.uint64: UINT, np.int64: INT, np.float64: DOUBLE}
_MODULES = (math, np)
_REDUCED = {np.sum: "sum", np.min: "min", np.max: "max", np.any: "any", np.all: "all"}


class Calls(Subscripts):
    """Translates calls."""

    def _call(self, node: ast.Call) -> Operand:
        if isinstance(node.func, ast.Attribute) and node.func.attr == "copy" and not (node.args or node.keywords):
            owner = self.expression(node.func.value)
            if self.is_array(owner):
                return self.grid(owner, node)
        if isinstance(node.func, ast.Attribute) and node.func.attr == "_replace":
            return self._replaced(node.func, node)
        called = self.expression(node.func)
        if not isinstance(called, Known):
            self.fail(node, "a call of what is no function")
        function = called.value
        if node.keywords and not hasattr(function, "_fields"):
            self.fail(node, "an argument by its name")
        operands = self.in_order([*node.args, *(keyword.value for keyword in node.keywords)])
        name = getattr(function, "__name__", "")
        if function is call_c:
            return self._foreign(operands, node)
        made = self._of_arrays(function, operands, node)
        if made is not None:
            return made
        if hasattr(function, "_fields"):
            return self.make_record(function, [self.value(operand, node) for operand in operands], node)
        if function in (min, max):
            return self._extreme(function, operands, node)
        if function in (abs, np.abs):
            if self.is_array(operands[0]):
                grid = self.grid(operands[0], node)
                return self.elementwise(lambda x: self._absolute(x[0]), [grid], grid.item, node)
            return self._absolute(self.scalar(operands[0], node))
        if function in _CAST:
            value = self.scalar(operands[0], node)
            kind = _CAST[function]
            if kind == BOOL != value.type:
                return Value(BOOL, f"{bracketed(value)} != 0")
            return Value(kind, self.converted(value, kind))
        if _is_of(function, _MODULES) or isinstance(function, np.ufunc):
            return self._of_math(name, operands, node)
        if isinstance(function, python_types.FunctionType):
            return self.call_translated(function, operands, node)
        return self.fail(node, f"a call of {name or function!r}")

    def _replaced(self, function: ast.Attribute, node: ast.Call) -> Value:
        """Return a named tuple with other values of some fields."""
        record = self.value(self.expression(function.value), node)
        fields = set(record.type.fields) if isinstance(record.type, Record) and not record.type.mutable else set()
        if not isinstance(record.type, Record) or not {k.arg for k in node.keywords} <= fields:
            self.fail(node, "_replace of what is no named tuple, or of a field that it does not have")
        changes = dict(
            zip((k.arg for k in node.keywords), self.in_order([k.value for k in node.keywords]), strict=True)
        )
        items = [changes.get(field) or self.field(record, field) for field in record.type.fields]
        return self.make_record(record.type.python, [self.value(item, node) for item in items], node)

    def _of_arrays(self, function: Any, operands: Sequence[Operand], node: ast.AST) -> Operand | None:
        """Return what a function makes of, or from, whole arrays; None if it is none of these."""
        if function is zeros:
            shape = [operand.value for operand in operands if isinstance(operand, Known)]
            if len(shape) != len(operands):
                self.fail(node, "zeros of a shape that is not written as numbers")
            return self.make_zeros(tuple(shape), node)
        if function is array:
            return self.array_of(operands, node)
        if function is np.concatenate:
            return self.concatenated(self.items_of(operands[0], node), node)
        if function in _REDUCED and self.is_array(operands[0]) and len(operands) == 1:
            return self.reduced(_REDUCED[function], operands[0], node)
        return None

    def _foreign(self, operands: Sequence[Operand], node: ast.AST) -> Value:
        address, listed, *arguments = operands
        kinds = [kind.value for kind in self.items_of(listed, node) if isinstance(kind, Known)]
        if len(kinds) != len(arguments):
            self.fail(node, "a call of C whose kinds are no constants, one for each argument")
        values = [self.value(operand, node) for operand in arguments]
        self.n_writes += 1
        self.writes_arguments = True
        codes = [_as_kind(value, kind) for value, kind in zip(values, kinds, strict=True)]
        function = f"(int (*)({', '.join(kinds)}))(intptr_t)"
        return self.temporary(INT, f"({function}{self.scalar(address, node).code})({', '.join(codes)})")

    def _absolute(self, value: Value) -> Value:
        return Value(value.type, f"{'fabs' if value.type == DOUBLE else 'llabs'}({value.code})")

    def _of_math(self, name: str, operands: Sequence[Operand], node: ast.AST) -> Operand:
        if name == "where" and len(operands) == 3:
            return self._where(operands, node)
        if any(map(self.is_array, operands)):
            item = BOOL if name in _TESTS else DOUBLE
            return self.elementwise(lambda x: self._of_math(name, x, node), operands, item, node)
        codes = [self.converted(self.scalar(operand, node), DOUBLE) for operand in operands]
        if name in _TESTS:
            return Value(BOOL, f"{_TESTS[name]}({', '.join(codes)}) != 0")
        if name in _MATH:
            return Value(DOUBLE, f"{_MATH[name]}({', '.join(codes)})")
        if name in ("minimum", "maximum"):
            return Value(DOUBLE, f"{name}_f64({', '.join(codes)})")
        if name == "clip":
            return Value(DOUBLE, f"minimum_f64(maximum_f64({codes[0]}, {codes[1]}), {codes[2]})")
        return self.fail(node, f"{name} has no C here")

    def _where(self, operands: Sequence[Operand], node: ast.AST) -> Operand:
        a, b = self.grid(operands[1], node), self.grid(operands[2], node)
        kind = unified(a.item, b.item)

        def choose(x: list[Value]) -> Value:
            return Value(kind, f"{bracketed(x[0])} ? {bracketed(x[1], kind)} : {bracketed(x[2], kind)}")

        return self.elementwise(choose, [operands[0], a, b], kind, node)

    def _extreme(self, function: Any, operands: Sequence[Operand], node: ast.AST) -> Value:
        values = [self.scalar(operand, node) for operand in operands]
        kind = values[0].type
        for value in values[1:]:
            kind = unified(kind, value.type)
        if kind not in (DOUBLE, INT):
            self.fail(node, f"{function.__name__} of {name_of(kind)}")
        name = f"{function.__name__}_{'f64' if kind == DOUBLE else 'i64'}"
        code = self.converted(values[0], kind)
        for value in values[1:]:
            code = f"{name}({code}, {self.converted(value, kind)})"
        return Value(kind, code)


def _as_kind(value: Value, kind: str) -> str:
    """Return the code of an argument of a C function."""
    if isinstance(value.type, Array):
        return f"({value.code}).data"
    return f"({kind}){'(intptr_t)' if kind == POINTER else ''}{bracketed(value)}"


def _is_of(function: Any, modules: Sequence[Any]) -> bool:
    return any(getattr(module, getattr(function, "__name__", ""), None) is function for module in modules)
