"""Translate statements to C."""

from __future__ import annotations

import ast
from collections.abc import Sequence
from dataclasses import replace

from controller.translator.array_views import known_shape
from controller.translator.calls import Calls
from controller.translator.operands import Items, Known, LazyArray, Operand, Value, View
from controller.translator.types import (
    BOOL,
    DOUBLE,
    INT,
    Array,
    Nothing,
    Record,
    Scalar,
    Tuple,
    Type,
    name_of,
    return_type,
)


class Statements(Calls):
    """Translate the statements of one function into `lines`."""

    parameters: list[str]
    result: Type
    loops: list[ast.stmt]  # that the statement is in
    later: list[Sequence[ast.stmt]]  # statements that follow in each of the blocks that the statement is in

    def statement(self, node: ast.stmt) -> None:
        """Translate a statement."""
        self.current = node
        method = getattr(self, f"_do_{type(node).__name__.lower()}", None)
        if method is None:
            self.fail(node, f"{type(node).__name__}")
        method(node)

    def _block(self, nodes: Sequence[ast.stmt]) -> None:
        for i, node in enumerate(nodes):
            self.later.append(nodes[i + 1 :])
            self.statement(node)
            self.later.pop()

    def check_alias(self, name: str, value: View, node: ast.AST) -> None:
        """Refuse a second name of storage that the next iteration of a loop overwrites, if it is read there again."""
        # Python makes a new array each time. The name must be read only after it was assigned in the same iteration.
        after = {id(inner) for statement in self.later[-1] for inner in ast.walk(statement)}
        for loop in self.loops:
            inside = set(map(id, ast.walk(loop)))
            places = {id(self.made_at[root]) for root in value.roots if root in self.made_at}
            reads = [
                n for n in ast.walk(loop) if isinstance(n, ast.Name) and n.id == name and isinstance(n.ctx, ast.Load)
            ]
            if places & inside and (places & after or any(id(read) not in after for read in reads)):
                self.fail(node, f"{name}, an alias of an array that the loop makes anew")

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
        operand = self.expression(node.value)
        if isinstance(operand, View) and not self.is_local(operand.roots):
            self.fail(node, "a view of an argument that is returned, instead of a copy")
        if self.is_array(operand):
            self._return_array(self.grid(operand, node), node)
            return
        value = self.value(operand, node)
        if isinstance(value.type, Record) or (isinstance(value.type, Tuple) and _holds_array(value.type)):
            self.fail(node, f"{name_of(value.type)} that is returned")
        self.result = value.type if isinstance(self.result, Nothing) else self.unify(self.result, value.type, node)
        self.lines.append(f"return {self._code_as(value, self.result, node)};")

    def _return_array(self, grid: LazyArray, node: ast.Return) -> None:
        """Return an array by value, as a tuple of its numbers."""
        shape = known_shape(grid.sizes)
        if shape is None or grid.item != DOUBLE:
            self.fail(node, "an array that is returned, of a length that is known only at run time")
        kind = Array(DOUBLE, shape)
        self.result = kind if isinstance(self.result, Nothing) else self.unify(self.result, kind, node)
        if self.result != kind:
            self.fail(node, "arrays of two shapes that are returned")
        name = self.new_name("result")
        self.declared[name] = f"{self.c(return_type(kind))} {name};"
        self.store(self.view_of_storage(f"{name}.f", DOUBLE, shape), grid, node)
        self.lines.append(f"return {name};")

    def _code_as(self, value: Value, kind: Type, node: ast.AST) -> str:
        """Return a value's C expression, converted to a type that holds it."""
        if isinstance(kind, Tuple) and value.type != kind:
            items = [self.value(item, node) for item in self.items_of(value, node)]
            return self.tuple_expression(
                kind, [self._code_as(v, k, node) for v, k in zip(items, kind.items, strict=True)]
            )
        return self.convert(value, kind)

    def _do_annassign(self, node: ast.AnnAssign) -> None:
        if node.value is not None:
            self._assign(node.target, self.expression(node.value), node)

    def _do_assign(self, node: ast.Assign) -> None:
        value = self.expression(node.value)
        if len(node.targets) > 1 and isinstance(value, LazyArray):
            value = self.materialize(value, node)
        elif len(node.targets) > 1 and isinstance(value, Value) and not value.simple:
            value = self.new_variable(value.type, value.code, value)
        for target in node.targets:
            self._assign(target, value, node)

    def _assign(self, target: ast.expr, operand: Operand, node: ast.AST) -> None:
        if isinstance(target, ast.Tuple):
            items = self.items_of(operand, node)
            if len(items) != len(target.elts):
                self.fail(node, f"{len(items)} items for {len(target.elts)} names")
            if isinstance(operand, Items | View):  # all are computed before any is written
                items = [self._store_items(item, element) for item, element in zip(items, target.elts, strict=True)]
            for element, item in zip(target.elts, items, strict=True):
                self._assign(element, item, node)
        elif isinstance(target, ast.Name):
            self._bind(target.id, operand, node)
        elif isinstance(target, ast.Subscript | ast.Attribute):
            self._write(target, operand, node)
        else:
            self.fail(node, f"a value for {type(target).__name__}")

    def _store_items(self, operand: Operand, target: ast.expr) -> Operand:
        if isinstance(operand, Items):
            return Items(tuple(self._store_items(item, target) for item in operand.items))
        if isinstance(operand, LazyArray):
            return self.materialize(operand, target)
        if isinstance(operand, Value) and isinstance(operand.type, Scalar | Array | Record):
            return self.new_variable(operand.type, operand.code, operand)
        return operand

    def _bind(self, name: str, operand: Operand, node: ast.AST) -> None:
        if name == "_":
            return
        value = self.materialize(operand, node, name) if isinstance(operand, LazyArray) else self.value(operand, node)
        kind = self.unify(self.names[name], value.type, node) if name in self.names else value.type
        if name in self.parameters:
            own = self.names[name]
            if isinstance(kind, Array) and isinstance(own, Array):
                shape = zip(own.shape, kind.shape, strict=True)
                kind = replace(kind, shape=tuple(None if n is None else m for n, m in shape))
            if kind != own:
                self.fail(node, f"another type for the parameter {name}")
            if isinstance(kind, Tuple) and _holds_array(kind):
                self.fail(node, f"new arrays in the parameter {name}")
        self.note_lengths(name, value, again=name in self.names)
        self.names[name] = kind
        self.roots[name] = self.roots.get(name, frozenset()) | value.roots
        if isinstance(value, View) and not value.fresh:
            self.check_alias(name, value, node)
        self.lines.append(f"{self.variable(name)} = {self._code_as(value, kind, node)};")

    def _target(self, target: ast.Subscript | ast.Attribute) -> Value:
        """Return the element, array or field that is written."""
        if isinstance(target, ast.Attribute):
            return self._field_target(target)
        array = self.expression(target.value)
        if isinstance(array, Value) and not isinstance(array, View):
            self.fail(target, f"an item of {name_of(array.type)} that is written")
        if not isinstance(array, View):
            self.fail(target, "an item of what is no array")
        self.writes_arguments = self.writes_arguments or not self.is_local(array.roots)
        places = list(target.slice.elts) if isinstance(target.slice, ast.Tuple) else [target.slice]
        return self.element(array, places, target)

    def _field_target(self, target: ast.Attribute) -> Value:
        owner = self.expression(target.value)
        if not isinstance(owner, Value) or not isinstance(owner.type, Record) or not owner.type.mutable:
            self.fail(target, f"a value for attribute {target.attr} of what is no State")
        if target.attr not in owner.type.fields:
            self.fail(target, f"{target.attr}, which {name_of(owner.type)} does not have")
        self.writes_arguments = True
        field = self.field(owner, target.attr)
        if not isinstance(field.type, Scalar | Array):
            self.fail(target, f"a value for {target.attr}, which is {name_of(field.type)}")
        return field

    def _write(self, target: ast.Subscript | ast.Attribute, operand: Operand, node: ast.AST) -> None:
        value = operand if self.is_array(operand) else self.value(operand, node)
        lvalue, needed, writes = self.evaluate_separately(self._target, target)
        if needed and not (isinstance(value, Value) and value.simple):  # the value is computed first
            value = self.freeze(value, node, writes)
        self.lines += needed
        if isinstance(lvalue, View):
            self.store(lvalue, value, node)
        else:
            self.lines.append(f"{lvalue.code} = {self.convert(self.scalar(value, node), lvalue.type)};")

    def _do_augassign(self, node: ast.AugAssign) -> None:
        target = node.target
        if isinstance(target, ast.Name):
            old = self.expression(ast.copy_location(ast.Name(target.id, ast.Load()), node))
        else:
            old = self._target(target)
        other, needed, _ = self.evaluate_separately(self.expression, node.value)
        target_value = self.value(old, node)
        before = self.temporary(target_value.type, target_value.code) if needed and not isinstance(old, View) else old
        self.lines += needed
        if isinstance(target_value, View):
            self.store(target_value, other, node, node.op)
        elif isinstance(target, ast.Name):
            self._bind(target.id, self.arithmetic(node.op, before, other, node), node)
        else:
            value = self.scalar(self.arithmetic(node.op, before, other, node), node)
            self.lines.append(f"{target_value.code} = {self.convert(value, target_value.type)};")

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
        condition, needed, _ = self.evaluate_separately(self.condition, node.test)
        if needed:
            self.lines += ["for (;;) {", *needed, f"if (!({condition.code})) {{", "break;", "}"]
        else:
            self.lines.append(f"while ({condition.code}) {{")
        self.loops.append(node)
        self._block(node.body)
        self.loops.pop()
        self.lines.append("}")

    def _do_for(self, node: ast.For) -> None:
        if node.orelse:
            self.fail(node, "else of a loop")
        self.loops.append(node)
        self._repeat(node)
        self.loops.pop()

    def _repeat(self, node: ast.For) -> None:
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
        end = last.code if isinstance(operands[0 if len(operands) == 1 else 1], Known) else self._loop_end(last)
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

    def _loop_end(self, last: Value) -> str:
        return self.temporary(INT, last.code).code


def _holds_array(kind: Tuple) -> bool:
    return any(isinstance(k, Array | Record) or (isinstance(k, Tuple) and _holds_array(k)) for k in kind.items)


def _is_written(name: str, body: Sequence[ast.stmt]) -> bool:
    names = (inner for statement in body for inner in ast.walk(statement))
    return any(isinstance(n, ast.Name) and n.id == name and isinstance(n.ctx, ast.Store) for n in names)
