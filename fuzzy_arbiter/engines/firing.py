"""Fuzzify and fire: from inputs to the strengths of rules and the cuts of output terms, for one sample or many."""

from __future__ import annotations

import functools
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Generic, TypeVar

import numpy as np
from numpy.typing import NDArray

from fuzzy_arbiter.definition import Conjunction, Disjunction, System
from fuzzy_arbiter.propositions import And, Is, Not, Or, Proposition
from fuzzy_arbiter.shapes import Shape

Array = NDArray[np.float64]
D = TypeVar("D")


@dataclass(frozen=True, slots=True)
class Logic(Generic[D]):
    """What *and*, *or* and *not* do with degrees of one kind: numbers, arrays, or others."""

    conjunction: Callable[[D, D], D]
    disjunction: Callable[[D, D], D]
    negation: Callable[[D], D]

    def degree(self, proposition: Proposition, of: Callable[[Is], D]) -> D:
        """Return the degree to which a proposition holds.

        Parameters
        ----------
        proposition : Proposition
            Of terms of the system's inputs.
        of : callable
            Gives the degree of each statement in it.

        Returns
        -------
        D
            Its degree.
        """
        if isinstance(proposition, Is):
            return of(proposition)
        if isinstance(proposition, Not):
            return self.negation(self.degree(proposition.part, of))
        assert isinstance(proposition, And | Or)
        join = self.conjunction if isinstance(proposition, And) else self.disjunction
        return functools.reduce(join, (self.degree(part, of) for part in proposition.parts))


_NUMBERS: dict[str, Callable[[float, float], float]] = {
    "min": min,
    "prod": lambda a, b: a * b,
    "max": max,
    "probor": lambda a, b: a + b - a * b,
}
_ARRAYS: dict[str, Callable[[Array, Array], Array]] = {
    "min": np.minimum,
    "prod": np.multiply,
    "max": np.maximum,
    "probor": lambda a, b: a + b - a * b,
}


def number_logic(conjunction: Conjunction, disjunction: Disjunction) -> Logic[float]:
    """Return the logic of single degrees.

    Parameters
    ----------
    conjunction, disjunction
        As of `System`.

    Returns
    -------
    Logic of float
        On degrees in [0, 1].
    """
    return Logic(_NUMBERS[conjunction], _NUMBERS[disjunction], lambda a: 1.0 - a)


def array_logic(conjunction: Conjunction, disjunction: Disjunction) -> Logic[Array]:
    """Return the logic of arrays of degrees.

    Parameters
    ----------
    conjunction, disjunction
        As of `System`.

    Returns
    -------
    Logic of ndarray
        On arrays of one shape, degrees in [0, 1].
    """
    return Logic(_ARRAYS[conjunction], _ARRAYS[disjunction], lambda a: 1.0 - a)


class Firing:
    """The first half of every engine: degrees of input terms, strengths of rules, cuts of output terms.

    Parameters
    ----------
    system : System
        Whose rules fire.
    """

    def __init__(self, system: System) -> None:
        self.system = system
        self._inputs = {v.name: i for i, v in enumerate(system.inputs)}
        self._shapes = {(v.name, t.name): t.shape for v in system.inputs for t in v.terms}
        self._outputs = {v.name: {t.name: j for j, t in enumerate(v.terms)} for v in system.outputs}

    def strengths(self, inputs: Sequence[float]) -> list[float]:
        """Return how strongly each rule fires for one sample.

        Parameters
        ----------
        inputs : sequence of float
            One value in its universe for each input.

        Returns
        -------
        list of float
            Degree of each rule's condition times its weight, in the order of the rules.
        """
        logic = number_logic(self.system.conjunction, self.system.disjunction)

        def of(statement: Is) -> float:
            return self._shapes[statement.variable, statement.term](inputs[self._inputs[statement.variable]])

        return [logic.degree(rule.condition, of) * rule.weight for rule in self.system.rules]

    def strengths_of_many(self, inputs: Array) -> list[Array]:
        """Return how strongly each rule fires for each of many samples.

        Parameters
        ----------
        inputs : ndarray, shape (n, inputs)
            Values in their universes.

        Returns
        -------
        list of ndarray, shape (n,)
            For each rule, in the order of the rules.
        """
        logic = array_logic(self.system.conjunction, self.system.disjunction)
        known: dict[tuple[str, str], Array] = {}

        def of(statement: Is) -> Array:
            key = (statement.variable, statement.term)
            if key not in known:
                known[key] = degrees_of_many(self._shapes[key], inputs[:, self._inputs[statement.variable]])
            return known[key]

        return [logic.degree(rule.condition, of) * rule.weight for rule in self.system.rules]

    def cuts(self, strengths: Sequence[float]) -> list[list[float]]:
        """Return the greatest strength with which each output term is concluded.

        Parameters
        ----------
        strengths : sequence of float
            Of each rule, as from `strengths`.

        Returns
        -------
        list of list of float
            For each output, the cut of each of its terms; 0 where no rule fires.
        """
        result = [[0.0] * len(v.terms) for v in self.system.outputs]
        cuts = dict(zip(self._outputs, result, strict=True))
        for rule, strength in zip(self.system.rules, strengths, strict=True):
            for conclusion in rule.conclusions:
                j = self._outputs[conclusion.variable][conclusion.term]
                cuts[conclusion.variable][j] = max(cuts[conclusion.variable][j], strength)
        return result

    def cuts_of_many(self, strengths: Sequence[Array]) -> list[Array]:
        """Return the greatest strength with which each output term is concluded, for each of many samples.

        Parameters
        ----------
        strengths : sequence of ndarray, shape (n,)
            Of each rule, as from `strengths_of_many`.

        Returns
        -------
        list of ndarray, shape (terms, n)
            For each output.
        """
        n = len(strengths[0])
        result = [np.zeros((len(v.terms), n)) for v in self.system.outputs]
        cuts = dict(zip(self._outputs, result, strict=True))
        for rule, strength in zip(self.system.rules, strengths, strict=True):
            for conclusion in rule.conclusions:
                row = cuts[conclusion.variable][self._outputs[conclusion.variable][conclusion.term]]
                np.maximum(row, strength, out=row)
        return result


def degrees_of_many(shape: Shape, places: Array) -> Array:
    """Return the degrees of a shape at many places, each as the shape itself gives it.

    Parameters
    ----------
    shape : Shape
        A membership function.
    places : ndarray, shape (n,)
        Finite.

    Returns
    -------
    ndarray, shape (n,)
        Degrees in [0, 1].
    """
    x, y = np.array(shape.points).T
    if len(x) == 1:
        return np.full(len(places), y[0])
    right = np.clip(np.searchsorted(x, places), 1, len(x) - 1)  # of x[right - 1] < place <= x[right]
    left = right - 1
    with np.errstate(divide="ignore", invalid="ignore"):  # at jumps, which are set below
        share = (places - x[left]) / (x[right] - x[left])
        degrees = y[left] + (y[right] - y[left]) * share
    degrees[places <= x[0]] = y[0]
    degrees[places >= x[-1]] = y[-1]
    for i in range(len(x) - 1):
        if x[i] == x[i + 1]:
            degrees[places == x[i]] = max(y[i], y[i + 1])
    return np.asarray(degrees)
