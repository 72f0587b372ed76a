"""Translate statements to C."""

from __future__ import annotations

import ast
from collections.abc import Sequence

from controller.translator.calls import Calls
from controller.translator.operands import Items, Known, Operand, Value
from controller.translator.types import BOOL, INT, Array, Nothing, Record, Scalar, Tuple, Type, name_of, unified


class Statements(Calls):
    """Translate the statements of one function into `lines`."""

    parameters: list[str]
    declared: dict[str, str]  # declarations of variables that Python does not have
    result: Type

    def new_name(self, stem: str) -> str:
        """Return a name that no variable has."""
        raise NotImplementedError

    def statement(self, node: ast.stmt) -> None:
        """Translate a statement."""
        method = getattr(self, f"_do_{type(node).__name__.lower()}", None)
        if method is None:
            self.fail(node, f"{type(node).__name__}")
        method(node)

    def _block(self, nodes: Sequence[ast.stmt]) -> None:
        for node in nodes:
            self.statement(node)

    def _do_expr(self, node: ast.Expr) -> None:
        if isinstance(node.value, ast.Constant):  # a docstring
            return
        if not isinstance(node.value, ast.Call):
            self.fail(node, "an expression without effect")
        mark = len(self.lines)
        result = self.expression(node.value)
        if isinstance(result, Value) and len(self.lines) > mark and self.lines[-1].startswith(f"{result.code} = "):
            self.lines[-1] = f"(void){self.lines[-1].removeprefix(f'{result.code} = ')}"
            del self.declared[result.code]

    def _do_pass(self, node: ast.Pass) -> None:
        pass

    def _do_break(self, node: ast.Break) -> None:
        self.lines.append("break;")

    def _do_continue(self, node: ast.Continue) -> None:
        self.lines.append("continue;")

    def _do_return(self, node: ast.Return) -> None:
        if node.value is None:
            self.lines.append("return;")
            return
        value = self.value(self.expression(node.value), node)
        if isinstance(value.type, Array | Record):
            self.fail(node, f"{name_of(value.type)} that is returned")
        self.result = value.type if isinstance(self.result, Nothing) else self._unified(self.result, value.type, node)
        self.lines.append(f"return {self._as(value, self.result, node)};")

    def _unified(self, one: Type, other: Type, node: ast.AST) -> Type:
        try:
            return unified(one, other)
        except TypeError as error:
            self.fail(node, str(error))

    def _as(self, value: Value, kind: Type, node: ast.AST) -> str:
        """Return a value's C expression, converted to a type that holds it."""
        if isinstance(kind, Tuple) and value.type != kind:
            items = [self.value(item, node) for item in self.items_of(value, node)]
            return self.compound(kind, [self._as(v, k, node) for v, k in zip(items, kind.items, strict=True)])
        return self.converted(value, kind)

    def _do_annassign(self, node: ast.AnnAssign) -> None:
        if node.value is not None:
            self._assign(node.target, self.expression(node.value), node)

    def _do_assign(self, node: ast.Assign) -> None:
        value = self.expression(node.value)
        if len(node.targets) > 1 and isinstance(value, Value) and not value.simple:
            value = self.temporary(value.type, value.code)
        for target in node.targets:
            self._assign(target, value, node)

    def _assign(self, target: ast.expr, operand: Operand, node: ast.AST) -> None:
        if isinstance(target, ast.Tuple):
            items = self.items_of(operand, node)
            if len(items) != len(target.elts):
                self.fail(node, f"{len(items)} items for {len(target.elts)} names")
            if isinstance(operand, Items):  # all are computed before any is written
                items = [self._fixed(item) for item in items]
            for element, item in zip(target.elts, items, strict=True):
                self._assign(element, item, node)
        elif isinstance(target, ast.Name):
            self._name_it(target.id, operand, node)
        elif isinstance(target, ast.Subscript):
            self._write(target, operand, node)
        else:
            self.fail(node, f"a value for {type(target).__name__}")

    def _fixed(self, operand: Operand) -> Operand:
        if isinstance(operand, Items):
            return Items(tuple(map(self._fixed, operand.items)))
        if isinstance(operand, Value) and isinstance(operand.type, Scalar):
            return self.temporary(operand.type, operand.code)
        return operand

    def _name_it(self, name: str, operand: Operand, node: ast.AST) -> None:
        if name == "_":
            return
        value = self.value(operand, node)
        kind = self._unified(self.names[name], value.type, node) if name in self.names else value.type
        if name in self.parameters and kind != self.names[name]:
            self.fail(node, f"another type for the parameter {name}")
        self.names[name] = kind
        self.lines.append(f"{self.variable(name)} = {self._as(value, kind, node)};")

    def _place(self, target: ast.Subscript) -> Value:
        array = self.value(self.expression(target.value), target)
        if not isinstance(array.type, Array):
            self.fail(target, f"an item of {name_of(array.type)} that is written")
        places = list(target.slice.elts) if isinstance(target.slice, ast.Tuple) else [target.slice]
        return self.element(array, places, target)

    def _write(self, target: ast.Subscript, operand: Operand, node: ast.AST) -> None:
        value = self.value(operand, node)
        mark = len(self.lines)
        lvalue = self._place(target)
        if len(self.lines) > mark and not value.simple:  # the value is computed before the index
            later, self.lines[mark:] = self.lines[mark:], []
            value = self.temporary(value.type, value.code)
            self.lines += later
        if isinstance(lvalue.type, Scalar):
            self.lines.append(f"{lvalue.code} = {self.converted(value, lvalue.type)};")
            return
        assert isinstance(lvalue.type, Array)
        if isinstance(value.type, Array):
            self.lines.append(f"{self.c(lvalue.type)}_copy({lvalue.code}, {value.code});")
        else:
            self.lines.append(f"{self.c(lvalue.type)}_fill({lvalue.code}, {self.converted(value, lvalue.type.item)});")

    def _do_augassign(self, node: ast.AugAssign) -> None:
        if isinstance(node.target, ast.Name):
            old = self.expression(ast.copy_location(ast.Name(node.target.id, ast.Load()), node))
            mark = len(self.lines)
            other = self.expression(node.value)
            if len(self.lines) > mark:
                later, self.lines[mark:] = self.lines[mark:], []
                kept = self.value(old, node)
                old = self.temporary(kept.type, kept.code)
                self.lines += later
            self._name_it(node.target.id, self.arithmetic(node.op, old, other, node), node)
            return
        if not isinstance(node.target, ast.Subscript):
            self.fail(node, "an operation on what is no name and no item")
        lvalue = self._place(node.target)
        if not isinstance(lvalue.type, Scalar):
            self.fail(node, "an operation on a whole array")
        mark = len(self.lines)
        other = self.expression(node.value)
        before: Value = lvalue
        if len(self.lines) > mark:
            later, self.lines[mark:] = self.lines[mark:], []
            before = self.temporary(lvalue.type, lvalue.code)
            self.lines += later
        value = self.scalar(self.arithmetic(node.op, before, other, node), node)
        self.lines.append(f"{lvalue.code} = {self.converted(value, lvalue.type)};")

    def _do_if(self, node: ast.If) -> None:
        test = self.expression(node.test)
        if isinstance(test, Known):
            self._block(node.body if test.value else node.orelse)
            return
        self.lines.append(f"if ({self._truth_of(test, node)}) {{")
        self._block(node.body)
        if node.orelse:
            self.lines.append("} else {")
            self._block(node.orelse)
        self.lines.append("}")

    def _truth_of(self, operand: Operand, node: ast.AST) -> str:
        value = self.scalar(operand, node)
        return value.code if value.type == BOOL else f"{value.code} != 0"

    def _do_while(self, node: ast.While) -> None:
        if node.orelse:
            self.fail(node, "else of a loop")
        mark = len(self.lines)
        condition = self.condition(node.test).code
        if len(self.lines) == mark:
            self.lines.append(f"while ({condition}) {{")
        else:
            needed, self.lines[mark:] = self.lines[mark:], []
            self.lines += ["for (;;) {", *needed, f"if (!({condition})) {{", "break;", "}"]
        self._block(node.body)
        self.lines.append("}")

    def _do_for(self, node: ast.For) -> None:
        if node.orelse:
            self.fail(node, "else of a loop")
        called = node.iter.func if isinstance(node.iter, ast.Call) else None
        if isinstance(called, ast.Name) and called.id == "range":
            self._count_up(node, node.iter.args)  # type: ignore[attr-defined]
            return
        if any(isinstance(inner, ast.Break | ast.Continue) for inner in ast.walk(node)):
            self.fail(node, "break or continue in a loop over a tuple")
        if isinstance(called, ast.Name) and called.id == "enumerate":
            items = self.items_of(self.expression(node.iter.args[0]), node)  # type: ignore[attr-defined]
            each: list[Operand] = [Items((Known(i), item)) for i, item in enumerate(items)]
        else:
            each = self.items_of(self.expression(node.iter), node)
        for item in each:  # one after the other
            self._assign(node.target, item, node)
            self._block(node.body)

    def _count_up(self, node: ast.For, bounds: Sequence[ast.expr]) -> None:
        if not isinstance(node.target, ast.Name):
            self.fail(node, "a loop over numbers into what is no name")
        operands = self.in_order(bounds)
        step = operands[2] if len(operands) == 3 else Known(1)
        if not isinstance(step, Known) or not isinstance(step.value, int) or not step.value:
            self.fail(node, "a step of a loop that is no constant")
        first = self.scalar(operands[0], node).code if len(operands) > 1 else "0"
        last = self.scalar(operands[-1] if len(operands) < 3 else operands[1], node)
        end = last.code if isinstance(operands[0 if len(operands) == 1 else 1], Known) else self._end(last)
        name = node.target.id
        counter = self.new_name("i") if name == "_" or _is_written(name, node.body) else ""
        if name != "_":
            self.names.setdefault(name, INT)
            if self.names[name] != INT:
                self.fail(node, f"{name}, which counts and is {name_of(self.names[name])} elsewhere")
        variable = counter or self.variable(name)
        if counter:
            self.declared[counter] = f"int64_t {counter};"
        sign, change = ("<", f"{variable} += {step.value}") if step.value > 0 else (">", f"{variable} -= {-step.value}")
        self.lines.append(f"for ({variable} = {first}; {variable} {sign} {end}; {change}) {{")
        if counter and name != "_":
            self.lines.append(f"{self.variable(name)} = {counter};")
        self._block(node.body)
        self.lines.append("}")

    def _end(self, last: Value) -> str:
        return self.temporary(INT, last.code).code


def _is_written(name: str, body: Sequence[ast.stmt]) -> bool:
    names = (inner for statement in body for inner in ast.walk(statement))
    return any(isinstance(n, ast.Name) and n.id == name and isinstance(n.ctx, ast.Store) for n in names)
