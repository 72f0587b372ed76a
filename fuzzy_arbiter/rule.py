"""A rule: a condition, its conclusions, and its weight; and rules as text."""

from __future__ import annotations

import re
from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import partial
from typing import TypeVar

from fuzzy_arbiter.checks import all_of, finite, require_choice, shown
from fuzzy_arbiter.errors import DefinitionError
from fuzzy_arbiter.propositions import KEYWORDS, MAX_NESTING, And, Anything, Hedged, Is, Not, Or, Proposition, bend
from fuzzy_arbiter.terms.norms import HEDGES, S_NORMS, T_NORMS

_TOKEN = re.compile(
    r"""\s*(?: (?P<quoted>"[^"]*") | (?P<number>[0-9.]+(?:[eE][+-]?[0-9]+)?(?![A-Za-z_]))
        | (?P<word>[^\W\d]\w*) | (?P<sign>[()&|~,]) | (?P<other>\S) )""",
    re.VERBOSE,
)
_SIGNS = {"&": "and", "|": "or", "~": "not", ",": ","}


@dataclass(frozen=True, slots=True)
class Operators:
    """The norms of a block of rules.

    Attributes
    ----------
    conjunction, implication : str
        Names from `fuzzy_arbiter.terms.norms.T_NORMS`.
    disjunction : str
        Name from `fuzzy_arbiter.terms.norms.S_NORMS`.

    Raises
    ------
    DefinitionError
        If there is no such norm.

    Examples
    --------
    >>> from fuzzy_arbiter import Operators, Rule
    >>> Rule.parse("if wind is calm then sail is full", Operators("prod")).operators.conjunction
    'prod'
    """

    conjunction: str = "min"
    disjunction: str = "max"
    implication: str = "min"

    def __post_init__(self) -> None:
        for key, known in (("conjunction", T_NORMS), ("disjunction", S_NORMS), ("implication", T_NORMS)):
            require_choice(getattr(self, key), known, key)


@dataclass(frozen=True, slots=True)
class Rule:
    """If a condition holds, then outputs are in terms, as strongly as it holds times the rule's weight.

    Attributes
    ----------
    condition : Proposition
        Condition on inputs.
    conclusions : tuple of Is
        Conclusions on outputs, at least one.
    weight : float
        Weight, above 0 and at most 1.
    operators : Operators or None
        Operators of its block, where a system has several; None for those of the system.

    Raises
    ------
    DefinitionError
        If there is no conclusion, or the weight is outside its range.

    Examples
    --------
    >>> from fuzzy_arbiter import Arbiter
    >>> system = Arbiter().system
    >>> print(system.rules[0])
    if obstacle is exist then alpha_1 is high
    """

    condition: Proposition
    conclusions: tuple[Is, ...]
    weight: float = 1.0
    operators: Operators | None = None

    def __post_init__(self) -> None:
        if not isinstance(self.condition, Proposition):
            raise DefinitionError(f"rule: condition is {shown(self.condition)}, expected such as variable['term']")
        listed = (self.conclusions,) if isinstance(self.conclusions, Is) else self.conclusions
        conclusions = all_of(Is, listed, self.condition, "as conclusions output['term'] or a sequence of such")
        if not conclusions:
            raise DefinitionError(f"{self.condition}: no conclusions, expected output['term']")
        weight = finite(self.weight)
        if weight is None or not 0.0 < weight <= 1.0:
            rule = str(Rule(self.condition, conclusions))
            raise DefinitionError(f"{rule!r}: weight is {shown(self.weight)}, expected above 0 and at most 1")
        if not isinstance(self.operators, Operators | None):
            raise DefinitionError(f"rule: operators are {shown(self.operators)}, expected Operators or None")
        object.__setattr__(self, "conclusions", conclusions)
        object.__setattr__(self, "weight", weight)

    @staticmethod
    def parse(text: str, operators: Operators | None = None) -> Rule:
        """Parse a text such as ``if wind is calm then sail is full with 0.5``; `operators` are those of its block.

        A text that is not a rule raises `DefinitionError`; only a system checks that its variables and terms exist.
        """
        return replace(parse_rule(text), operators=operators)

    def __repr__(self) -> str:
        operators = "" if self.operators is None else f", {self.operators!r}"
        return f"Rule.parse({str(self)!r}{operators})"

    def __str__(self) -> str:
        conclusions = " and ".join(map(str, self.conclusions))
        weight = "" if self.weight == 1.0 else f" with {self.weight!r}"
        return f"if {self.condition} then {conclusions}{weight}"


def parse_rules(text: str) -> list[Rule]:
    """Parse a text whose conclusions may have hedges as rules, in the way of fuzzylite."""
    # A hedge in a conclusion bends the strength of that conclusion and of those after it, as one on the whole condition
    # does. So conclusions with other hedges become a rule of their own.
    condition, conclusions, weight = _parsed(text, hedges=True)
    return bent_rules(condition, conclusions, weight)


def parse_rule(text: str) -> Rule:
    """Parse a text as a rule."""
    # Words of rules may be in any case. The hedges very, somewhat, extremely, seldom, cubed and cube_root are written
    # before a term. `&`, `|`, `~` are *and*, *or*, *not*; *not* binds before *and*, *and* before *or*. Names that are
    # no identifiers stand in double quotes.
    condition, conclusions, weight = _parsed(text, hedges=False)
    return Rule(condition, tuple(conclusion for _, conclusion in conclusions), weight)


Conclusions = list[tuple[tuple[str, ...], Is]]  # each with its hedges
T = TypeVar("T")


def _parsed(text: str, hedges: bool) -> tuple[Proposition, Conclusions, float]:
    """Parse a rule's condition, its conclusions and its weight."""
    if not isinstance(text, str):
        raise DefinitionError(f"rule: got {shown(text)}, expected text")
    try:
        return _Parser(text).parts(hedges)
    except DefinitionError as error:
        raise DefinitionError(f"rule {text.strip()!r}: {error}") from None


class _Parser:
    """Parse one text by recursive descent."""

    def __init__(self, text: str) -> None:
        self.tokens: list[tuple[str, str]] = []  # kind (keyword or sign itself, "name", "number", "end") and text
        for match in _TOKEN.finditer(text):
            kind, token = str(match.lastgroup), match.group(match.lastgroup or 0)
            if kind == "other":
                raise DefinitionError(f"{token!r} cannot stand in a rule")
            if kind == "quoted":
                kind, token = "name", token[1:-1]
            elif kind != "number":
                word = _SIGNS.get(token, token).lower()
                kind = word if word in KEYWORDS or kind == "sign" else "name"
            self.tokens.append((kind, token))
        self.tokens.append(("end", "the end"))
        self.at = self.depth = 0

    def accept(self, kind: str) -> bool:
        if self.tokens[self.at][0] != kind:
            return False
        self.at += 1
        return True

    def take(self, kind: str, what: str) -> str:
        received, token = self.tokens[self.at]
        if received != kind:
            before = f" after {self.tokens[self.at - 1][1]!r}" if self.at else ""
            raise DefinitionError(f"got {token if received == 'end' else repr(token)}{before}, expected {what}")
        self.at += 1
        return token

    def parts(self, hedges: bool) -> tuple[Proposition, Conclusions, float]:
        self.take("if", "'if'")
        condition = self.joined(Or)
        self.take("then", "'then', 'and' or 'or'")
        conclusions = self.conclusions(hedges)
        weight = self.number() if self.accept("with") else 1.0
        self.take("end", "'and', 'with' or the end")
        if weight != 1.0 and any(words for words, _ in conclusions):
            raise DefinitionError("a hedge in a conclusion of a rule with a weight, expected the weight 1")
        return condition, conclusions, weight

    def conclusions(self, hedges: bool) -> Conclusions:
        """Read conclusions, some of which may stand in parentheses."""
        result: Conclusions = []
        while not result or self.accept("and") or self.accept(","):
            if self.accept("("):
                result += self.inner(lambda: self.conclusions(hedges))
                self.take(")", "')' or 'and'")
            else:
                result.append(self.conclusion(hedges))
        return result

    def conclusion(self, hedges: bool) -> tuple[tuple[str, ...], Is]:
        variable = self.take("name", "an output's name")
        self.take("is", "'is'")
        words = self.hedges("name", "not") if hedges else ()
        if not hedges and self.accept("any"):  # which in a conclusion is a name like others
            return words, Is(variable, self.tokens[self.at - 1][1])
        return words, Is(variable, self.take("name", "a term's name"))

    def hedges(self, *before: str) -> tuple[str, ...]:
        """Read hedges, which stand before tokens of some kinds, and *not*."""
        words: list[str] = []
        while self.accept("not") or self.accept_hedge(*before):
            kind, text = self.tokens[self.at - 1]
            words.append("not" if kind == "not" else text.lower())  # which may be written ~
        return tuple(words)

    def accept_hedge(self, *before: str) -> bool:
        is_hedge = self.tokens[self.at][1].lower() in HEDGES and self.tokens[self.at + 1][0] in before
        self.at += is_hedge
        return is_hedge

    def number(self) -> float:
        token = self.take("number", "the rule's weight")
        try:
            return float(token)
        except ValueError:
            raise DefinitionError(f"{token!r} is not a number") from None

    def joined(self, kind: type[Or | And]) -> Proposition:
        """Read a disjunction, or a conjunction."""
        word = "or" if kind is Or else "and"
        part: Callable[[], Proposition] = partial(self.joined, And) if kind is Or else self.statement
        parts = [part()]
        while self.accept(word):
            parts.append(part())
        return kind(tuple(parts)) if len(parts) > 1 else parts[0]

    def inner(self, parse: Callable[[], T]) -> T:
        """Parse what is nested in parentheses, or follows *not* or a hedge."""
        self.depth += 1
        if self.depth > MAX_NESTING:
            raise DefinitionError(f"nested deeper than {MAX_NESTING} parentheses and negations")
        parsed = parse()
        self.depth -= 1
        return parsed

    def statement(self) -> Proposition:
        if self.accept("not"):
            return Not(self.inner(self.statement))
        if self.accept_hedge("("):
            word = self.tokens[self.at - 1][1].lower()
            return Hedged(word, self.inner(self.statement))
        if self.accept("("):
            inner = self.inner(lambda: self.joined(Or))
            self.take(")", "')', 'and' or 'or'")
            return inner
        variable = self.take("name", "an input's name, 'not' or '('")
        self.take("is", "'is'")
        words = self.hedges("name", "not", "any")
        if self.accept("any"):
            return bend(words, Anything(variable))
        return bend(words, Is(variable, self.take("name", "a term's name")))


def bent_rules(condition: Proposition, conclusions: Conclusions, weight: float, carry: bool = True) -> list[Rule]:
    """Return a rule whose conclusions have hedges as rules whose conclusions have none."""
    rows: dict[tuple[tuple[str, ...], int], list[Is]] = {}
    carried: tuple[str, ...] = ()
    for k, (hedges, conclusion) in enumerate(conclusions):
        carried = hedges + carried if carry else hedges
        # a second conclusion on one output is another rule, too
        before = sum(c.variable == conclusion.variable for _, c in conclusions[:k])
        rows.setdefault((carried, before), []).append(conclusion)
    return [Rule(bend(words, condition), tuple(concluded), weight) for (words, _), concluded in rows.items()]
