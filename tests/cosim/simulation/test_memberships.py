"""Memberships of criteria against NumPy and against their terms."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from controller.compiling.function import CompiledFunction
from controller.regions import Orientation, Region, Sphere
from cosim.errors import ScenarioError
from cosim.scenario.criteria import PAPER, check_criteria
from cosim.scenario.region_tables import CriterionEntry, SecondaryRegion
from cosim.step.curves import _power, _quotient
from cosim.step.memberships import compute_memberships, pack_memberships
from fuzzy_arbiter import Shape
from fuzzy_arbiter.terms.curves import Curve
from fuzzy_arbiter.terms.kinds import KINDS
from fuzzy_arbiter.terms.values import Formula

lengths = st.floats(-2.0, 2.0) | st.sampled_from([np.nan, np.inf, -np.inf, 0.0, 0.2])
NAMES = ("obstacle", "shape", "depth")
BALL = Sphere((0.0, 0.0, 0.0), 1.0)


def regions(criteria, shape=BALL):
    return [SecondaryRegion(Region(f"r{i}", shape, "out"), name) for i, name in enumerate(criteria)]


def memberships_of(clearances, criteria, width, setups=PAPER, times=(), shape=BALL):
    found = np.full(len(setups), 7.0)
    packed = pack_memberships(regions(criteria, shape), setups, width)
    compute_memberships(packed, np.array(clearances, float), np.array(times, float), found)
    return found


@given(arrays(np.float64, 5, elements=lengths), arrays(np.int64, 5, elements=st.integers(0, 2)), st.floats(1e-3, 1.0))
def test_criterion_membership_is_that_of_its_most_critical_region(clearances, criteria, width):
    found = memberships_of(clearances, [NAMES[i] for i in criteria], width)
    for criterion, membership in enumerate(found):
        mine = clearances[(criteria == criterion) & ~np.isnan(clearances)]
        expected = np.clip(1.0 - mine / width, 0.0, 1.0).max(initial=0.0)
        assert membership == pytest.approx(expected, abs=1e-15)


def test_crisp_membership_is_one_inside_the_region():
    assert memberships_of([0.0, 1e-300, -1.0], NAMES, 0.0).tolist() == [1.0, 0.0, 1.0]


POINTS = st.lists(st.floats(-3.0, 3.0), min_size=2, max_size=6, unique=True).map(sorted)


@given(POINTS, st.data())
def test_membership_term_equals_its_curve(places, data):
    degrees = data.draw(st.lists(st.floats(0.0, 1.0), min_size=len(places), max_size=len(places)))
    if len(set(degrees)) == 1 or min(np.diff(places)) < 1e-9:
        return
    points = [list(point) for point in zip(places, degrees, strict=True)]
    setups = check_criteria(
        (
            CriterionEntry("near", membership={"clearance": points}),
            CriterionEntry("soon", membership={"approach_time": points}),
        )
    )
    samples = data.draw(st.lists(st.floats(-4.0, 4.0) | st.sampled_from(places), min_size=2, max_size=2))
    found = memberships_of([samples[0], 9.0], ["near", "soon"], 0.2, setups, [9.0, samples[1]])
    shape = Shape(tuple(map(tuple, points)))
    assert found.tolist() == [shape(x) for x in samples]  # to the last bit
    assert found == pytest.approx(np.interp(samples, places, degrees), abs=1e-12)


def test_criterion_membership_is_the_maximum_over_its_terms():
    membership = {
        "clearance": {"falling": [0.0, 1.0]},
        "angle": {"falling": [0.0, 0.1]},
        "approach_time": {"falling": [2.0, 4.0]},
    }
    setups = check_criteria((CriterionEntry("view", membership=membership),))
    assert memberships_of([0.5], ["view"], 0.2, setups, [9.0]).tolist() == [0.5]
    assert memberships_of([0.5], ["view"], 0.2, setups, [2.5]).tolist() == [0.75]
    level = Orientation((1.0, 0.0, 0.0, 0.0), 0.1)
    assert memberships_of([0.5], ["view"], 0.2, setups, [np.inf], shape=level).tolist() == [0.0]
    assert memberships_of([0.05], ["view"], 0.2, setups, [np.inf], shape=level).tolist() == [0.5]


def test_criteria_without_membership_use_the_arbiter_ramp():
    setups = check_criteria((CriterionEntry("a"), CriterionEntry("b", membership={"ramp": 0.4})))
    assert memberships_of([0.1, 0.1], ["a", "b"], 0.2, setups).tolist() == [0.5, 0.75]
    assert pack_memberships(regions(["a", "b"]), setups, 0.2).follows.tolist() == [True, False]


CURVES = {
    "gaussian": [0.2, 0.5],
    "gaussian2": [-0.4, 0.3, 0.5, 0.8],
    "bell": [0.5, 0.7, 2.3],
    "sigmoid": [0.5, -7.0],
    "sigmoid_difference": [-0.5, 9.0, 4.0, 1.0],
    "sigmoid_product": [-0.5, 9.0, -4.0, 1.0],
    "z_shape": [-0.2, 1.0],
    "s_shape": [-0.2, 1.0],
    "pi_shape": [-1.0, -0.2, 0.3, 1.5],
    "cosine": [0.3, 1.4],
    "spike": [0.4, 2.0],
    "concave": [0.5, 1.5],
    "arc": [1.5, 0.5],
    "semi_ellipse": [-1.0, 1.2],
}
FORMULAS = [
    "exp(-abs(x)) * le(x, 1) + gt(x, 1) * 0.1",
    "min(1, abs(sin(x)) / max(x ^ 2, 0.5))",
    "0.5 + 0.5 * cos(3 * x) * tan(0.5)",
    "1 / (1 + sqrt(abs(x)) * log(2 + x ^ 2)) * lt(x, 2.5) * ge(x, -2.5) * neq(x, 1) + 0 * eq(x, 7)",
    "min(1, pow(0.5, x - 1) * 0.25) * gt(x, -3)",
]


def curved(term):
    return check_criteria((CriterionEntry("near", membership={"clearance": term}),))


def test_every_curve_has_a_case():
    assert set(CURVES) == set(KINDS) - {"singleton"}  # which jumps


@pytest.mark.medium(fast=6)
@pytest.mark.parametrize(
    "term",
    [*({kind: numbers} for kind, numbers in CURVES.items()), {"gaussian": [0.2, 0.5], "height": 0.7},
     *({"formula": text} for text in FORMULAS)],
    ids=str,
)  # fmt: skip
@pytest.mark.parametrize("compiled", [False, True])
def test_membership_term_equals_its_definition(term, compiled):
    """By the translated C, too; powers by NumPy's or C's own routine are off by a unit of the last place or two."""
    kind, given = next(iter(term.items()))
    if kind == "formula":
        expected_of, samples = Formula(given), np.linspace(-3.0, 3.0, 61)
    else:
        expected_of = Curve(kind, tuple(map(float, given)), term.get("height", 1.0))
        samples = [*np.linspace(-2.0, 2.0, 401), *given, np.inf, -np.inf, 1e300]
    packed = pack_memberships(regions(["near"]), curved(term), 0.2)
    compute = CompiledFunction(compute_memberships) if compiled else compute_memberships
    found, x = np.zeros(1), np.zeros(1)
    for x[0] in samples:
        compute(packed, x, np.zeros(0), found)
        expected = expected_of(float(x[0]))
        assert found[0] == pytest.approx(0.0 if np.isnan(expected) else expected, abs=4e-16)


@pytest.mark.parametrize(
    ("a", "b"), [(0.0, -1.0), (-2.0, 0.5), (-2.0, 3.0), (1e200, 2.0), (-1e200, 3.0), (1e-200, -2.0), (np.inf, -1.0)]
)
def test_division_and_power_errors_follow_numpy(a, b):
    with np.errstate(all="ignore"):
        np.testing.assert_equal(_power(a, b), float(np.power(np.float64(a), b)))
        np.testing.assert_equal(_quotient(a, 0.0), float(np.divide(a, 0.0)))
        np.testing.assert_equal(_quotient(a, -0.0), float(np.divide(a, -0.0)))


@pytest.mark.parametrize(
    ("term", "fault"),
    [
        ({"singleton": [0.5]}, r"clearance: singleton \[0.5\] jumps, expected a change without jumps"),
        ({"s_shape": [0.5, 0.5]}, r"clearance: s_shape \[0.5, 0.5\] jumps"),
        ({"gaussian": [0.5, 0.0]}, "clearance: gaussian of mean, deviation: .* expected a deviation other than 0"),
        ({"gaussian": [0.5]}, "clearance.gaussian: got a list of 1, expected a list of 2 numbers"),
        ({"formula": "x"}, "clearance: expression 'x' gives 2 at x = 2, expected at most 1"),
        ({"formula": "q"}, "clearance is a value, expected a membership function"),
        ({"formula": "0.5 * tanh(x)"}, "clearance: the function 'tanh', expected of pow, abs, .*; arbiter.file takes"),
        (
            {"formula": "0*(x" + "+(x" * 40 + ")" * 41},
            "clearance: a formula nested so deep, expected at most 32 numbers",
        ),
    ],
)
def test_invalid_curves_are_rejected(term, fault):
    with pytest.raises(ScenarioError, match=rf"^criteria\[0\].membership.{fault}"):
        curved(term)


def test_membership_terms_have_text_descriptions():
    says = {
        "gaussian of mean 0.2, deviation 0.5, height 0.7, in m": {"gaussian": [0.2, 0.5], "height": 0.7},
        "exp(-abs(x)), with x in m": {"formula": "exp(-abs(x))"},
        "1 at 0.2 m, 0 at 0.5 m": {"falling": [0.2, 0.5]},
    }
    for words, term in says.items():
        assert curved(term)[0].reasons[0].words(0.2) == f"clearance: {words}"
