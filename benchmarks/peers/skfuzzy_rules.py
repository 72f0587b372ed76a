"""The paper's rules in scikit-fuzzy, in the style of its examples."""

from __future__ import annotations

import warnings
from collections.abc import Callable
from typing import Any

import numpy as np
from skfuzzy import control, gaussmf, trimf

NAMES = ("obstacle", "shape", "depth")


def simulation(points: int) -> Any:
    """Return a simulation of the rules over universes of a number of points."""
    universe = np.linspace(0.0, 1.0, points)
    inputs = [control.Antecedent(universe, name) for name in NAMES]
    outputs = [control.Consequent(universe, f"alpha_{i + 1}") for i in range(len(NAMES))]
    for variable in (*inputs, *outputs):
        variable["low"] = trimf(universe, [0.0, 0.0, 1.0])
        variable["high"] = trimf(universe, [0.0, 1.0, 1.0])
    obstacle, shape, depth = inputs
    rules = [
        control.Rule(obstacle["high"], outputs[0]["high"]),
        control.Rule(obstacle["low"], outputs[0]["low"]),
        control.Rule(obstacle["high"], outputs[1]["low"]),
        control.Rule(shape["low"], outputs[1]["low"]),
        control.Rule(obstacle["low"] & shape["high"], outputs[1]["high"]),
        control.Rule(obstacle["high"] | shape["high"], outputs[2]["low"]),
        control.Rule(depth["low"], outputs[2]["low"]),
        control.Rule(obstacle["low"] & shape["low"] & depth["high"], outputs[2]["high"]),
    ]
    return control.ControlSystemSimulation(control.ControlSystem(rules))


def calls(setup: dict[str, Any]) -> Callable[[int], object]:
    """Return a function that makes a number of computations, with new inputs, since scikit-fuzzy caches results."""
    warnings.simplefilter("ignore", DeprecationWarning)
    system, rng = simulation(setup["points"]), np.random.default_rng(0)

    def work(count: int) -> None:
        for values in rng.random((count, len(NAMES))).tolist():
            for name, x in zip(NAMES, values, strict=True):
                system.input[name] = x
            system.compute()

    return work


def arrays(setup: dict[str, Any]) -> Callable[[int], object]:
    """Return a function that computes a given number of rows at once."""
    warnings.simplefilter("ignore", DeprecationWarning)
    system, rng = simulation(setup["points"]), np.random.default_rng(0)

    def work(count: int) -> None:
        for name, column in zip(NAMES, rng.random((len(NAMES), max(2, count))), strict=True):
            system.input[name] = column
        system.compute()

    return work


def tipping(setup: dict[str, Any]) -> Callable[[int], object]:
    """Return a function that computes a given number of rows of tipping, with Gaussian tips, at once."""
    warnings.simplefilter("ignore", DeprecationWarning)
    marks = [control.Antecedent(np.linspace(0.0, 10.0, setup["points"]), name) for name in ("quality", "service")]
    for mark in marks:
        mark.automf(3)
    universe = np.linspace(0.0, 25.0, setup["points"])
    tip = control.Consequent(universe, "tip", defuzzify_method=setup["defuzzifier"])
    for name, mean in (("low", 4.0), ("medium", 12.5), ("high", 21.0)):
        tip[name] = gaussmf(universe, mean, 3.0)
    quality, service = marks
    rules = [
        control.Rule(quality["poor"] | service["poor"], tip["low"]),
        control.Rule(service["average"], tip["medium"]),
        control.Rule(quality["good"] | service["good"], tip["high"]),
    ]
    system, rng = control.ControlSystemSimulation(control.ControlSystem(rules)), np.random.default_rng(0)

    def work(count: int) -> None:
        for mark, column in zip(marks, rng.uniform(0.0, 10.0, (2, max(2, count))), strict=True):
            system.input[mark.label] = column
        system.compute()

    return work
