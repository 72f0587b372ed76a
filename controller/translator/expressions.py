"""Translate expressions of numbers to C, in Python's order of evaluation and rounding."""

from __future__ import annotations

import ast
import operator
from typing import Any

from controller.translator.array_expressions import ArrayExpressions
from controller.translator.operands import Items, Known, LazyArray, Operand, Value, View, in_brackets
from controller.translator.types import BOOL, DOUBLE, INT, UINT, Array, Record, Type, common_type, name_of

_ARITHMETIC = {ast.Add: "+", ast.Sub: "-", ast.Mult: "*"}
_FOLDED = {ast.Add: operator.add, ast.Sub: operator.sub, ast.Mult: operator.mul}  # of integers that are known
_BITS = {ast.BitXor: "^", ast.BitAnd: "&", ast.BitOr: "|", ast.LShift: "<<", ast.RShift: ">>"}
_COMPARED = {ast.Lt: "<", ast.LtE: "<=", ast.Gt: ">", ast.GtE: ">=", ast.Eq: "==", ast.NotEq: "!="}
_LARGEST_POWER = 8  # greatest exponent that is multiplied out


class Expressions(ArrayExpressions):
    """Translate names, numbers, operators and choices."""

    def expression(self, node: ast.expr) -> Operand:
        """Return the operand of an expression."""
        method = getattr(self, f"_{type(node).__name__.lower()}", None)
        if method is None:
            self.fail(node, f"{type(node).__name__} is not translated")
        operand: Operand = method(node)
        return operand

    def _constant(self, node: ast.Constant) -> Operand:
        return Known(node.value)

    def _name(self, node: ast.Name) -> Operand:
        if node.id in self.names:
            roots, code = self.roots.get(node.id, frozenset()), self.variable(node.id)
            return self.variable_value(self.names[node.id], code, True, roots, (node.id,))
        if node.id in self.globals:
            return Known(self.global_value(node.id))
        builtins: Any = self.globals["__builtins__"]
        builtin = builtins.get(node.id) if isinstance(builtins, dict) else getattr(builtins, node.id, None)
        if builtin is None:
            self.fail(node, f"{node.id} is not known here")
        return Known(builtin)

    def _attribute(self, node: ast.Attribute) -> Operand:
        owner = self.expression(node.value)
        match owner:
            case Known(value):
                return Known(getattr(value, node.attr))
            case Value(Record() as kind) if node.attr in kind.fields:
                return self.field(owner, node.attr)
            case View() | LazyArray() if node.attr == "size":
                return _length(self.product(owner.sizes))
            case View() | LazyArray() if node.attr == "shape":
                return Items(tuple(map(_length, owner.sizes)))
        if node.attr == "T" and self.is_array(owner):
            return self.transpose(owner, node)
        return self.fail(node, f"attribute {node.attr}")

    def field(self, record: Value, name: str) -> Value:
        """Return a field of a named tuple."""
        assert isinstance(record.type, Record)
        item, inside = record.type.items[record.type.fields.index(name)], f"{in_brackets(record)}->{name}"
        paths = tuple(f"{root}.{name}" for root in sorted(record.roots))
        roots = frozenset().union(*(self.made.get(path, {path}) for path in paths))
        return self.variable_value(item, f"(&{inside})" if isinstance(item, Record) else inside, True, roots, paths)

    def _tuple(self, node: ast.Tuple) -> Operand:
        return Items(tuple(self.in_order(node.elts)))

    def _unaryop(self, node: ast.UnaryOp) -> Operand:
        operand = self.expression(node.operand)
        if isinstance(operand, Known) and not isinstance(node.op, ast.Not):
            return Known(-operand.value if isinstance(node.op, ast.USub) else operand.value)
        if self.is_array(operand) and isinstance(node.op, ast.USub):
            grid = self.grid(operand, node)
            return self.elementwise(lambda x: Value(grid.item, f"-{in_brackets(x[0])}"), [grid], grid.item, node)
        value = self.scalar(operand, node)
        match node.op:
            case ast.USub():
                return Value(value.type if value.type != BOOL else INT, f"-{in_brackets(value)}")
            case ast.UAdd():
                return value
            case ast.Not():
                return Value(BOOL, f"!{in_brackets(value)}")
        return self.fail(node, f"{type(node.op).__name__} is not translated")

    def _binop(self, node: ast.BinOp) -> Operand:
        left, right = self.in_order([node.left, node.right])
        fold = _FOLDED.get(type(node.op))
        if (
            fold
            and isinstance(left, Known)
            and isinstance(right, Known)
            and type(left.value) is type(right.value) is int
        ):
            return Known(fold(left.value, right.value))
        return self.arithmetic(node.op, left, right, node)

    def arithmetic(self, op: ast.operator, left: Operand, right: Operand, node: ast.AST) -> Operand:
        """Return the result of an operator on two numbers or arrays."""
        if self.is_array(left) or self.is_array(right):
            return self.apply_operator(op, left, right, node)
        if isinstance(op, ast.Pow):
            return self._power(left, right, node)
        a, b = self.scalar(left, node), self.scalar(right, node)
        if UINT in (a.type, b.type):
            sign = _BITS.get(type(op)) or _ARITHMETIC.get(type(op))
            if sign is None or a.type != b.type:
                self.fail(node, "an operation on uint64 and another type")
            return Value(UINT, f"{in_brackets(a)} {sign} {in_brackets(b)}")
        if isinstance(op, ast.Div):
            return Value(DOUBLE, f"{in_brackets(a, DOUBLE)} / {in_brackets(b, DOUBLE)}")
        if a.type == b.type == BOOL and isinstance(op, ast.Mult):
            return Value(BOOL, f"{in_brackets(a)} && {in_brackets(b)}")
        kind = common_type(common_type(a.type, b.type), INT)
        if type(op) in _ARITHMETIC and not a.type == b.type == BOOL:  # a sum of those of NumPy is at most 1
            return Value(kind, f"{in_brackets(a, kind)} {_ARITHMETIC[type(op)]} {in_brackets(b, kind)}")
        if kind == INT and isinstance(op, ast.Mod | ast.FloorDiv):
            return Value(INT, f"{'floor_mod' if isinstance(op, ast.Mod) else 'floor_div'}({a.code}, {b.code})")
        return self.fail(node, f"{type(op).__name__} of {name_of(a.type)} and {name_of(b.type)}")

    def _power(self, base: Operand, exponent: Operand, node: ast.AST) -> Value:
        a = self.scalar(base, node)
        if isinstance(exponent, Known) and isinstance(exponent.value, int) and 1 <= exponent.value <= _LARGEST_POWER:
            if not a.simple:
                a = self.temporary(a.type, a.code)
            result, factor, n = "", in_brackets(a), exponent.value
            while n:  # repeated squaring
                if n & 1:
                    result = f"{result} * {factor}" if result else factor
                n >>= 1
                factor = f"({factor} * {factor})"
            return Value(a.type, result if result[0] != "(" else result[1:-1])
        b = self.scalar(exponent, node)
        return Value(DOUBLE, f"pow({self.convert(a, DOUBLE)}, {self.convert(b, DOUBLE)})")

    def _compare(self, node: ast.Compare) -> Operand:
        operands = self.in_order([node.left, *node.comparators])
        if isinstance(node.ops[0], ast.In | ast.NotIn) and len(node.ops) == 1:
            value = self.scalar(operands[0], node)
            value = value if value.simple else self.temporary(value.type, value.code)
            equalities = [f"{value.code} == {self.scalar(x, node).code}" for x in self.items_of(operands[1], node)]
            code = " || ".join(equalities) if equalities else "false"
            return Value(BOOL, f"!({code})" if isinstance(node.ops[0], ast.NotIn) else code)
        if len(operands) == 2 and any(map(self.is_array, operands)):
            return self.elementwise(lambda x: self._compare_values(node, x), operands, BOOL, node)
        return self._compare_values(node, [self.scalar(operand, node) for operand in operands])

    def _compare_values(self, node: ast.Compare, values: list[Value]) -> Value:
        for i in range(1, len(values) - 1):
            values[i] = values[i] if values[i].simple else self.temporary(values[i].type, values[i].code)
        parts = []
        for op, a, b in zip(node.ops, values, values[1:], strict=False):
            if type(op) not in _COMPARED:
                self.fail(node, f"{type(op).__name__} is not translated")
            kind = a.type if a.type == b.type else common_type(a.type, b.type)
            parts.append(f"{in_brackets(a, kind)} {_COMPARED[type(op)]} {in_brackets(b, kind)}")
        return Value(BOOL, parts[0] if len(parts) == 1 else " && ".join(f"({part})" for part in parts))

    def _boolop(self, node: ast.BoolOp) -> Operand:
        sign = "&&" if isinstance(node.op, ast.And) else "||"
        result = self.condition(node.values[0])
        for other in node.values[1:]:
            value, needed, _ = self.evaluate_separately(self.condition, other)
            if not needed:
                result = Value(BOOL, f"{in_brackets(result)} {sign} {in_brackets(value)}")
                continue
            held = self.temporary(BOOL, result.code)
            condition = held.code if sign == "&&" else f"!{held.code}"
            self.lines += [f"if ({condition}) {{", *needed, f"{held.code} = {value.code};", "}"]
            result = held
        return result

    def condition(self, node: ast.expr) -> Value:
        """Return an expression as a truth value."""
        value = self.scalar(self.expression(node), node)
        return value if value.type == BOOL else Value(BOOL, f"{in_brackets(value)} != 0")

    def _ifexp(self, node: ast.IfExp) -> Operand:
        condition = self.condition(node.test)
        (a, first, _), (b, second, _) = (
            self.evaluate_separately(self._evaluate_stored, branch) for branch in (node.body, node.orelse)
        )
        if isinstance(a, Items) and isinstance(b, Items) and not (first or second):
            result = condition if condition.simple else self.temporary(BOOL, condition.code)
            return Items(tuple(self._choose(result, x, y, node) for x, y in zip(a.items, b.items, strict=True)))
        if not (first or second):
            return self._choose(condition, a, b, node)
        x, y = self.value(a, node), self.value(b, node)
        kind = self.unify(x.type, y.type, node)
        result = self.new_variable(kind, "", x, y)
        self.lines += [f"if ({condition.code}) {{", *first, f"{result.code} = {self.convert(x, kind)};", "} else {"]
        self.lines += [*second, f"{result.code} = {self.convert(y, kind)};", "}"]
        return result

    def _evaluate_stored(self, node: ast.expr) -> Operand:
        operand = self.expression(node)
        return self.materialize(operand, node) if isinstance(operand, LazyArray) else operand

    def unify(self, one: Type, other: Type, node: ast.AST) -> Type:
        """Return the type that holds values of both."""
        try:
            return common_type(one, other)
        except TypeError as error:
            self.fail(node, str(error))

    def _choose(self, condition: Value, a: Operand, b: Operand, node: ast.AST) -> Value:
        x, y = self.value(a, node), self.value(b, node)
        kind = self.unify(x.type, y.type, node)
        if isinstance(kind, Array | Record):
            codes = [self.convert(v, kind) for v in (x, y)]
            return self.new_variable(kind, f"{in_brackets(condition)} ? {codes[0]} : {codes[1]}", x, y)
        roots = x.roots | y.roots
        return Value(kind, f"{in_brackets(condition)} ? {in_brackets(x, kind)} : {in_brackets(y, kind)}", False, roots)


def _length(code: str) -> Operand:
    return Known(int(code)) if code.isdigit() else Value(INT, code, "*" not in code and "(" not in code)
