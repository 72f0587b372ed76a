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
    return _Parser(text).all()


class _Parser:
    """Parse one text by recursive descent."""

    def __init__(self, text: str) -> None:
        if not isinstance(text, str):
            raise DefinitionError(f"expression: got {shown(text)}, expected text")
        self.text = text
        if len(text) > MAX_LENGTH:
            raise self.fault(f"got {len(text)} characters, expected at most {MAX_LENGTH}")
        self.tokens = [match.groups(default="") for match in _TOKEN.finditer(text)]
        self.at = self.depth = 0

    def fault(self, what: str) -> DefinitionError:
        return DefinitionError(f"expression {shown(self.text.strip())}: {what}")

    @property
    def here(self) -> str:
        return "".join(self.tokens[self.at]) if self.at < len(self.tokens) else ""

    def unexpected(self, expected: str) -> DefinitionError:
        return self.fault(f"got {repr(self.here) if self.here else 'the end'}, expected {expected}")

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
                raise self.fault(f"got {number}, expected a finite number")
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
        word = SAME.get(name.lower(), name.lower())
        if word == "pi":
            self.at += 1
            if not self.accept(")"):
                raise self.unexpected("')' after 'pi('")
            return math.pi
        if word not in FUNCTIONS:
            raise self.fault(f"no function {name!r}, expected one of {', '.join(sorted(WORDS))}")
        self.at += 1
        arguments = [self.inner()]
        while self.accept(","):
            arguments.append(self.inner())
        if not self.accept(")"):
            raise self.unexpected("')', ',' or an operator")
        if len(arguments) != FUNCTIONS[word].arguments:
            raise self.fault(f"{name} of {len(arguments)} numbers, expected {FUNCTIONS[word].arguments}")
        return (word, *arguments)
