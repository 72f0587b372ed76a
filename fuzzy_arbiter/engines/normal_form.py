"""Proofs that an output's two terms are cut at h and 1 - h for all inputs, in the algebra of min, max and 1 - x."""

# A condition is brought to its disjunctive normal form, a set of clauses, each a set of literals, in which no clause
# contains another. Conditions with one form have one degree, always, and by De Morgan the form of a negation is found
# in the same way. If the negation of all conditions for one term has the clauses of the conditions for the other, then
# the cuts are h and 1 - h. The converse is not quite so: what follows only from "a and not a" never being above "b or
# not b" is not seen, and such systems are swept.

from __future__ import annotations

from collections.abc import Iterable, Sequence

from fuzzy_arbiter.definition import System, Variable
from fuzzy_arbiter.errors import EngineError
from fuzzy_arbiter.propositions import And, Is, Not, Or, Proposition
from fuzzy_arbiter.shapes import Shape

Literal = tuple[str, str, bool]  # variable, term, and whether it is affirmed
Clause = frozenset[Literal]

MAX_CLAUSES = 512  # a form with more is not computed


def ladder(system: System, clauses: Sequence[Sequence[Clause]]) -> tuple[Literal, ...] | None:
    """Return the literals of prioritized criteria, if the clauses have this form."""
    complements = _complements(system)
    steps: list[Literal] = []
    above: set[Literal] = set()  # literals by which the criteria before do not hold
    for forms in clauses:
        if len(forms) != 1 or not above < forms[0] or len(forms[0]) != len(above) + 1:
            return None
        (step,) = forms[0] - above
        steps.append(step)
        above.add(_opposite(step, complements))
    return tuple(steps)


class NoClosedFormError(EngineError):
    """Raised for a system that the closed form does not cover."""

    def __init__(self, reason: str) -> None:
        super().__init__(f"engine 'closed': {reason}")
        self.reason = reason


def high_clauses(system: System) -> list[tuple[Clause, ...]]:
    """Return, for each output, the clauses of the condition under which its second term is concluded."""
    complements = _complements(system)
    result = []
    for output in system.outputs:
        statements = (Is(output.name, name) for name in output.term_names)
        low, high = ([rule.condition for rule in system.rules if s in rule.conclusions] for s in statements)
        if not low or not high:
            raise NoClosedFormError(f"output {output.name!r} has a term that no rule concludes")
        high_form = _joined((_clauses(p, True, complements) for p in high), any_of=True)
        low_negated = _joined((_clauses(p, False, complements) for p in low), any_of=False)
        if high_form is None or low_negated is None:
            raise NoClosedFormError(f"output {output.name!r} has conditions of more than {MAX_CLAUSES} clauses")
        if high_form != low_negated:
            first, second = map(repr, output.term_names)
            what = f"output {output.name!r}: the cut of {first} is not 1 minus that of {second} for all inputs"
            raise NoClosedFormError(what)
        result.append(tuple(sorted(high_form, key=sorted)))
    return result


def _complements(system: System) -> dict[str, tuple[str, str]]:
    return {v.name: (v.terms[0].name, v.terms[1].name) for v in system.inputs if _complementary(v)}


def _complementary(variable: Variable) -> bool:
    """Return True if a variable has two terms whose degrees sum to 1, at the knots to the last bit."""
    if len(variable.terms) != 2:
        return False
    first, second = (term.shape for term in variable.terms)
    if not isinstance(first, Shape) or not isinstance(second, Shape):
        return False
    return not first.jumps and second == first.complement() and first == second.complement()


def _opposite(literal: Literal, complements: dict[str, tuple[str, str]]) -> Literal:
    """Negate a literal; where a variable has two complementary terms, the negation of one is the other."""
    variable, term, affirmed = literal
    if variable not in complements:
        return variable, term, not affirmed
    first, second = complements[variable]
    return variable, second if term == first else first, affirmed


def _clauses(
    proposition: Proposition, affirmed: bool, complements: dict[str, tuple[str, str]]
) -> frozenset[Clause] | None:
    """Return the disjunctive normal form of a proposition or of its negation; None if it is too long."""
    if isinstance(proposition, Not):
        return _clauses(proposition.part, not affirmed, complements)
    if isinstance(proposition, Is):
        literal = (proposition.variable, proposition.term, True)
        return frozenset((frozenset((literal if affirmed else _opposite(literal, complements),)),))
    assert isinstance(proposition, And | Or)
    parts = (_clauses(part, affirmed, complements) for part in proposition.parts)
    return _joined(parts, any_of=isinstance(proposition, Or) is affirmed)


def _joined(parts: Iterable[frozenset[Clause] | None], any_of: bool) -> frozenset[Clause] | None:
    """Return the disjunction or conjunction of normal forms, in normal form."""
    result: frozenset[Clause] = frozenset() if any_of else frozenset((frozenset(),))
    for part in parts:
        if part is None:
            return None
        result = _absorbed(result | part if any_of else (a | b for a in result for b in part))
        if len(result) > MAX_CLAUSES:
            return None
    return result


def _absorbed(clauses: Iterable[Clause]) -> frozenset[Clause]:
    """Drop each clause that contains another, which it cannot exceed; of too many, only some are looked at."""
    minimal: list[Clause] = []
    for clause in sorted(set(clauses), key=len):
        if len(minimal) > MAX_CLAUSES:
            break
        if not any(other <= clause for other in minimal):
            minimal.append(clause)
    return frozenset(minimal)
