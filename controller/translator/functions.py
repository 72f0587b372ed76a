"""One function of Python, for arguments of some types, as a function of C."""

from __future__ import annotations

import ast
import inspect
import re
import textwrap
from collections.abc import Sequence
from types import FunctionType
from typing import Any

from controller.errors import TranslationError
from controller.translator.function_code import Aliases, Functions
from controller.translator.operands import Length, Requirement
from controller.translator.statements import Statements
from controller.translator.types import Nothing, Type, return_type

_MAX_PASSES = 6  # maximum number of passes until the types of variables are fixed


class Function(Statements):
    """One function for arguments of some types."""

    def __init__(
        self, program: Functions, function: FunctionType, arguments: tuple[Type, ...], aliases: Aliases
    ) -> None:
        self.program, self.module = program, function.__module__
        self.globals = function.__globals__ | _closure_variables(function)
        text = getattr(function, "source", None)
        self.file = inspect.getsourcefile(function) or "?"
        lines, self.first_line = ([text], 1) if text else inspect.getsourcelines(function)
        tree = ast.parse(textwrap.dedent("".join(lines))).body[0]
        if not isinstance(tree, ast.FunctionDef) or tree.args.kwonlyargs or tree.args.vararg or tree.args.kwarg:
            raise TranslationError(
                f"{self.file}:{self.first_line}: expected a function with parameters by their places"
            )
        self._tree = tree
        self.parameters = [argument.arg for argument in tree.args.args]
        if len(self.parameters) != len(arguments):
            self.fail(tree, f"{tree.name} is given {len(arguments)} arguments, expected {len(self.parameters)}")
        self.names = dict(zip(self.parameters, arguments, strict=True))
        self._arguments, self.aliases = arguments, aliases
        self.roots = {name: frozenset([name]) for name in self.parameters}
        self.made: dict[str, frozenset[str]] = {}
        self.made_at: dict[str, ast.AST] = {}
        self.writes_arguments, self.result = False, Nothing()
        self.fixed_lengths: dict[str, tuple[Length | None, ...]] = {}
        self.where = f"{function.__module__.rpartition('.')[2]}.{function.__name__}"

    def translate(self, name: str) -> str:
        """Return the function in C, under a name; afterwards the type of its result is known."""
        for _ in range(_MAX_PASSES):
            known = self._state()
            self.lines: list[str] = []
            self.declared: dict[str, str] = {}
            self.bounds: dict[str, float] = {}
            self.fixed: dict[str, Length] = {}
            self.requirements: dict[Requirement, None] = {}
            self.loops, self.later = [], []
            self.n_names = self.n_writes = 0
            self.sites: dict[str, int] = {}
            self._block(self._tree.body)
            if known == self._state():
                break
        else:
            self.fail(self._tree, "types that do not settle")
        variables = [
            self.definition(kind, self.variable(variable))
            for variable, kind in self.names.items()
            if variable not in self.parameters
        ]
        head = f"{self.signature(name)}\n{{\n"
        used = set(re.findall(r"\w+", " ".join(re.sub(r"^\w+ = ", "", line) for line in self.lines)))
        unused = [f"(void){code};" for code in map(self.variable, self.names) if code not in used]
        idle = {temporary for temporary in self.declared if temporary not in used}  # such as a length that nobody asks
        unused += [f"(void){temporary};" for temporary in sorted(idle)]
        body = [*variables, *self.declared.values(), *unused, *self.lines]
        return head + _indent(body) + "}\n"

    def _state(self) -> tuple[Any, ...]:
        """Return what is known of variables."""
        return dict(self.names), dict(self.roots), dict(self.made), dict(self.fixed_lengths), self.result

    def signature(self, name: str) -> str:
        """Return the head of the function."""
        parameters = ", ".join(
            self.declaration(kind, self.variable(parameter))
            for parameter, kind in zip(self.parameters, self._arguments, strict=True)
        )
        return f"static {self.c(return_type(self.result))} {name}({parameters or 'void'})"


def _closure_variables(function: FunctionType) -> dict[str, Any]:
    cells = function.__closure__ or ()
    return dict(zip(function.__code__.co_freevars, (cell.cell_contents for cell in cells), strict=True))


def _indent(lines: Sequence[str]) -> str:
    depth, out = 1, []
    for line in lines:
        if line.startswith("}"):
            depth -= 1
        out.append("    " * depth + line + "\n")
        if line.endswith("{"):
            depth += 1
    return "".join(out)
