"""Define Python functions from a generated text."""

from __future__ import annotations

import ast
from types import FunctionType
from typing import Any


def functions_of(text: str, names: dict[str, Any]) -> dict[str, FunctionType]:
    r"""Define the functions of a text, so that they can be translated.

    Parameters
    ----------
    text : str
        Python text of functions alone; it is executed, so it must not come from a user.
    names : dict
        Objects that the functions refer to, by name; ``__name__`` is the module that they belong to.

    Returns
    -------
    dict of str to function
        Functions by name; each has its own text as ``source``.

    Examples
    --------
    >>> from controller.translator.generated import functions_of
    >>> functions_of("def double(x):\n    return 2.0 * x\n", {"__name__": __name__})["double"](3.0)
    6.0
    """
    found = dict(names)
    exec(compile(text, f"<{names['__name__']}>", "exec"), found)  # noqa: S102 -- of our own making
    functions = {}
    for node in ast.parse(text).body:
        if isinstance(node, ast.FunctionDef):
            functions[node.name] = found[node.name]
            functions[node.name].source = ast.get_source_segment(text, node)
    return functions
