"""Conditions of rules: a variable is in a term, and the conjunctions, disjunctions and negations of that."""

from __future__ import annotations

import re
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field
from typing import Any

from fuzzy_arbiter.checks import all_of, require_choice, shown
from fuzzy_arbiter.errors import DefinitionError
from fuzzy_arbiter.shapes import Membership
from fuzzy_arbiter.terms.norms import HEDGES

MAX_NESTING = 100  # maximum number of nested parentheses and negations
KEYWORDS = ("if", "then", "and", "or", "not", "is", "with", "any")
_PLAIN = re.compile(r"[A-Za-z_][A-Za-z0-9_]*")


def is_identifier(name: str) -> bool:
    """Return True if a name needs no quotes in a rule, nor in any format."""
    return _PLAIN.fullmatch(name) is not None and name.lower() not in KEYWORDS


def quoted(name: str) -> str:
    """Format a name for a rule's text."""
    return name if is_identifier(name) else f'"{name}"'


class Proposition:
    """A condition that holds to a degree; ``&``, ``|`` and ``~`` combine propositions."""

    __slots__ = ()
    nesting: int = 0  # number of nested parentheses and negations in the text

    def __and__(self, other: Proposition) -> And:
        return And((self, other))

    def __or__(self, other: Proposition) -> Or:
        return Or((self, other))

    def __invert__(self) -> Not:
        return Not(self)

    def __bool__(self) -> bool:
        raise DefinitionError(f"{self}: a proposition is not true or false; combine with &, | and ~, not and, or, not")

    @property
    def inner(self) -> tuple[Proposition, ...]:
        """Propositions that it combines or bends."""
        return ()

    def parts_within(self) -> Iterator[Proposition]:
        """Yield the proposition and all that it combines or bends, at any depth, from left to right."""
        yield self
        for part in self.inner:
            yield from part.parts_within()

    def by_variable(self) -> dict[str, str] | None:
        """Return the words on each variable, if this joins statements on different variables by *and*."""
        parts = self.inner if isinstance(self, And) else (self,)
        words = dict(map(_words, parts)) if all(map(_on_one, parts)) else {}
        return words if len(words) == len(parts) else None

    def terms(self) -> Iterator[Is]:
        """Yield every statement about a term, from left to right."""
        return (part for part in self.parts_within() if isinstance(part, Is))


@dataclass(frozen=True, slots=True)
class Is(Proposition):
    """A variable is in a term; a statement made by a variable has the term's shape and can be called with a value."""

    variable: str
    term: str
    shape: Membership | None = field(default=None, repr=False, compare=False)

    def __post_init__(self) -> None:
        if not (isinstance(self.variable, str) and isinstance(self.term, str)):
            raise DefinitionError(f"{shown(self.variable)} is {shown(self.term)}: expected the names of both")

    def __call__(self, value: Any) -> Any:
        """Return the degree to which a value, or each of an array, is in the term."""
        if self.shape is None:
            raise DefinitionError(f"{self}: made of names alone, expected such as variable['term'], to be called")
        return self.shape(value)

    def __str__(self) -> str:
        return f"{quoted(self.variable)} is {quoted(self.term)}"


@dataclass(frozen=True, slots=True)
class _Join(Proposition):
    """Two or more propositions under one connective; nested ones of the same kind are one."""

    parts: tuple[Proposition, ...]
    nesting: int = field(init=False, repr=False, compare=False)

    def __post_init__(self) -> None:
        flat: list[Proposition] = []
        for part in all_of(Proposition, self.parts, type(self).__name__, "such as variable['term']"):
            flat += part.parts if isinstance(part, _Join) and type(part) is type(self) else [part]
        if len(flat) < 2:
            raise DefinitionError(f"{type(self).__name__} of {len(flat)} propositions, expected two or more")
        object.__setattr__(self, "parts", tuple(flat))
        _set_nesting(self, max(part.nesting + isinstance(part, _Join) for part in flat))

    @property
    def inner(self) -> tuple[Proposition, ...]:
        """All parts."""
        return self.parts

    def __str__(self) -> str:
        word = f" {type(self).__name__.lower()} "
        return word.join(f"({part})" if isinstance(part, _Join) else str(part) for part in self.parts)


@dataclass(frozen=True, slots=True)
class And(_Join):
    """All of the parts hold."""


@dataclass(frozen=True, slots=True)
class Or(_Join):
    """Any of the parts holds."""


@dataclass(frozen=True, slots=True)
class Anything(Proposition):
    """A variable is in any term: this always holds."""

    variable: str

    def __post_init__(self) -> None:
        if not isinstance(self.variable, str):
            raise DefinitionError(f"{shown(self.variable)} is any: expected the name of an input")

    def __str__(self) -> str:
        return f"{quoted(self.variable)} is any"


class _Modifier(Proposition):
    """A proposition that changes another by a word in front."""

    __slots__ = ()
    part: Proposition

    @property
    def word(self) -> str:
        """The word: *not*, or the hedge."""
        return self.hedge if isinstance(self, Hedged) else "not"

    @property
    def inner(self) -> tuple[Proposition, ...]:
        """The part."""
        return (self.part,)

    def __post_init__(self) -> None:
        if not isinstance(self.part, Proposition):
            raise DefinitionError(f"{self.word}: got {shown(self.part)}, expected such as variable['term']")
        simple = _on_one(self.part) if isinstance(self, Hedged) else isinstance(self.part, Is)
        _set_nesting(self, self.part.nesting + (1 if simple else 2))

    def __str__(self) -> str:
        if not _on_one(self.part) or (isinstance(self, Not) and isinstance(self.part, Not)):
            return f"{self.word} ({self.part})"
        variable, words = _words(self)
        return f"{quoted(variable)} is {words}"


@dataclass(frozen=True, slots=True)
class Not(_Modifier):
    """The part does not hold."""

    part: Proposition
    nesting: int = field(init=False, repr=False, compare=False)


@dataclass(frozen=True, slots=True)
class Hedged(_Modifier):
    """A statement or a whole condition, bent by a hedge: ``service is very poor``, ``very (a is b or c is d)``."""

    hedge: str  # name of the hedge, of `fuzzy_arbiter.terms.norms.HEDGES`
    part: Proposition  # proposition that the hedge modifies
    nesting: int = field(init=False, repr=False, compare=False)

    def __post_init__(self) -> None:
        require_choice(self.hedge, HEDGES, "hedge")
        _Modifier.__post_init__(self)


def bend(words: Sequence[str], proposition: Proposition) -> Proposition:
    """Put hedges and *not* before a proposition, the last one next to it."""
    for word in reversed(words):
        proposition = Not(proposition) if word == "not" else Hedged(word, proposition)
    return proposition


def _on_one(p: Proposition) -> bool:
    """Return True if a proposition is a statement on one term, perhaps with hedges and negations."""
    while isinstance(p, _Modifier):
        p = p.part
    return isinstance(p, Is | Anything)


def _words(p: Proposition) -> tuple[str, str]:
    """Return the variable of a statement on one term, and the text after *is*."""
    if isinstance(p, _Modifier):
        variable, words = _words(p.part)
        return variable, f"{p.word} {words}"
    assert isinstance(p, Is | Anything)
    return p.variable, quoted(p.term) if isinstance(p, Is) else "any"


def _set_nesting(proposition: Proposition, nesting: int) -> None:
    # the nesting limit keeps recursion over a proposition well below Python's own stack limit
    if nesting > MAX_NESTING:
        raise DefinitionError(f"nested deeper than {MAX_NESTING} parentheses and negations")
    object.__setattr__(proposition, "nesting", nesting)
