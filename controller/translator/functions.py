"""One function of Python, for arguments of some types, as a function of C."""

from __future__ import annotations

import ast
import inspect
import textwrap
from collections.abc import Callable, Sequence
from types import FunctionType
from typing import Any, NoReturn, Protocol

from controller.errors import TranslationError
from controller.translator.operands import Known, Operand, Value
from controller.translator.statements import Statements
from controller.translator.types import BOOL, Array, Nothing, Record, Scalar, Tuple, Type

# words of C, and names that its headers define
_RESERVED = {
    "auto", "break", "case", "char", "const", "continue", "default", "do", "double", "else", "enum", "extern",
    "float", "for", "goto", "if", "inline", "int", "long", "register", "restrict", "return", "short",
    "signed", "sizeof", "static", "struct", "switch", "typedef", "union", "unsigned", "void", "volatile",
    "while", "bool", "true", "false", "NAN", "INFINITY", "gamma", "div", "free", "index", "j0", "j1", "jn",
    "y0", "y1", "yn", "time", "remove", "signal",
}  # fmt: skip
_MAX_PASSES = 6  # maximum number of passes until the types of variables are fixed


class Functions(Protocol):
    """The program's interface for a function that is translated."""

    def instance(self, function: FunctionType, arguments: tuple[Type, ...]) -> tuple[str, Type]:
        """Return the C name of a function for some arguments, and the type of what it returns."""
        ...

    def name(self, kind: Type) -> str:
        """Return the C name of a type."""
        ...


class Function(Statements):
    """One function for arguments of some types."""

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
        self.parameters = [argument.arg for argument in tree.args.args]
        if len(self.parameters) != len(arguments):
            self.fail(tree, f"{tree.name} is given {len(arguments)} arguments, expected {len(self.parameters)}")
        self.names = dict(zip(self.parameters, arguments, strict=True))
        self._arguments = arguments
        self.result: Type = Nothing()

    def fail(self, node: ast.AST, what: str) -> NoReturn:
        """Refuse a construct, with its file and line."""
        line = self._first + getattr(node, "lineno", 1) - 1
        raise TranslationError(f"{self._file}:{line}: {what}, which is not translated to C")

    def translate(self, name: str) -> str:
        """Return the function in C, under a name; afterwards the type of its result is known."""
        for _ in range(_MAX_PASSES):
            known, result = dict(self.names), self.result
            self.lines: list[str] = []
            self.declared: dict[str, str] = {}
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
            if variable not in self.parameters
        ]
        head = f"{self.signature(name)}\n{{\n"
        used = {inner.id for inner in ast.walk(self._tree) if isinstance(inner, ast.Name)}
        unused = [f"(void){self.variable(name)};" for name in self.parameters if name not in used]
        body = [*unused, *variables, *self.declared.values(), *self.lines]
        return head + _indented(body) + "}\n"

    def signature(self, name: str) -> str:
        """Return the head of the function."""
        parameters = ", ".join(
            self._declaration(kind, self.variable(parameter))
            for parameter, kind in zip(self.parameters, self._arguments, strict=True)
        )
        return f"static {self._program.name(self.result)} {name}({parameters or 'void'})"

    def _declaration(self, kind: Type, name: str) -> str:
        return f"const {self.c(kind)} *{name}" if isinstance(kind, Record) else f"{self.c(kind)} {name}"

    def c(self, kind: Type) -> str:
        """Return the C name of a type."""
        return self._program.name(kind)

    def variable(self, name: str) -> str:
        """Return the C name of a variable."""
        return f"{name}_" if name in _RESERVED else name

    def temporary(self, kind: Type, code: str) -> Value:
        """Assign a value to a new variable, and return that."""
        name = self.new_name("t")
        self.declared[name] = f"{self._declaration(kind, name)}{_zero(kind)};"
        if code:
            self.lines.append(f"{name} = {code};")
        return Value(kind, name, True)

    def new_name(self, stem: str) -> str:
        """Return a name that no variable has."""
        self._count += 1
        return f"{stem}{self._count}_"

    def make_zeros(self, shape: tuple[int, ...]) -> Value:
        """Return a new array of zeros on the stack."""
        kind = Array(Scalar("double"), len(shape))
        room, size = self.new_name("room"), 1
        for n in shape:
            size *= n
        self.declared[room] = f"double {room}[{size}];"
        self.lines.append(f"memset({room}, 0, sizeof {room});")
        return Value(kind, f"({self.c(kind)}){{{room}, {', '.join(map(str, shape))}}}")

    def make_record(self, kind: type, items: Sequence[Value]) -> Value:
        """Return a new named tuple on the stack."""
        record = Record(kind, tuple(item.type for item in items))
        name = self.new_name("record")
        self.declared[name] = f"{self.c(record)} {name};"
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


def _captured(function: FunctionType) -> dict[str, Any]:
    cells = function.__closure__ or ()
    return dict(zip(function.__code__.co_freevars, (cell.cell_contents for cell in cells), strict=True))


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
