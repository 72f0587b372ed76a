"""Read the Fuzzy Control Language."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field, replace
from typing import Any

from fuzzy_arbiter.definition import WEIGHTED, Output, System, Variable
from fuzzy_arbiter.formats.fcl_cursor import Cursor
from fuzzy_arbiter.formats.fcl_terms import universe_of
from fuzzy_arbiter.formats.fcl_words import (
    CONJUNCTIONS,
    DISJUNCTIONS,
    JOINS,
    METHODS,
    PAIRS,
    SECTIONS,
    Token,
    block_name,
)
from fuzzy_arbiter.formats.notation import assembled, join_rule_blocks, located, refuse
from fuzzy_arbiter.propositions import Is, quoted
from fuzzy_arbiter.rule import Operators, Rule
from fuzzy_arbiter.rule_text import parse_rules
from fuzzy_arbiter.terms.term import Term
from fuzzy_arbiter.terms.values import Constant, Linear, Value

_RULE_WORDS = frozenset(("if", "then", "and", "or", "not", "is", "with"))


def system_of(tokens: list[Token], fuzzylite: bool, settings: dict[str, Any]) -> System:
    """Build the system of one function block."""
    return _Reader(tokens, fuzzylite=fuzzylite).system(settings)


@dataclass
class _Draft:
    """The part of a variable that is read so far."""

    line: int
    universe: tuple[float, float] | None = None
    default: float | None = None
    terms: list[Term] | None = None
    places: list[float] = field(default_factory=list)
    method: str | None = None
    accumulation: str | None = None
    locks: set[str] = field(default_factory=set)


@dataclass
class _Block:
    """The statements of a rule block."""

    line: int
    norms: dict[str, str] = field(default_factory=dict)
    rules: list[tuple[int, Rule]] = field(default_factory=list)

    def operators(self) -> Operators:
        """Return the operators; AND and OR imply each other, and a missing ACT is MIN."""
        conjunction = self.norms.get("AND") or next((a for a, b in PAIRS.items() if b == self.norms.get("OR")), "min")
        return Operators(conjunction, self.norms.get("OR", PAIRS[conjunction]), self.norms.get("ACT", "min"))


def _on_first_of_value(rule: Rule, outputs: list[Output]) -> Rule:
    """Return a rule that concludes the first of terms of one value: jFuzzyLogic joins strengths by value."""
    known = {output.name: output for output in outputs if output.weighted and output.aggregation != "sum"}
    shapes = {(name, term.name): term.shape for name, output in known.items() for term in output.terms}
    conclusions = tuple(
        next(
            Is(c.variable, term)
            for (name, term), shape in shapes.items()
            if name == c.variable and shape == shapes[c.variable, c.term]
        )
        if (c.variable, c.term) in shapes
        else c
        for c in rule.conclusions
    )
    return rule if conclusions == rule.conclusions else replace(rule, conclusions=conclusions)


@dataclass
class _Reader(Cursor):
    """Parse one text by recursive descent."""

    inputs: dict[str, _Draft] = field(default_factory=dict)
    outputs: dict[str, _Draft] = field(default_factory=dict)
    blocks: list[_Block] = field(default_factory=list)

    def input_names(self) -> tuple[str, ...]:
        return tuple(self.inputs)

    def system(self, settings: dict[str, Any]) -> System:
        begin = self.take("FUNCTION_BLOCK")
        name = block_name(self.tokens[self.index :])
        while name and self.here.line == begin.line and self.here.text.upper() not in SECTIONS:
            self.index += 1
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
            self.unexpected("the end of the file")
        accumulations = {block.norms["ACCU"]: block.line for block in self.blocks if "ACCU" in block.norms}
        if len(accumulations) > 1:
            refuse(max(accumulations.values()), "RULEBLOCK has another ACCU than that before it, expected the same")
        accumulation = next(iter(accumulations), None)
        inputs, outputs = [], []
        for variable, draft in self.inputs.items():
            with located(f"line {draft.line}"):
                inputs.append(Variable(*self.parts(variable, draft, "FUZZIFY", False)))
        for variable, draft in self.outputs.items():
            outputs.append(self.output(variable, draft, accumulation))
        norms, rules = join_rule_blocks([(block.operators(), block.rules) for block in self.blocks])
        if not self.fuzzylite:
            rules = [(line, _on_first_of_value(rule, outputs)) for line, rule in rules]
        return assembled(begin.line, inputs, outputs, rules, name=name or "arbiter", **norms, **settings)

    def output(self, name: str, draft: _Draft, accumulation: str | None) -> Output:
        shapes = [term.shape for term in draft.terms or ()]
        values = any(isinstance(shape, Constant | Linear) for shape in shapes)
        sets = any(not isinstance(shape, Value) for shape in shapes)
        method: Any = draft.method or ("average" if values and not sets else "centroid")  # the default of jFuzzyLogic
        weighted = method in WEIGHTED
        own = draft.accumulation or accumulation or ("sum" if weighted and self.fuzzylite else "max")
        with located(f"line {draft.line}"):
            parts = self.parts(name, draft, "DEFUZZIFY", weighted)
            return Output(*parts, draft.default, method, own, "RANGE" in draft.locks, "PREVIOUS" in draft.locks)

    def parts(
        self, name: str, draft: _Draft, section: str, weighted: bool
    ) -> tuple[str, tuple[float, float], tuple[Term, ...]]:
        if draft.terms is None:
            refuse(draft.line, f"{name!r} has no {section}")
        universe = draft.universe or universe_of(draft.places)
        if universe is None and weighted:  # values do not depend on the universe
            low, high = min(draft.places, default=0.0), max(draft.places, default=0.0)
            universe = (low - 1.0, high + 1.0)
        if universe is None:
            refuse(
                draft.line, f"{name!r} has no range, and its points make none; expected RANGE := (least .. greatest);"
            )
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

    def draft(self, known: dict[str, _Draft], section: str) -> _Draft:
        token = self.name("a variable's name")
        if token.text not in known:
            refuse(
                token.line, f"{section} {token.text!r}, expected one of {', '.join(known) or 'none: none is declared'}"
            )
        draft = known[token.text]
        if draft.terms is not None:
            refuse(token.line, f"{section} {token.text!r} appears twice")
        draft.line, draft.terms = token.line, []
        return draft

    def fuzzify(self) -> None:
        draft = self.draft(self.inputs, "FUZZIFY")
        while not self.accept("END_FUZZIFY"):
            word = self.take("TERM", "RANGE", "ENABLED", "END_FUZZIFY").text.upper()
            if word == "TERM":
                self.term(draft, None)
            elif word == "ENABLED":
                self.choice({"TRUE": True})
            else:
                self.only_range(draft)
                self.fuzzylite = True

    def only_range(self, draft: _Draft) -> None:
        if draft.universe is not None:
            refuse(self.here.line, "RANGE appears twice")
        draft.universe = self.range()

    def defuzzify(self) -> None:
        draft = self.draft(self.outputs, "DEFUZZIFY")
        keywords: set[str] = set()
        while not self.accept("END_DEFUZZIFY"):
            key = self.take("TERM", "METHOD", "DEFAULT", "RANGE", "ACCU", "LOCK", "ENABLED", "END_DEFUZZIFY")
            word = key.text.upper()
            if word == "TERM":
                self.term(draft, len(self.inputs))
                continue
            if word in keywords:
                refuse(key.line, f"{word} appears twice")
            keywords.add(word)
            if word == "RANGE":
                self.only_range(draft)
            elif word == "DEFAULT":
                self.default(draft)
            elif word == "ACCU":
                draft.accumulation = self.choice(JOINS)
            elif word == "LOCK":
                draft.locks |= self.flags(("PREVIOUS", "RANGE"))
            elif word == "ENABLED":
                self.choice({"TRUE": True})
            else:
                draft.method = self.choice(METHODS)

    def default(self, draft: _Draft) -> None:
        """Take a default: a number, or none; fuzzylite adds NC where the previous value is kept."""
        self.take(":=")
        if not self.accept("NC", "NAN"):
            draft.default = self.number("the default, or NC")
        if self.accept("|"):
            self.take("NC")
            draft.locks.add("PREVIOUS")
        self.take(";")

    def term(self, draft: _Draft, inputs: int | None) -> None:
        assert draft.terms is not None
        token = self.name("a term's name")
        self.take(":=")
        with located(f"line {token.line}: term {token.text!r}"):
            shape, places = self.shape(inputs)
            draft.terms.append(Term(token.text, shape))
        draft.places += places
        self.take(";")

    def rule_block(self) -> None:
        block = _Block(self.here.line)
        self.blocks.append(block)
        choices = {"AND": CONJUNCTIONS, "OR": DISJUNCTIONS, "ACT": CONJUNCTIONS, "ACCU": JOINS}
        if self.here.text.upper() not in (*choices, "RULE", "ENABLED", "END_RULEBLOCK"):
            self.name("the rule block's name")
        while not self.accept("END_RULEBLOCK"):
            key = self.take(*choices, "RULE", "ENABLED", "END_RULEBLOCK")
            word = key.text.upper()
            if word == "RULE":
                self.rule(key.line, block)
            elif word == "ENABLED":
                self.choice({"TRUE": True})
            elif word in block.norms:
                refuse(key.line, f"{word} appears twice")
            else:
                block.norms[word] = self.choice(choices[word])

    def rule(self, line: int, block: _Block) -> None:
        if self.here.kind in ("name", "number"):
            self.index += 1
        elif self.here.text != ":":
            self.unexpected("the rule's number")
        self.take(":")
        start = self.index
        while self.here.text != ";" and self.here.kind != "end":
            if self.index > start and self.here.line > self.tokens[self.index - 1].line and self.next_statement():
                self.fuzzylite = True  # fuzzylite ends a rule with its line
                break
            self.index += 1
        # read as names, except the words of rules, since the language has no other words
        words = [
            token if token.text.lower() in _RULE_WORDS else self.as_name(token)
            for token in self.tokens[start : self.index]
        ]
        if not self.fuzzylite or self.here.text == ";":
            self.take(";")
        with located(f"line {line}"):
            block.rules += [(line, rule) for rule in parse_rules(" ".join(token.text for token in words))]

    def next_statement(self) -> bool:
        """Return True if another statement of a rule block begins here."""
        after = self.tokens[self.index + 1] if self.here.kind != "end" else self.here
        word = self.here.text.upper()
        return word in ("RULE", "END_RULEBLOCK") and (word != "RULE" or after.kind in ("name", "number", "sign"))

    def as_name(self, token: Token) -> Token:
        own = token.text.lower() == "any" and any(
            term.name == token.text for draft in self.inputs.values() for term in draft.terms or ()
        )
        return token._replace(text=quoted(token.text)) if own else token
