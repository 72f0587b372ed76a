"""A program: functions with all functions that they call, as one file of C99."""

from __future__ import annotations

import sys
from collections.abc import Callable, Iterator, Sequence
from dataclasses import replace
from types import FunctionType
from typing import Any

from controller.errors import TranslationError
from controller.translator.function_code import Aliases, Instance
from controller.translator.functions import Function
from controller.translator.operands import Requirement
from controller.translator.types import Array, Nothing, Record, Scalar, Tuple, Type, type_with_shape

_HEAD = """\
/* Translated from Python: change that text, not this one. No heap; compile with -ffp-contract=off. */
#include <math.h>
#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>
#include <stdlib.h>
#include <string.h>
"""

# helpers by name, in the order in which one may call another; among equal or NaN arguments Python's
# min and max take the first; those of NumPy give NaN
_HELPERS = {
    "min_f64": "static inline double min_f64(double a, double b) { return b < a ? b : a; }\n",
    "max_f64": "static inline double max_f64(double a, double b) { return b > a ? b : a; }\n",
    "min_i64": "static inline int64_t min_i64(int64_t a, int64_t b) { return b < a ? b : a; }\n",
    "max_i64": "static inline int64_t max_i64(int64_t a, int64_t b) { return b > a ? b : a; }\n",
    "minimum_f64": "static inline double minimum_f64(double a, double b) { return b < a || isnan(b) ? b : a; }\n",
    "maximum_f64": "static inline double maximum_f64(double a, double b) { return b > a || isnan(b) ? b : a; }\n",
    "clipped": "static inline int64_t clipped(int64_t i, int64_t n)\n"
    "{\n    return i < 0 ? max_i64(i + n, 0) : min_i64(i, n);\n}\n",
    "floor_div": "static inline int64_t floor_div(int64_t a, int64_t b)\n"
    "{\n    return a / b - (a % b != 0 && (a < 0) != (b < 0));\n}\n",
    "floor_mod": "static inline int64_t floor_mod(int64_t a, int64_t b) { return a - b * floor_div(a, b); }\n",
}


class Program:
    """Functions in C, each for the argument types of its calls."""

    def __init__(self) -> None:
        self._instances: dict[tuple[FunctionType, tuple[Type, ...], Aliases], Instance] = {}
        self._under_way: set[FunctionType] = set()
        self._reserved: set[str] = set()
        self._functions: list[str] = []
        self._types: dict[Type, str] = {}
        self._definitions: list[str] = []  # of types
        self._exports: list[str] = []
        self.globals: dict[str, str] = {}  # what the functions use of their modules, by "module:name", as text

    def export(self, name: str, function: Callable[..., None], arguments: tuple[Type, ...]) -> None:
        """Translate a function, and make it callable by a name, with its arguments as words."""
        self._reserved.add(name)
        if not isinstance(function, FunctionType):
            raise TranslationError(f"{function!r} is no plain function, which is not translated to C")
        names = function.__code__.co_varnames
        arguments = tuple(type_with_shape(function, name, kind) for name, kind in zip(names, arguments, strict=False))
        called, _, _, requirements = self.instance(function, arguments, frozenset())
        fields = "".join(f"    {self.name(kind)} a{i};\n" for i, kind in enumerate(arguments))
        arguments_text = ", ".join(
            f"{'&' if isinstance(kind, Record) else ''}w->a{i}" for i, kind in enumerate(arguments)
        )
        self._exports.append(
            f"typedef struct {{\n{fields}}} {name}_arguments;\n\n"
            f"void {name}(const void *words);\nvoid {name}(const void *words)\n{{\n"
            f"    const {name}_arguments *w = words;\n    {called}({arguments_text});\n}}\n"
            + _check(name, requirements, names)
        )

    def text(self) -> str:
        """Return the file."""
        code = [*self._functions, *self._exports]
        code = [*self._definitions, *code]
        for name, text in reversed(_HELPERS.items()):
            if any(f"{name}(" in part for part in code):
                code.insert(0, text)
        return "\n".join([_HEAD, *code])

    @property
    def modules(self) -> set[str]:
        """Names of the modules of all translated functions."""
        return {function.__module__ for function, *_ in self._instances}

    def instance(self, function: FunctionType, arguments: tuple[Type, ...], aliases: Aliases) -> Instance:
        """Return a function in C for some arguments."""
        key = (function, arguments, aliases)
        if key not in self._instances:
            if function in self._under_way:
                raise TranslationError(f"{function.__qualname__} calls itself, which is not translated to C")
            self._under_way.add(function)
            stem = f"{function.__module__.rpartition('.')[2]}_{function.__name__.strip('_')}"
            name = next(n for n in _unique_names(stem) if n not in self._reserved)
            self._reserved.add(name)
            translation = Function(self, function, arguments, aliases)
            code = translation.translate(name)
            self._under_way.discard(function)
            self._instances[key] = (
                name,
                translation.result,
                translation.writes_arguments,
                tuple(translation.requirements),
            )
            self._functions.append(code)
        return self._instances[key]

    def use_global(self, module: str, name: str, value: Any) -> None:
        """Note a value that a function uses from its module."""
        if getattr(sys.modules.get(module), name, None) is value:
            self.globals[f"{module}:{name}"] = text_of_global(value)

    def name(self, kind: Type) -> str:
        """Return the C name of a type, which is defined before its first use."""
        match kind:
            case Scalar():
                return kind.c
            case Nothing():
                return "void"
            case Array():
                kind = replace(kind, shape=(None,) * kind.ndim)
        if kind not in self._types:
            name, text = self._define(kind)
            self._types[kind] = name
            self._definitions.append(text)
        return self._types[kind]

    def _define(self, kind: Type) -> tuple[str, str]:
        match kind:
            case Array():
                return kind.c, _array(kind)
            case Record():
                fields = [f"{self.name(item)} {field};" for field, item in zip(kind.fields, kind.items, strict=True)]
                return self._struct(kind.python.__name__, fields)
            case Tuple():
                if any(isinstance(item, Record) for item in kind.items):
                    raise TranslationError("a record stored in a tuple, which is not translated to C")
                if kind.uniform:
                    return self._struct("tuple", [f"{self.name(kind.items[0])} f[{len(kind.items)}];"])
                return self._struct("tuple", [f"{self.name(item)} f{i};" for i, item in enumerate(kind.items)])
        raise TypeError(kind)

    def _struct(self, stem: str, fields: Sequence[str]) -> tuple[str, str]:
        name = next(n for n in _unique_names(stem) if n not in self._types.values())
        inside = "".join(f"    {field}\n" for field in fields)
        return name, f"typedef struct {{\n{inside}}} {name};\n"


def _check(name: str, requirements: Sequence[Requirement], parameters: Sequence[str]) -> str:
    """Return a C function that checks lengths of arguments; it returns the first requirement that they do not meet."""
    lines = []
    for needed in requirements:
        code, text = (f"{needed.left.text(p)} {needed.sign} {needed.right.text(p)}" for p in (None, parameters))
        lines.append(f'    if (!({code}))\n        return "{text} (in {needed.where})";\n')
    head = f"const char *{name}_check_shapes(const void *words)"
    arguments = f"    const {name}_arguments *w = words;\n" if lines else "    (void)words;\n"
    return f"\n{head};\n{head}\n{{\n{arguments}{''.join(lines)}    return NULL;\n}}\n"


def text_of_global(value: Any) -> str:
    """Return a text that differs for different values: of functions, classes and modules, their names."""
    name = getattr(value, "__qualname__", None) or getattr(value, "__name__", None)
    return f"{getattr(value, '__module__', '')}.{name}" if name else repr(value)


def _unique_names(stem: str) -> Iterator[str]:
    yield stem
    n = 2
    while True:
        yield f"{stem}_{n}"
        n += 1


def _array(kind: Array) -> str:
    """Return the C struct of an array view."""
    sizes = "".join(f"    int64_t n{i};\n" for i in range(kind.ndim))
    strides = "" if kind.contiguous else "".join(f"    int64_t s{i};\n" for i in range(kind.ndim))
    return f"typedef struct {{\n    {kind.item.c} *data;\n{sizes}{strides}}} {kind.c};\n"
