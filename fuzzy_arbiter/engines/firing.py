"""Fuzzify and fire: from inputs to the strengths of rules and the cuts of output terms, for one sample or many."""

from __future__ import annotations

import functools
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any, Generic, TypeVar

import numpy as np

from fuzzy_arbiter.definition import Output, System
from fuzzy_arbiter.propositions import And, Anything, Hedged, Is, Not, Or, Proposition
from fuzzy_arbiter.rule import Operators
from fuzzy_arbiter.shapes import Array
from fuzzy_arbiter.terms.norms import AGGREGATIONS, HEDGES, S_NORMS, T_NORMS

Degrees = Mapping[tuple[str, str], Callable[[Any], Any]]  # of each input's terms, by the names of both
D = TypeVar("D")


@dataclass(frozen=True, slots=True)
class Logic(Generic[D]):
    """The operators *and*, *or*, *not* and hedges on one type of degree: numbers, arrays, or others."""

    conjunction: Callable[[D, D], D]
    disjunction: Callable[[D, D], D]
    negation: Callable[[D], D]
    hedge: Callable[[str, D], D] | None = None
    certain: D | None = None  # degree of *any*

    def degree(self, proposition: Proposition, degree_of: Callable[[Is], D]) -> D:
        """Return the degree to which a proposition holds."""
        if isinstance(proposition, Is):
            return degree_of(proposition)
        if isinstance(proposition, Not):
            return self.negation(self.degree(proposition.part, degree_of))
        if isinstance(proposition, Hedged):
            assert self.hedge is not None
            return self.hedge(proposition.hedge, self.degree(proposition.part, degree_of))
        if isinstance(proposition, Anything):
            assert self.certain is not None
            return self.certain
        assert isinstance(proposition, And | Or)
        join = self.conjunction if isinstance(proposition, And) else self.disjunction
        return functools.reduce(join, (self.degree(part, degree_of) for part in proposition.parts))


def logic_of(operators: System | Operators, many: bool = False) -> Logic[Any]:
    """Return the logic of single degrees, or of arrays of degrees."""
    word = "array" if many else "number"
    conjunction, disjunction = T_NORMS[operators.conjunction], S_NORMS[operators.disjunction]
    hedges: dict[str, Callable[[Any], Any]] = {name: getattr(hedge, word) for name, hedge in HEDGES.items()}
    joins = getattr(conjunction, word), getattr(disjunction, word)
    return Logic(*joins, lambda a: 1.0 - a, lambda name, a: hedges[name](a), 1.0)


@dataclass(frozen=True, slots=True)
class Slot:
    """One of the sets or values that are joined to an output."""

    term: int  # index of the output's term
    rules: tuple[int, ...]  # the rules that conclude it, of which the joined strength is the slot's degree
    implication: str  # implication of these rules


def slots_of(system: System, output: Output) -> tuple[Slot, ...]:
    """Return the slots of an output: one for each term where the result is the same, else one for each conclusion."""
    names = output.term_names
    concluded = [
        (i, names.index(c.term), (rule.operators or system).implication)
        for i, rule in enumerate(system.rules)
        for c in rule.conclusions
        if c.variable == output.name
    ]
    implications = {implication for _, _, implication in concluded}
    if output.weighted or (output.aggregation == "max" and len(implications) <= 1):
        implication = next(iter(implications), system.implication)
        return tuple(Slot(j, tuple(i for i, t, _ in concluded if t == j), implication) for j in range(len(names)))
    return tuple(Slot(j, (i,), implication) for i, j, implication in concluded)


class Firing:
    """The first half of every engine: degrees of input terms, strengths of rules, cuts of output terms."""

    # Each function takes numbers of one sample, or arrays of many samples' numbers.

    def __init__(self, system: System, degrees: Degrees | None = None) -> None:
        self.system = system
        self.slots = tuple(slots_of(system, output) for output in system.outputs)
        self._inputs = {v.name: i for i, v in enumerate(system.inputs)}
        shapes = {(v.name, t.name): t.membership for v in system.inputs for t in v.terms}
        # of one sample, and of many
        many = {name: shape.of_many for name, shape in shapes.items()}
        self._degrees: tuple[Degrees, Degrees] = degrees or shapes, degrees or many
        operators = {rule.operators: rule.operators or system for rule in system.rules}
        self._logics = [{key: logic_of(norms, many) for key, norms in operators.items()} for many in (False, True)]
        joins = [AGGREGATIONS[output.aggregation] for output in system.outputs]
        self._joins: tuple[list[Callable[..., Any]], ...] = [j.number for j in joins], [j.array for j in joins]

    def strengths(self, inputs: Sequence[float] | Array) -> list[Any]:
        """Return the firing strength of each rule; an array of many samples is (n, inputs), and each strength (n,)."""
        many = isinstance(inputs, np.ndarray)
        degrees, logics, columns = self._degrees[many], self._logics[many], np.transpose(inputs) if many else inputs
        known: dict[tuple[str, str], Any] = {}
        result: list[Any] = []

        def degree_of(statement: Is) -> Any:
            key = statement.variable, statement.term
            degree = known.get(key)
            if degree is not None:
                return degree
            if key not in degrees:  # of an output: its degree by the rules before this one
                return self._concluded(statement, result)
            degree = known[key] = degrees[key](columns[self._inputs[statement.variable]])
            return degree

        for rule in self.system.rules:
            strength = logics[rule.operators].degree(rule.condition, degree_of) * rule.weight
            result.append(np.broadcast_to(strength, len(inputs)) if many else strength)
        return result

    def _concluded(self, statement: Is, strengths: Sequence[Any]) -> Any:
        """Return the joined strength of the rules so far that conclude a statement on an output."""
        earlier = [s for s, rule in zip(strengths, self.system.rules, strict=False) if statement in rule.conclusions]
        k = next(k for k, output in enumerate(self.system.outputs) if output.name == statement.variable)
        if not earlier:
            return 0.0
        return functools.reduce(self._joins[isinstance(earlier[0], np.ndarray)][k], earlier)

    def cuts(self, strengths: Sequence[Any]) -> list[Any]:
        """Return the strength of each slot of each output: lists of numbers, or arrays (slots, n)."""
        many = isinstance(strengths[0], np.ndarray)
        none: Any = np.zeros_like(strengths[0]) if many else 0.0
        result: list[Any] = [
            [functools.reduce(join, [strengths[i] for i in slot.rules]) if slot.rules else none for slot in slots]
            for slots, join in zip(self.slots, self._joins[many], strict=True)
        ]
        return [np.array(cuts).reshape(len(cuts), len(none)) for cuts in result] if many else result
