"""Arguments of translated functions as static data in C: what a law begins with, for where no Python runs."""

from __future__ import annotations

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
        That exports the function by that name.
    name : str
        Of the function; its arguments are called ``name_data``, and are given to ``name`` by their address.
    arguments : tuple
        Such as it was exported for.

    Returns
    -------
    str
        C, to stand behind the program's text. Arrays are static, and may be written.

    Raises
    ------
    TypeError
        If an argument is of a type that C has no words for.
    """
    arrays: list[str] = []
    values = [_value(program, f"{name}_{i}", argument, arrays) for i, argument in enumerate(arguments)]
    return "\n".join([*arrays, f"static {name}_arguments {name}_data = {{{', '.join(values)}}};\n"])


def _value(program: Program, path: str, value: Any, arrays: list[str]) -> str:
    if isinstance(value, tuple):
        keys = getattr(value, "_fields", range(len(value)))
        items = [_value(program, f"{path}_{key}", item, arrays) for key, item in zip(keys, value, strict=True)]
        return f"{{{', '.join(items)}}}"
    kind = type_of(value)
    if isinstance(value, np.ndarray):
        program.name(kind)
        sizes = ", ".join(map(str, value.shape))
        if not value.size:
            return f"{{NULL, {sizes}}}"
        numbers = ", ".join(_number(x) for x in value.ravel())
        arrays.append(f"static {kind.item.c} {path}[] = {{{numbers}}};")  # type: ignore[union-attr]
        return f"{{{path}, {sizes}}}"
    return _number(value)


def _number(x: Any) -> str:
    if isinstance(x, bool | np.bool_):
        return "true" if x else "false"
    if isinstance(x, np.uint64):
        return f"UINT64_C({int(x)})"
    return number(float(x)) if isinstance(x, float) else f"INT64_C({int(x)})"
