"""Parse expressions."""

from __future__ import annotations

import math
import re
from collections.abc import Callable
from typing import Any

from fuzzy_arbiter.checks import shown
from fuzzy_arbiter.errors import DefinitionError
from fuzzy_arbiter.terms.functions import FUNCTIONS, SAME, WORDS

MAX_LENGTH = 2000  # maximum number of characters of an expression
MAX_NESTING = 50  # maximum number of nested parentheses and signs
MAX_DEPTH = 200  # maximum number of nested operators; a sum of n terms has n - 1

_TOKEN = re.compile(r"\s*(?:(\d+\.?\d*(?:[eE][+-]?\d+)?|\.\d+(?:[eE][+-]?\d+)?)|([A-Za-z_]\w*)|(\S))", re.ASCII)

Node = float | str | tuple[Any, ...]  # a number, a name, or (function, argument, ..)


def parsed(text: str) -> Node:
    """Parse a text as an expression's tree."""
    if not isinstance(text, str):
        raise DefinitionError(f"expression: got {shown(text)}, expected text")
    try:
        return _Parser(text).all()
    except DefinitionError as error:
        raise DefinitionError(f"expression {shown(text.strip())}: {error}") from None


class _Parser:
    """Parse one text by recursive descent."""

    def __init__(self, text: str) -> None:
        if len(text) > MAX_LENGTH:
            raise DefinitionError(f"got {len(text)} characters, expected at most {MAX_LENGTH}")
        self.tokens = [match.groups(default="") for match in _TOKEN.finditer(text)]
        self.at = self.depth = 0

    @property
    def here(self) -> str:
        return "".join(self.tokens[self.at]) if self.at < len(self.tokens) else ""

    def unexpected(self, expected: str) -> DefinitionError:
        return DefinitionError(f"got {repr(self.here) if self.here else 'the end'}, expected {expected}")

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
            raise DefinitionError(f"has {depth} operators within each other, expected at most {MAX_DEPTH}")
        return tree

    def inner(self, parse: Callable[[], Node]) -> Node:
        """Parse what is nested in parentheses, or follows a sign."""
        self.depth += 1
        if self.depth > MAX_NESTING:
            raise DefinitionError(f"nested deeper than {MAX_NESTING} parentheses")
        tree = parse()
        self.depth -= 1
        return tree

    def sum(self, signs: tuple[str, ...] = ("+", "-")) -> Node:
        part = self.signed if "*" in signs else lambda: self.sum(("*", "/", "%"))
        tree = part()
        while sign := self.accept(*signs):
            tree = (sign, tree, part())
        return tree

    def signed(self) -> Node:
        if sign := self.accept("+", "-", "~"):
            tree = self.inner(self.signed)
            return tree if sign == "+" else -tree if isinstance(tree, float) else ("~", tree)
        base = self.atom()
        return ("^", base, self.inner(self.signed)) if self.accept("^") else base

    def atom(self) -> Node:
        number, name, sign = self.tokens[self.at] if self.at < len(self.tokens) else ("", "", "")
        if not (number or name or sign == "("):
            raise self.unexpected("a number, a name, a function or '('")
        self.at += 1
        if number:
            if not math.isfinite(float(number)):
                raise DefinitionError(f"got {number}, expected a finite number")
            return float(number)
        if name and self.here != "(":
            if name in WORDS - {"pi"}:
                raise self.unexpected(f"'(' after the function {name!r}")
            return math.pi if name == "pi" else name
        if name:
            return self.called(name)
        tree = self.inner(self.sum)
        if not self.accept(")"):
            raise self.unexpected("')' or an operator")
        return tree

    def called(self, name: str) -> Node:
        word = SAME.get(name.lower(), name.lower())
        if word == "pi":
            self.at += 1
            if not self.accept(")"):
                raise self.unexpected("')' after 'pi('")
            return math.pi
        if word not in FUNCTIONS:
            raise DefinitionError(f"no function {name!r}, expected one of {', '.join(sorted(WORDS))}")
        self.at += 1
        arguments = [self.inner(self.sum)]
        while self.accept(","):
            arguments.append(self.inner(self.sum))
        if not self.accept(")"):
            raise self.unexpected("')', ',' or an operator")
        if len(arguments) != FUNCTIONS[word].arguments:
            raise DefinitionError(f"{name} of {len(arguments)} numbers, expected {FUNCTIONS[word].arguments}")
        return (word, *arguments)
