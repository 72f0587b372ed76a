"""The exact engine against rational arithmetic, for any piecewise-linear system."""

import math
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
from fuzzy_arbiter.terms.values import Formula
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
    arbiter = Arbiter(system, engine="exact")
    expected = [math.nan if c is None else float(c) for c in exact]
    assert arbiter(inputs) == pytest.approx(expected, abs=8 * EPS, nan_ok=True)
    assert np.array_equal(arbiter.batch([inputs])[0], arbiter(inputs), equal_nan=True)


def system(terms, *concluded, start=0.0, universe=(0, 1), default=None, **options):
    """A rule for each of some terms, all of the strength of the input, which rises from `start`."""
    x = Variable("x", (0, 1), {"on": rising(start, 1)})
    rules = [f"if x is on then y is {term}" for term in concluded]
    return System((x,), (Output("y", universe, terms, default),), rules, **options)


ALMOST_LEVEL = Shape(((0, 1), (1, 1e-20)))
BOX = Shape(((2, 0), (2, 1), (5, 1), (5, 0)))
TINY = (5e-324, 1e-310, 1e-200, 1e-121, 1e-119, 1e-60, 1e-30, 1e-17, 1e-12, 1e-9, 1e-6)


@pytest.mark.parametrize("implication", ["min", "prod"])
@pytest.mark.parametrize(
    ("terms", "concluded", "universe", "strengths", "value"),
    [
        # as both cuts vanish alike, the centroid goes to the middle of the joined supports
        ({"low": falling(0, 1), "high": rising(0, 1)}, ("low", "high"), (0, 1), TINY[:7], 0.5),
        ({"mid": triangle(0, 0.5, 1)}, ("mid",), (0, 1), TINY, 0.5),
        ({"a": falling(0, 1), "b": ALMOST_LEVEL, "c": rising(0, 1)}, ("a", "b"), (0, 1), (1.0,), 1 / 3),
        ({"box": BOX, "b": rising(9, 10)}, ("box",), (0, 10), (0.5,), 3.5),  # its middle, however it is bounded
    ],
)
def test_centroids_that_are_known(implication, terms, concluded, universe, strengths, value):
    arbiter = Arbiter(system(terms, *concluded, universe=universe, implication=implication))
    assert arbiter.engine == "exact"
    for strength in strengths:
        assert arbiter([strength]) == pytest.approx([value], abs=4 * EPS)
        assert arbiter.batch([[strength]])[0].tolist() == list(arbiter([strength]))


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


def test_output_with_one_centroid_cannot_be_normalized():
    with pytest.raises(EngineError, match=r"output 'y': its terms have one centroid, 0\.5"):
        Arbiter(system({"any": triangle(0, 0.5, 1)}, "any", normalization="range"))


PAIR = {"a": falling(0, 5), "b": rising(5, 10)}


@pytest.mark.parametrize(
    ("normalization", "default", "weight"),
    [
        ("none", 7.0, 7.0),
        ("none", None, math.nan),
        ("range", 7.0, (7.0 - 5 / 3) / (25 / 3 - 5 / 3)),
        ("range", 0.5, 0.0),  # beyond the terms' centroids
        ("range", 9.5, 1.0),
    ],
)
def test_the_default_counts_where_no_rule_fires(normalization, default, weight):
    made = system(PAIR, "b", start=0.5, universe=(0, 10), default=default, normalization=normalization)
    arbiter = Arbiter(made)
    assert arbiter([0.25]) == pytest.approx((weight,), nan_ok=True)
    assert arbiter.batch([[0.1], [0.25], [0.75]])[:2, 0] == pytest.approx([weight] * 2, nan_ok=True)
    assert not np.isnan(arbiter.batch([[0.1], [0.75]])[1, 0])


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


@pytest.mark.parametrize("engine", ["exact", "grid"])
def test_a_rule_without_value_leaves_other_outputs_alone(engine):
    """Of a term of `y` that no rule concludes, too."""
    gap = Formula("0.5 + 0 * (1 / (x - 0.1234567))")
    x = Variable("x", (0, 1), (Term("odd", gap), Term("on", triangle(0, 0.5, 1))))
    y = Output("y", (0, 1), (Term("a", triangle(0, 0.5, 1)), Term("b", triangle(0, 0.9, 1))))
    rules = ("if x is odd then z is a", "if x is ~odd then z is a", "if x is on then y is a")
    system = System((x,), (Output("z", (0, 1), y.terms[:1]), y), rules, normalization="none")
    assert str(system.rules[1]) == "if x is not odd then z is a"
    assert Arbiter(system, engine=engine).batch([[0.1234567]])[0, 1] == pytest.approx(0.5)
