"""Fuzzify and fire: from inputs to the strengths of rules and the cuts of output terms, for one sample or many."""

from __future__ import annotations

import functools
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any, Generic, TypeVar

import numpy as np
from numpy.typing import NDArray

from fuzzy_arbiter.definition import Output, System
from fuzzy_arbiter.propositions import And, Anything, Hedged, Is, Not, Or, Proposition
from fuzzy_arbiter.rule import Operators
from fuzzy_arbiter.terms.norms import AGGREGATIONS, HEDGES, S_NORMS, T_NORMS

Array = NDArray[np.float64]
Degrees = Mapping[tuple[str, str], Callable[[float], float]]  # of each input's terms, by the names of both
D = TypeVar("D")


@dataclass(frozen=True, slots=True)
class Logic(Generic[D]):
    """The operators *and*, *or*, *not* and hedges on one type of degree: numbers, arrays, or others."""

    conjunction: Callable[[D, D], D]
    disjunction: Callable[[D, D], D]
    negation: Callable[[D], D]
    hedge: Callable[[str, D], D] | None = None
    certain: Callable[[], D] | None = None

    def degree(self, proposition: Proposition, of: Callable[[Is], D]) -> D:
        """Return the degree to which a proposition holds."""
        if isinstance(proposition, Is):
            return of(proposition)
        if isinstance(proposition, Not):
            return self.negation(self.degree(proposition.part, of))
        if isinstance(proposition, Hedged):
            assert self.hedge is not None
            return self.hedge(proposition.hedge, self.degree(proposition.part, of))
        if isinstance(proposition, Anything):
            assert self.certain is not None
            return self.certain()
        assert isinstance(proposition, And | Or)
        join = self.conjunction if isinstance(proposition, And) else self.disjunction
        return functools.reduce(join, (self.degree(part, of) for part in proposition.parts))


def number_logic(operators: System | Operators) -> Logic[float]:
    """Return the logic of single degrees."""
    conjunction, disjunction = T_NORMS[operators.conjunction], S_NORMS[operators.disjunction]
    return Logic(
        conjunction.number, disjunction.number, lambda a: 1.0 - a, lambda word, a: HEDGES[word].number(a), lambda: 1.0
    )


def array_logic(operators: System | Operators, n: int = 1) -> Logic[Array]:
    """Return the logic of arrays of degrees."""
    conjunction, disjunction = T_NORMS[operators.conjunction], S_NORMS[operators.disjunction]
    return Logic(
        conjunction.array,
        disjunction.array,
        lambda a: 1.0 - a,
        lambda word, a: HEDGES[word].array(a),
        lambda: np.ones(n),
    )


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

    def __init__(self, system: System, degrees: Degrees | None = None) -> None:
        self.system = system
        self.slots = tuple(slots_of(system, output) for output in system.outputs)
        self._inputs = {v.name: i for i, v in enumerate(system.inputs)}
        self._shapes = {(v.name, t.name): t.membership for v in system.inputs for t in v.terms}
        self._degrees = degrees or self._shapes
        logics = {o: number_logic(o or system) for o in {rule.operators for rule in system.rules}}
        self._rules = [(rule.condition, logics[rule.operators], rule.weight) for rule in system.rules]
        self._joins = [AGGREGATIONS[output.aggregation] for output in system.outputs]

    def strengths(self, inputs: Sequence[float]) -> list[float]:
        """Return the firing strength of each rule for one sample."""

        def of(statement: Is) -> float:
            index = self._inputs.get(statement.variable)
            if index is None:  # an output: its degree by the rules before this one
                return float(self._concluded(statement, result, number=True))
            return self._degrees[statement.variable, statement.term](inputs[index])

        result: list[float] = []
        for condition, logic, weight in self._rules:
            result.append(logic.degree(condition, of) * weight)
        return result

    def _concluded(self, statement: Is, strengths: Sequence[Any], number: bool) -> Any:
        """Return the joined strength of the rules so far that conclude a statement on an output."""
        earlier = [s for s, rule in zip(strengths, self.system.rules, strict=False) if statement in rule.conclusions]
        if not earlier:
            return 0.0 if number else np.zeros_like(strengths[0])
        k = next(k for k, output in enumerate(self.system.outputs) if output.name == statement.variable)
        return functools.reduce(self._joins[k].number if number else self._joins[k].array, earlier)

    def strengths_of_many(self, inputs: Array) -> list[Array]:
        """Return the firing strength of each rule for many samples; inputs (n, inputs), returns (n,)."""
        known: dict[tuple[str, str], Array] = {}

        def of(statement: Is) -> Array:
            key = (statement.variable, statement.term)
            if statement.variable not in self._inputs:
                return np.asarray(self._concluded(statement, result, number=False))
            if key not in known:
                known[key] = self._shapes[key].of_many(inputs[:, self._inputs[statement.variable]])
            return known[key]

        result: list[Array] = []
        for rule in self.system.rules:
            logic = array_logic(rule.operators or self.system, len(inputs))
            result.append(logic.degree(rule.condition, of) * rule.weight)
        return result

    def cuts(self, strengths: Sequence[float]) -> list[list[float]]:
        """Return the strength of each slot of each output."""
        result = []
        for slots, norm in zip(self.slots, self._joins, strict=True):
            join = norm.number
            result.append(
                [functools.reduce(join, [strengths[i] for i in slot.rules]) if slot.rules else 0.0 for slot in slots]
            )
        return result

    def cuts_of_many(self, strengths: Sequence[Array]) -> list[Array]:
        """Return the strength of each slot of each output, for each of many samples."""
        result = []
        for slots, norm in zip(self.slots, self._joins, strict=True):
            cuts = np.zeros((len(slots), len(strengths[0])))
            for row, slot in zip(cuts, slots, strict=True):
                if slot.rules:
                    row[:] = functools.reduce(norm.array, [strengths[i] for i in slot.rules])
            result.append(cuts)
        return result

    def term_cuts(self, k: int, strengths: Sequence[float]) -> list[float]:
        """Return the greatest strength with which each term of an output is concluded."""
        result = [0.0] * len(self.system.outputs[k].terms)
        for slot in self.slots[k]:
            result[slot.term] = max([result[slot.term], *(strengths[i] for i in slot.rules)])
        return result
