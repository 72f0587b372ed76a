"""Arithmetic expressions of files and terms: read by a parser of their own, never run as Python."""

# One tree is evaluated on numbers and on arrays, and written as text, or as C and Python.

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from typing import Any, Literal

import numpy as np

from fuzzy_arbiter.terms.functions import ALL
from fuzzy_arbiter.terms.parser import Node, parsed

_BINDS = {"+": 1, "-": 1, "*": 2, "/": 2, "%": 2, "~": 3, "^": 4}  # precedence of the operators

# functions in exported code, where the word has another meaning
EXPORTED = {
    "/": "quotient", "%": "fmod", "^": "power", "pow": "power", "abs": "fabs", "min": "minimum", "max": "maximum",
    "round": "rint",
}  # fmt: skip


@dataclass(frozen=True, slots=True)
class Expression:
    """Arithmetic on named numbers."""

    # text with ``+ - * / % ^``, parentheses, names, and functions such as ``sin(x)``; texts with one tree are equal
    text: str
    tree: Node = None  # type: ignore[assignment]  # read from the text
    _number: Callable[[Mapping[str, float]], float] = field(init=False, repr=False, compare=False)
    _array: Callable[[Mapping[str, Any]], Any] = field(init=False, repr=False, compare=False)

    def __post_init__(self) -> None:
        tree = parsed(self.text) if self.tree is None else self.tree
        object.__setattr__(self, "tree", tree)
        object.__setattr__(self, "text", said(tree))
        object.__setattr__(self, "_number", evaluator(tree, "number"))
        object.__setattr__(self, "_array", evaluator(tree, "array"))

    def __reduce__(self) -> tuple[Any, ...]:
        return Expression, (self.text, self.tree)

    @property
    def names(self) -> frozenset[str]:
        """Names of the numbers in the expression."""
        return frozenset(_names(self.tree))

    def __call__(self, values: Mapping[str, float]) -> float:
        """Return the value for numbers, by IEEE 754: 0/0 is NaN, 1/0 infinite."""
        return float(self._number(values))

    def of_many(self, values: Mapping[str, Any]) -> Any:
        """Return the values for arrays of one shape."""
        with np.errstate(all="ignore"):
            return self._array(values)

    def bound(self, values: Mapping[str, float]) -> Expression:
        """Return the expression with numbers for some names, simplified as far as possible."""
        return Expression("", _bound(self.tree, values))


def _names(node: Node) -> list[str]:
    if isinstance(node, tuple):
        return [name for part in node[1:] for name in _names(part)]
    return [node] if isinstance(node, str) else []


def _bound(node: Node, values: Mapping[str, float]) -> Node:
    if isinstance(node, str):
        return values.get(node, node)
    if isinstance(node, float):
        return node
    parts = [_bound(part, values) for part in node[1:]]
    if all(isinstance(part, float) for part in parts):
        return float(ALL[node[0]].number(*parts))
    return (node[0], *parts)


def evaluator(node: Node, kind: Literal["number", "array"]) -> Callable[[Mapping[str, Any]], Any]:
    """Return a function that evaluates a tree on numbers or on arrays."""
    if isinstance(node, float):
        return lambda values: node
    if isinstance(node, str):
        return lambda values: values[node]
    function, (first, *others) = getattr(ALL[node[0]], kind), [evaluator(part, kind) for part in node[1:]]
    if not others:
        return lambda values: function(first(values))
    (second,) = others
    return lambda values: function(first(values), second(values))


def said(node: Node) -> str:
    """Format a tree as text that parses as the same tree."""
    return _said(node)[0]


def _said(node: Node) -> tuple[str, int]:
    """Return a node's text, and the precedence of its outermost operator."""
    if isinstance(node, str):
        return node, 9
    if isinstance(node, float):
        text = repr(node).removesuffix(".0")
        return (text, 9) if node >= 0.0 or node != node else (text, 3)
    word, *parts = node
    texts = [_said(part) for part in parts]
    if word not in _BINDS:
        return f"{word}({', '.join(text for text, _ in texts)})", 9
    binds = _BINDS[word]
    if word == "~":
        return f"-{_within(texts[0], binds)}", binds
    # operators of equal precedence are evaluated from the left, except powers
    first, second = _within(texts[0], binds + (word == "^")), _within(texts[1], binds + (word != "^"))
    return (f"{first}^{second}" if word == "^" else f"{first} {word} {second}"), binds


def _within(part: tuple[str, int], binds: int) -> str:
    text, own = part
    return text if own >= binds else f"({text})"


def code(node: Node, names: Mapping[str, str]) -> str:
    """Format a tree as code that is valid in C and in Python."""
    if isinstance(node, float):
        return repr(node) if math.isfinite(node) else "INFINITY" if node > 0 else "-INFINITY" if node < 0 else "NAN"
    if isinstance(node, str):
        return names[node]
    word, *parts = node
    texts = [code(part, names) for part in parts]
    if word == "~":
        return f"(-{texts[0]})"
    if word in ("+", "-", "*"):
        return f"({texts[0]} {word} {texts[1]})"
    return f"{EXPORTED.get(word, word)}({', '.join(texts)})"
