"""The scikit-fuzzy engine equals scikit-fuzzy and avoids its known defects."""

import subprocess
import sys
from dataclasses import replace
from functools import reduce
from operator import and_, or_

import numpy as np
import pytest
from skfuzzy import control

from fuzzy_arbiter import (
    Output,
    Rule,
    Shape,
    System,
    Term,
    Variable,
    falling,
    prioritized,
    rising,
    trapezoid,
    triangle,
)
from fuzzy_arbiter.engines.scikit import ScikitEngine
from fuzzy_arbiter.errors import EngineError
from fuzzy_arbiter.propositions import And, Is, Not, Or
from tests.fuzzy_arbiter.formats.systems import TIPPING as SYSTEM

TIPPING = replace(SYSTEM, points=26)
QUALITY, SERVICE, (TIP,) = *TIPPING.inputs, TIPPING.outputs
# nested conditions, weights, two conclusions, knots off the grid, a jump, a term that no rule concludes
MIXED_OUTPUTS = (
    Output(
        "u",
        (-1, 2),
        (
            Term("a", triangle(-1.5, -0.4, 0.31)),
            Term("b", trapezoid(-0.2, 0.5, 0.77, 1.4)),
            Term("c", Shape(((1.013, 0), (1.013, 0.8), (1.9, 0.2)))),
            Term("never", triangle(0, 1, 2)),
        ),
        default=0.0,
    ),
    Output("v", (10, 30), (Term("a", falling(10, 23)), Term("b", rising(13.3, 29))), default=12.5),
)
MIXED_RULES = (
    Rule((QUALITY["poor"] | ~SERVICE["poor"]) & ~(QUALITY["good"] & SERVICE["average"]), MIXED_OUTPUTS[0]["a"], 0.7),
    Rule(
        QUALITY["average"] & (SERVICE["good"] | QUALITY["good"]), (MIXED_OUTPUTS[0]["b"], MIXED_OUTPUTS[1]["a"]), 0.35
    ),
    Rule(~(QUALITY["average"] | ~SERVICE["good"]), (MIXED_OUTPUTS[0]["c"], MIXED_OUTPUTS[1]["b"])),
    Rule(SERVICE["poor"] & QUALITY["poor"] & ~SERVICE["average"], (MIXED_OUTPUTS[1]["b"],), 0.05),
)


def mixed(conjunction="min", disjunction="max", points=101):
    options = {"conjunction": conjunction, "disjunction": disjunction, "points": points}
    return System((QUALITY, SERVICE), MIXED_OUTPUTS, MIXED_RULES, normalization="none", **options)


def stock(system):
    """The system in scikit-fuzzy's own classes, as its examples build it, but with knots as universes of the inputs."""

    def variable(kind, definition, universe):
        made = kind(universe, definition.name)
        for term in definition.terms:
            made[term.name] = term.shape.of_many(universe)
        return made

    def condition(proposition):
        if isinstance(proposition, Is):
            return known[proposition.variable][proposition.term]
        if isinstance(proposition, Not):
            return ~condition(proposition.part)
        join = {And: and_, Or: or_}[type(proposition)]
        return reduce(join, map(condition, proposition.parts))

    known = {}
    for v in system.inputs:
        knots = {x for term in v.terms for x, _ in term.shape.points if v.universe[0] < x < v.universe[1]}
        known[v.name] = variable(control.Antecedent, v, np.array(sorted({*knots, *v.universe})))
    for v in system.outputs:
        known[v.name] = variable(control.Consequent, v, np.linspace(*v.universe, system.points))
    functions = {"min": np.fmin, "max": np.fmax, "prod": np.multiply, "probor": lambda a, b: a + b - a * b}
    rules = [
        control.Rule(
            condition(rule.condition),
            [known[c.variable][c.term] % rule.weight for c in rule.conclusions],
            and_func=functions[system.conjunction],
            or_func=functions[system.disjunction],
        )
        for rule in system.rules
    ]
    return control.ControlSystem(rules)


@pytest.mark.medium(fast=1)
@pytest.mark.parametrize(
    "system",
    [
        TIPPING,
        prioritized(points=11),
        prioritized(form="complete"),
        mixed(),
        mixed("prod", "probor", 37),
        mixed("prod"),
    ],
    ids=lambda system: f"{system.name}, {len(system.rules)} rules, {system.conjunction}, {system.disjunction}",
)
def test_engine_equals_stock_scikit_fuzzy_bit_for_bit(system):
    engine, built = ScikitEngine(system), stock(system)
    rng = np.random.default_rng(1)
    low, high = np.array([v.universe for v in system.inputs]).T
    for row in (low + (high - low) * np.vstack([rng.random((25, len(low))), np.eye(len(low))])).tolist():
        simulation = control.ControlSystemSimulation(built)
        simulation.inputs(dict(zip((v.name for v in system.inputs), row, strict=True)))
        simulation.compute()
        expected = [simulation.output.get(v.name, v.default) for v in system.outputs]
        assert engine.centroids(row) == expected


def gap(default=None):
    """No rule fires between 4 and 6."""
    x = Variable("x", (0, 10), (Term("a", falling(0, 4)), Term("b", rising(6, 10))))
    y = Output("y", (5, 6), (Term("a", triangle(5, 5.2, 5.4)), Term("b", triangle(5.4, 5.8, 6))), default=default)
    return System((x,), (y,), (Rule(x["a"], y["a"]), Rule(x["b"], y["b"])), normalization="none")


def test_output_without_a_firing_rule_is_never_stale():
    engine = ScikitEngine(gap())
    for _ in range(2):
        assert engine.centroids([1.0])[0] == pytest.approx(5.2)
        assert np.isnan(engine.centroids([5.0])).tolist() == [True]
    assert np.isnan(engine.weights_of_many(np.array([[1.0], [9.0], [4.0], [5.0]]))[:, 0]).tolist() == [0, 0, 1, 1]
    assert ScikitEngine(gap(default=5.5)).centroids_of_many(np.array([[5.0], [1.0]]))[:, 0] == pytest.approx([5.5, 5.2])


@pytest.mark.parametrize(
    ("system", "words"),
    [
        (System(TIPPING.inputs, TIPPING.outputs, TIPPING.rules, implication="prod"), "implication is 'prod'"),
        (
            System(
                (Variable("x", (0, 1), (Term("step", Shape(((0.5, 0), (0.5, 1)))),)),),
                (TIP,),
                ("if x is step then tip is low",),
                normalization="none",
            ),
            "input 'x': term 'step' jumps",
        ),
        (
            System(
                (QUALITY,),
                (Output("y", (0, 1), (Term("thin", triangle(0.501, 0.505, 0.509)),)),),
                ("if quality is poor then y is thin",),
                normalization="none",
            ),
            "term 'thin' is 0 at all 101 points; expected more points",
        ),
        (
            System(
                (QUALITY,),
                (Output("y", (1, 1 + 1e-15), (Term("all", Shape(((1, 1),))),)),),
                ("if quality is poor then y is all",),
                normalization="none",
            ),
            "101 points do not fit",
        ),
    ],
)
def test_systems_unsupported_by_scikit_fuzzy_are_rejected_by_name(system, words):
    with pytest.raises(EngineError, match=words):
        ScikitEngine(system)


def test_edges_at_the_ends_of_an_input_are_no_jumps():
    x = Variable("x", (0, 1), (Term("low", triangle(0, 0, 1)), Term("high", triangle(0, 1, 1))))
    engine = ScikitEngine(System((x,), (TIP,), ("if x is low then tip is low",), normalization="none"))
    assert engine.centroids([0.0]) == [engine.defuzzifiers[0].value([1, 0, 0], ())]


@pytest.mark.slow
def test_scikit_fuzzy_warnings_are_suppressed():
    code = (
        "from fuzzy_arbiter import prioritized; from fuzzy_arbiter.engines.scikit import ScikitEngine;"
        "print(ScikitEngine(prioritized()).weights([1, 0, 0]))"
    )
    done = subprocess.run([sys.executable, "-W", "error", "-c", code], capture_output=True, text=True, check=False)
    assert (done.stdout.strip(), done.stderr) == ("(1.0, 0.0, 0.0)", "")
