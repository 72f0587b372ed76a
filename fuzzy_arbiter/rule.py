"""A rule: a condition, its conclusions, and its weight."""

from __future__ import annotations

from dataclasses import dataclass, replace

from fuzzy_arbiter.checks import all_of, finite, require_choice, shown
from fuzzy_arbiter.errors import DefinitionError
from fuzzy_arbiter.propositions import Is, Proposition
from fuzzy_arbiter.terms.norms import S_NORMS, T_NORMS


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
        from fuzzy_arbiter.rule_text import parse_rule

        return replace(parse_rule(text), operators=operators)

    def __repr__(self) -> str:
        operators = "" if self.operators is None else f", {self.operators!r}"
        return f"Rule.parse({str(self)!r}{operators})"

    def __str__(self) -> str:
        conclusions = " and ".join(map(str, self.conclusions))
        weight = "" if self.weight == 1.0 else f" with {self.weight!r}"
        return f"if {self.condition} then {conclusions}{weight}"
