"""Write arguments of translated functions as static data in C: the data of a law at the start, without Python."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np

from controller.translator.operands import number
from controller.translator.program import Program
from controller.translator.types import type_of


def static_data(program: Program, name: str, arguments: tuple[Any, ...]) -> str:
    """Return the definition of a function's arguments, with their present numbers."""
    arrays: list[str] = []

    def pointer(array: np.ndarray, path: str) -> str:
        program.name(type_of(array))
        if not array.size:
            return "NULL"
        arrays.append(array_data(array, path))
        return path

    values = [initializer(argument, pointer, f"{name}_{i}") for i, argument in enumerate(arguments)]
    return "\n".join([*arrays, f"static {name}_arguments {name}_data = {{{', '.join(values)}}};\n"])


def initializer(value: Any, pointer: Callable[[np.ndarray, str], str], path: str = "") -> str:
    """Return the C initializer of an argument."""
    if isinstance(value, tuple):
        keys = getattr(value, "_fields", range(len(value)))
        items = [initializer(item, pointer, f"{path}_{key}") for key, item in zip(keys, value, strict=True)]
        return f"{{{', '.join(items)}}}"
    if isinstance(value, np.ndarray):
        return f"{{{', '.join([pointer(value, path), *map(str, value.shape)])}}}"
    return _number(value)


def array_data(array: np.ndarray, name: str, qualifier: str = "static") -> str:
    """Return the C definition of an array with its present numbers."""
    kind = type_of(array)
    numbers = ", ".join(_number(x) for x in array.ravel())
    return f"{qualifier} {kind.item.c} {name}[] = {{{numbers}}};"  # type: ignore[union-attr]


class Expression(int):
    """An integer that C computes, such as the address of a function."""

    text: str

    def __new__(cls, text: str) -> Expression:
        """Return the integer of a C expression; in Python it is 0."""
        made = super().__new__(cls, 0)
        made.text = text
        return made


def _number(x: Any) -> str:
    if isinstance(x, Expression):
        return x.text
    if isinstance(x, bool | np.bool_):
        return "true" if x else "false"
    if isinstance(x, np.uint64):
        return f"UINT64_C({int(x)})"
    return number(float(x)) if isinstance(x, float) else f"INT64_C({int(x)})"
