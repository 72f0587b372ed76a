"""The definition of a Mamdani system, immutable and standing once for all engines, formats and pictures."""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from numbers import Integral, Real
from typing import Literal, TypeVar, get_args

from fuzzy_arbiter.errors import DefinitionError
from fuzzy_arbiter.propositions import Is, Proposition
from fuzzy_arbiter.shapes import Shape

Conjunction = Literal["min", "prod"]
Disjunction = Literal["max", "probor"]
Implication = Literal["min", "prod"]
Normalisation = Literal["range", "none", "sum", "max"]
Outside = Literal["refuse", "clip"]


@dataclass(frozen=True, slots=True)
class Term:
    """A word for a part of a universe, and to what degree each place belongs to it."""

    name: str
    shape: Shape


@dataclass(frozen=True, slots=True)
class Variable:
    """An input: a universe, and the terms that cover it.

    Attributes
    ----------
    name : str
        Unlike those of all other variables.
    universe : (float, float)
        Least and greatest value.
    terms : tuple of Term
        At least one.

    Raises
    ------
    DefinitionError
        If the name cannot stand in a rule, the universe is empty, or two terms share a name.

    Examples
    --------
    >>> from fuzzy_arbiter import falling, rising
    >>> wind = Variable("wind", (0, 20), (Term("calm", falling(2, 6)), Term("strong", rising(4, 12))))
    >>> print(~wind["calm"])
    wind is not calm
    """

    name: str
    universe: tuple[float, float]
    terms: tuple[Term, ...]

    def __post_init__(self) -> None:
        _require_name(self.name, "variable")
        what = f"variable {self.name!r}"
        bounds = tuple(self.universe)
        if len(bounds) != 2 or not all(isinstance(x, Real) and math.isfinite(x) for x in bounds):
            raise DefinitionError(f"{what}: universe is {self.universe!r}, expected two finite numbers")
        low, high = map(float, bounds)
        if not low < high:
            raise DefinitionError(f"{what}: universe is [{low}, {high}], expected the first below the second")
        object.__setattr__(self, "universe", (low, high))
        terms = tuple(self.terms)
        if not terms:
            raise DefinitionError(f"{what}: no terms came, expected at least one")
        for term in terms:
            _require_name(term.name, f"{what}: term")
        twice = _repeated(term.name for term in terms)
        if twice is not None:
            raise DefinitionError(f"{what}: two terms are named {twice!r}, expected each name once")
        object.__setattr__(self, "terms", tuple(Term(term.name, term.shape.within((low, high))) for term in terms))

    def __getitem__(self, term: str) -> Is:
        """Return the proposition that this variable is in a term.

        Raises
        ------
        DefinitionError
            If there is no such term.
        """
        if term not in self.term_names:
            raise DefinitionError(f"{self.name!r} has no term {term!r}, expected one of {', '.join(self.term_names)}")
        return Is(self.name, term)

    @property
    def term_names(self) -> tuple[str, ...]:
        """Names of the terms, in their order."""
        return tuple(term.name for term in self.terms)


@dataclass(frozen=True, slots=True)
class Output(Variable):
    """An output: a variable that rules conclude on.

    Attributes
    ----------
    default : float or None
        Value where no rule fires; with None that is an error.

    Raises
    ------
    DefinitionError
        If a term has no area in the universe, so that it has no centroid.
    """

    default: float | None = None

    def __post_init__(self) -> None:
        # not super(): the decorator makes the class anew for its slots, and the method keeps the old one
        Variable.__post_init__(self)
        for term in self.terms:
            if not term.shape.area(self.universe) > 0.0:
                raise DefinitionError(f"output {self.name!r}: term {term.name!r} has no area in [{_span(self)}]")
        if self.default is not None:
            if not (isinstance(self.default, Real) and math.isfinite(self.default)):
                raise DefinitionError(f"output {self.name!r}: default is {self.default!r}, expected a finite number")
            object.__setattr__(self, "default", float(self.default))


@dataclass(frozen=True, slots=True)
class Rule:
    """If a condition holds, then outputs are in terms, as strongly as it holds times the rule's weight.

    Attributes
    ----------
    condition : Proposition
        On inputs.
    conclusions : tuple of Is
        On outputs, at least one.
    weight : float
        Above 0, at most 1.

    Raises
    ------
    DefinitionError
        If there is no conclusion, or the weight is outside its range.
    """

    condition: Proposition
    conclusions: tuple[Is, ...]
    weight: float = 1.0

    def __post_init__(self) -> None:
        conclusions = (self.conclusions,) if isinstance(self.conclusions, Is) else tuple(self.conclusions)
        object.__setattr__(self, "conclusions", conclusions)
        if not isinstance(self.condition, Proposition):
            raise DefinitionError(f"rule: condition is {self.condition!r}, expected such as variable['term']")
        if not conclusions or not all(isinstance(c, Is) for c in conclusions):
            raise DefinitionError(
                f"rule {str(self.condition)!r}: conclusions are {conclusions!r}, expected output['term']"
            )
        if not (isinstance(self.weight, Real) and 0.0 < self.weight <= 1.0):
            raise DefinitionError(f"{str(self)!r}: weight is {self.weight!r}, expected above 0 and at most 1")
        object.__setattr__(self, "weight", float(self.weight))

    def __str__(self) -> str:
        conclusions = " and ".join(map(str, self.conclusions))
        weight = "" if self.weight == 1.0 else f" with {self.weight!r}"
        return f"if {self.condition} then {conclusions}{weight}"


@dataclass(frozen=True, slots=True)
class System:
    """A Mamdani system: clipped (or scaled) output terms, joined by their maximum, of which the centroid is taken.

    Attributes
    ----------
    inputs : tuple of Variable
        In the order in which values come.
    outputs : tuple of Output
        In the order in which weights are given.
    rules : tuple of Rule
        At least one; a text such as ``if wind is calm then sail is full`` is a rule too.
    name : str
        What the system is called in files.
    conjunction : {"min", "prod"}
        Degree of *and*.
    disjunction : {"max", "probor"}
        Degree of *or*; ``probor`` is a + b - a b.
    implication : {"min", "prod"}
        Whether an output's term is clipped at a rule's strength, or scaled by it.
    normalisation : {"range", "none", "sum", "max"}
        What is done to the centroids: ``none`` leaves them; ``range`` maps those of the least and of the greatest term
        alone to 0 and 1; ``sum`` and ``max`` then divide by all weights' sum or greatest.
    outside : {"refuse", "clip"}
        What happens to an input outside its universe.
    points : int
        Points of an output's universe, 3 or more, for those engines and formats that sample it.

    Raises
    ------
    DefinitionError
        If names clash, or a rule speaks of what there is not.
    """

    inputs: tuple[Variable, ...]
    outputs: tuple[Output, ...]
    rules: tuple[Rule, ...]
    name: str = "arbiter"
    conjunction: Conjunction = "min"
    disjunction: Disjunction = "max"
    implication: Implication = "min"
    normalisation: Normalisation = "range"
    outside: Outside = "refuse"
    points: int = 101

    def __post_init__(self) -> None:
        from fuzzy_arbiter.rule_text import parse_rule  # it needs the rules that are defined here

        rules: list[Rule | str] = list(self.rules)
        object.__setattr__(self, "inputs", tuple(self.inputs))
        object.__setattr__(self, "outputs", tuple(self.outputs))
        object.__setattr__(self, "rules", tuple(parse_rule(r) if isinstance(r, str) else r for r in rules))
        _require_name(self.name, "system")
        for key, choices in _CHOICES.items():
            if getattr(self, key) not in choices:
                raise DefinitionError(f"{key} is {getattr(self, key)!r}, expected one of {', '.join(choices)}")
        if not (isinstance(self.points, Integral) and self.points >= 3):
            raise DefinitionError(f"points is {self.points!r}, expected a whole number, 3 or more")
        object.__setattr__(self, "points", int(self.points))
        for key in ("inputs", "outputs", "rules"):
            if not getattr(self, key):
                raise DefinitionError(f"{key}: none came, expected at least one")
        twice = _repeated(v.name for v in (*self.inputs, *self.outputs))
        if twice is not None:
            raise DefinitionError(f"variables: two are named {twice!r}, expected each name once")
        inputs = {v.name: frozenset(v.term_names) for v in self.inputs}
        outputs = {v.name: frozenset(v.term_names) for v in self.outputs}
        for i, rule in enumerate(self.rules):
            where = f"R{i + 1} {str(rule)!r}"
            for statement in rule.condition.terms():
                _require_known(statement, inputs, "input", where)
            for statement in rule.conclusions:
                _require_known(statement, outputs, "output", where)
            if len({statement.variable for statement in rule.conclusions}) < len(rule.conclusions):
                raise DefinitionError(f"{where}: two conclusions on one output, expected each output once")

    def __str__(self) -> str:
        return "\n".join(f"R{i + 1}: {rule}" for i, rule in enumerate(self.rules))


_CHOICES = {
    "conjunction": get_args(Conjunction),
    "disjunction": get_args(Disjunction),
    "implication": get_args(Implication),
    "normalisation": get_args(Normalisation),
    "outside": get_args(Outside),
}
_N = TypeVar("_N", bound=str)


def _require_name(name: object, what: str) -> None:
    if not isinstance(name, str) or not name or name != name.strip() or not name.isprintable() or '"' in name:
        raise DefinitionError(f"{what} name is {name!r}, expected printable text without double quotes or outer spaces")


def _require_known(statement: Is, known: dict[str, frozenset[str]], kind: str, where: str) -> None:
    if statement.variable not in known:
        raise DefinitionError(f"{where}: no {kind} {statement.variable!r}, expected one of {', '.join(known)}")
    if statement.term not in known[statement.variable]:
        expected = ", ".join(sorted(known[statement.variable]))
        raise DefinitionError(
            f"{where}: {statement.variable!r} has no term {statement.term!r}, expected one of {expected}"
        )


def _repeated(names: Iterable[_N]) -> _N | None:
    seen: set[str] = set()
    for name in names:
        if name in seen:
            return name
        seen.add(name)
    return None


def _span(variable: Variable) -> str:
    return f"{variable.universe[0]:g}, {variable.universe[1]:g}"


def variable_names(variables: Sequence[Variable]) -> tuple[str, ...]:
    """Return the variables' names in their order.

    Parameters
    ----------
    variables : sequence of Variable
        Inputs or outputs.

    Returns
    -------
    tuple of str
        Names.
    """
    return tuple(variable.name for variable in variables)
