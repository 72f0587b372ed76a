"""The exact engine against rational arithmetic, for any piecewise-linear system."""

import math
from dataclasses import replace
from fractions import Fraction

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from fuzzy_arbiter import (
    Arbiter,
    Output,
    Shape,
    System,
    Term,
    Variable,
    falling,
    rising,
    triangle,
)
from fuzzy_arbiter.engines.clipped_centroid import centroid, outline
from fuzzy_arbiter.engines.exact import ExactEngine
from fuzzy_arbiter.errors import EngineError
from tests.examples import examples
from tests.fuzzy_arbiter import reference
from tests.fuzzy_arbiter.systems import shapes, systems

EPS = np.finfo(float).eps


@pytest.mark.medium
@settings(max_examples=examples(150), deadline=None, suppress_health_check=[HealthCheck.too_slow])
@given(systems(), st.data())
def test_centroid_is_exact_for_any_system(system, data):
    inputs = [data.draw(st.floats(0.0, 1.0)) for _ in system.inputs]
    exact = reference.centroids(system, inputs)
    arbiter = Arbiter(system=system, engine="exact")
    expected = [math.nan if c is None else float(c) for c in exact]
    assert arbiter(inputs) == pytest.approx(expected, abs=8 * EPS, nan_ok=True)
    assert np.array_equal(arbiter.batch([inputs])[0], arbiter(inputs), equal_nan=True)


@pytest.mark.parametrize("implication", ["min", "prod"])
def test_tiny_degrees_do_not_underflow(implication):
    """As both cuts vanish alike, the centroid goes to the middle of the joined supports."""
    output = Output("y", (0, 1), (Term("low", falling(0, 1)), Term("high", rising(0, 1))))
    rules = ("if x is on then y is low", "if x is on then y is high")
    inputs = (Variable("x", (0, 1), (Term("on", rising(0, 1)),)),)
    arbiter = Arbiter(system=System(inputs, (output,), rules, normalization="none", implication=implication))
    assert arbiter.engine == "exact"
    for x in (5e-324, 1e-310, 1e-121, 1e-119, 1e-30):
        assert arbiter([x]) == pytest.approx([0.5], abs=4 * EPS)
        assert arbiter.batch([[x]])[0] == pytest.approx([0.5], abs=4 * EPS)


@settings(max_examples=examples(150), deadline=None)
@given(st.lists(shapes(), min_size=1, max_size=4), st.data(), st.booleans())
def test_cuts_of_any_size_are_exact(terms, data, scaled):
    """The sweep and its batch at tiny cuts, alone or beside others."""
    sizes = st.one_of(st.just(0.0), st.floats(0.0, 1.0), st.floats(-300.0, 0.0).map(lambda x: 10.0**x))
    cuts = [data.draw(sizes) for _ in terms]
    cuts[0] = cuts[0] or 1e-17
    output = Output("y", (0, 1), tuple(Term(f"t{i}", shape) for i, shape in enumerate(terms)))
    found = centroid(cuts, *outline(output), scaled)
    assert found == pytest.approx(float(reference.centroid(output, list(map(Fraction, cuts)), scaled)), abs=8 * EPS)
    rule = "if x is on then y is t0"
    on = (Variable("x", (0, 1), (Term("on", rising(0, 1)),)),)
    engine = ExactEngine(System(on, (output,), (rule,), normalization="none", implication="prod" if scaled else "min"))
    assert engine.defuzzifiers[0].values(np.array([cuts, cuts]).T, ()).tolist() == [found, found]


@pytest.mark.parametrize("cut", [1e-6, 1e-9, 1e-12, 1e-17, 1e-60, 1e-200, 5e-324])
def test_single_symmetric_term_has_its_center_at_any_cut(cut):
    output = Output("y", (0, 1), (Term("mid", triangle(0, 0.5, 1)),))
    inputs = (Variable("x", (0, 1), (Term("on", rising(0, 1)),)),)
    arbiter = Arbiter(system=System(inputs, (output,), ("if x is on then y is mid",), normalization="none"))
    assert arbiter([cut]) == pytest.approx([0.5], abs=4 * EPS)
    assert arbiter.batch([[cut]])[0].tolist() == list(arbiter([cut]))


def test_nearly_parallel_lines_are_exact():
    almost = Shape(((0, 1), (1, 1e-20)))
    output = Output("y", (0, 1), (Term("a", falling(0, 1)), Term("b", almost), Term("c", rising(0, 1))))
    inputs = (Variable("x", (0, 1), (Term("on", rising(0, 1)),)),)
    rules = ("if x is on then y is a", "if x is on then y is b")
    for implication in ("min", "prod"):
        arbiter = Arbiter(system=System(inputs, (output,), rules, normalization="none", implication=implication))
        assert arbiter([1.0]) == pytest.approx([1 / 3], abs=4 * EPS)
        assert arbiter.batch([[1.0]])[0].tolist() == list(arbiter([1.0]))


def test_output_with_one_centroid_cannot_be_normalized():
    output = Output("y", (0, 1), (Term("any", triangle(0, 0.5, 1)),))
    system = System((Variable("x", (0, 1), (Term("on", rising(0, 1)),)),), (output,), ("if x is on then y is any",))
    system = replace(system, normalization="range")
    with pytest.raises(EngineError, match=r"output 'y': its terms have one centroid, 0\.5"):
        Arbiter(system=system)


def test_default_is_used_if_no_rule_fires():
    output = Output("y", (0, 10), (Term("a", falling(0, 5)), Term("b", rising(5, 10))), default=7.0)
    inputs = (Variable("x", (0, 1), (Term("on", rising(0.5, 1)),)),)
    rules = ("if x is on then y is b",)
    raw = Arbiter(system=System(inputs, (output,), rules, normalization="none"))
    assert raw([0.25]) == (7.0,)
    assert raw.batch([[0.25], [1.0]])[:, 0] == pytest.approx([7.0, 25 / 3])
    scaled = Arbiter(system=System(inputs, (output,), rules, normalization="range"))
    assert scaled([0.25])[0] == pytest.approx((7.0 - 5 / 3) / (25 / 3 - 5 / 3))


@pytest.mark.parametrize(("default", "weight"), [(0.5, 0.0), (9.5, 1.0)])
def test_default_outside_the_terms_gives_a_weight_in_range(default, weight):
    output = Output("y", (0, 10), (Term("a", falling(0, 5)), Term("b", rising(5, 10))), default=default)
    inputs = (Variable("x", (0, 1), (Term("on", rising(0.5, 1)),)),)
    arbiter = Arbiter(system=System(inputs, (output,), ("if x is on then y is b",), normalization="range"))
    assert arbiter([0.25]) == (weight,)
    assert arbiter.batch([[0.25], [1.0]])[:, 0].tolist() == [weight, 1.0]


def test_batch_rows_without_a_firing_rule_are_nan():
    output = Output("y", (0, 1), (Term("a", falling(0, 1)), Term("b", rising(0, 1))))
    inputs = (Variable("x", (0, 1), (Term("on", rising(0.5, 1)),)),)
    arbiter = Arbiter(system=System(inputs, (output,), ("if x is on then y is b",)))
    assert np.isnan(arbiter.batch([[1.0], [0.75], [0.25], [0.1]])[:, 0]).tolist() == [False, False, True, True]


def test_discontinuous_shapes_are_integrated_exactly():
    """A box clipped at 1/2 is a box: its centroid is the middle."""
    output = Output("y", (0, 10), (Term("box", Shape(((2, 0), (2, 1), (5, 1), (5, 0)))), Term("b", rising(9, 10))))
    inputs = (Variable("x", (0, 1), (Term("on", rising(0, 1)),)),)
    system = System(inputs, (output,), ("if x is on then y is box",), normalization="none")
    assert Arbiter(system=system)([0.5]) == pytest.approx([3.5])


def test_an_outline_grows_with_the_number_of_terms():
    """Of triangles side by side two meet in each interval between knots, however many there are."""
    for n in (10, 1000):
        terms = {f"t{j}": triangle(j - 1.0, float(j), j + 1.0) for j in range(n)}
        shape = outline(Output("y", (0.0, n - 1.0), terms))
        assert len(shape.breakpoints) == 2 * n - 1
        assert len(shape.term) == 4 * (n - 1)


def test_terms_that_overlap_in_too_many_places_are_integrated_by_quadrature():
    n = 90
    terms = {f"t{j}": triangle(-1.0 - j / n, j / n, 2.0 + j / n) for j in range(n)}
    rules = tuple(f"if x is t{j} then y is t{j}" for j in range(0, n, 9))
    made = System((Variable("x", (0.0, 1.0), terms),), (Output("y", (0.0, 1.0), terms),), rules)
    with pytest.raises(EngineError, match="output 'y': its terms overlap in 200"):
        outline(made.outputs[0])
    engine = ExactEngine(made)
    assert engine.methods["y"] == "integrals of polynomials, to rounding"
    x = (np.arange(100_000) + 0.5) / 100_000
    (cuts,) = engine.firing.cuts(engine.firing.strengths([0.3]))
    height = np.max(
        [np.minimum(c, t.shape.of_many(x)) for c, t in zip(cuts, made.outputs[0].terms, strict=True)], axis=0
    )
    assert engine.centroids([0.3])[0] == pytest.approx((x * height).sum() / height.sum(), abs=1e-8)
