"""The definition of a fuzzy system: immutable, and the same for all engines, formats and pictures."""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, fields
from numbers import Integral
from typing import Literal, get_args

from fuzzy_arbiter.checks import all_of, finite, require_choice, require_distinct, require_name, shown
from fuzzy_arbiter.errors import DefinitionError
from fuzzy_arbiter.propositions import Anything, Is
from fuzzy_arbiter.rule import Rule, parse_rule
from fuzzy_arbiter.shapes import Membership
from fuzzy_arbiter.table import html_of, rule_rows
from fuzzy_arbiter.terms.curves import Curve
from fuzzy_arbiter.terms.norms import AGGREGATIONS, S_NORMS, T_NORMS
from fuzzy_arbiter.terms.term import AutomaticTerms, Term
from fuzzy_arbiter.terms.values import Formula, Linear, Value

_Terms = dict[str, frozenset[str]]  # names of each variable's terms
Defuzzifier = Literal["centroid", "bisector", "mom", "som", "lom", "average", "sum"]
WEIGHTED = ("average", "sum")  # defuzzifiers that take each term's value times its strength
Normalization = Literal["none", "range", "sum", "max"]
Outside = Literal["refuse", "clip"]

MAX_POINTS = 1_000_000_000
# minimum and maximum width of an output's universe; moments are products of widths, which must not over- or underflow
WIDTHS = (1e-100, 1e100)


@dataclass(frozen=True, slots=True)
class Variable:
    """An input: a universe, and the terms that cover it.

    Attributes
    ----------
    name : str
        Name, different from those of all other variables.
    universe : (float, float)
        Least and greatest value.
    terms : tuple of Term
        Terms, at least one unless only values of outputs depend on the input. A mapping from names to shapes
        becomes a tuple of terms, and so does the result of `auto_terms`.

    Raises
    ------
    DefinitionError
        If the name is invalid in a rule, the universe is empty, or two terms share a name.

    Examples
    --------
    >>> from fuzzy_arbiter import Variable, falling, rising
    >>> wind = Variable("wind", (0, 20), {"calm": falling(2, 6), "strong": rising(4, 12)})
    >>> print(~wind["calm"])
    wind is not calm
    >>> wind["calm"](3)  # the degree of 3 m/s
    0.75
    """

    name: str
    universe: tuple[float, float]
    terms: tuple[Term, ...]

    def __post_init__(self) -> None:
        require_name(self.name, "variable")
        what = f"variable {self.name!r}"
        bounds = tuple(map(finite, self.universe)) if isinstance(self.universe, Iterable) else ()
        if len(bounds) != 2 or bounds[0] is None or bounds[1] is None:
            raise DefinitionError(f"{what}: universe is {shown(self.universe)}, expected two finite numbers")
        low, high = bounds[0], bounds[1]
        # terms that are values may have a universe of a single value: it only bounds the result
        if not (low < high or (low == high and isinstance(self, Output) and self.weighted)):
            raise DefinitionError(f"{what}: universe is [{low}, {high}], expected the first below the second")
        if finite(high - low) is None:
            raise DefinitionError(f"{what}: universe is [{low}, {high}], expected a finite width")
        object.__setattr__(self, "universe", (low, high))
        given = self.terms.over((low, high)) if isinstance(self.terms, AutomaticTerms) else self.terms
        if isinstance(given, Mapping):
            given = tuple(Term(term, shape) for term, shape in given.items())
        terms = all_of(Term, given, f"{what}: terms", "a mapping from names to shapes, or a sequence of Term")
        if not terms and isinstance(self, Output):
            raise DefinitionError(f"{what}: no terms, expected at least one")
        for term in terms:
            require_name(term.name, f"{what}: term")
        require_distinct((term.name for term in terms), f"{what}: two terms")
        object.__setattr__(self, "terms", terms if isinstance(self, Output) else tuple(map(self._within, terms)))

    def _within(self, term: Term) -> Term:
        try:
            return Term(term.name, term.membership.within(self.universe))
        except DefinitionError as error:
            raise DefinitionError(f"variable {self.name!r}: term {term.name!r}: {error}") from None

    def __getitem__(self, term: str) -> Is:
        """Return the proposition that this variable is in a term; called with a value, it gives the term's degree."""
        for known in self.terms:
            if known.name == term:
                return Is(self.name, term, known.shape if isinstance(known.shape, Membership) else None)
        raise DefinitionError(f"{self.name!r} has no term {shown(term)}, expected one of {', '.join(self.term_names)}")

    @property
    def term_names(self) -> tuple[str, ...]:
        """Names of the terms, in their order."""
        return tuple(term.name for term in self.terms)

    @property
    def knots(self) -> tuple[float, ...]:
        """Ends of the universe and all positions in it where a term bends or jumps, which increase."""
        low, high = self.universe
        shapes = [term.shape for term in self.terms if isinstance(term.shape, Membership)]
        return (low, *sorted({x for shape in shapes for x in shape.breaks((low, high))}), high)


@dataclass(frozen=True, slots=True)
class Output(Variable):
    """An output: a variable that rules conclude on.

    Attributes
    ----------
    default : float or None
        Value where no rule fires; with None that is NaN.
    defuzzifier : {"centroid", "bisector", "mom", "som", "lom", "average", "sum"}
        Value of the joined terms: their centroid, the position that halves their area, or the mean, smallest or
        largest of the positions where they are greatest; for terms that are values (Sugeno), or that only rise or only
        fall (Tsukamoto), the mean of the values, weighted by strength, or their sum.
    aggregation : str
        Operator that joins the rules' conclusions, one of `fuzzy_arbiter.terms.norms.AGGREGATIONS`. For values, it
        joins the strengths of the rules that conclude one term. Default: ``sum`` for values, else ``max``.
    lock_range : bool
        True if the value is held within the universe.
    lock_previous : bool
        True if, in a batch, an output for which no rule fires keeps the value of the row before. A call for one sample
        is then refused where no rule fires.

    Raises
    ------
    DefinitionError
        If a term has no area in the universe, and so no centroid, unless it is a singleton, which counts where nothing
        else fires; if the default is outside a locked range; if the universe is wider than 1e100 or below 1e-100, so
        that floating point cannot hold its moments; or if the terms do not suit the defuzzifier.

    Examples
    --------
    >>> from fuzzy_arbiter import Output, falling, rising
    >>> Output("speed", (0.0, 2.0), {"slow": falling(0.0, 2.0), "fast": rising(0.0, 2.0)}, default=0.5).term_names
    ('slow', 'fast')
    """

    default: float | None = None
    defuzzifier: Defuzzifier = "centroid"
    aggregation: str = ""
    lock_range: bool = False
    lock_previous: bool = False

    def __post_init__(self) -> None:
        # not super(): the decorator makes the class anew for its slots, and the method keeps the old one
        Variable.__post_init__(self)
        what = f"output {self.name!r}"
        if self.aggregation == "":
            object.__setattr__(self, "aggregation", self.usual_aggregation)
        if not self.weighted and not WIDTHS[0] <= self.universe[1] - self.universe[0] <= WIDTHS[1]:
            raise DefinitionError(f"{what}: universe is [{_span(self)}], expected a width from 1e-100 to 1e+100")
        for key, known in (("defuzzifier", get_args(Defuzzifier)), ("aggregation", tuple(AGGREGATIONS))):
            require_choice(getattr(self, key), known, f"{what}: {key}")
        for key in ("lock_range", "lock_previous"):
            if not isinstance(getattr(self, key), bool):
                raise DefinitionError(f"{what}: {key} is {shown(getattr(self, key))}, expected True or False")
        if not self.weighted:
            object.__setattr__(self, "terms", tuple(map(self._joinable, self.terms)))
        for term in self.terms if self.weighted else ():
            if not isinstance(term.shape, Value) and not term.shape.invertible:
                raise DefinitionError(
                    f"{what}: term {term.name!r} is no value, nor does it only rise or only fall, as the defuzzifier "
                    f"{self.defuzzifier!r} expects it"
                )
        if self.default is not None:
            default = finite(self.default)
            if default is None:
                raise DefinitionError(f"{what}: default is {shown(self.default)}, expected a finite number")
            if self.lock_range and not self.universe[0] <= default <= self.universe[1]:
                expected = f"a number in [{_span(self)}], in which lock_range holds it"
                raise DefinitionError(f"{what}: default is {shown(self.default)}, expected {expected}")
            object.__setattr__(self, "default", default)

    def _joinable(self, term: Term) -> Term:
        """Return a term as it is in the universe, if it can be joined with others there."""
        what = f"output {self.name!r}: term {term.name!r}"
        if not isinstance(term.shape, Membership) or (isinstance(term.shape, Formula) and term.shape.names - {"x"}):
            raise DefinitionError(
                f"{what} is a value, expected a membership function, or one of the defuzzifiers {', '.join(WEIGHTED)}"
            )
        bounded = self._within(term)
        shape = bounded.membership
        point = shape.parameters[0] if isinstance(shape, Curve) and shape.kind == "singleton" else math.nan
        if not self.universe[0] <= point <= self.universe[1] and not shape.area(self.universe) > 0.0:
            raise DefinitionError(f"{what} has no area in [{_span(self)}]")
        return bounded

    @property
    def weighted(self) -> bool:
        """True if its terms are values, weighted by strength, and not sets that are joined."""
        return self.defuzzifier in WEIGHTED

    @property
    def usual_aggregation(self) -> str:
        """Aggregation unless another is given: a value that two rules conclude counts twice."""
        return "sum" if self.weighted else "max"


@dataclass(frozen=True, slots=True)
class System:
    """A fuzzy system: rules, and outputs that join what these conclude and make one number of it.

    The default is Mamdani's kind: output terms are clipped and joined by their maximum, whose centroid is the value.

    Attributes
    ----------
    inputs : tuple of Variable
        Inputs in the order of a sample's values.
    outputs : tuple of Output
        Outputs in the order of the weights.
    rules : tuple of Rule
        Rules, at least one; a text such as ``if wind is calm then sail is full`` is a rule too.
    name : str
        Name of the system in files.
    conjunction : str
        Degree of *and*: ``min``, ``prod`` or another of `fuzzy_arbiter.terms.norms.T_NORMS`.
    disjunction : str
        Degree of *or*: ``max``, ``probor``, which is a + b - a b, or another of `fuzzy_arbiter.terms.norms.S_NORMS`.
    implication : str
        Bound of an output's term by a rule's strength: ``min`` clips it, ``prod`` scales it; or another T-norm.
    normalization : {"none", "range", "sum", "max"}
        Normalization of the centroids: ``none`` leaves them; ``range`` maps those of the least and of the greatest term
        alone to 0 and 1; ``sum`` and ``max`` then divide by all weights' sum or greatest.
    outside : {"refuse", "clip"}
        Treatment of an input outside its universe.
    points : int
        Points of an output's universe, 3 to 1 000 000 000, for those engines and formats that sample it.
    weights_of : tuple of str
        Names that results carry, those of the criteria whose weights the outputs are; empty for the outputs' own names.

    Raises
    ------
    DefinitionError
        If names clash, or a rule refers to an unknown variable or term.

    Examples
    --------
    >>> from fuzzy_arbiter import Arbiter
    >>> system = Arbiter().system
    >>> [variable.name for variable in system.inputs], len(system.rules), system["shape"].term_names
    (['obstacle', 'shape', 'depth'], 8, ('simple', 'complex'))
    """

    inputs: tuple[Variable, ...]
    outputs: tuple[Output, ...]
    rules: tuple[Rule, ...]
    name: str = "arbiter"
    conjunction: str = "min"
    disjunction: str = "max"
    implication: str = "min"
    normalization: Normalization = "none"
    outside: Outside = "refuse"
    points: int = 101
    weights_of: tuple[str, ...] = ()

    def __post_init__(self) -> None:
        rules: tuple[Rule | str, ...] = all_of((Rule, str), self.rules, "rules", "a sequence of Rule or text")
        for key, kind in (("inputs", Variable), ("outputs", Output)):
            variables = all_of(kind, getattr(self, key), key, f"a sequence of {kind.__name__}")
            object.__setattr__(self, key, variables)
        object.__setattr__(self, "rules", tuple(parse_rule(r) if isinstance(r, str) else r for r in rules))
        require_name(self.name, "system")
        for key, choices in CHOICES.items():
            require_choice(getattr(self, key), choices, key)
        if not (isinstance(self.points, Integral) and 3 <= self.points <= MAX_POINTS):
            raise DefinitionError(
                f"points is {shown(self.points)}, expected a whole number, 3 or more, to {MAX_POINTS}"
            )
        object.__setattr__(self, "points", int(self.points))
        names = all_of(str, self.weights_of, "weights_of", "names of criteria")
        for name in names:
            require_name(name, "weights_of")
        if len(names) not in (0, len(self.outputs)) or len(set(names)) < len(names):
            expected = f"a name for each of the {len(self.outputs)} outputs, each once"
            raise DefinitionError(f"weights_of is {shown(names)}, expected {expected}")
        object.__setattr__(self, "weights_of", names)
        for key in ("inputs", "outputs", "rules"):
            if not getattr(self, key):
                raise DefinitionError(f"{key}: got none, expected at least one")
        require_distinct((v.name for v in (*self.inputs, *self.outputs)), "variables: two")
        _require_rules(self)
        _require_values(self)

    @property
    def result_names(self) -> tuple[str, ...]:
        """Names that results carry: those of the criteria whose weights the outputs are, else the outputs' own."""
        return self.weights_of or variable_names(self.outputs)

    def __getitem__(self, variable: str) -> Variable:
        """Return the input or output of a name."""
        for known in (*self.inputs, *self.outputs):
            if known.name == variable:
                return known
        expected = ", ".join(variable_names((*self.inputs, *self.outputs)))
        raise DefinitionError(f"no variable {shown(variable)}, expected one of {expected}")

    def __str__(self) -> str:
        return "\n".join(f"R{i + 1}: {rule}" for i, rule in enumerate(self.rules))

    def rule_table(self) -> list[dict[str, str]]:
        """Return a row for each rule, with a column for each input where every condition only joins such by *and*."""
        return rule_rows(self)

    def _repr_html_(self) -> str:
        return html_of(self)

    def __repr__(self) -> str:
        """Return Python text that builds an equal system; rules are texts, and default settings are left out."""
        rules = tuple(str(rule) if rule.operators is None else rule for rule in self.rules)
        parts = [
            f"{key.name}={getattr(self, key.name)!r}" for key in fields(self) if getattr(self, key.name) != key.default
        ]
        parts[2] = f"rules={rules!r}"
        return f"System({', '.join(parts)})"


CHOICES = {
    "conjunction": tuple(T_NORMS),
    "disjunction": tuple(S_NORMS),
    "implication": tuple(T_NORMS),
    "normalization": get_args(Normalization),
    "outside": get_args(Outside),
}


def _span(variable: Variable) -> str:
    return f"{variable.universe[0]:g}, {variable.universe[1]:g}"


def variable_names(variables: Sequence[Variable]) -> tuple[str, ...]:
    """Return the variables' names in their order."""
    return tuple(variable.name for variable in variables)


def _require_rules(system: System) -> None:
    """Require that the rules refer only to variables and terms of the system."""
    inputs = {v.name: frozenset(v.term_names) for v in system.inputs}
    outputs = {v.name: frozenset(v.term_names) for v in system.outputs}
    before: set[str] = set()
    for i, rule in enumerate(system.rules):
        try:
            _require_rule(rule, inputs, outputs, before)
        except DefinitionError as error:
            raise DefinitionError(f"R{i + 1} {str(rule)!r}: {error}") from None
        before |= {c.variable for c in rule.conclusions}


def _require_rule(rule: Rule, inputs: _Terms, outputs: _Terms, before: set[str]) -> None:
    for statement in rule.condition.terms():
        if statement.variable not in outputs:
            _require_known(statement, inputs, "input")
            continue
        _require_known(statement, outputs, "output")
        if statement.variable not in before:
            raise DefinitionError(f"asks for output {statement.variable!r}, on which no rule before concludes")
    for part in rule.condition.parts_within():
        if isinstance(part, Anything) and part.variable not in inputs:
            raise DefinitionError(f"no input {part.variable!r}, expected one of {', '.join(inputs)}")
    for statement in rule.conclusions:
        _require_known(statement, outputs, "output")
    if len({statement.variable for statement in rule.conclusions}) < len(rule.conclusions):
        raise DefinitionError("two conclusions on one output, expected each output once")


def _require_values(system: System) -> None:
    """Require that values refer only to existing variables, and that every input is used."""
    inputs, outputs = ([v.name for v in variables] for variables in (system.inputs, system.outputs))
    used: set[str] = set()
    for k, output in enumerate(system.outputs):
        for term in output.terms if output.weighted else ():
            if isinstance(term.shape, Value):
                try:
                    whole = term.shape.expression(inputs, outputs[:k])
                except DefinitionError as error:
                    raise DefinitionError(f"output {output.name!r}: term {term.name!r}: {error}") from None
                used |= whole.names | (set(inputs) if isinstance(term.shape, Linear) else set())
    for variable in system.inputs:
        if not variable.terms and variable.name not in used:
            raise DefinitionError(f"variable {variable.name!r}: no terms, expected at least one")


def _require_known(statement: Is, known: _Terms, kind: str) -> None:
    if statement.variable not in known:
        raise DefinitionError(f"no {kind} {statement.variable!r}, expected one of {', '.join(known)}")
    if statement.term not in known[statement.variable]:
        expected = ", ".join(sorted(known[statement.variable]))
        raise DefinitionError(f"{statement.variable!r} has no term {statement.term!r}, expected one of {expected}")
