"""The scikit-fuzzy engine equals scikit-fuzzy and avoids its known defects."""

import subprocess
import sys
from dataclasses import replace
from functools import reduce
from operator import and_, or_

import numpy as np
import pytest
from skfuzzy import control

from fuzzy_arbiter import Output, Rule, Shape, System, Variable, falling, rising, trapezoid, triangle
from fuzzy_arbiter.criteria import prioritized
from fuzzy_arbiter.engines.scikit import ScikitEngine
from fuzzy_arbiter.errors import EngineError
from fuzzy_arbiter.propositions import And, Is, Not, Or
from tests.fuzzy_arbiter.formats.systems import TIPPING as SYSTEM

TIPPING = replace(SYSTEM, points=26)
QUALITY, SERVICE, (TIP,) = *TIPPING.inputs, TIPPING.outputs
# nested conditions, weights, two conclusions, knots off the grid, a jump, a term that no rule concludes
U_TERMS = {
    "a": triangle(-1.5, -0.4, 0.31),
    "b": trapezoid(-0.2, 0.5, 0.77, 1.4),
    "c": Shape(((1.013, 0), (1.013, 0.8), (1.9, 0.2))),
    "never": triangle(0, 1, 2),
}
MIXED = System(
    (QUALITY, SERVICE),
    (
        Output("u", (-1, 2), U_TERMS, default=0.0),
        Output("v", (10, 30), {"a": falling(10, 23), "b": rising(13.3, 29)}, default=12.5),
    ),
    (
        "if (quality is poor or service is not poor) and not (quality is good and service is average)"
        " then u is a with 0.7",
        "if quality is average and (service is good or quality is good) then u is b and v is a with 0.35",
        "if not (quality is average or service is not good) then u is c and v is b",
        "if service is poor and quality is poor and service is not average then v is b with 0.05",
    ),
)


def stock(system):
    """The system in scikit-fuzzy's own classes, as its examples build it, but with knots as universes of the inputs."""

    def variable(kind, definition, universe):
        made = kind(np.array(universe), definition.name)
        for term in definition.terms:
            made[term.name] = term.shape.of_many(made.universe)
        return made

    def condition(proposition):
        if isinstance(proposition, Is):
            return known[proposition.variable][proposition.term]
        if isinstance(proposition, Not):
            return ~condition(proposition.part)
        return reduce({And: and_, Or: or_}[type(proposition)], map(condition, proposition.parts))

    known = {v.name: variable(control.Antecedent, v, v.knots) for v in system.inputs}
    for v in system.outputs:
        known[v.name] = variable(control.Consequent, v, np.linspace(*v.universe, system.points))
    functions = {"min": np.fmin, "max": np.fmax, "prod": np.multiply, "probor": lambda a, b: a + b - a * b}
    norms = {"and_func": functions[system.conjunction], "or_func": functions[system.disjunction]}
    rules = [
        control.Rule(
            condition(rule.condition), [known[c.variable][c.term] % rule.weight for c in rule.conclusions], **norms
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
        MIXED,
        replace(MIXED, conjunction="prod", disjunction="probor", points=37),
        replace(MIXED, conjunction="prod"),
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
    x = Variable("x", (0, 10), {"a": falling(0, 4), "b": rising(6, 10)})
    y = Output("y", (5, 6), {"a": triangle(5, 5.2, 5.4), "b": triangle(5.4, 5.8, 6)}, default=default)
    return System((x,), (y,), (Rule(x["a"], y["a"]), Rule(x["b"], y["b"])), normalization="none")


def test_output_without_a_firing_rule_is_never_stale():
    engine = ScikitEngine(gap())
    for _ in range(2):
        assert engine.centroids([1.0])[0] == pytest.approx(5.2)
        assert np.isnan(engine.centroids([5.0])).tolist() == [True]
    assert np.isnan(engine.weights_of_many(np.array([[1.0], [9.0], [4.0], [5.0]]))[:, 0]).tolist() == [0, 0, 1, 1]
    assert ScikitEngine(gap(default=5.5)).centroids_of_many(np.array([[5.0], [1.0]]))[:, 0] == pytest.approx([5.5, 5.2])


def thin(terms, universe=(0, 1), x=QUALITY, of="poor"):
    return System((x,), (Output("y", universe, terms),), (f"if {x.name} is {of} then y is t",))


STEP = Variable("x", (0, 1), {"step": Shape(((0.5, 0), (0.5, 1)))})


@pytest.mark.parametrize(
    ("system", "words"),
    [
        (replace(TIPPING, implication="prod"), "implication is 'prod'"),
        (thin({"t": rising(0, 1)}, x=STEP, of="step"), "input 'x': term 'step' jumps"),
        (thin({"t": triangle(0.501, 0.505, 0.509)}), "term 't' is 0 at all 101 points; expected more points"),
        (thin({"t": Shape(((1, 1),))}, (1, 1 + 1e-15)), "101 points do not fit"),
    ],
)
def test_systems_unsupported_by_scikit_fuzzy_are_rejected_by_name(system, words):
    with pytest.raises(EngineError, match=words):
        ScikitEngine(system)


def test_edges_at_the_ends_of_an_input_are_no_jumps():
    x = Variable("x", (0, 1), {"low": triangle(0, 0, 1), "high": triangle(0, 1, 1)})
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


def test_the_engine_imports_no_scipy_and_leaves_scikit_fuzzy_whole():
    code = """
import sys
from fuzzy_arbiter.engines.scikit import centroid
assert "scipy" not in sys.modules
import skfuzzy
assert skfuzzy.cmeans is skfuzzy.cluster.cmeans and skfuzzy.continuous_to_discrete
assert centroid([0, 1, 3], [0, 1, 0]) == skfuzzy.centroid([0, 1, 3], [0, 1, 0])
from fuzzy_arbiter.engines import scikit
"""
    subprocess.run([sys.executable, "-c", code], check=True)
