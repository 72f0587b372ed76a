"""Read the tokens of the Fuzzy Control Language in order, and parse small groups of them."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import NoReturn, TypeVar

from fuzzy_arbiter.formats.fcl_terms import COUNTS, read_curve
from fuzzy_arbiter.formats.fcl_words import RESERVED, Token
from fuzzy_arbiter.formats.fll_terms import TYPES, read_shape
from fuzzy_arbiter.formats.notation import read_number, refuse
from fuzzy_arbiter.shapes import Membership, Point, Shape
from fuzzy_arbiter.terms.curves import Curve
from fuzzy_arbiter.terms.values import Constant, Formula, Linear, Value

_T = TypeVar("_T")


@dataclass
class Cursor:
    """A position among the tokens of a text."""

    tokens: list[Token]  # all tokens of the text
    index: int = 0  # index of the next token
    fuzzylite: bool = False  # true if a construct so far is one of fuzzylite's, and not of the standard or jFuzzyLogic

    @property
    def here(self) -> Token:
        """The next token."""
        return self.tokens[self.index]

    def unexpected(self, expected: str) -> NoReturn:
        """Refuse the next token."""
        before = f" after {self.tokens[self.index - 1].text!r}" if self.index else ""
        found = self.here.text if self.here.kind == "end" else repr(self.here.text)
        refuse(self.here.line, f"got {found}{before}, expected {expected}")

    def accept(self, *words: str) -> Token | None:
        """Take the next token if it is one of these words or signs."""
        token = self.here
        if token.kind in ("name", "sign") and token.text.upper() in words:
            self.index += 1
            return token
        return None

    def take(self, *words: str) -> Token:
        """Take the next token, which must be one of these words or signs."""
        return self.accept(*words) or self.unexpected(" or ".join(words))

    def name(self, what: str) -> Token:
        """Take a name."""
        if self.here.kind != "name" or self.here.text.lower() in RESERVED:
            self.unexpected(what)
        self.index += 1
        return self.tokens[self.index - 1]

    def number(self, what: str) -> float:
        """Take a number."""
        if self.here.kind != "number":
            self.unexpected(f"a number, {what}")
        self.index += 1
        return read_number(self.tokens[self.index - 1].text, self.tokens[self.index - 1].line, what)

    def choice(self, words: Mapping[str, _T]) -> _T:
        """Take a colon, one of some words, and the end of the statement."""
        self.take(":")
        word = self.take(*words)
        self.take(";")
        return words[word.text.upper()]

    def flags(self, what: tuple[str, ...]) -> set[str]:
        """Take a colon, some words with | between them, and the end of the statement."""
        self.take(":")
        found = {self.take(*what).text.upper()}
        while self.accept("|"):
            found.add(self.take(*what).text.upper())
        self.take(";")
        return found

    def range(self) -> tuple[float, float]:
        """Take the two limits after the word of a range, in the units of the variable."""
        self.accept(":=")  # some texts of the standard leave it out
        self.take("(")
        low = self.number("the least value")
        self.take("..")
        high = self.number("the greatest value")
        self.take(")")
        self.take(";")
        return low, high

    def rest(self) -> str:
        """Take all tokens up to the end of the statement, as text."""
        start = self.index
        while self.here.text != ";" and self.here.kind != "end":
            self.index += 1
        return " ".join(token.text for token in self.tokens[start : self.index])

    def shape(self, inputs: int | None) -> tuple[Membership | Value, list[float]]:
        """Parse a term's shape, and its lowest and highest point."""
        if self.here.kind == "number":
            value = self.number("a value")
            return Constant(value) if inputs is not None else Curve("singleton", (value,)), [value]
        if self.here.kind == "name":
            token = self.here
            self.index += 1
            word = token.text.upper()
            if word in COUNTS and token.text not in TYPES:
                return read_curve(word, [self.number("a parameter") for _ in range(COUNTS[word])])
            if token.text == "FUNCTION":  # jFuzzyLogic's, whose LOG is that to the base of 10
                return self.function(), []
            if token.text not in (*COUNTS, *TYPES):
                expected = (
                    f"points such as (0, 0) (5, 1), a number, or one of {', '.join(('FUNCTION', *COUNTS, *TYPES))}"
                )
                refuse(token.line, f"{token.text!r} is no membership function, expected {expected}")
            self.fuzzylite = True
            shape = read_shape(token.text, self.rest(), token.line, inputs)
            return shape, [shape.value] if isinstance(shape, Constant) else []
        points: list[Point] = []
        while self.accept("("):
            place = self.number("a place")
            self.take(",")
            points.append((place, self.number("a degree")))
            self.take(")")
            self.accept(",")  # examples of the standard have it
        if not points:
            self.unexpected("points such as (0, 0) (5, 1), a number or a function such as GAUSS")
        return Shape(tuple(points)), [x for x, _ in points]

    def function(self) -> Formula | Linear:
        """Take jFuzzyLogic's function of the inputs, as a linear value where it has that form."""
        formula = Formula(_decimal_logs(self.rest()))
        linear = Linear.of(formula.expression(sorted(formula.names)).tree, self.input_names())
        return linear or formula

    def input_names(self) -> tuple[str, ...]:
        """Return the names of the inputs so far."""
        return ()


def _decimal_logs(text: str) -> str:
    return " ".join("log10" if word.upper() == "LOG" else word for word in text.split(" "))
