"""The definition of an arbiter, standing once for all engines: prioritised criteria and the rules they generate."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal

from fuzzy_arbiter.errors import DefinitionError


@dataclass(frozen=True)
class Criterion:
    """An input variable with two complementary terms, and the weight it decides."""

    name: str
    on: str  # the term whose degree is measured: the criterion asks for attention
    off: str  # its complement


@dataclass(frozen=True)
class Term:
    """A proposition: a criterion is in one of its terms."""

    criterion: int  # index in the order of priority
    on: bool

    def text(self, criteria: Sequence[Criterion]) -> str:
        """Return the proposition in words, such as ``obstacle is exist``."""
        c = criteria[self.criterion]
        return f"{c.name} is {c.on if self.on else c.off}"


@dataclass(frozen=True)
class Rule:
    """If all (or any) of the terms hold, then the weight of one criterion is high (or low)."""

    terms: tuple[Term, ...]
    join: Literal["and", "or"]
    criterion: int  # whose weight is decided
    high: bool

    def text(self, criteria: Sequence[Criterion]) -> str:
        """Return the rule in words, such as ``if obstacle is exist then alpha_1 is high``."""
        condition = f" {self.join} ".join(term.text(criteria) for term in self.terms)
        return f"if {condition} then alpha_{self.criterion + 1} is {'high' if self.high else 'low'}"


# section VI of Ismail & Dunnigan, in their order of priority
SECTION_VI = (
    Criterion("obstacle", on="exist", off="not exist"),
    Criterion("shape", on="complex", off="simple"),
    Criterion("depth", on="not maintain", off="maintain"),
)


def check_criteria(criteria: Sequence[Criterion]) -> tuple[Criterion, ...]:
    """Return the criteria as a tuple.

    Parameters
    ----------
    criteria : sequence of Criterion
        In order of priority, the highest first.

    Returns
    -------
    tuple of Criterion
        The same.

    Raises
    ------
    DefinitionError
        If there is none, or two share a name, or the two terms of one do.
    """
    names = [c.name for c in criteria]
    if not names:
        raise DefinitionError("criteria: none came, expected at least one")
    for c in criteria:
        if names.count(c.name) > 1:
            raise DefinitionError(f"criteria: {c.name!r} came {names.count(c.name)} times, expected once")
        if c.on == c.off:
            raise DefinitionError(f"criterion {c.name!r}: both terms are {c.on!r}, expected two names")
    return tuple(criteria)


def hierarchical_rules(n: int) -> tuple[Rule, ...]:
    """Return the rules that give each criterion the floor if none of higher priority wants it.

    For three criteria these are the eight rules of section VI, in the paper's order; in general 3n - 1.

    Parameters
    ----------
    n : int
        Number of criteria.

    Returns
    -------
    tuple of Rule
        Complete and consistent: on crisp inputs each weight is either high or low, and at most one is high.
    """
    rules = [Rule((Term(0, True),), "and", 0, True), Rule((Term(0, False),), "and", 0, False)]
    for k in range(1, n):
        above = range(k)
        rules += [
            Rule(tuple(Term(j, True) for j in above), "or", k, False),
            Rule((Term(k, False),), "and", k, False),
            Rule((*(Term(j, False) for j in above), Term(k, True)), "and", k, True),
        ]
    return tuple(rules)
