"""The reference engine: the same definition on scikit-fuzzy's control API (min-max, centroid)."""

from __future__ import annotations

import functools
import operator
import threading
from collections.abc import Iterable, Sequence
from typing import Any

import numpy as np
from skfuzzy import control, trimf

from fuzzy_arbiter.closed_form import CENTROID_HIGH, CENTROID_LOW
from fuzzy_arbiter.definition import Criterion, Rule

_REMEMBERED = 4096  # results kept for inputs that come again, as crisp ones do


class ScikitEngine:
    """Runs the rules in scikit-fuzzy; safe to call from several threads, each of which gets a system of its own."""

    def __init__(self, criteria: Sequence[Criterion], rules: Sequence[Rule], points: int) -> None:
        self._criteria = tuple(criteria)
        self._rules = tuple(rules)
        self._points = points
        self._local = threading.local()

    def weights(self, memberships: Sequence[float]) -> tuple[float, ...]:
        """Return the range-normalised weight of each criterion.

        Parameters
        ----------
        memberships : sequence of float
            Degree of each criterion's on-term in [0, 1].

        Returns
        -------
        tuple of float
            Weights in [0, 1].
        """
        scale = 1.0 / (CENTROID_HIGH - CENTROID_LOW)
        return tuple(min(max((c - CENTROID_LOW) * scale, 0.0), 1.0) for c in self.centroids(memberships))

    def centroids(self, memberships: Sequence[float]) -> tuple[float, ...]:
        """Return the raw centroid of each output, in [1/3, 2/3].

        Parameters
        ----------
        memberships : sequence of float
            Degree of each criterion's on-term in [0, 1].

        Returns
        -------
        tuple of float
            Centroids, off the exact ones by at most the square of the grid step over 6.
        """
        if not hasattr(self._local, "simulation"):
            self._local.simulation = _simulation(self._criteria, self._rules, self._points)
            self._local.known = {}
        known: dict[tuple[float, ...], tuple[float, ...]] = self._local.known
        key = tuple(map(float, memberships))
        if key not in known:
            if len(known) >= _REMEMBERED:
                known.clear()
            known[key] = self._compute(key)
        return known[key]

    def _compute(self, memberships: tuple[float, ...]) -> tuple[float, ...]:
        simulation = self._local.simulation
        # all inputs, every time: scikit-fuzzy forgets them when it flushes its cache
        for i, m in enumerate(memberships):
            simulation.input[_input(i)] = m
        simulation.compute()
        return tuple(float(simulation.output[_output(i)]) for i in range(len(memberships)))


class _OrderedSystem(control.ControlSystem):  # type: ignore[misc]
    """A control system that works out the order of its rules once, not at every evaluation."""

    _ordered: tuple[control.Rule, ...] | None = None

    @property
    def rules(self) -> Iterable[control.Rule]:
        return super().rules if self._ordered is None else self._ordered

    def freeze(self) -> None:
        self._ordered = tuple(super().rules)


def _input(i: int) -> str:
    return f"m_{i + 1}"


def _output(i: int) -> str:
    return f"alpha_{i + 1}"


def _simulation(criteria: Sequence[Criterion], rules: Sequence[Rule], points: int) -> Any:
    """Build the system; its inputs are degrees of the on-terms, which a two-point universe represents exactly."""
    knots = np.array([0.0, 1.0])
    universe = np.linspace(0.0, 1.0, points)
    inputs, outputs = [], []
    for i, criterion in enumerate(criteria):
        antecedent = control.Antecedent(knots, _input(i))
        antecedent[criterion.off] = 1.0 - knots
        antecedent[criterion.on] = knots
        inputs.append(antecedent)
        consequent = control.Consequent(universe, _output(i), defuzzify_method="centroid")
        consequent["low"] = trimf(universe, [0.0, 0.0, 1.0])
        consequent["high"] = trimf(universe, [0.0, 1.0, 1.0])
        outputs.append(consequent)

    def condition(rule: Rule) -> Any:
        terms = [
            inputs[t.criterion][criteria[t.criterion].on if t.on else criteria[t.criterion].off] for t in rule.terms
        ]
        return functools.reduce(operator.and_ if rule.join == "and" else operator.or_, terms)

    system = _OrderedSystem(
        control.Rule(condition(rule), outputs[rule.criterion]["high" if rule.high else "low"], label=f"R{i + 1}")
        for i, rule in enumerate(rules)
    )
    system.freeze()
    return control.ControlSystemSimulation(system, clip_to_bounds=False, lenient=False)
