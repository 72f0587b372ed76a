"""The arbiter: the rules of section VI, and two engines that agree."""

import itertools
import math
import subprocess
import sys
import threading
from fractions import Fraction

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from fuzzy_arbiter import SECTION_VI, Arbiter, Criterion, DefinitionError, MembershipError, hierarchical_rules, ramp
from fuzzy_arbiter.closed_form import CENTROID_HIGH, CENTROID_LOW
from fuzzy_arbiter.scikit import ScikitEngine

degrees = st.floats(0.0, 1.0)


@pytest.fixture(scope="module")
def scikit():
    return Arbiter(engine="skfuzzy")


# the paper's rules on crisp inputs: (obstacle exists, shape is complex, depth is not maintained) -> alpha
CRISP = {
    (1, 1, 1): (1, 0, 0), (1, 1, 0): (1, 0, 0), (1, 0, 1): (1, 0, 0), (1, 0, 0): (1, 0, 0),
    (0, 1, 1): (0, 1, 0), (0, 1, 0): (0, 1, 0), (0, 0, 1): (0, 0, 1), (0, 0, 0): (0, 0, 0),
}  # fmt: skip


@pytest.mark.parametrize(("inputs", "outputs"), CRISP.items())
def test_crisp_table(inputs, outputs, scikit):
    assert Arbiter()(inputs) == outputs
    assert scikit(inputs) == pytest.approx(outputs, abs=2e-15)


def test_the_eight_rules_read_as_in_the_paper():
    assert str(Arbiter()).splitlines() == [
        "R1: if obstacle is exist then alpha_1 is high",
        "R2: if obstacle is not exist then alpha_1 is low",
        "R3: if obstacle is exist then alpha_2 is low",
        "R4: if shape is simple then alpha_2 is low",
        "R5: if obstacle is not exist and shape is complex then alpha_2 is high",
        "R6: if obstacle is exist or shape is complex then alpha_3 is low",
        "R7: if depth is maintain then alpha_3 is low",
        "R8: if obstacle is not exist and shape is simple and depth is not maintain then alpha_3 is high",
    ]


@pytest.mark.parametrize("n", range(1, 7))
def test_rules_are_few_complete_and_consistent(n):
    rules = hierarchical_rules(n)
    assert len(rules) == 3 * n - 1
    for crisp in itertools.product((False, True), repeat=n):
        for k in range(n):
            fired = {
                rule.high
                for rule in rules
                if rule.criterion == k
                and (all if rule.join == "and" else any)(crisp[t.criterion] == t.on for t in rule.terms)
            }
            assert len(fired) == 1  # high or low, never neither, never both


def exact_weight(memberships, k, points=None):
    """The Mamdani system by its definition, in rational numbers: cut, join, centroid, normalise.

    Exact on the envelope's breakpoints; nothing here knows of the closed form.
    """
    m = [Fraction(x) for x in memberships]
    fires = {True: Fraction(0), False: Fraction(0)}
    for rule in hierarchical_rules(len(m)):
        if rule.criterion == k:
            degree = [m[t.criterion] if t.on else 1 - m[t.criterion] for t in rule.terms]
            fires[rule.high] = max(fires[rule.high], min(degree) if rule.join == "and" else max(degree))
    high, low = fires[True], fires[False]

    def envelope(y):
        return max(min(high, y), min(low, 1 - y))

    knots = sorted({Fraction(0), Fraction(1), Fraction(1, 2), *(x for c in (high, low) for x in (c, 1 - c))})
    area = moment = Fraction(0)
    for a, b in itertools.pairwise(knots):
        fa, fb, w = envelope(a), envelope(b), b - a
        area += w * (fa + fb) / 2
        moment += w * (a * (2 * fa + fb) + b * (fa + 2 * fb)) / 6
    return (moment / area - Fraction(1, 3)) * 3


@settings(max_examples=300, deadline=None)
@given(st.lists(st.fractions(0, 1, max_denominator=64), min_size=1, max_size=5))
def test_closed_form_is_the_exact_centroid(memberships):
    criteria = [Criterion(f"c{i}", "on", "off") for i in range(len(memberships))]
    weights = Arbiter(criteria)([float(m) for m in memberships])
    exact = [float(exact_weight(memberships, k)) for k in range(len(memberships))]
    assert weights == pytest.approx(exact, abs=4 * np.finfo(float).eps)


@pytest.mark.parametrize("points", [11, 101])
def test_engines_agree_within_the_grid_of_scikit_fuzzy(points):
    step = 1.0 / (points - 1)
    engine = ScikitEngine(SECTION_VI, hierarchical_rules(3), points)
    rng = np.random.default_rng(3)
    for memberships in rng.random((400, 3)):
        closed = np.array(Arbiter()(memberships))
        raw = CENTROID_LOW + (CENTROID_HIGH - CENTROID_LOW) * closed
        assert np.abs(np.array(engine.centroids(memberships)) - raw).max() <= step**2 / 6 + 1e-15
        assert np.abs(np.array(engine.weights(memberships)) - closed).max() <= step**2 / 2 + 1e-15


@given(st.lists(degrees, min_size=3, max_size=3))
def test_at_most_one_weight_is_above_one_half(memberships):
    assert sum(w > 0.5 for w in Arbiter()(memberships)) <= 1


@given(st.lists(degrees, min_size=3, max_size=3), degrees)
def test_more_obstacle_never_means_less_weight_for_it(memberships, more):
    low, high = sorted((memberships[0], more))
    rest = memberships[1:]
    fewer, greater = Arbiter()([low, *rest]), Arbiter()([high, *rest])
    assert greater[0] >= fewer[0]
    assert all(g <= f for g, f in zip(greater[1:], fewer[1:], strict=True))


def test_memberships_may_be_named():
    assert Arbiter()({"depth": 1.0, "obstacle": 0.0, "shape": 0.0}) == (0.0, 0.0, 1.0)


@pytest.mark.parametrize("engine", ["closed", "skfuzzy"])
@pytest.mark.parametrize(
    ("memberships", "words"),
    [
        ([0.1, 0.2], "2 memberships"),
        ([0.1, math.nan, 0.3], "shape"),
        ([0.1, 0.2, 1.1], "depth"),
        ([-1e-9, 0.2, 0.3], "obstacle"),
        ([None, 0.2, 0.3], "obstacle"),
        (["exist", 0.2, 0.3], "obstacle"),
        ({"obstacle": 0.1, "shape": 0.2}, "depth: membership is missing"),
        ({"obstacle": 0.1, "shape": 0.2, "depth": 0.3, "dept": 0.3}, "dept: unknown"),
    ],
)
def test_bad_inputs_are_errors(engine, memberships, words):
    with pytest.raises(MembershipError, match=words):
        Arbiter(engine=engine)(memberships)


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        ({"criteria": []}, "at least one"),
        ({"criteria": [SECTION_VI[0], SECTION_VI[0]]}, "obstacle"),
        ({"criteria": [Criterion("a", "on", "on")]}, "both terms"),
        ({"engine": "fast"}, "closed, skfuzzy"),
        ({"engine": "skfuzzy", "points": 2}, "points"),
        ({"engine": "skfuzzy", "points": 101.5}, "points"),
    ],
)
def test_bad_definitions_are_errors(arguments, words):
    with pytest.raises(DefinitionError, match=words):
        Arbiter(**arguments)


def test_threads_do_not_disturb_each_other(scikit):
    rng = np.random.default_rng(0)
    inputs = rng.random((4, 40, 3))
    expected = [[Arbiter()(x) for x in rows] for rows in inputs]
    wrong = []

    def work(rows, answers):
        for x, answer in zip(rows, answers, strict=True):
            if np.abs(np.subtract(scikit(x), answer)).max() > 6e-5:
                wrong.append(x)

    threads = [threading.Thread(target=work, args=pair) for pair in zip(inputs, expected, strict=True)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert wrong == []


def test_many_evaluations_forget_no_input(scikit):
    """scikit-fuzzy drops its inputs when its cache is flushed, after 1000 runs."""
    rng = np.random.default_rng(1)
    for x in rng.random((1100, 3)):
        scikit(x)


def test_ramp_is_one_up_to_the_boundary_and_falls_outside():
    assert [ramp(c, 0.2) for c in (-1.0, 0.0, 0.05, 0.2, 3.0)] == pytest.approx([1.0, 1.0, 0.75, 0.0, 0.0])
    assert [ramp(c, 0.0) for c in (-1e-9, 1e-9)] == [1.0, 0.0]
    assert math.isnan(ramp(math.nan, 0.2))
    assert math.isnan(ramp(math.nan, 0.0))


def test_alone_it_needs_neither_the_vehicle_nor_matplotlib():
    code = (
        "import sys, fuzzy_arbiter; fuzzy_arbiter.Arbiter()([0, 1, 0]);"
        "print({'matplotlib', 'fmpy', 'numba', 'cosim', 'controller', 'plant_fmu', 'skfuzzy'} & set(sys.modules))"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout.strip() == "set()"
