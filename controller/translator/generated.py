"""Define Python functions from a generated text."""

from __future__ import annotations

import ast
from types import FunctionType
from typing import Any


def functions_of(text: str, names: dict[str, Any]) -> dict[str, FunctionType]:
    """Define the functions of a text, so that they can be translated."""
    namespace = dict(names)
    exec(compile(text, f"<{names['__name__']}>", "exec"), namespace)  # noqa: S102 -- of our own making
    functions = {}
    for node in ast.parse(text).body:
        if isinstance(node, ast.FunctionDef):
            functions[node.name] = namespace[node.name]
            functions[node.name].source = ast.get_source_segment(text, node)
    return functions
