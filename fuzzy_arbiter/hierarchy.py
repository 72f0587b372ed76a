"""Prioritized criteria, and the rule bases that weigh each criterion if none of higher priority is active."""

from __future__ import annotations

import itertools
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from typing import Literal, get_args

from fuzzy_arbiter.checks import all_of, require_choice, require_name, shown
from fuzzy_arbiter.definition import Normalization, Output, Outside, System, Variable
from fuzzy_arbiter.errors import DefinitionError
from fuzzy_arbiter.propositions import And, Is, Or, Proposition
from fuzzy_arbiter.rule import Rule
from fuzzy_arbiter.shapes import DEGREE, Shape, falling, rising
from fuzzy_arbiter.terms.term import Term

Form = Literal["hierarchical", "minimal", "conjunctive", "complete"]
FORMS: tuple[str, ...] = get_args(Form)
MAX_COMPLETE = 16  # maximum number of criteria in the complete form, which then has a million rules

# the pair of section VI: low is the triangle (0, 0, 1), high the triangle (0, 1, 1)
WEIGHT = Output("alpha", (0.0, 1.0), (Term("low", falling(0.0, 1.0)), Term("high", rising(0.0, 1.0))))


@dataclass(frozen=True, slots=True)
class Criterion:
    """A criterion that may ask for attention: an input variable with two complementary terms.

    Attributes
    ----------
    name : str
        Name of the input.
    on, off : str
        Term that asks for attention, and its complement.
    membership : Shape
        Degree of the on-term at each position; by default the input is that degree itself, in [0, 1].

    Raises
    ------
    DefinitionError
        If both terms have one name, or the membership jumps or is the same everywhere.

    Examples
    --------
    >>> from fuzzy_arbiter import Arbiter, rising
    >>> from fuzzy_arbiter.criteria import Criterion
    >>> arbiter = Arbiter([Criterion("battery", membership=rising(0.0, 1.0)), Criterion("survey")])
    >>> weights = arbiter(battery=0.9, survey=1.0)
    >>> round(weights["battery"], 3), round(weights["survey"], 3)
    (0.972, 0.028)
    """

    name: str
    on: str = "on"
    off: str = "off"
    membership: Shape = DEGREE

    def __post_init__(self) -> None:
        for key in ("name", "on", "off"):
            require_name(getattr(self, key), f"criterion {shown(self.name)}: {key}" if key != "name" else "criterion")
        if self.on == self.off:
            raise DefinitionError(f"criterion {self.name!r}: both terms are {self.on!r}, expected two names")
        if not isinstance(self.membership, Shape):
            raise DefinitionError(
                f"criterion {self.name!r}: membership is {shown(self.membership)}, expected such as rising(0.5, 3)"
            )
        if len(self.membership.points) < 2 or self.membership.jumps:
            raise DefinitionError(
                f"criterion {self.name!r}: membership is {self.membership.points}, expected a change without jumps"
            )

    @property
    def variable(self) -> Variable:
        """The input, on the universe from the membership's first point to its last."""
        points = self.membership.points
        terms = (Term(self.off, self.membership.complement()), Term(self.on, self.membership))
        return Variable(self.name, (points[0][0], points[-1][0]), terms)


# section VI of Ismail & Dunnigan, in their order of priority
SECTION_VI = (
    Criterion("obstacle", on="exist", off="not_exist"),
    Criterion("shape", on="complex", off="simple"),
    Criterion("depth", on="not_maintain", off="maintain"),
)


def prioritized(
    criteria: Sequence[Criterion] = SECTION_VI,
    form: Form = "hierarchical",
    weight: Output = WEIGHT,
    normalization: Normalization = "range",
    outside: Outside = "refuse",
    points: int = 101,
    name: str = "arbiter",
) -> System:
    """Return the system in which each criterion gets its weight if none of higher priority is active.

    Parameters
    ----------
    criteria : sequence of Criterion
        Criteria by descending priority.
    form : {"hierarchical", "minimal", "conjunctive", "complete"}
        Form of the rules, for N criteria: 3N - 1 rules, as in the paper; 2N with a long *or* each;
        N + N (N + 1) / 2 without any *or*; or the complete table of N 2^N. The first three give the same weights
        always, the complete table on crisp inputs (see ``docs/arbiter.md``).
    weight : Output
        Template of the outputs; a criterion's number follows its name, and its first term is low. Results carry the
        names of the criteria.
    normalization, outside, points, name
        Settings, as for `System`.

    Returns
    -------
    System
        Complete and consistent: on crisp inputs each weight is either high or low, and at most one is high.

    Raises
    ------
    DefinitionError
        If there is no criterion, two share a name, or `weight` does not have two terms.

    Examples
    --------
    >>> from fuzzy_arbiter.criteria import prioritized
    >>> len(prioritized().rules), len(prioritized(form="complete").rules)
    (8, 24)
    """
    criteria = all_of(Criterion, criteria, "criteria", "a sequence of Criterion")
    if not criteria:
        raise DefinitionError("criteria: got none, expected at least one")
    require_choice(form, FORMS, "form")
    if not isinstance(weight, Output):
        raise DefinitionError(f"weight is {shown(weight)}, expected an Output")
    if len(weight.terms) != 2:
        raise DefinitionError(f"weight {weight.name!r}: got {len(weight.terms)} terms, expected two, low and high")
    outputs = tuple(replace(weight, name=f"{weight.name}_{k + 1}") for k in range(len(criteria)))
    on = tuple(Is(c.name, c.on) for c in criteria)
    off = tuple(Is(c.name, c.off) for c in criteria)
    if form == "complete":
        conditions = list(_complete(on, off))
    else:
        conditions = [(k, *each) for k in range(len(criteria)) for each in _conditions(form, on, off, k)]
    conclusions = [[(output[term],) for term in output.term_names] for output in outputs]
    rules = tuple(Rule(condition, conclusions[k][is_high]) for k, condition, is_high in conditions)
    inputs = tuple(c.variable for c in criteria)
    names = tuple(c.name for c in criteria)
    return System(
        inputs, outputs, rules, name, normalization=normalization, outside=outside, points=points, weights_of=names
    )


def _conditions(form: str, on: Sequence[Is], off: Sequence[Is], k: int) -> Iterator[tuple[Proposition, bool]]:
    """Yield the conditions of the k-th criterion's rules, and True where its weight is then high."""
    high = _all((*off[:k], on[k])), True  # no criterion above k is active, and k is
    reasons = (*on[:k], off[k])  # each of which makes it low
    if form == "minimal":
        yield from (high, (_any(reasons), False))
    elif form == "conjunctive":
        yield from (high, *((reason, False) for reason in reasons))
    elif k == 0:  # and so on as in section VI, whose eight rules these are for three criteria
        yield from (high, (off[0], False))
    else:
        yield from ((_any(on[:k]), False), (off[k], False), high)


def _complete(on: Sequence[Is], off: Sequence[Is]) -> Iterator[tuple[int, Proposition, bool]]:
    """Yield a condition for each combination of terms and each output."""
    if len(on) > MAX_COMPLETE:
        raise DefinitionError(f"complete form of {len(on)} criteria, expected at most {MAX_COMPLETE}")
    for combination in itertools.product((True, False), repeat=len(on)):
        condition = _all(tuple(on[j] if asks else off[j] for j, asks in enumerate(combination)))
        first = combination.index(True) if True in combination else None
        yield from ((k, condition, k == first) for k in range(len(on)))


def _all(statements: Sequence[Is]) -> Proposition:
    return And(tuple(statements)) if len(statements) > 1 else statements[0]


def _any(statements: Sequence[Is]) -> Proposition:
    return Or(tuple(statements)) if len(statements) > 1 else statements[0]
