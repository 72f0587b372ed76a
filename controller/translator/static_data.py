"""Write arguments of translated functions as static data in C: the data of a law at the start, without Python."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np

from controller.translator.operands import number
from controller.translator.program import Program
from controller.translator.types import type_of


def static_data(program: Program, name: str, arguments: tuple[Any, ...]) -> str:
    """Return the definition of a function's arguments, with their present numbers.

    Parameters
    ----------
    program : Program
        Program that exports the function.
    name : str
        Name of the function; its arguments are called ``name_data``, and are passed to ``name`` by their address.
    arguments : tuple
        Arguments of the types that it was exported for.

    Returns
    -------
    str
        C text to put after the program's text. Arrays are static, and may be written.

    Raises
    ------
    TypeError
        If an argument has a type that is not translated to C.
    """
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
    """Return the C initializer of an argument.

    Parameters
    ----------
    value : number, ndarray or tuple of such
        The argument.
    pointer : callable
        Returns the C expression of an array's address, from the array and its path.
    path : str, optional
        Path of the argument: with the names of fields, a C name for each array.

    Returns
    -------
    str
        Initializer of the struct that a `Program` has for its type.
    """
    if isinstance(value, tuple):
        keys = getattr(value, "_fields", range(len(value)))
        items = [initializer(item, pointer, f"{path}_{key}") for key, item in zip(keys, value, strict=True)]
        return f"{{{', '.join(items)}}}"
    if isinstance(value, np.ndarray):
        return f"{{{', '.join([pointer(value, path), *map(str, value.shape)])}}}"
    return _number(value)


def array_data(array: np.ndarray, name: str, qualifier: str = "static") -> str:
    """Return the C definition of an array with its present numbers.

    Parameters
    ----------
    array : ndarray
        Array, not empty.
    name : str
        Name in C.
    qualifier : str, optional
        Text before its type.

    Returns
    -------
    str
        Definition in one line.
    """
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
