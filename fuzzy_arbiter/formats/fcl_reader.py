"""Reads the Fuzzy Control Language."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any, NoReturn

from fuzzy_arbiter.definition import Output, System, Term, Variable
from fuzzy_arbiter.formats.fcl_words import CONJUNCTIONS, DISJUNCTIONS, PAIRS, RESERVED, Token
from fuzzy_arbiter.formats.notation import assembled, located, read_number, refuse
from fuzzy_arbiter.rule import Rule
from fuzzy_arbiter.rule_text import parse_rule
from fuzzy_arbiter.shapes import Point, Shape, trapezoid, triangle


def system_of(tokens: list[Token], settings: dict[str, Any]) -> System:
    """Return the system of one function block.

    Parameters
    ----------
    tokens : list of Token
        Of all of the text.
    settings : dict
        Further attributes of `System`, of the comment.

    Returns
    -------
    System
        Mamdani, with the centroid.

    Raises
    ------
    FormatError, DefinitionError
        As of `fuzzy_arbiter.formats.reads`.
    """
    return _Reader(tokens).system(settings)


@dataclass
class _Draft:
    """What is known of a variable so far."""

    line: int
    universe: tuple[float, float] | None = None
    default: float | None = None
    terms: list[Term] | None = None
    places: list[float] = field(default_factory=list)
    accumulates: bool = False


@dataclass
class _Reader:
    """Reads one text by recursive descent."""

    tokens: list[Token]
    at: int = 0
    inputs: dict[str, _Draft] = field(default_factory=dict)
    outputs: dict[str, _Draft] = field(default_factory=dict)
    rules: list[tuple[int, Rule]] = field(default_factory=list)
    norms: dict[str, str] | None = None

    @property
    def here(self) -> Token:
        return self.tokens[self.at]

    def unexpected(self, expected: str) -> NoReturn:
        before = f" after {self.tokens[self.at - 1].text!r}" if self.at else ""
        found = self.here.text if self.here.kind == "end" else repr(self.here.text)
        refuse(self.here.line, f"{found} came{before}, expected {expected}")

    def accept(self, *words: str) -> Token | None:
        """Take the next token if it is one of these words or signs."""
        token = self.here
        if token.kind in ("name", "sign") and token.text.upper() in words:
            self.at += 1
            return token
        return None

    def take(self, *words: str) -> Token:
        return self.accept(*words) or self.unexpected(" or ".join(words))

    def name(self, what: str) -> Token:
        if self.here.kind != "name" or self.here.text.lower() in RESERVED:
            self.unexpected(what)
        self.at += 1
        return self.tokens[self.at - 1]

    def number(self, what: str) -> float:
        if self.here.kind != "number":
            self.unexpected(f"a number, {what}")
        self.at += 1
        return read_number(self.tokens[self.at - 1].text, self.tokens[self.at - 1].line, what)

    def system(self, settings: dict[str, Any]) -> System:
        begin = self.take("FUNCTION_BLOCK")
        name = self.name("the block's name").text if self.here.text.lower() not in RESERVED else "arbiter"
        sections: dict[str, Callable[[], None]] = {
            "VAR_INPUT": lambda: self.variables(self.inputs),
            "VAR_OUTPUT": lambda: self.variables(self.outputs),
            "FUZZIFY": self.fuzzify,
            "DEFUZZIFY": self.defuzzify,
            "RULEBLOCK": self.rule_block,
        }
        while not self.accept("END_FUNCTION_BLOCK"):
            sections[self.take(*sections, "END_FUNCTION_BLOCK").text.upper()]()
        if self.here.kind != "end":
            self.unexpected("the end of the file; one function block makes a system")
        inputs, outputs = [], []
        for variable, draft in self.inputs.items():
            with located(f"line {draft.line}"):
                inputs.append(Variable(*self.parts(variable, draft, "FUZZIFY")))
        for variable, draft in self.outputs.items():
            with located(f"line {draft.line}"):
                outputs.append(Output(*self.parts(variable, draft, "DEFUZZIFY"), draft.default))
        return assembled(begin.line, inputs, outputs, self.rules, name=name, **(self.norms or {}), **settings)

    def parts(self, name: str, draft: _Draft, section: str) -> tuple[str, tuple[float, float], tuple[Term, ...]]:
        if draft.terms is None:
            refuse(draft.line, f"{name!r} has no {section}")
        universe = draft.universe or universe_of(draft.places)
        if universe is None:
            refuse(
                draft.line, f"{name!r} has no range, and its points make none; expected RANGE := (least .. greatest);"
            )
        with located(f"line {draft.line}"):
            Variable(name, universe, tuple(draft.terms))
        return name, universe, tuple(draft.terms)

    def variables(self, into: dict[str, _Draft]) -> None:
        while not self.accept("END_VAR"):
            names = [self.name("a variable's name or END_VAR")]
            while self.accept(","):
                names.append(self.name("a variable's name"))
            self.take(":")
            self.take("REAL")
            self.take(";")
            universe = self.range() if self.accept("RANGE") else None
            for token in names:
                if token.text in self.inputs or token.text in self.outputs:
                    refuse(token.line, f"{token.text!r} is declared twice")
                into[token.text] = _Draft(token.line, universe)

    def range(self) -> tuple[float, float]:
        self.accept(":=")  # which some texts of the standard leave out
        self.take("(")
        low = self.number("the least value")
        self.take("..")
        high = self.number("the greatest value")
        self.take(")")
        self.take(";")
        return low, high

    def draft(self, known: dict[str, _Draft], section: str) -> _Draft:
        token = self.name("a variable's name")
        if token.text not in known:
            refuse(
                token.line, f"{section} {token.text!r}, expected one of {', '.join(known) or 'none: none is declared'}"
            )
        draft = known[token.text]
        if draft.terms is not None:
            refuse(token.line, f"{section} {token.text!r} came twice")
        draft.line, draft.terms = token.line, []
        return draft

    def fuzzify(self) -> None:
        draft = self.draft(self.inputs, "FUZZIFY")
        while not self.accept("END_FUZZIFY"):
            if self.take("TERM", "RANGE", "END_FUZZIFY").text.upper() == "TERM":
                self.term(draft)
            else:
                self.only_range(draft)

    def only_range(self, draft: _Draft) -> None:
        if draft.universe is not None:
            refuse(self.here.line, "RANGE came twice")
        draft.universe = self.range()

    def defuzzify(self) -> None:
        draft = self.draft(self.outputs, "DEFUZZIFY")
        seen: set[str] = set()
        while not self.accept("END_DEFUZZIFY"):
            key = self.take("TERM", "METHOD", "DEFAULT", "RANGE", "ACCU", "END_DEFUZZIFY")
            word = key.text.upper()
            if word == "TERM":
                self.term(draft)
                continue
            if word in seen:
                refuse(key.line, f"{word} came twice")
            seen.add(word)
            if word == "RANGE":
                self.only_range(draft)
            elif word == "DEFAULT":
                self.take(":=")
                draft.default = None if self.accept("NC") else self.number("the default, or NC")
                self.take(";")
            elif word == "ACCU":
                draft.accumulates = bool(self.choice({"MAX": "max"}))
            else:
                self.choice({"COG": ""})
        if "METHOD" not in seen:
            refuse(draft.line, "DEFUZZIFY without METHOD, expected METHOD : COG;")

    def choice(self, words: dict[str, str]) -> str:
        self.take(":")
        word = self.take(*words)
        self.take(";")
        return words[word.text.upper()]

    def term(self, draft: _Draft) -> None:
        assert draft.terms is not None
        token = self.name("a term's name")
        self.take(":=")
        with located(f"line {token.line}: term {token.text!r}"):
            shape, places = self.shape()
            draft.terms.append(Term(token.text, shape))
        draft.places += places
        self.take(";")

    def shape(self) -> tuple[Shape, list[float]]:
        if self.accept("TRIAN"):
            a, b, c = (self.number("a place") for _ in range(3))
            return triangle(a, b, c), [a, c]
        if self.accept("TRAPE"):
            a, b, c, d = (self.number("a place") for _ in range(4))
            return trapezoid(a, b, c, d), [a, d]
        points: list[Point] = []
        while self.accept("("):
            place = self.number("a place")
            self.take(",")
            points.append((place, self.number("a degree")))
            self.take(")")
            self.accept(",")  # which examples of the standard have
        if not points:
            self.unexpected("points such as (0, 0) (5, 1); a singleton or another function is not known here")
        return Shape(tuple(points)), [x for x, _ in points]

    def rule_block(self) -> None:
        first = self.name("the rule block's name")
        choices = {"AND": CONJUNCTIONS, "OR": DISJUNCTIONS, "ACT": CONJUNCTIONS, "ACCU": {"MAX": "max"}}
        said: dict[str, str] = {}
        while not self.accept("END_RULEBLOCK"):
            key = self.take(*choices, "RULE", "END_RULEBLOCK")
            word = key.text.upper()
            if word == "RULE":
                self.rule(key.line)
            elif word in said:
                refuse(key.line, f"{word} came twice")
            else:
                said[word] = self.choice(choices[word])
        # some tools say it of each output
        if "ACCU" not in said and not all(draft.accumulates for draft in self.outputs.values()):
            refuse(first.line, f"RULEBLOCK {first.text!r} without ACCU, expected ACCU : MAX;")
        conjunction = said.get("AND") or next((a for a, b in PAIRS.items() if b == said.get("OR")), "min")
        if said.get("OR", PAIRS[conjunction]) != PAIRS[conjunction]:
            refuse(first.line, "AND and OR are no pair of the standard, expected MIN with MAX, or PROD with ASUM")
        norms = {"conjunction": conjunction, "disjunction": PAIRS[conjunction], "implication": said.get("ACT", "min")}
        if self.norms not in (None, norms):
            refuse(first.line, f"RULEBLOCK {first.text!r} has other AND, OR or ACT than that before it")
        self.norms = norms

    def rule(self, line: int) -> None:
        if self.here.kind not in ("name", "number"):
            self.unexpected("the rule's number")
        self.at += 1
        self.take(":")
        start = self.at
        while self.here.text != ";" and self.here.kind != "end":
            self.at += 1
        text = " ".join(token.text for token in self.tokens[start : self.at])
        self.take(";")
        with located(f"line {line}"):
            self.rules.append((line, parse_rule(text)))


def universe_of(places: list[float]) -> tuple[float, float] | None:
    """Return the universe that points make, where none is said.

    Parameters
    ----------
    places : list of float
        Of all terms of a variable.

    Returns
    -------
    (float, float) or None
        Least and greatest; None if they are not two.
    """
    low, high = min(places, default=0.0), max(places, default=0.0)
    return (low, high) if low < high else None
