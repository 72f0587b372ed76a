"""The text of one function in C: its lines, and names of variables and of storage."""

from __future__ import annotations

import ast
from collections.abc import Callable
from types import FunctionType
from typing import Any, NoReturn, Protocol, TypeVar

from controller.errors import TranslationError
from controller.translator.operands import Requirement
from controller.translator.types import BOOL, Array, Record, Scalar, Tuple, Type

# words of C, and names that its headers define
_RESERVED = {
    "auto", "break", "case", "char", "const", "continue", "default", "do", "double", "else", "enum", "extern",
    "float", "for", "goto", "if", "inline", "int", "long", "register", "restrict", "return", "short",
    "signed", "sizeof", "static", "struct", "switch", "typedef", "union", "unsigned", "void", "volatile",
    "while", "bool", "true", "false", "NAN", "INFINITY", "gamma", "div", "free", "index", "j0", "j1", "jn",
    "y0", "y1", "yn", "time", "remove", "signal",
}  # fmt: skip

Aliases = frozenset[frozenset[str]]  # pairs of parameters that may overlap
# the C name of a function, the type of what it returns, if it writes arrays, and what it requires of their lengths
Instance = tuple[str, Type, bool, tuple[Requirement, ...]]

N = TypeVar("N")
T = TypeVar("T")


class Functions(Protocol):
    """The program's interface for a function that is translated."""

    def instance(self, function: FunctionType, arguments: tuple[Type, ...], aliases: Aliases) -> Instance:
        """Return a function in C for some arguments."""
        ...

    def name(self, kind: Type) -> str:
        """Return the C name of a type."""
        ...

    def use_global(self, module: str, name: str, value: Any) -> None:
        """Note a value that a function uses from its module."""
        ...


class FunctionCode:
    """Lines and names of one function."""

    program: Functions
    module: str
    globals: dict[str, Any]
    file: str
    first_line: int
    current: ast.stmt  # that is translated
    names: dict[str, Type]  # types of variables by name, as far as they are known
    lines: list[str]
    n_writes: int  # number of calls so far that write into arrays
    declared: dict[str, str]  # declarations of variables that Python does not have
    made_at: dict[str, ast.AST]  # place in the text of each storage on the stack
    n_names: int  # number of names made so far
    sites: dict[str, int]  # number of names made so far for each line and column

    def evaluate_separately(self, evaluate: Callable[[N], T], node: N) -> tuple[T, list[str], bool]:
        """Evaluate a node; return the statements that it needs, which `lines` do not have, and if they write arrays."""
        mark, n_writes = len(self.lines), self.n_writes
        result = evaluate(node)
        needed, self.lines[mark:] = self.lines[mark:], []
        return result, needed, self.n_writes > n_writes

    def fail(self, node: ast.AST, what: str) -> NoReturn:
        """Refuse a construct, with its file and line."""
        line = self.first_line + getattr(node, "lineno", 1) - 1
        raise TranslationError(f"{self.file}:{line}: {what}, which is not translated to C")

    def global_value(self, name: str) -> Any:
        """Return what the function uses from its module, or has captured."""
        self.program.use_global(self.module, name, self.globals[name])
        return self.globals[name]

    def declaration(self, kind: Type, name: str) -> str:
        """Return the C declaration of a parameter."""
        return f"const {self.c(kind)} *{name}" if isinstance(kind, Record) else f"{self.c(kind)} {name}"

    def definition(self, kind: Type, name: str) -> str:
        """Return the C definition of a variable: of 0, unless it is a tuple."""
        match kind:
            case Record():
                start = " = NULL"
            case Array():
                start = " = {0}"
            case Tuple():
                start = ""
            case _:
                start = " = false" if kind == BOOL else " = 0"
        return f"{self.declaration(kind, name)}{start};"

    def c(self, kind: Type) -> str:
        """Return the C name of a type."""
        return self.program.name(kind)

    def variable(self, name: str) -> str:
        """Return the C name of a variable."""
        return f"{name}_" if name in _RESERVED else name

    def new_name(self, stem: str) -> str:
        """Return a name that no variable has."""
        self.n_names += 1
        return f"{stem}{self.n_names}_"

    def storage(self, stem: str, node: ast.AST, item: Scalar, size: int) -> str:
        """Declare storage on the stack, one for each place in the text, and return its name."""
        name = self.site(stem, node)
        self.declared[name] = f"{item.c} {name}[{max(size, 1)}];"
        return name

    def site(self, stem: str, node: ast.AST) -> str:
        """Return a name that is the same in each pass."""
        name = f"{stem}_{getattr(node, 'lineno', 0)}_{getattr(node, 'col_offset', 0)}_"
        self.sites[name] = self.sites.get(name, 0) + 1
        name += f"{self.sites[name]}_" if self.sites[name] > 1 else ""
        self.made_at[name] = node
        return name
