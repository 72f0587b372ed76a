"""One function of Python, for arguments of some types, as a function of C."""

from __future__ import annotations

import ast
import inspect
import itertools
import math
import re
import textwrap
from collections.abc import Callable, Sequence
from types import FunctionType
from typing import Any, NoReturn, Protocol

from controller.errors import TranslationError
from controller.translator.array_lengths import Length, Requirement
from controller.translator.array_views import ANY
from controller.translator.operands import Grid, Items, Known, Operand, Value, View
from controller.translator.statements import Statements
from controller.translator.types import BOOL, DOUBLE, Array, Nothing, Record, Scalar, Tuple, Type, known_lengths, shaped

# words of C, and names that its headers define
_RESERVED = {
    "auto", "break", "case", "char", "const", "continue", "default", "do", "double", "else", "enum", "extern",
    "float", "for", "goto", "if", "inline", "int", "long", "register", "restrict", "return", "short",
    "signed", "sizeof", "static", "struct", "switch", "typedef", "union", "unsigned", "void", "volatile",
    "while", "bool", "true", "false", "NAN", "INFINITY", "gamma", "div", "free", "index", "j0", "j1", "jn",
    "y0", "y1", "yn", "time", "remove", "signal",
}  # fmt: skip
_MAX_PASSES = 6  # maximum number of passes until the types of variables are fixed


Aliases = frozenset[frozenset[str]]  # pairs of parameters that may overlap
# the C name of a function, the type of what it returns, if it writes arrays, and what it requires of their lengths
Instance = tuple[str, Type, bool, tuple[Requirement, ...]]


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


class Function(Statements):
    """One function for arguments of some types."""

    def __init__(
        self, program: Functions, function: FunctionType, arguments: tuple[Type, ...], aliases: Aliases
    ) -> None:
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
        self._arguments, self.aliases = arguments, aliases
        self.roots = {name: frozenset([name]) for name in self.parameters}
        self.made: dict[str, frozenset[str]] = {}
        self.made_at: dict[str, ast.AST] = {}
        self.writes_arguments, self.result = False, Nothing()
        self.fixed_lengths: dict[str, tuple[Length | None, ...]] = {}
        self.where = f"{function.__module__.rpartition('.')[2]}.{function.__name__}"

    def fail(self, node: ast.AST, what: str) -> NoReturn:
        """Refuse a construct, with its file and line."""
        line = self._first + getattr(node, "lineno", 1) - 1
        raise TranslationError(f"{self._file}:{line}: {what}, which is not translated to C")

    def global_value(self, name: str) -> Any:
        """Return what the function uses from its module, or has captured."""
        self._program.use_global(self._function.__module__, name, self.globals[name])
        return self.globals[name]

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
            self._count = self.n_writes = 0
            self._sites: dict[str, int] = {}
            self._block(self._tree.body)
            if known == self._state():
                break
        else:
            self.fail(self._tree, "types that do not settle")
        variables = [
            f"{self._declaration(kind, self.variable(variable))}{_zero(kind)};"
            for variable, kind in self.names.items()
            if variable not in self.parameters
        ]
        head = f"{self.signature(name)}\n{{\n"
        used = set(re.findall(r"\w+", " ".join(re.sub(r"^\w+ = ", "", line) for line in self.lines)))
        unused = [f"(void){code};" for code in map(self.variable, self.names) if code not in used]
        idle = {temporary for temporary in self.declared if temporary not in used}  # such as a length that nobody asks
        unused += [f"(void){temporary};" for temporary in sorted(idle)]
        body = [*variables, *self.declared.values(), *unused, *self.lines]
        return head + _indented(body) + "}\n"

    def _state(self) -> tuple[Any, ...]:
        """Return what is known of variables."""
        return dict(self.names), dict(self.roots), dict(self.made), dict(self.fixed_lengths), self.result

    def signature(self, name: str) -> str:
        """Return the head of the function."""
        parameters = ", ".join(
            self._declaration(kind, self.variable(parameter))
            for parameter, kind in zip(self.parameters, self._arguments, strict=True)
        )
        return f"static {self.c(self.returned(self.result))} {name}({parameters or 'void'})"

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
        return self.held(kind, name, True, frozenset([ANY]), ())

    def new_variable(self, kind: Type, code: str, *values: Value) -> Value:
        """Assign one of some values to a new variable, and return that."""
        name = self.temporary(kind, code).code
        for i, value in enumerate(values):
            self.note_lengths(name, value, again=i > 0)
        return self.held(kind, name, True, frozenset().union(*(value.roots for value in values)), (name,))

    def held(self, kind: Type, code: str, simple: bool, roots: frozenset[str], paths: tuple[str, ...]) -> Value:
        """Return what a C variable or member holds; its lengths are known by paths."""
        if isinstance(kind, Array):
            return self.view_of(kind, code, roots, paths) if kind.ndim else Value(kind.item, f"{code}.data[0]")
        return Value(kind, code, simple, frozenset() if isinstance(kind, Scalar) else roots, paths)

    def storage(self, stem: str, node: ast.AST, item: Scalar, size: int) -> str:
        """Declare storage on the stack, one for each place in the text, and return its name."""
        name = self._site(stem, node)
        self.declared[name] = f"{item.c} {name}[{max(size, 1)}];"
        return name

    def _site(self, stem: str, node: ast.AST) -> str:
        """Return a name that is the same in each pass."""
        name = f"{stem}_{getattr(node, 'lineno', 0)}_{getattr(node, 'col_offset', 0)}_"
        self._sites[name] = self._sites.get(name, 0) + 1
        name += f"{self._sites[name]}_" if self._sites[name] > 1 else ""
        self.made_at[name] = node
        return name

    def new_name(self, stem: str) -> str:
        """Return a name that no variable has."""
        self._count += 1
        return f"{stem}{self._count}_"

    def make_zeros(self, shape: tuple[int, ...], node: ast.AST) -> Value:
        """Return a new array of zeros on the stack."""
        name = self.storage("zeros", node, DOUBLE, math.prod(shape))
        self.lines.append(f"memset({name}, 0, sizeof {name});")
        return self.stored(name, DOUBLE, shape)

    def make_record(self, kind: type, items: Sequence[Value], node: ast.AST) -> Value:
        """Return a new named tuple on the stack."""
        fields: tuple[str, ...] = kind._fields  # type: ignore[attr-defined]
        try:
            types = tuple(self._shaped(kind, field, item, node) for field, item in zip(fields, items, strict=True))
        except TypeError as error:
            self.fail(node, str(error))
        record, name = Record(kind, types), self._site("record", node)
        if record.mutable:
            self.fail(node, f"a new State, {kind.__name__}")
        self.declared[name] = f"{self.c(record)} {name};"
        for field, item, of in zip(fields, items, types, strict=True):
            code = f"*{item.code}" if isinstance(of, Record) else self.converted(item, of)
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
            kinds = tuple(self._shaped(function, name, value, node) for name, value in zip(names, values, strict=False))
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
        name, result, writes, requirements = self._program.instance(function, kinds, aliases)
        operands = [a if isinstance(a, Items) else value for a, value in zip(arguments, values, strict=True)]
        for requirement in requirements:
            left, right = (self._of_argument(n, operands, node) for n in (requirement.left, requirement.right))
            if not (left and right):
                self.fail(node, f"arrays of lengths that C computes, in {requirement.where}")
            self.require(left, requirement.sign, right, node, requirement.where)
        code = f"{name}({', '.join(self.converted(v, k) for v, k in zip(values, kinds, strict=True))})"
        if writes:
            self.n_writes += 1
            self.writes_arguments = self.writes_arguments or not all(map(self.is_local, roots))
        if isinstance(result, Nothing):
            self.lines.append(f"{code};")
            return Known(None)
        if not isinstance(result, Array):
            return self.temporary(result, code)
        name = self._site("r", node)
        self.declared[name] = f"{self.c(self.returned(result))} {name};"
        self.lines.append(f"{name} = {code};")
        return self.stored(f"{name}.f", DOUBLE, known_lengths(result))

    def _of_argument(self, length: Length, arguments: Sequence[Operand], node: ast.AST) -> Length | None:
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
        assert isinstance(operand, View | Grid)
        own = self.length(operand.sizes[int(axis)])
        return own and Length(own.path, own.offset + length.offset)

    def _shaped(self, owner: Any, name: str, value: Value, node: ast.AST) -> Type:
        """Return the type of a parameter or field; require the lengths of its annotation."""
        kind = shaped(owner, name, value.type)
        if isinstance(kind, Array) and isinstance(value, View):
            for n, size in zip(kind.shape, value.sizes, strict=True):
                length = self.length(size)
                if isinstance(n, int) and length:
                    self.require(length, "==", Length("", n), node)
                elif isinstance(n, int) and self.max_length(size) != n:
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
