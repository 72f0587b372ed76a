"""Translate calls: of Python's built-in functions, of `math` and NumPy, and of translated functions."""

from __future__ import annotations

import ast
import itertools
import math
from collections.abc import Callable, Sequence
from types import FunctionType
from typing import Any

import numpy as np

from controller.stack_array import array, zeros
from controller.translator.foreign import POINTER, call_c
from controller.translator.operands import Items, Known, LazyArray, Length, Operand, Value, View, in_brackets
from controller.translator.subscripts import Subscripts
from controller.translator.types import (
    BOOL,
    DOUBLE,
    INT,
    UINT,
    Array,
    Nothing,
    Record,
    Type,
    common_type,
    known_lengths,
    name_of,
    return_type,
    type_with_shape,
)

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
            return self._replace_fields(node.func, node)
        called = self.expression(node.func)
        if not isinstance(called, Known):
            self.fail(node, "a call of what is no function")
        function = called.value
        if node.keywords and not hasattr(function, "_fields"):
            self.fail(node, "an argument by its name")
        operands = self.in_order([*node.args, *(keyword.value for keyword in node.keywords)])
        name = getattr(function, "__name__", "")
        if function is call_c:
            return self._call_foreign(operands, node)
        made = self._call_on_arrays(function, operands, node)
        if made is not None:
            return made
        if hasattr(function, "_fields"):
            return self.make_record(function, [self.value(operand, node) for operand in operands], node)
        if function in (min, max):
            return self._extreme(function, operands, node)
        if function in (abs, np.abs):
            if self.is_array(operands[0]):
                grid = self.grid(operands[0], node)
                return self.elementwise(lambda x: self._absolute_value(x[0]), [grid], grid.item, node)
            return self._absolute_value(self.scalar(operands[0], node))
        if function in _CAST:
            value = self.scalar(operands[0], node)
            kind = _CAST[function]
            if kind == BOOL != value.type:
                return Value(BOOL, f"{in_brackets(value)} != 0")
            return Value(kind, self.convert(value, kind))
        if _is_from(function, _MODULES) or isinstance(function, np.ufunc):
            return self._call_math(name, operands, node)
        if isinstance(function, FunctionType):
            return self.call_translated(function, operands, node)
        return self.fail(node, f"a call of {name or function!r}")

    def _replace_fields(self, function: ast.Attribute, node: ast.Call) -> Value:
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

    def _call_on_arrays(self, function: Any, operands: Sequence[Operand], node: ast.AST) -> Operand | None:
        """Return what a function makes of, or from, whole arrays; None if it is none of these."""
        if function is zeros:
            shape = [operand.value for operand in operands if isinstance(operand, Known)]
            if len(shape) != len(operands):
                self.fail(node, "zeros of a shape that is not written as numbers")
            return self.make_zeros(tuple(shape), node)
        if function is array:
            return self.array_of(operands, node)
        if function is np.concatenate:
            return self.concatenate(self.items_of(operands[0], node), node)
        if function in _REDUCED and self.is_array(operands[0]) and len(operands) == 1:
            return self.reduce(_REDUCED[function], operands[0], node)
        return None

    def _call_foreign(self, operands: Sequence[Operand], node: ast.AST) -> Value:
        address, listed, *arguments = operands
        kinds = [kind.value for kind in self.items_of(listed, node) if isinstance(kind, Known)]
        if len(kinds) != len(arguments):
            self.fail(node, "a call of C whose kinds are no constants, one for each argument")
        values = [self.value(operand, node) for operand in arguments]
        self.n_writes += 1
        self.writes_arguments = True
        codes = [_c_argument(value, kind) for value, kind in zip(values, kinds, strict=True)]
        function = f"(int (*)({', '.join(kinds)}))(intptr_t)"
        return self.temporary(INT, f"({function}{self.scalar(address, node).code})({', '.join(codes)})")

    def make_record(self, kind: type, items: Sequence[Value], node: ast.AST) -> Value:
        """Return a new named tuple on the stack."""
        fields: tuple[str, ...] = kind._fields  # type: ignore[attr-defined]
        try:
            types = tuple(self._check_shape(kind, field, item, node) for field, item in zip(fields, items, strict=True))
        except TypeError as error:
            self.fail(node, str(error))
        record, name = Record(kind, types), self.site("record", node)
        if record.mutable:
            self.fail(node, f"a new State, {kind.__name__}")
        self.declared[name] = f"{self.c(record)} {name};"
        for field, item, of in zip(fields, items, types, strict=True):
            code = f"*{item.code}" if isinstance(of, Record) else self.convert(item, of)
            self.lines.append(f"{name}.{field} = {code};")
            self.made[f"{name}.{field}"] = item.roots
            self.note_lengths(f"{name}.{field}", item)
        return Value(record, f"(&{name})", False, frozenset([name]))

    def call_translated(self, function: Callable[..., Any], arguments: Sequence[Operand], node: ast.AST) -> Operand:
        """Call a function of Python that is translated too."""
        if not isinstance(function, FunctionType):
            self.fail(node, f"a call of {function!r}")
        values = [self.value(argument, node) for argument in arguments]
        names = function.__code__.co_varnames
        try:
            kinds = tuple(
                self._check_shape(function, name, value, node) for name, value in zip(names, values, strict=False)
            )
        except TypeError as error:
            self.fail(node, str(error))
        roots = [self._all_roots(value) for value in values]
        aliases = frozenset(
            frozenset([names[i], names[k]])
            for i, k in itertools.combinations(range(min(len(values), len(names))), 2)
            if any(one.startswith(f"{other}.") or other.startswith(f"{one}.") for one in roots[i] for other in roots[k])
            or self.may_overlap(roots[i], roots[k])
        )
        aliases |= {frozenset([name]) for name, value in zip(names, values, strict=False) if self._is_aliased(value)}
        name, result, writes, requirements = self.program.instance(function, kinds, aliases)
        operands = [a if isinstance(a, Items) else value for a, value in zip(arguments, values, strict=True)]
        for requirement in requirements:
            left, right = (self._length_of_argument(n, operands, node) for n in (requirement.left, requirement.right))
            if not (left and right):
                self.fail(node, f"arrays of lengths that C computes, in {requirement.where}")
            self.require(left, requirement.sign, right, node, requirement.where)
        code = f"{name}({', '.join(self.convert(v, k) for v, k in zip(values, kinds, strict=True))})"
        if writes:
            self.n_writes += 1
            self.writes_arguments = self.writes_arguments or not all(map(self.is_local, roots))
        if isinstance(result, Nothing):
            self.lines.append(f"{code};")
            return Known(None)
        if not isinstance(result, Array):
            return self.temporary(result, code)
        name = self.site("r", node)
        self.declared[name] = f"{self.c(return_type(result))} {name};"
        self.lines.append(f"{name} = {code};")
        return self.view_of_storage(f"{name}.f", DOUBLE, known_lengths(result))

    def _length_of_argument(self, length: Length, arguments: Sequence[Operand], node: ast.AST) -> Length | None:
        """Return what a length of a called function's parameter is here."""
        if not length.path:
            return length
        index, *items, axis = length.path.split(".")
        operand = arguments[int(index)]
        for item in items:
            if isinstance(operand, Value) and isinstance(operand.type, Record):
                operand = self.field(operand, item)
            else:
                operand = self.items_of(operand, node)[int(item)]
        assert isinstance(operand, View | LazyArray)
        own = self.length(operand.sizes[int(axis)])
        return own and Length(own.path, own.offset + length.offset)

    def _check_shape(self, owner: Any, name: str, value: Value, node: ast.AST) -> Type:
        """Return the type of a parameter or field; require the lengths of its annotation."""
        kind = type_with_shape(owner, name, value.type)
        if isinstance(kind, Array) and isinstance(value, View):
            for n, size in zip(kind.shape, value.sizes, strict=True):
                length = self.length(size)
                if isinstance(n, int) and length:
                    self.require(length, "==", Length("", n), node)
                elif isinstance(n, int) and self.max_size(size) != n:
                    self.fail(node, f"{name} of a length that is known only at run time, expected {n}")
        return kind

    def _is_aliased(self, record: Value) -> bool:
        """Return True if arrays of one record may overlap."""
        fields = [self.made[path] for path in self.made for root in record.roots if path.startswith(f"{root}.")]
        owners = {root.partition(".")[0] for root in record.roots.union(*fields)}
        return any(frozenset([owner]) in self.aliases for owner in owners) or any(
            self.may_overlap(one, other) for one, other in itertools.combinations(fields, 2)
        )

    def _all_roots(self, value: Value) -> frozenset[str]:
        """Return the roots of all arrays of a value."""
        if not isinstance(value.type, Record):
            return value.roots
        own = [self.made[path] for path in self.made for root in value.roots if path.startswith(f"{root}.")]
        return value.roots.union(*own)

    def _absolute_value(self, value: Value) -> Value:
        return Value(value.type, f"{'fabs' if value.type == DOUBLE else 'llabs'}({value.code})")

    def _call_math(self, name: str, operands: Sequence[Operand], node: ast.AST) -> Operand:
        if name == "where" and len(operands) == 3:
            return self._where(operands, node)
        if any(map(self.is_array, operands)):
            item = BOOL if name in _TESTS else DOUBLE
            return self.elementwise(lambda x: self._call_math(name, x, node), operands, item, node)
        codes = [self.convert(self.scalar(operand, node), DOUBLE) for operand in operands]
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
        kind = common_type(a.item, b.item)

        def choose(x: list[Value]) -> Value:
            return Value(kind, f"{in_brackets(x[0])} ? {in_brackets(x[1], kind)} : {in_brackets(x[2], kind)}")

        return self.elementwise(choose, [operands[0], a, b], kind, node)

    def _extreme(self, function: Any, operands: Sequence[Operand], node: ast.AST) -> Value:
        values = [self.scalar(operand, node) for operand in operands]
        kind = values[0].type
        for value in values[1:]:
            kind = common_type(kind, value.type)
        if kind not in (DOUBLE, INT):
            self.fail(node, f"{function.__name__} of {name_of(kind)}")
        name = f"{function.__name__}_{'f64' if kind == DOUBLE else 'i64'}"
        code = self.convert(values[0], kind)
        for value in values[1:]:
            code = f"{name}({code}, {self.convert(value, kind)})"
        return Value(kind, code)


def _c_argument(value: Value, kind: str) -> str:
    """Return the code of an argument of a C function."""
    if isinstance(value.type, Array):
        return f"({value.code}).data"
    return f"({kind}){'(intptr_t)' if kind == POINTER else ''}{in_brackets(value)}"


def _is_from(function: Any, modules: Sequence[Any]) -> bool:
    return any(getattr(module, getattr(function, "__name__", ""), None) is function for module in modules)
