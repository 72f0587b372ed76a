"""Statements: one function of Python, for arguments of some types, as a function of C."""

from __future__ import annotations

import ast
import inspect
import textwrap
from collections.abc import Callable, Sequence
from types import FunctionType
from typing import Any, NoReturn, Protocol

from controller.errors import TranslationError
from controller.translator.expressions import Expressions, Items, Known, Operand, Value
from controller.translator.types import BOOL, INT, Array, Nothing, Record, Scalar, Tuple, Type, name_of, unified

_KEPT = frozenset(
    "auto break case char const continue default do double else enum extern float for goto if inline int long register "
    "restrict return short signed sizeof static struct switch typedef union unsigned void volatile while bool true "
    "false NAN INFINITY gamma div free index j0 j1 jn y0 y1 yn time remove signal".split()
)
_PASSES = 6  # until the types of variables stand


class Functions(Protocol):
    """What a function that is translated asks of the program that it is part of."""

    def instance(self, function: FunctionType, arguments: tuple[Type, ...]) -> tuple[str, Type]:
        """Return the C name of a function for some arguments, and the type of what it returns."""
        ...

    def name(self, kind: Type) -> str:
        """Return the C name of a type."""
        ...


class Function(Expressions):
    """One function for arguments of some types.

    Parameters
    ----------
    program : Functions
        Which translates what it calls.
    function : function
        Plain Python.
    arguments : tuple of Type
        Of its parameters.
    """

    def __init__(self, program: Functions, function: FunctionType, arguments: tuple[Type, ...]) -> None:
        self._program, self._function = program, function
        self.globals = function.__globals__ | _captured(function)
        text = getattr(function, "source", None)
        self._file = inspect.getsourcefile(function) or "?"
        lines, self._first = ([text], 1) if text else inspect.getsourcelines(function)
        tree = ast.parse(textwrap.dedent("".join(lines))).body[0]
        if not isinstance(tree, ast.FunctionDef) or tree.args.kwonlyargs or tree.args.vararg or tree.args.kwarg:
            raise TranslationError(f"{self._file}:{self._first}: expected a function with parameters by their places")
        self._tree = tree
        self._parameters = [argument.arg for argument in tree.args.args]
        if len(self._parameters) != len(arguments):
            self.fail(tree, f"{tree.name} is given {len(arguments)} arguments, expected {len(self._parameters)}")
        self.names = dict(zip(self._parameters, arguments, strict=True))
        self._arguments = arguments
        self.result: Type = Nothing()

    def fail(self, node: ast.AST, what: str) -> NoReturn:
        """Refuse a construct by its place."""
        line = self._first + getattr(node, "lineno", 1) - 1
        raise TranslationError(f"{self._file}:{line}: {what}, which is not translated to C")

    def translate(self, name: str) -> str:
        """Return the function in C, under a name; its result's type is known then."""
        for _ in range(_PASSES):
            known, result = dict(self.names), self.result
            self.lines: list[str] = []
            self._declared: dict[str, str] = {}
            self._count = 0
            for statement in self._tree.body:
                self.statement(statement)
            if known == self.names and result == self.result:
                break
        else:
            self.fail(self._tree, "types that do not settle")
        variables = [
            f"{self._declaration(kind, self.variable(variable))}{_zero(kind)};"
            for variable, kind in self.names.items()
            if variable not in self._parameters
        ]
        head = f"{self.signature(name)}\n{{\n"
        used = {inner.id for inner in ast.walk(self._tree) if isinstance(inner, ast.Name)}
        unused = [f"(void){self.variable(name)};" for name in self._parameters if name not in used]
        body = [*unused, *variables, *self._declared.values(), *self.lines]
        return head + _indented(body) + "}\n"

    def signature(self, name: str) -> str:
        """Return the head of the function."""
        given = ", ".join(
            self._declaration(kind, self.variable(parameter))
            for parameter, kind in zip(self._parameters, self._arguments, strict=True)
        )
        return f"static {self._program.name(self.result)} {name}({given or 'void'})"

    def _declaration(self, kind: Type, name: str) -> str:
        return f"const {self.c(kind)} *{name}" if isinstance(kind, Record) else f"{self.c(kind)} {name}"

    def c(self, kind: Type) -> str:
        """Return the C name of a type."""
        return self._program.name(kind)

    def variable(self, name: str) -> str:
        """Return the C name of a variable."""
        return f"{name}_" if name in _KEPT else name

    def temporary(self, kind: Type, code: str) -> Value:
        """Return a new variable with a value."""
        name = self._new("t")
        self._declared[name] = f"{self._declaration(kind, name)}{_zero(kind)};"
        if code:
            self.lines.append(f"{name} = {code};")
        return Value(kind, name, True)

    def _new(self, stem: str) -> str:
        self._count += 1
        return f"{stem}{self._count}_"

    def make_zeros(self, shape: tuple[int, ...]) -> Value:
        """Return a new array of zeros on the stack."""
        kind = Array(Scalar("double"), len(shape))
        room, size = self._new("room"), 1
        for n in shape:
            size *= n
        self._declared[room] = f"double {room}[{size}];"
        self.lines.append(f"memset({room}, 0, sizeof {room});")
        return Value(kind, f"({self.c(kind)}){{{room}, {', '.join(map(str, shape))}}}")

    def make_record(self, kind: type, items: Sequence[Value]) -> Value:
        """Return a new named tuple on the stack."""
        record = Record(kind, tuple(item.type for item in items))
        name = self._new("record")
        self._declared[name] = f"{self.c(record)} {name};"
        for field, item in zip(record.fields, items, strict=True):
            self.lines.append(f"{name}.{field} = {'*' if isinstance(item.type, Record) else ''}{item.code};")
        return Value(record, f"(&{name})")

    def call_translated(self, function: Callable[..., Any], arguments: Sequence[Operand], node: ast.AST) -> Operand:
        """Call a function of Python that is translated too."""
        if not isinstance(function, FunctionType):
            self.fail(node, f"a call of {function!r}")
        values = [self.value(argument, node) for argument in arguments]
        name, result = self._program.instance(function, tuple(value.type for value in values))
        code = f"{name}({', '.join(value.code for value in values)})"
        if isinstance(result, Nothing):
            self.lines.append(f"{code};")
            return Known(None)
        return self.temporary(result, code)

    # ---- statements ----

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
            del self._declared[result.code]

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
        """Return a value's code as that of another type that holds it."""
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
        if name in self._parameters and kind != self.names[name]:
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
        place = self._place(target)
        if len(self.lines) > mark and not value.simple:  # the value is computed before the index
            later, self.lines[mark:] = self.lines[mark:], []
            value = self.temporary(value.type, value.code)
            self.lines += later
        if isinstance(place.type, Scalar):
            self.lines.append(f"{place.code} = {self.converted(value, place.type)};")
            return
        assert isinstance(place.type, Array)
        if isinstance(value.type, Array):
            self.lines.append(f"{self._program.name(place.type)}_copy({place.code}, {value.code});")
        else:
            self.lines.append(
                f"{self._program.name(place.type)}_fill({place.code}, {self.converted(value, place.type.item)});"
            )

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
        place = self._place(node.target)
        if not isinstance(place.type, Scalar):
            self.fail(node, "an operation on a whole array")
        mark = len(self.lines)
        other = self.expression(node.value)
        before: Value = place
        if len(self.lines) > mark:
            later, self.lines[mark:] = self.lines[mark:], []
            before = self.temporary(place.type, place.code)
            self.lines += later
        value = self.scalar(self.arithmetic(node.op, before, other, node), node)
        self.lines.append(f"{place.code} = {self.converted(value, place.type)};")

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
        condition = self.truth(node.test).code
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
        counter = self._new("i") if name == "_" or _is_written(name, node.body) else ""
        if name != "_":
            self.names.setdefault(name, INT)
            if self.names[name] != INT:
                self.fail(node, f"{name}, which counts and is {name_of(self.names[name])} elsewhere")
        variable = counter or self.variable(name)
        if counter:
            self._declared[counter] = f"int64_t {counter};"
        sign, change = ("<", f"{variable} += {step.value}") if step.value > 0 else (">", f"{variable} -= {-step.value}")
        self.lines.append(f"for ({variable} = {first}; {variable} {sign} {end}; {change}) {{")
        if counter and name != "_":
            self.lines.append(f"{self.variable(name)} = {counter};")
        self._block(node.body)
        self.lines.append("}")

    def _end(self, last: Value) -> str:
        return self.temporary(INT, last.code).code


def _captured(function: FunctionType) -> dict[str, Any]:
    cells = function.__closure__ or ()
    return dict(zip(function.__code__.co_freevars, (cell.cell_contents for cell in cells), strict=True))


def _is_written(name: str, body: Sequence[ast.stmt]) -> bool:
    names = (inner for statement in body for inner in ast.walk(statement))
    return any(isinstance(n, ast.Name) and n.id == name and isinstance(n.ctx, ast.Store) for n in names)


def _zero(kind: Type) -> str:
    match kind:
        case Record():
            return " = NULL"
        case Array():
            return " = {0}"
        case Tuple():
            return ""
    return " = false" if kind == BOOL else " = 0"


def _indented(lines: Sequence[str]) -> str:
    depth, out = 1, []
    for line in lines:
        if line.startswith("}"):
            depth -= 1
        out.append("    " * depth + line + "\n")
        if line.endswith("{"):
            depth += 1
    return "".join(out)
