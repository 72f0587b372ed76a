"""Arithmetic in text, as files and terms say it: read by a parser of its own, never run as Python.

One tree serves all: it is evaluated on numbers and on arrays, and written as text, or as C and Python alike.
"""

from __future__ import annotations

import math
import re
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from typing import Any, NamedTuple

import numpy as np

from fuzzy_arbiter.checks import shown
from fuzzy_arbiter.errors import DefinitionError

MAX_LENGTH = 2000  # characters of an expression
MAX_NESTING = 50  # parentheses and signs within each other
MAX_DEPTH = 200  # operators within each other, of which a row of sums has as many as it has signs

_TOKEN = re.compile(r"\s*(?:(\d+\.?\d*(?:[eE][+-]?\d+)?|\.\d+(?:[eE][+-]?\d+)?)|([A-Za-z_]\w*)|(\S))", re.ASCII)


class Function(NamedTuple):
    """Something that an expression may call."""

    arguments: int
    number: Callable[..., float]
    array: Callable[..., Any]


def _guarded(function: Callable[..., float]) -> Callable[..., float]:
    """Return a function that gives what IEEE 754 and NumPy give, where Python's own raises."""

    def value(*arguments: float) -> float:
        try:
            return function(*arguments)
        except OverflowError:
            return math.inf
        except (ValueError, ZeroDivisionError):
            return math.nan

    return value


def _divided(a: float, b: float) -> float:
    if b:
        return a / b
    return math.nan if a == 0.0 or a != a else math.copysign(math.inf, a) * math.copysign(1.0, b)


def _compared(name: str) -> Function:
    function = getattr(np, {"lt": "less", "le": "less_equal", "gt": "greater", "ge": "greater_equal"}[name])
    number: Callable[[float, float], float] = {
        "lt": lambda a, b: float(a < b),
        "le": lambda a, b: float(a <= b),
        "gt": lambda a, b: float(a > b),
        "ge": lambda a, b: float(a >= b),
    }[name]
    return Function(2, number, lambda a, b: function(a, b).astype(np.float64))


def _log(a: float) -> float:
    return -math.inf if a == 0.0 else math.log(a)


def _power(a: float, b: float) -> float:
    return math.inf if a == 0.0 and b < 0.0 else math.pow(a, b)


_FUNCTIONS: dict[str, Function] = {
    "abs": Function(1, abs, np.abs),
    "acos": Function(1, _guarded(math.acos), np.arccos),
    "asin": Function(1, _guarded(math.asin), np.arcsin),
    "atan": Function(1, math.atan, np.arctan),
    "atan2": Function(2, math.atan2, np.arctan2),
    "ceil": Function(1, _guarded(math.ceil), np.ceil),
    "cos": Function(1, _guarded(math.cos), np.cos),
    "cosh": Function(1, _guarded(math.cosh), np.cosh),
    "eq": Function(2, lambda a, b: float(a == b), lambda a, b: np.equal(a, b).astype(np.float64)),
    "exp": Function(1, _guarded(math.exp), np.exp),
    "floor": Function(1, _guarded(math.floor), np.floor),
    "fmod": Function(2, _guarded(math.fmod), np.fmod),
    "ge": _compared("ge"),
    "gt": _compared("gt"),
    "le": _compared("le"),
    "log": Function(1, _guarded(_log), np.log),
    "log10": Function(1, _guarded(lambda a: -math.inf if a == 0.0 else math.log10(a)), np.log10),
    "log1p": Function(1, _guarded(lambda a: -math.inf if a == -1.0 else math.log1p(a)), np.log1p),
    "lt": _compared("lt"),
    "max": Function(2, max, np.maximum),
    "min": Function(2, min, np.minimum),
    "neq": Function(2, lambda a, b: float(a != b), lambda a, b: np.not_equal(a, b).astype(np.float64)),
    "pow": Function(2, _guarded(_power), np.power),
    "round": Function(1, _guarded(round), np.round),
    "sin": Function(1, _guarded(math.sin), np.sin),
    "sinh": Function(1, _guarded(math.sinh), np.sinh),
    "sqrt": Function(1, _guarded(math.sqrt), np.sqrt),
    "tan": Function(1, _guarded(math.tan), np.tan),
    "tanh": Function(1, math.tanh, np.tanh),
}
# other tools' words for the same
_SAME = {"fabs": "abs", "ln": "log"}
_OPERATORS: dict[str, Function] = {
    "+": Function(2, lambda a, b: a + b, np.add),
    "-": Function(2, lambda a, b: a - b, np.subtract),
    "*": Function(2, lambda a, b: a * b, np.multiply),
    "/": Function(2, _divided, np.divide),
    "%": _FUNCTIONS["fmod"],
    "^": _FUNCTIONS["pow"],
    "~": Function(1, lambda a: -a, np.negative),  # unary minus
}
_BINDS = {"+": 1, "-": 1, "*": 2, "/": 2, "%": 2, "~": 3, "^": 4}
_ALL = {**_FUNCTIONS, **_OPERATORS}
WORDS = frozenset((*_FUNCTIONS, *_SAME, "pi"))
"""Names that an expression keeps for itself."""

Node = float | str | tuple[Any, ...]  # a number, a name, or (function, argument, ..)


@dataclass(frozen=True, slots=True)
class Expression:
    """Arithmetic on named numbers.

    Attributes
    ----------
    text : str
        With ``+ - * / % ^``, parentheses, names, and functions such as ``sin(x)``; two that say the same are equal.

    Raises
    ------
    DefinitionError
        If the text is none, is longer than 2000 characters, or nests deeper than 50 parentheses.

    Examples
    --------
    >>> from fuzzy_arbiter.terms.expressions import Expression
    >>> Expression("2 * speed ^ 2 + 1")({"speed": 3.0})
    19.0
    """

    text: str
    tree: Node = None  # type: ignore[assignment]  # read from the text
    _number: Callable[[Mapping[str, float]], float] = field(init=False, repr=False, compare=False)
    _array: Callable[[Mapping[str, Any]], Any] = field(init=False, repr=False, compare=False)

    def __post_init__(self) -> None:
        tree = _Parser(self.text).all() if self.tree is None else self.tree
        object.__setattr__(self, "tree", tree)
        object.__setattr__(self, "text", said(tree))
        object.__setattr__(self, "_number", number_function(tree))
        object.__setattr__(self, "_array", array_function(tree))

    def __reduce__(self) -> tuple[Any, ...]:
        return Expression, (self.text, self.tree)

    @property
    def names(self) -> frozenset[str]:
        """The names whose numbers it needs."""
        return frozenset(_names(self.tree))

    def __call__(self, values: Mapping[str, float]) -> float:
        """Return the value for numbers, by IEEE 754: 0/0 is NaN, 1/0 infinite."""
        return float(self._number(values))

    def of_many(self, values: Mapping[str, Any]) -> Any:
        """Return the values for arrays of one shape."""
        with np.errstate(all="ignore"):
            return self._array(values)

    def bound(self, values: Mapping[str, float]) -> Expression:
        """Return the expression with numbers in the place of some names, worked out as far as they go."""
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
        return float(_ALL[node[0]].number(*parts))
    return (node[0], *parts)


def number_function(node: Node) -> Callable[[Mapping[str, float]], float]:
    """Return what evaluates a tree on numbers.

    Parameters
    ----------
    node : Node
        Of an `Expression`.

    Returns
    -------
    callable
        From names to numbers, to a number.
    """
    if isinstance(node, float):
        return lambda values: node
    if isinstance(node, str):
        return lambda values: values[node]
    function, parts = _ALL[node[0]].number, [number_function(part) for part in node[1:]]
    if len(parts) == 1:
        (one,) = parts
        return lambda values: function(one(values))
    first, second = parts
    return lambda values: function(first(values), second(values))


def array_function(node: Node) -> Callable[[Mapping[str, Any]], Any]:
    """Return what evaluates a tree on arrays.

    Parameters
    ----------
    node : Node
        Of an `Expression`.

    Returns
    -------
    callable
        From names to arrays, to an array, or to a number where nothing depends on the names.
    """
    if isinstance(node, float):
        return lambda values: node
    if isinstance(node, str):
        return lambda values: values[node]
    function, parts = _ALL[node[0]].array, [array_function(part) for part in node[1:]]
    return lambda values: function(*(part(values) for part in parts))


def said(node: Node) -> str:
    """Return a tree as text that reads as the same tree again.

    Parameters
    ----------
    node : Node
        Of an `Expression`.

    Returns
    -------
    str
        With no more parentheses than are needed.
    """
    return _said(node)[0]


def _said(node: Node) -> tuple[str, int]:
    """Return a node's text, and how strongly its outermost operator binds."""
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
    left, right = texts
    # of equal ones the left is first, but for powers
    first, second = (_within(left, binds + 1), _within(right, binds)) if word == "^" else (
        _within(left, binds),
        _within(right, binds + 1),
    )
    return (f"{first}^{second}" if word == "^" else f"{first} {word} {second}"), binds


def _within(part: tuple[str, int], binds: int) -> str:
    text, own = part
    return text if own >= binds else f"({text})"


def code(node: Node, names: Mapping[str, str]) -> str:
    """Return a tree as C and Python alike say it.

    Parameters
    ----------
    node : Node
        Of an `Expression`.
    names : mapping from name to str
        What each name is called there.

    Returns
    -------
    str
        Calls of functions of C's ``math.h``, of which Python's ``math`` has the same; comparisons and ``quotient`` and
        ``power`` are functions that the exported code brings along.
    """
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
    called = {"/": "quotient", "%": "fmod", "^": "power", "pow": "power", "abs": "fabs", "min": "least"}
    return f"{called.get(word, 'greatest' if word == 'max' else word)}({', '.join(texts)})"


class _Parser:
    """Reads one text by recursive descent."""

    def __init__(self, text: str) -> None:
        if not isinstance(text, str):
            raise DefinitionError(f"expression: {shown(text)} came, expected text")
        self.text = text
        if len(text) > MAX_LENGTH:
            raise self.fault(f"{len(text)} characters came, expected at most {MAX_LENGTH}")
        self.tokens = [match.groups(default="") for match in _TOKEN.finditer(text)]
        self.at = self.depth = 0

    def fault(self, what: str) -> DefinitionError:
        return DefinitionError(f"expression {shown(self.text.strip())}: {what}")

    @property
    def here(self) -> str:
        return "".join(self.tokens[self.at]) if self.at < len(self.tokens) else ""

    def unexpected(self, expected: str) -> DefinitionError:
        return self.fault(f"{repr(self.here) if self.here else 'the end'} came, expected {expected}")

    def accept(self, *signs: str) -> str:
        sign = self.here
        if sign not in signs or not sign:
            return ""
        self.at += 1
        return sign

    def all(self) -> Node:
        tree = self.sum()
        if self.here:
            raise self.unexpected("an operator or the end")
        level, depth = [tree], 0
        while level := [part for node in level if isinstance(node, tuple) for part in node[1:]]:
            depth += 1
        if depth > MAX_DEPTH:
            raise self.fault(f"has {depth} operators within each other, expected at most {MAX_DEPTH}")
        return tree

    def deeper(self) -> None:
        self.depth += 1
        if self.depth > MAX_NESTING:
            raise self.fault(f"nested deeper than {MAX_NESTING} parentheses")

    def joined(self, signs: tuple[str, ...], part: Callable[[], Node]) -> Node:
        tree = part()
        while sign := self.accept(*signs):
            tree = (sign, tree, part())
        return tree

    def sum(self) -> Node:
        return self.joined(("+", "-"), self.product)

    def product(self) -> Node:
        return self.joined(("*", "/", "%"), self.signed)

    def signed(self) -> Node:
        if sign := self.accept("+", "-", "~"):
            self.deeper()
            tree = self.signed()
            self.depth -= 1
            return tree if sign == "+" else -tree if isinstance(tree, float) else ("~", tree)
        return self.power()

    def power(self) -> Node:
        base = self.atom()
        if not self.accept("^"):
            return base
        self.deeper()
        tree = ("^", base, self.signed())
        self.depth -= 1
        return tree

    def atom(self) -> Node:
        number, name, sign = self.tokens[self.at] if self.at < len(self.tokens) else ("", "", "")
        if number:
            self.at += 1
            if not math.isfinite(float(number)):
                raise self.fault(f"{number} came, expected a finite number")
            return float(number)
        if name:
            self.at += 1
            return self.called(name) if self.here == "(" else math.pi if name == "pi" else self.plain(name)
        if sign == "(":
            self.at += 1
            tree = self.inner()
            if not self.accept(")"):
                raise self.unexpected("')' or an operator")
            return tree
        raise self.unexpected("a number, a name, a function or '('")

    def inner(self) -> Node:
        self.deeper()
        tree = self.sum()
        self.depth -= 1
        return tree

    def plain(self, name: str) -> str:
        if name in WORDS:
            raise self.unexpected(f"'(' after the function {name!r}")
        return name

    def called(self, name: str) -> Node:
        word = _SAME.get(name.lower(), name.lower())
        if word == "pi":
            self.at += 1
            if not self.accept(")"):
                raise self.unexpected("')' after 'pi('")
            return math.pi
        if word not in _FUNCTIONS:
            raise self.fault(f"no function {name!r}, expected one of {', '.join(sorted(WORDS))}")
        self.at += 1
        arguments = [self.inner()]
        while self.accept(","):
            arguments.append(self.inner())
        if not self.accept(")"):
            raise self.unexpected("')', ',' or an operator")
        if len(arguments) != _FUNCTIONS[word].arguments:
            raise self.fault(f"{name} of {len(arguments)} numbers, expected {_FUNCTIONS[word].arguments}")
        return (word, *arguments)
