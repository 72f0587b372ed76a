"""The closed form against the exact centroid, and the proof of its existence."""

from dataclasses import replace
from fractions import Fraction

import numpy as np
import pytest
from hypothesis import HealthCheck, assume, given, settings
from hypothesis import strategies as st

from fuzzy_arbiter import Arbiter, Output, Rule, Shape, System, Term, Variable, falling, rising, triangle
from fuzzy_arbiter.criteria import Criterion, prioritized
from fuzzy_arbiter.engines.closed import ClosedEngine
from fuzzy_arbiter.errors import EngineError
from fuzzy_arbiter.propositions import And, Is, Or
from tests.examples import examples
from tests.fuzzy_arbiter import reference
from tests.fuzzy_arbiter.systems import LOW_HIGH, shapes, systems

EPS = np.finfo(float).eps
OFF_ON = (Term("off", falling(0, 1)), Term("on", rising(0, 1)))
ONLY_ON = OFF_ON[1:]
GAP = (Term("off", falling(0, 0.4)), Term("on", rising(0.6, 1)))
Y, _ = LOW_HIGH


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
@settings(max_examples=examples(90), deadline=None, suppress_health_check=[HealthCheck.too_slow])
@given(shapes(), shapes(), st.floats(0.0, 1.0), st.sampled_from(["none", "range", "sum", "max"]))
def test_weights_of_any_pair_are_exact(low, high, h, normalization):
    """Between its ends a C(h) may lie beyond them; normalized weights are in [0, 1] even so."""
    output = Output("y", (0, 1), {"low": low, "high": high})
    system = prioritized(criteria(2), weight=output, normalization=normalization)
    inputs, tolerance = [h, 0.25], 16 * EPS
    if normalization == "none":
        expected = np.array([float(c) for c in reference.centroids(system, inputs)])
    else:
        ends = [reference.centroid(output, [Fraction(1 - i), Fraction(i)]) for i in (0, 1)]
        assume(abs(ends[1] - ends[0]) > Fraction(1, 64))
        expected = np.array([float(w) for w in reference.weights(system, inputs)])
        whole = {"range": 1.0, "sum": expected.sum(), "max": expected.max()}[normalization]
        assume(whole > 0.01)  # where all vanish shares are of roundings
        expected, tolerance = expected / whole, 1e-11
        alone = Arbiter(criteria(1), weight=output)
        assert {alone([0.0]), alone([1.0])} == {(0.0,), (1.0,)}
    arbiter = Arbiter(system, engine="closed")
    assert all(0.0 <= w <= 1.0 for w in arbiter(inputs))
    assert arbiter(inputs) == pytest.approx(expected, abs=tolerance)
    assert arbiter.batch([inputs])[0] == pytest.approx(expected, abs=tolerance)


def test_a_centroid_beyond_both_ends_is_clipped():
    """The peak of low is cut off before high has an area worth speaking of, so that C(h) falls at first."""
    low = Shape(((0, 0.2), (0.5, 0.2), (0.5, 1), (0.6, 1), (0.6, 0)))
    arbiter = Arbiter(criteria(1), weight=Output("y", (0, 1), {"low": low, "high": triangle(0.89, 0.9, 0.91)}))
    assert arbiter.engine == "closed"
    assert arbiter.centroids([0.7])[0] < arbiter.centroids([0.0])[0] - 0.02
    assert arbiter([0.7]) == arbiter.with_engine("exact")([0.7]) == (0.0,)
    assert arbiter.batch([[0.7], [1.0]]).tolist() == [[0.0], [1.0]]


PLATEAU = Shape(((0, 1),))


@pytest.mark.medium(fast=7)
@pytest.mark.parametrize(
    ("low", "high", "near"),
    [
        # just below h = 1 the wide foot of low begins to be clipped: C(h) bends by a slope of about 1/height
        *(
            (
                Shape(((0, 1), (0.01, 1), (0.01, height), (1, height))),
                Shape(((0.7, 0), (0.7, 3 * height), (0.9, 3 * height), (0.9, 0))),
                height,
            )
            for height in (2e-6, 3e-6, 5e-6, 7e-6, 1.1e-5, 1.3e-5)
        ),
        # the area falls to a millionth of what it was, where C(h) is a million times as steep
        *(
            (*pair, height)
            for height in (1e-2, 1e-4, 1e-6)
            for small in (Shape(((0.6, 0), (0.7, height), (0.8, 0))), triangle(0.7 - height, 0.7, 0.7 + height))
            for pair in ((PLATEAU, small), (small, PLATEAU))
        ),
    ],
)
def test_weights_are_exact_where_the_area_is_small(low, high, near):
    output = replace(Y, terms=(Term("low", low), Term("high", high)))
    engine = ClosedEngine(prioritized(criteria(1), weight=output, normalization="none"))
    small = [*(near * x for x in (0.1, 0.5, 0.9, 1.0, 1.1, 3.0)), *np.random.default_rng(0).random(20).tolist()]
    for h in [*small, *(1 - x for x in small)]:
        exact = float(reference.centroid(output, [1 - Fraction(h), Fraction(h)]))
        assert engine.weights([h])[0] == pytest.approx(exact, abs=16 * EPS)


@pytest.mark.parametrize("n", range(1, 13))
def test_equivalent_rule_forms_give_the_same_weights(n):
    inputs = np.random.default_rng(n).random((50, n))
    expected = Arbiter(criteria(n), engine="exact").batch(inputs)
    for form in ("hierarchical", "minimal", "conjunctive"):
        arbiter = Arbiter(criteria(n), form=form)
        assert arbiter.engine == "closed"
        assert np.abs(arbiter.batch(inputs) - expected).max() <= 16 * EPS


def system(rules, names="ab", terms=OFF_ON, universe=(0, 1), outputs=LOW_HIGH):
    """Inputs of two terms, and a rule for each text."""
    return System(tuple(Variable(name, universe, terms) for name in names), outputs, [f"if {rule}" for rule in rules])


LADDER = (
    "a is on then y is high",
    "{0} then y is low",
    "{0} and b is on then z is high",
    "a is on or {1} then z is low",
)
ORDERED = tuple(rule.format("a is off", "b is off") for rule in LADDER)
NOT_ON = (
    "a is not on then y is high", "a is on then y is low",
    "a is on and b is not on then z is high", "a is not on or b is on then z is low",
)  # fmt: skip
EXCLUSIVE = (
    "a is on and b is off or a is off and b is on then y is high",
    "not (a is on and b is not on or a is not on and b is on) then y is low",
)
ASYMMETRIC = (replace(Y, terms=(Term("low", falling(0.2, 0.9)), Term("high", rising(0.2, 0.9)))),)
ROOM = [Criterion("wall", membership=falling(0.0, 0.5)), Criterion("temperature", membership=rising(24.0, 30.0))]


@pytest.mark.parametrize(
    "made",
    [
        system(EXCLUSIVE, outputs=ASYMMETRIC),  # neither a ladder of criteria nor a single clause
        system(NOT_ON, terms=ONLY_ON),
        system(ORDERED, universe=(-1, 2)),  # beyond the degrees
        system(ORDERED, names="ba"),  # in another order
        system(
            ["a is on then y is high", "b is on and a is on then y is high", "a is off then y is low"],
            outputs=LOW_HIGH[:1],
        ),
        system(["a is on then y is high", "a is not on then y is low"], "a", GAP, outputs=LOW_HIGH[:1]),
        prioritized(ROOM, outside="clip"),
    ],
)
def test_whatever_is_cut_at_h_and_1_minus_h_has_a_closed_form(made):
    arbiter, exact = Arbiter(made), Arbiter(made, engine="exact")
    assert arbiter.engine == "closed"
    rows = np.random.default_rng(2).uniform(*np.array([v.universe for v in made.inputs]).T, (50, len(made.inputs)))
    assert np.abs(arbiter.batch(rows) - exact.batch(rows)).max() <= 16 * EPS
    assert np.array_equal(arbiter.batch(rows), [arbiter(row) for row in rows.tolist()])


ON_OFF = ("a is on then y is high", "a is off then y is low")
NEARLY = (Term("on", Shape(((0, 1e-20), (1, 1)))), Term("off", falling(0, 1)))  # beside 1e-20 the other has 1


@pytest.mark.parametrize(
    ("terms", "rules", "words"),
    [
        (OFF_ON, (ON_OFF[0], ON_OFF[1] + " with 0.5"), "R2 has the weight 0.5, expected 1"),
        (OFF_ON, ON_OFF[:1], "output 'y' has a term that no rule concludes"),
        (OFF_ON, (ON_OFF[0], "a is on then y is low"), "the cut of 'low' is not 1 minus that of 'high'"),
        *((terms, ON_OFF, "the cut of 'low' is not 1 minus") for terms in (GAP, NEARLY, NEARLY[::-1])),
    ],
)
def test_missing_closed_form_is_explained(terms, rules, words):
    made = system(rules, "a", terms, outputs=LOW_HIGH[:1])
    with pytest.raises(EngineError, match=words):
        Arbiter(made, engine="closed")
    automatic = Arbiter(made)
    assert (automatic.engine, words in automatic.engine_reason) == ("exact", True)


@pytest.mark.medium
@settings(max_examples=examples(80), deadline=None, suppress_health_check=[HealthCheck.too_slow])
@given(systems(norms=False), st.data())
def test_closed_form_matches_exact_centroid_for_any_system(system, data):
    arbiter = Arbiter(system)
    inputs = [data.draw(st.floats(0.0, 1.0)) for _ in system.inputs]
    if arbiter.engine == "closed":
        exact = [float(c) for c in reference.centroids(system, inputs)]
        assert arbiter(inputs) == pytest.approx(exact, abs=16 * EPS)


@settings(max_examples=examples(100), deadline=None)
@given(st.lists(st.floats(0.0, 1.0), min_size=1, max_size=12), st.data())
def test_laws_of_priority(memberships, data):
    arbiter = Arbiter(criteria(len(memberships)))
    before = arbiter(memberships)
    assert sum(w > 0.5 for w in before) <= 1
    # a criterion that asks for more gets no less, those below it no more
    k = data.draw(st.integers(0, len(memberships) - 1))
    after = arbiter([*memberships[:k], data.draw(st.floats(memberships[k], 1.0)), *memberships[k + 1 :]])
    assert after[:k] == before[:k] and after[k] >= before[k]
    assert all(b <= a for a, b in zip(before[k + 1 :], after[k + 1 :], strict=True))
    *above, last = memberships
    assert arbiter([*data.draw(st.permutations(above)), last])[-1] == before[-1]


@pytest.mark.parametrize("engine", ["closed", "exact", "skfuzzy"])
@given(asks=st.lists(st.booleans(), min_size=1, max_size=12))
def test_crisp_inputs_give_full_weight_to_the_first_active_criterion(engine, asks):
    first = asks.index(True) if True in asks else None
    weights = Arbiter(criteria(len(asks)), engine=engine, points=50)(list(map(float, asks)))
    assert weights == tuple(float(k == first) for k in range(len(asks)))


def test_weights_rise_smoothly():
    h = np.linspace(0, 1, 1001)
    assert Arbiter(criteria(1)).batch(h[:, None])[:, 0] == pytest.approx(h * h * (3 - 2 * h), abs=4 * EPS)


@pytest.mark.slow
def test_closed_form_search_is_bounded():
    """Two disjunctions of 400 clauses each, joined by *and*: 160,000 clauses, none of which is in another."""
    names = [f"v{i}" for i in range(60)]
    variables = tuple(Variable(name, (0, 1), OFF_ON) for name in names)

    def pairs(names):
        both = [And((Is(a, "on"), Is(b, "off"))) for a in names for b in names if a != b]
        return Or(tuple(both[:400]))

    rules = (Rule(And((pairs(names[:30]), pairs(names[30:]))), Y["high"]), Rule(Is("v0", "on"), Y["low"]))
    arbiter = Arbiter(System(variables, (Y,), rules))  # at once, or the limit on the time of a test ends it
    assert "more than 512 clauses" in arbiter.engine_reason
