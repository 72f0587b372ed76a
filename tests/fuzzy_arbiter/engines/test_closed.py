"""The closed form against the exact centroid, and the proof of its existence."""

import math
from fractions import Fraction

import numpy as np
import pytest
from hypothesis import HealthCheck, assume, given, settings
from hypothesis import strategies as st

from fuzzy_arbiter import (
    Arbiter,
    Criterion,
    Output,
    Rule,
    Shape,
    System,
    Term,
    Variable,
    falling,
    prioritized,
    rising,
    triangle,
)
from fuzzy_arbiter.engines.closed import ClosedEngine
from fuzzy_arbiter.engines.rational_pieces import pieces
from fuzzy_arbiter.errors import EngineError
from fuzzy_arbiter.propositions import And, Is, Or
from tests.examples import examples
from tests.fuzzy_arbiter import reference
from tests.fuzzy_arbiter.systems import shapes, systems

EPS = np.finfo(float).eps
DEGREES = (Variable("a", (0, 1), (Term("off", falling(0, 1)), Term("on", rising(0, 1)))),)


def criteria(n):
    return [Criterion(f"c{i}") for i in range(n)]


def test_closed_form_equals_exact_centroid_on_100_000_inputs():
    """The joined triangles integrated over their knots in extended precision, without the closed form."""
    inputs = np.random.default_rng(5).random((100_000, 3))
    x = inputs.astype(np.longdouble)
    high = np.stack([x[:, 0], np.minimum(1 - x[:, 0], x[:, 1]), np.minimum(1 - x[:, :2].max(axis=1), x[:, 2])], axis=1)
    low = 1 - high
    half, zero = np.full_like(high, 0.5), np.zeros_like(high)
    y = np.sort(np.stack([zero, high, low, half, zero + 1]), axis=0)
    f = np.maximum(np.minimum(high, y), np.minimum(low, 1 - y))
    w = np.diff(y, axis=0)
    area = (w * (f[:-1] + f[1:]) / 2).sum(axis=0)
    moment = (w * (y[:-1] * (2 * f[:-1] + f[1:]) + y[1:] * (f[:-1] + 2 * f[1:])) / 6).sum(axis=0)
    exact = moment / area
    raw = Arbiter(normalization="none", engine="closed").batch(inputs)
    assert np.abs(raw - exact).max() <= 4 * EPS
    scaled = Arbiter(engine="closed").batch(inputs)
    assert np.abs(scaled - (3 * exact - 1)).max() <= 4 * EPS
    swept = Arbiter(normalization="none", engine="exact").batch(inputs[:10_000])
    assert np.abs(raw[:10_000] - swept).max() <= 8 * EPS  # both are rounded


@pytest.mark.medium
@settings(max_examples=examples(60), deadline=None)
@given(st.lists(st.fractions(0, 1, max_denominator=64), min_size=1, max_size=5))
def test_closed_form_equals_rational_centroid(memberships):
    system = prioritized(criteria(len(memberships)))
    inputs = [float(m) for m in memberships]
    exact = [float(w) for w in reference.weights(system, inputs)]
    assert Arbiter(system=system, engine="closed")(inputs) == pytest.approx(exact, abs=4 * EPS)


@pytest.mark.medium
@settings(max_examples=examples(60), deadline=None, suppress_health_check=[HealthCheck.too_slow])
@given(shapes(), shapes(), st.floats(0.0, 1.0))
def test_any_pair_of_output_terms_has_its_pieces(low, high, h):
    output = Output("y", (0, 1), (Term("low", low), Term("high", high)))
    exact = reference.centroid(output, [1 - Fraction(h), Fraction(h)])
    engine = ClosedEngine(prioritized(criteria(1), weight=output, normalization="none"))
    assert engine.weights([h])[0] == pytest.approx(float(exact), abs=16 * EPS)
    assert engine.weights_of_many(np.array([[h]]))[0] == pytest.approx(engine.weights([h]), abs=EPS)


@pytest.mark.medium
@settings(max_examples=examples(30), deadline=None, suppress_health_check=[HealthCheck.too_slow])
@given(shapes(), shapes(), st.floats(0.0, 1.0), st.sampled_from(["range", "sum", "max"]))
def test_weights_of_any_pair_are_those_of_the_exact_engine(low, high, h, normalization):
    """Between its ends a C(h) may lie beyond them; weights are in [0, 1] even so."""
    output = Output("y", (0, 1), (Term("low", low), Term("high", high)))
    ends = [reference.centroid(output, [Fraction(1 - i), Fraction(i)]) for i in (0, 1)]
    assume(abs(ends[1] - ends[0]) > Fraction(1, 64))
    system = prioritized(criteria(2), weight=output, normalization=normalization)
    inputs = [h, 0.25]
    expected = np.array([float(w) for w in reference.weights(system, inputs)])
    whole = {"range": 1.0, "sum": expected.sum(), "max": expected.max()}[normalization]
    assume(whole > 0.01)  # where all vanish shares are of roundings
    expected = expected / whole
    arbiter = Arbiter(system=system, engine="closed")
    alone = Arbiter(criteria(1), weight=output)
    assert {alone([0.0]), alone([1.0])} == {(0.0,), (1.0,)}
    assert all(0.0 <= w <= 1.0 for w in arbiter(inputs))
    assert arbiter(inputs) == pytest.approx(expected, abs=1e-11)
    assert arbiter.batch([inputs])[0] == pytest.approx(expected, abs=1e-11)


def test_a_centroid_beyond_both_ends_is_clipped():
    """The peak of low is cut off before high has an area worth speaking of, so that C(h) falls at first."""
    low = Shape(((0, 0.2), (0.5, 0.2), (0.5, 1), (0.6, 1), (0.6, 0)))
    arbiter = Arbiter(
        criteria(1), weight=Output("y", (0, 1), (Term("low", low), Term("high", triangle(0.89, 0.9, 0.91))))
    )
    assert arbiter.engine == "closed"
    assert arbiter.centroids([0.7])[0] < arbiter.centroids([0.0])[0] - 0.02
    assert arbiter([0.7]) == arbiter.with_engine("exact")([0.7]) == (0.0,)
    assert arbiter.batch([[0.7], [1.0]]).tolist() == [[0.0], [1.0]]


@pytest.mark.medium(fast=1)
@pytest.mark.parametrize("height", [1e-2, 1e-4, 1e-6])
def test_terms_of_very_different_areas_are_exact(height):
    """Where the area is a millionth of what it was, and C(h) a million times as steep."""
    plateau, low_triangle = Shape(((0, 1),)), Shape(((0.6, 0), (0.7, height), (0.8, 0)))
    narrow = triangle(0.7 - height, 0.7, 0.7 + height)
    near = [*(height * x for x in (0.1, 0.5, 0.9, 1.0, 1.1, 3.0)), *np.random.default_rng(0).random(20).tolist()]
    for low, high in ((plateau, low_triangle), (low_triangle, plateau), (plateau, narrow), (narrow, plateau)):
        output = Output("y", (0, 1), (Term("low", low), Term("high", high)))
        raw, _ = pieces(output)
        engine = ClosedEngine(prioritized(criteria(1), weight=output, normalization="none"))
        starts = [x for p in raw for x in (p.start, math.nextafter(p.start, 0), math.nextafter(p.start, 1))]
        for h in [*near, *(1 - x for x in near), *starts]:
            exact = float(reference.centroid(output, [1 - Fraction(h), Fraction(h)]))
            assert engine.weights([h])[0] == pytest.approx(exact, abs=16 * EPS)


@pytest.mark.parametrize("height", [2e-6, 3e-6, 5e-6, 7e-6, 1.1e-5, 1.3e-5])
def test_piecewise_evaluation_is_exact_next_to_breakpoints(height):
    """Just below h = 1 the wide foot of low begins to be clipped: C(h) bends by a slope of about 1/height."""
    low = Shape(((0, 1), (0.01, 1), (0.01, height), (1, height)))
    high = Shape(((0.7, 0), (0.7, 3 * height), (0.9, 3 * height), (0.9, 0)))
    output = Output("y", (0, 1), (Term("low", low), Term("high", high)))
    engine = ClosedEngine(prioritized(criteria(1), weight=output, normalization="none"))
    for piece in engine.raw[0][1:]:
        for h in (piece.start, math.nextafter(piece.start, 0)):
            exact = float(reference.centroid(output, [1 - Fraction(h), Fraction(h)]))
            assert engine.weights([h])[0] == pytest.approx(exact, abs=16 * EPS)


def test_number_of_cubic_pieces_is_minimal():
    """One cubic for the full triangles, also for trapezoids that meet there; three for the asymmetric pair."""

    def count(low, high):
        _, scaled = pieces(Output("y", (0, 1), (Term("low", low), Term("high", high))))
        return sum(piece.start < 1.0 for piece in scaled)  # beside them there may be one for h = 1 alone

    assert count(falling(0, 1), rising(0, 1)) == 1
    assert count(falling(0.3, 0.7), rising(0.3, 0.7)) == 1
    assert count(falling(0.2, 0.55), rising(0.37, 0.83)) == 3


@pytest.mark.parametrize("n", range(1, 13))
def test_equivalent_rule_forms_give_the_same_weights(n):
    inputs = np.random.default_rng(n).random((50, n))
    expected = Arbiter(criteria(n), engine="exact").batch(inputs)
    for form in ("hierarchical", "minimal", "conjunctive"):
        arbiter = Arbiter(criteria(n), form=form)
        assert arbiter.engine == "closed"
        assert np.abs(arbiter.batch(inputs) - expected).max() <= 16 * EPS


def test_any_clauses_of_complementary_cuts_have_a_closed_form():
    """Neither a ladder of criteria nor a single clause: y is high if exactly one of a and b is on."""
    inputs = tuple(Criterion(name).variable for name in "ab")
    output = Output("y", (0, 1), (Term("low", falling(0.2, 0.9)), Term("high", rising(0.2, 0.9))))
    rules = (
        "if a is on and b is off or a is off and b is on then y is high",
        "if not (a is on and b is not on or a is not on and b is on) then y is low",
    )
    system = System(inputs, (output,), rules)
    arbiter = Arbiter(system=system)
    assert arbiter.engine == "closed"
    x = np.random.default_rng(0).random((200, 2))
    assert np.abs(arbiter.batch(x) - Arbiter(system=system, engine="exact").batch(x)).max() <= 16 * EPS
    assert np.abs(arbiter.batch(x) - [arbiter(row) for row in x.tolist()]).max() <= EPS


def test_criteria_with_custom_memberships_have_a_closed_form():
    hot = Criterion("temperature", on="hot", off="fine", membership=rising(24.0, 30.0))
    near = Criterion("wall", on="near", off="far", membership=falling(0.0, 0.5))
    arbiter = Arbiter([near, hot], outside="clip")
    assert arbiter.engine == "closed"
    assert arbiter([2.0, 35.0]) == (0.0, 1.0)
    assert arbiter([0.0, 35.0]) == (1.0, 0.0)
    x = np.random.default_rng(0).uniform([0, 24], [0.5, 30], (100, 2))
    assert np.abs(arbiter.batch(x) - arbiter.with_engine("exact").batch(x)).max() <= 16 * EPS


@pytest.mark.parametrize(
    ("rules", "words"),
    [
        (["if a is on then y is high", "if a is off then y is low with 0.5"], "R2 has the weight 0.5, expected 1"),
        (["if a is on then y is high"], "output 'y' has a term that no rule concludes"),
        (["if a is on then y is high", "if a is on then y is low"], "the cut of 'low' is not 1 minus that of 'high'"),
    ],
)
def test_missing_closed_form_is_explained(rules, words):
    system = System(DEGREES, (Output("y", (0, 1), (Term("low", falling(0, 1)), Term("high", rising(0, 1)))),), rules)
    with pytest.raises(EngineError, match=words):
        Arbiter(system=system, engine="closed")
    automatic = Arbiter(system=system)
    assert automatic.engine == "exact"
    assert words in automatic.engine_reason


def test_non_complementary_terms_have_no_closed_form():
    gap = Variable("a", (0, 1), (Term("off", falling(0, 0.4)), Term("on", rising(0.6, 1))))
    output = Output("y", (0, 1), (Term("low", falling(0, 1)), Term("high", rising(0, 1))))
    assert Arbiter(
        system=System((gap,), (output,), ("if a is on then y is high", "if a is off then y is low"))
    ).engine == ("exact")
    negated = System((gap,), (output,), ("if a is on then y is high", "if a is not on then y is low"))
    assert Arbiter(system=negated).engine == "closed"


@pytest.mark.medium
@settings(max_examples=examples(80), deadline=None, suppress_health_check=[HealthCheck.too_slow])
@given(systems(norms=False), st.data())
def test_closed_form_matches_exact_centroid_for_any_system(system, data):
    arbiter = Arbiter(system=system)
    inputs = [data.draw(st.floats(0.0, 1.0)) for _ in system.inputs]
    if arbiter.engine == "closed":
        exact = [float(c) for c in reference.centroids(system, inputs)]
        assert arbiter(inputs) == pytest.approx(exact, abs=16 * EPS)


@settings(max_examples=examples(100), deadline=None)
@given(st.lists(st.floats(0.0, 1.0), min_size=1, max_size=12))
def test_at_most_one_weight_is_above_one_half(memberships):
    assert sum(w > 0.5 for w in Arbiter(criteria(len(memberships)))(memberships)) <= 1


@settings(max_examples=examples(100), deadline=None)
@given(st.lists(st.floats(0.0, 1.0), min_size=1, max_size=12), st.data())
def test_weights_are_monotonic_in_the_memberships(memberships, data):
    k = data.draw(st.integers(0, len(memberships) - 1))
    more = data.draw(st.floats(memberships[k], 1.0))
    arbiter = Arbiter(criteria(len(memberships)))
    before, after = arbiter(memberships), arbiter([*memberships[:k], more, *memberships[k + 1 :]])
    assert after[:k] == before[:k]
    assert after[k] >= before[k]
    assert all(b <= a for a, b in zip(before[k + 1 :], after[k + 1 :], strict=True))


@settings(max_examples=examples(100), deadline=None)
@given(st.lists(st.floats(0.0, 1.0), min_size=3, max_size=12), st.randoms())
def test_lowest_weight_is_symmetric_in_higher_criteria(memberships, random):
    *above, last = memberships
    shuffled = random.sample(above, len(above))
    arbiter = Arbiter(criteria(len(memberships)))
    assert arbiter([*above, last])[-1] == arbiter([*shuffled, last])[-1]


@pytest.mark.parametrize("engine", ["closed", "exact", "skfuzzy"])
@given(asks=st.lists(st.booleans(), min_size=1, max_size=12))
def test_crisp_inputs_give_full_weight_to_the_first_active_criterion(engine, asks):
    first = asks.index(True) if True in asks else None
    weights = Arbiter(criteria(len(asks)), engine=engine, points=50)(list(map(float, asks)))
    assert weights == tuple(float(k == first) for k in range(len(asks)))


def test_weights_rise_smoothly():
    """Zero slope at both ends, 3/2 at most."""
    h = np.linspace(0, 1, 1001)
    slopes = np.diff(Arbiter(criteria(1)).batch(h[:, None])[:, 0]) / np.diff(h)
    assert slopes.min() >= 0.0
    assert math.isclose(slopes.max(), 1.5, rel_tol=1e-5)
    assert max(slopes[0], slopes[-1]) < 0.01


@pytest.mark.slow
def test_closed_form_search_is_bounded():
    """Two disjunctions of 400 clauses each, joined by *and*: 160,000 clauses, none of which is in another."""
    names = [f"v{i}" for i in range(60)]
    variables = tuple(Variable(name, (0, 1), (Term("off", falling(0, 1)), Term("on", rising(0, 1)))) for name in names)

    def pairs(names):
        both = [And((Is(a, "on"), Is(b, "off"))) for a in names for b in names if a != b]
        return Or(tuple(both[:400]))

    output = Output("y", (0, 1), (Term("low", falling(0, 1)), Term("high", rising(0, 1))))
    rules = (
        Rule(And((pairs(names[:30]), pairs(names[30:]))), output["high"]),
        Rule(Is("v0", "on"), output["low"]),
    )
    arbiter = Arbiter(system=System(variables, (output,), rules))  # at once, or the limit on the time of a test ends it
    assert "more than 512 clauses" in arbiter.engine_reason


OFF_ON = (Term("off", falling(0, 1)), Term("on", rising(0, 1)))
ONLY_ON = OFF_ON[1:]


@pytest.mark.parametrize(
    ("names", "terms", "universe", "rules"),
    [
        ("ab", ONLY_ON, (0, 1), ("a is not on", "a is on", "a is on and b is not on", "a is not on or b is on")),
        ("ab", OFF_ON, (-1, 2), ("a is on", "a is off", "a is off and b is on", "a is on or b is off")),
        ("ba", OFF_ON, (0, 1), ("a is on", "a is off", "a is off and b is on", "a is on or b is off")),
    ],
    ids=["negated", "beyond the degrees", "in another order"],
)
def test_closed_form_covers_nonlinear_input_terms(names, terms, universe, rules):
    outputs = tuple(Output(y, (0, 1), (Term("low", falling(0, 1)), Term("high", rising(0, 1)))) for y in "yz")
    conclusions = ("y is high", "y is low", "z is high", "z is low")
    variables = tuple(Variable(name, universe, terms) for name in names)
    texts = tuple(f"if {rule} then {conclusion}" for rule, conclusion in zip(rules, conclusions, strict=True))
    system = System(variables, outputs, texts)
    arbiter, exact = Arbiter(system=system), Arbiter(system=system, engine="exact")
    assert arbiter.engine == "closed"
    rows = np.random.default_rng(2).uniform(*universe, (50, 2))
    assert np.abs(arbiter.batch(rows) - exact.batch(rows)).max() <= 16 * EPS
    assert [arbiter(row) for row in rows.tolist()] == [tuple(row) for row in arbiter.batch(rows).tolist()]


@pytest.mark.parametrize("order", [1, -1])
def test_inexact_complements_have_no_closed_form(order):
    """Beside 1e-20 the other has 1."""
    terms = (Term("on", Shape(((0, 1e-20), (1, 1)))), Term("off", falling(0, 1)))[::order]
    output = Output("y", (0, 1), (Term("low", falling(0, 1)), Term("high", rising(0, 1))))
    rules = ("if x is on then y is high", "if x is off then y is low")
    arbiter = Arbiter(system=System((Variable("x", (0, 1), terms),), (output,), rules))
    assert "'low' is not 1 minus that of 'high'" in arbiter.engine_reason


def test_redundant_rules_do_not_prevent_a_closed_form():
    output = Output("y", (0, 1), OFF_ON)
    variables = tuple(Variable(name, (0, 1), OFF_ON) for name in "ab")
    rules = ("if a is on then y is on", "if b is on and a is on then y is on", "if a is off then y is off")
    assert Arbiter(system=System(variables, (output,), rules)).engine == "closed"
