"""Expressions: what each construct of Python becomes in C, in Python's order of evaluation and rounding."""

from __future__ import annotations

import ast
import math
import types as python_types
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any, NoReturn

import numpy as np

from controller.errors import TranslationError
from controller.translator.types import (
    BOOL,
    DOUBLE,
    INT,
    UINT,
    Array,
    Nothing,
    Record,
    Scalar,
    Tuple,
    Type,
    name_of,
    unified,
)

_ARITHMETIC = {ast.Add: "+", ast.Sub: "-", ast.Mult: "*"}
_BITS = {ast.BitXor: "^", ast.BitAnd: "&", ast.BitOr: "|", ast.LShift: "<<", ast.RShift: ">>"}
_COMPARED = {ast.Lt: "<", ast.LtE: "<=", ast.Gt: ">", ast.GtE: ">=", ast.Eq: "==", ast.NotEq: "!="}
_MATH = {
    "sqrt": "sqrt", "cos": "cos", "sin": "sin", "acos": "acos", "atan2": "atan2", "hypot": "hypot",
    "copysign": "copysign", "tan": "tan", "exp": "exp", "log": "log",
    "arccos": "acos", "arctan2": "atan2",
}  # fmt: skip
_TESTS = {"isnan": "isnan", "isfinite": "isfinite", "isinf": "isinf"}
_CAST = {float: DOUBLE, int: INT, bool: BOOL, np.uint64: UINT, np.int64: INT, np.float64: DOUBLE}
_LARGEST_POWER = 8  # that is multiplied out
_MODULES = (math, np)


@dataclass(frozen=True)
class Value:
    """A value that C computes: of a record, the pointer to it."""

    type: Type
    code: str
    simple: bool = False  # a name or a number: it may be written twice, and nothing that follows changes it


@dataclass(frozen=True)
class Known:
    """What is known when the code is translated: a number, a tuple of such, a function, a module, a class."""

    value: Any


@dataclass(frozen=True)
class Items:
    """A tuple that is not put together, but known by its items."""

    items: tuple[Operand, ...]


Operand = Value | Known | Items


class Expressions:
    """Translates the expressions of one function; statements that they need first go to `lines`."""

    names: dict[str, Type]  # of variables, as far as they are known
    globals: dict[str, Any]
    lines: list[str]

    def fail(self, node: ast.AST, what: str) -> NoReturn:
        """Refuse a construct by its place."""
        raise NotImplementedError

    def temporary(self, kind: Type, code: str) -> Value:
        """Return a new variable with a value."""
        raise NotImplementedError

    def call_translated(self, function: Callable[..., Any], arguments: Sequence[Operand], node: ast.AST) -> Operand:
        """Call a function of Python that is translated too."""
        raise NotImplementedError

    def make_zeros(self, shape: tuple[int, ...]) -> Value:
        """Return a new array of zeros on the stack."""
        raise NotImplementedError

    def make_record(self, kind: type, items: Sequence[Value]) -> Value:
        """Return a new named tuple on the stack."""
        raise NotImplementedError

    # ---- operands ----

    def in_order(self, nodes: Sequence[ast.expr]) -> list[Operand]:
        """Return operands, each evaluated before what the following ones do first."""
        operands: list[Operand] = []
        for node in nodes:
            mark = len(self.lines)
            operand = self.expression(node)
            if len(self.lines) > mark:
                later, self.lines[mark:] = self.lines[mark:], []
                operands = [self._kept(operand) for operand in operands]
                self.lines += later
            operands.append(operand)
        return operands

    def _kept(self, operand: Operand) -> Operand:
        if isinstance(operand, Items):
            return Items(tuple(map(self._kept, operand.items)))
        if isinstance(operand, Value) and not operand.simple and isinstance(operand.type, Scalar):
            return self.temporary(operand.type, operand.code)
        return operand

    def value(self, operand: Operand, node: ast.AST) -> Value:
        """Return an operand as C computes it."""
        match operand:
            case Value():
                return operand
            case Known(bool(x) | np.bool_(x)):
                return Value(BOOL, "true" if x else "false", True)
            case Known(np.uint64() as x):
                return Value(UINT, f"UINT64_C({int(x)})", True)
            case Known(int(x)) | Known(np.integer() as x):  # type: ignore[misc]
                return Value(INT, f"INT64_C({int(x)})" if abs(int(x)) > 2**31 else f"{int(x)}", True)
            case Known(float(x)):
                return Value(DOUBLE, _number(x), True)
            case Known(tuple(items)):
                return self.value(Items(tuple(map(Known, items))), node)
            case Items(items):
                values = [self.value(item, node) for item in items]
                kind = Tuple(tuple(value.type for value in values))
                return Value(kind, self.compound(kind, [value.code for value in values]))
        return self.fail(node, "not a value")

    def compound(self, kind: Type, codes: Sequence[str]) -> str:
        """Return a tuple made of its items."""
        inside = ", ".join(codes)
        braces = f"{{{inside}}}" if isinstance(kind, Tuple) and kind.uniform else inside
        return f"({self.c(kind)}){{{braces}}}"

    def c(self, kind: Type) -> str:
        """Return the C name of a type."""
        raise NotImplementedError

    def scalar(self, operand: Operand, node: ast.AST) -> Value:
        """Return an operand that is a number."""
        value = self.value(operand, node)
        if not isinstance(value.type, Scalar):
            self.fail(node, f"{name_of(value.type)}, expected a number")
        return value

    def converted(self, value: Value, kind: Type) -> str:
        """Return the code of a number as another type of number."""
        if value.type == kind or not isinstance(kind, Scalar):
            return value.code
        return f"({kind.c}){_bracketed(value)}"

    def items_of(self, operand: Operand, node: ast.AST) -> list[Operand]:
        """Return the items of a tuple."""
        match operand:
            case Items(items):
                return list(items)
            case Known(tuple(items)):
                return [Known(item) for item in items]
            case Value(Tuple() as kind, code):
                return [Value(item, f"{code}.{kind.item(i)}", operand.simple) for i, item in enumerate(kind.items)]
        return self.fail(node, "expected a tuple")

    # ---- expressions ----

    def expression(self, node: ast.expr) -> Operand:
        """Return what an expression is."""
        method = getattr(self, f"_{type(node).__name__.lower()}", None)
        if method is None:
            self.fail(node, f"{type(node).__name__} is not translated")
        operand: Operand = method(node)
        return operand

    def _constant(self, node: ast.Constant) -> Operand:
        return Known(node.value)

    def _name(self, node: ast.Name) -> Operand:
        if node.id in self.names:
            return Value(self.names[node.id], self.variable(node.id), True)
        if node.id in self.globals:
            return Known(self.globals[node.id])
        builtins: Any = self.globals["__builtins__"]
        found = builtins.get(node.id) if isinstance(builtins, dict) else getattr(builtins, node.id, None)
        if found is None:
            self.fail(node, f"{node.id} is not known here")
        return Known(found)

    def variable(self, name: str) -> str:
        """Return the C name of a variable."""
        raise NotImplementedError

    def _attribute(self, node: ast.Attribute) -> Operand:
        owner = self.expression(node.value)
        match owner:
            case Known(value):
                return Known(getattr(value, node.attr))
            case Value(Record() as kind, code) if node.attr in kind.fields:
                item = kind.items[kind.fields.index(node.attr)]
                inside = f"{_bracketed(owner)}->{node.attr}"
                return Value(item, f"(&{inside})" if isinstance(item, Record) else inside, True)
            case Value(Array() as kind, code) if node.attr == "size":
                return Value(INT, " * ".join(f"{code}.n{i}" for i in range(kind.ndim)), kind.ndim == 1)
            case Value(Array() as kind, code) if node.attr == "shape":
                return Items(tuple(Value(INT, f"{code}.n{i}", True) for i in range(kind.ndim)))
        return self.fail(node, f"attribute {node.attr}")

    def _tuple(self, node: ast.Tuple) -> Operand:
        return Items(tuple(self.in_order(node.elts)))

    def _unaryop(self, node: ast.UnaryOp) -> Operand:
        operand = self.expression(node.operand)
        if isinstance(operand, Known) and not isinstance(node.op, ast.Not):
            return Known(-operand.value if isinstance(node.op, ast.USub) else operand.value)
        value = self.scalar(operand, node)
        match node.op:
            case ast.USub():
                return Value(value.type if value.type != BOOL else INT, f"-{_bracketed(value)}")
            case ast.UAdd():
                return value
            case ast.Not():
                return Value(BOOL, f"!{_bracketed(value)}")
        return self.fail(node, f"{type(node.op).__name__} is not translated")

    def _binop(self, node: ast.BinOp) -> Operand:
        left, right = self.in_order([node.left, node.right])
        return self.arithmetic(node.op, left, right, node)

    def arithmetic(self, op: ast.operator, left: Operand, right: Operand, node: ast.AST) -> Operand:
        """Return what an operator makes of two numbers."""
        if isinstance(op, ast.Pow):
            return self._power(left, right, node)
        a, b = self.scalar(left, node), self.scalar(right, node)
        if UINT in (a.type, b.type):
            sign = _BITS.get(type(op)) or _ARITHMETIC.get(type(op))
            if sign is None or a.type != b.type:
                self.fail(node, "an operation on uint64 and another type")
            return Value(UINT, f"{_bracketed(a)} {sign} {_bracketed(b)}")
        if isinstance(op, ast.Div):
            return Value(DOUBLE, f"{_bracketed(a, DOUBLE)} / {_bracketed(b, DOUBLE)}")
        kind = unified(unified(a.type, b.type), INT)
        if type(op) in _ARITHMETIC:
            return Value(kind, f"{_bracketed(a, kind)} {_ARITHMETIC[type(op)]} {_bracketed(b, kind)}")
        if kind == INT and isinstance(op, ast.Mod | ast.FloorDiv):
            return Value(INT, f"{'floor_mod' if isinstance(op, ast.Mod) else 'floor_div'}({a.code}, {b.code})")
        return self.fail(node, f"{type(op).__name__} of {name_of(kind)}")

    def _power(self, base: Operand, exponent: Operand, node: ast.AST) -> Value:
        a = self.scalar(base, node)
        if isinstance(exponent, Known) and isinstance(exponent.value, int) and 1 <= exponent.value <= _LARGEST_POWER:
            if not a.simple:
                a = self.temporary(a.type, a.code)
            result, factor, n = "", _bracketed(a), exponent.value
            while n:  # as Numba multiplies
                if n & 1:
                    result = f"{result} * {factor}" if result else factor
                n >>= 1
                factor = f"({factor} * {factor})"
            return Value(a.type, result if result[0] != "(" else result[1:-1])
        b = self.scalar(exponent, node)
        return Value(DOUBLE, f"pow({self.converted(a, DOUBLE)}, {self.converted(b, DOUBLE)})")

    def _compare(self, node: ast.Compare) -> Operand:
        operands = self.in_order([node.left, *node.comparators])
        if isinstance(node.ops[0], ast.In | ast.NotIn) and len(node.ops) == 1:
            value = self.scalar(operands[0], node)
            value = value if value.simple else self.temporary(value.type, value.code)
            found = [f"{value.code} == {self.scalar(x, node).code}" for x in self.items_of(operands[1], node)]
            code = " || ".join(found) if found else "false"
            return Value(BOOL, f"!({code})" if isinstance(node.ops[0], ast.NotIn) else code)
        values = [self.scalar(operand, node) for operand in operands]
        for i in range(1, len(values) - 1):
            values[i] = values[i] if values[i].simple else self.temporary(values[i].type, values[i].code)
        parts = []
        for op, a, b in zip(node.ops, values, values[1:], strict=False):
            if type(op) not in _COMPARED:
                self.fail(node, f"{type(op).__name__} is not translated")
            kind = a.type if a.type == b.type else unified(a.type, b.type)
            parts.append(f"{_bracketed(a, kind)} {_COMPARED[type(op)]} {_bracketed(b, kind)}")
        return Value(BOOL, parts[0] if len(parts) == 1 else " && ".join(f"({part})" for part in parts))

    def _boolop(self, node: ast.BoolOp) -> Operand:
        sign = "&&" if isinstance(node.op, ast.And) else "||"
        result = self.truth(node.values[0])
        for other in node.values[1:]:
            mark = len(self.lines)
            value = self.truth(other)
            if len(self.lines) == mark:
                result = Value(BOOL, f"{_bracketed(result)} {sign} {_bracketed(value)}")
                continue
            later, self.lines[mark:] = self.lines[mark:], []
            held = self.temporary(BOOL, result.code)
            condition = held.code if sign == "&&" else f"!{held.code}"
            self.lines += [f"if ({condition}) {{", *later, f"{held.code} = {value.code};", "}"]
            result = held
        return result

    def truth(self, node: ast.expr) -> Value:
        """Return an expression as a truth value."""
        value = self.scalar(self.expression(node), node)
        return value if value.type == BOOL else Value(BOOL, f"{_bracketed(value)} != 0")

    def _ifexp(self, node: ast.IfExp) -> Operand:
        condition = self.truth(node.test)
        branches = []
        for branch in (node.body, node.orelse):
            mark = len(self.lines)
            operand = self.expression(branch)
            needed, self.lines[mark:] = self.lines[mark:], []
            branches.append((needed, operand))
        (first, a), (second, b) = branches
        if isinstance(a, Items) and isinstance(b, Items) and not (first or second):
            held = condition if condition.simple else self.temporary(BOOL, condition.code)
            return Items(tuple(self._chosen(held, x, y, node) for x, y in zip(a.items, b.items, strict=True)))
        if not (first or second):
            return self._chosen(condition, a, b, node)
        x, y = self.value(a, node), self.value(b, node)
        kind = unified(x.type, y.type)
        held = self.temporary(kind, "")
        self.lines += [f"if ({condition.code}) {{", *first, f"{held.code} = {self.converted(x, kind)};", "} else {"]
        self.lines += [*second, f"{held.code} = {self.converted(y, kind)};", "}"]
        return held

    def _chosen(self, condition: Value, a: Operand, b: Operand, node: ast.AST) -> Value:
        x, y = self.value(a, node), self.value(b, node)
        try:
            kind = unified(x.type, y.type)
        except TypeError as error:
            self.fail(node, str(error))
        return Value(kind, f"{_bracketed(condition)} ? {_bracketed(x, kind)} : {_bracketed(y, kind)}")

    # ---- arrays ----

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
        if isinstance(places[0], ast.Slice) and len(places) == 1 and kind.ndim == 1:
            return self._sliced(array, places[0])
        if all(isinstance(place, ast.Slice) for place in places) and all(map(_is_whole, places)):
            return array
        indices = [None if isinstance(place, ast.Slice) else place for place in places]
        indices += [None] * (kind.ndim - len(indices))
        if any(isinstance(place, ast.Slice) and not _is_whole(place) for place in places):
            self.fail(node, "a slice of one of several dimensions")
        found = [None if n is None else self.index(array, axis, n) for axis, n in enumerate(indices)]
        strides = [self._stride(array, axis) for axis in range(kind.ndim)]
        at = " + ".join(_product(n, stride) for n, stride in zip(found, strides, strict=True) if n is not None)
        left = [axis for axis, n in enumerate(found) if n is None]
        if not left:
            return Value(kind.item, f"{array.code}.data[{at}]")
        contiguous = kind.contiguous and left == list(range(kind.ndim - len(left), kind.ndim))
        view = Array(kind.item, len(left), contiguous)
        sizes = [f"{array.code}.n{axis}" for axis in left] + ([] if contiguous else [strides[axis] for axis in left])
        return Value(view, f"({self.c(view)}){{{array.code}.data + {at}, {', '.join(sizes)}}}")

    def index(self, array: Value, axis: int, node: ast.expr) -> str:
        """Return an index of an array; one that is a negative constant counts from the end."""
        operand = self.expression(node)
        if isinstance(operand, Known) and isinstance(operand.value, int) and operand.value < 0:
            return f"({array.code}.n{axis} - {-operand.value})"
        value = self.scalar(operand, node)
        if value.type not in (INT, BOOL):
            self.fail(node, f"an index of type {name_of(value.type)}")
        return _bracketed(value)

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

    # ---- calls ----

    def _call(self, node: ast.Call) -> Operand:
        called = self.expression(node.func)
        if not isinstance(called, Known):
            self.fail(node, "a call of what is no function")
        function = called.value
        if node.keywords and not hasattr(function, "_fields"):
            self.fail(node, "an argument by its name")
        if getattr(function, "__name__", "") == "call" and "jit" in getattr(function, "__module__", ""):
            _, target, arguments = self.in_order(node.args)
            assert isinstance(target, Known)
            return self.call_translated(_plain(target.value), self.items_of(arguments, node), node)
        operands = self.in_order([*node.args, *(keyword.value for keyword in node.keywords)])
        name = getattr(function, "__name__", "")
        if name == "zeros" and "stack_array" in function.__module__:
            shape = [operand.value for operand in operands if isinstance(operand, Known)]
            if len(shape) != len(operands):
                self.fail(node, "zeros of a shape that is not written as numbers")
            return self.make_zeros(tuple(shape))
        if hasattr(function, "_fields"):
            return self.make_record(function, [self.value(operand, node) for operand in operands])
        if function in (min, max):
            return self._extreme(function, operands, node)
        if function is abs:
            value = self.scalar(operands[0], node)
            return Value(value.type, f"{'fabs' if value.type == DOUBLE else 'llabs'}({value.code})")
        if function in _CAST:
            value = self.scalar(operands[0], node)
            kind = _CAST[function]
            return Value(kind, f"{_bracketed(value)} != 0" if kind == BOOL != value.type else self.converted(value, kind))
        if _is_of(function, _MODULES) or isinstance(function, np.ufunc):
            return self._of_math(name, operands, node)
        function = _plain(function)
        if isinstance(function, python_types.FunctionType):
            return self.call_translated(function, operands, node)
        return self.fail(node, f"a call of {name or function!r}")

    def _of_math(self, name: str, operands: Sequence[Operand], node: ast.AST) -> Value:
        codes = [self.converted(self.scalar(operand, node), DOUBLE) for operand in operands]
        if name in _TESTS:
            return Value(BOOL, f"{_TESTS[name]}({', '.join(codes)}) != 0")
        if name in _MATH:
            return Value(DOUBLE, f"{_MATH[name]}({', '.join(codes)})")
        return self.fail(node, f"{name} has no C here")

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


def _number(x: float) -> str:
    if math.isnan(x):
        return "NAN"
    if math.isinf(x):
        return "INFINITY" if x > 0.0 else "(-INFINITY)"
    return repr(float(x)) if x >= 0.0 and math.copysign(1.0, x) > 0.0 else f"({float(x)!r})"


def _bracketed(value: Value, kind: Type | None = None) -> str:
    """Return a value's code as an operand: with brackets around it unless it is a name, a number or a call."""
    code = value.code
    if kind is not None and kind != value.type and isinstance(kind, Scalar):
        code = f"({kind.c})({code})"
        return code
    plain = code.replace("_", "").replace(".", "").replace("->", "")
    return code if plain.isalnum() else f"({code})"


def _product(index: str, stride: str) -> str:
    return index if stride == "1" else f"{index} * ({stride})" if " " in stride else f"{index} * {stride}"


def _is_whole(node: ast.expr) -> bool:
    return isinstance(node, ast.Slice) and node.lower is None and node.upper is None and node.step is None


def _plain(function: Any) -> Any:
    """Return the function as it is written, of a compiled one."""
    return getattr(function, "py_func", function)


def _is_of(function: Any, modules: Sequence[Any]) -> bool:
    return any(getattr(module, getattr(function, "__name__", ""), None) is function for module in modules)


__all__ = ["Expressions", "Items", "Known", "Nothing", "Operand", "Record", "TranslationError", "Value"]
