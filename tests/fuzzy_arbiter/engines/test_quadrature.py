"""Outputs of any terms, norms and defuzzifiers, against SciPy's quadrature, sampling, and rational numbers."""

import itertools
import math
from dataclasses import replace
from fractions import Fraction

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from scipy.integrate import quad

from benchmarks.fuzzy_accuracy import BOUND as ACCURACY
from benchmarks.fuzzy_accuracy import DEFUZZIFIERS, errors, print_worst, random_cases, strengths_system
from fuzzy_arbiter import Arbiter, Output, Rule, Term, falling, rising, trapezoid, triangle
from fuzzy_arbiter.engines.clipped_curves import ClippedCurves
from fuzzy_arbiter.engines.exact import ExactEngine
from fuzzy_arbiter.engines.firing import slots_of
from fuzzy_arbiter.engines.quadrature import Quadrature
from fuzzy_arbiter.errors import EngineError
from fuzzy_arbiter.propositions import Is
from fuzzy_arbiter.rule import Operators
from fuzzy_arbiter.terms.curves import curve
from fuzzy_arbiter.terms.norms import AGGREGATIONS, T_NORMS
from fuzzy_arbiter.terms.values import Formula
from tests.examples import examples
from tests.fuzzy_arbiter import reference
from tests.fuzzy_arbiter.systems import shapes

TERMS = (
    Term("a", curve("gaussian", 2.0, 1.0)),
    Term("b", curve("bell", 5.0, 1.5, 2.0)),
    Term("c", curve("sigmoid", 7.5, 3.0)),
    Term("d", triangle(3.0, 4.0, 8.0)),
)


def value(output, cuts, implication="min"):
    """The output's value for some strengths."""
    return ExactEngine(strengths_system(output, implication)).centroids(cuts)[0]


def sampled(output, cuts, implications, points=500_000):
    """Places and joined heights in the middles of many cells, whose centroid is off by their width squared."""
    low, high = output.universe
    x = low + (high - low) * (np.arange(points) + 0.5) / points
    y = np.zeros(points)
    for term, cut, word in zip(output.terms, cuts, implications, strict=True):
        bounded = T_NORMS[word].array(np.full(points, cut), term.shape.of_many(x))
        y = AGGREGATIONS[output.aggregation].array(y, bounded)
    return x, y


@pytest.mark.medium
@pytest.mark.parametrize("seed", range(12))
def test_no_random_system_fails_or_is_beyond_its_bound(seed):
    """All implications, aggregations, defuzzifiers and kinds of terms; none, one, two or all rules fire."""
    for case in random_cases(25, 100 + seed):
        error, _ = errors(case)
        assert not error > ACCURACY, (error, case)


def gaussians(*parameters, universe=(0, 25), **options):
    return Output("y", universe, {f"t{i}": curve("gaussian", *p) for i, p in enumerate(parameters)}, **options)


@pytest.mark.parametrize("deviation", [6.0, 0.05, 1e-6])
@pytest.mark.parametrize("implication", T_NORMS)
def test_a_lone_gaussian_has_its_mean_for_all_values(deviation, implication):
    for defuzzifier in ("centroid", "bisector", "mom"):
        output = gaussians((9.7, deviation), universe=(9.7 - 10, 9.7 + 10), defuzzifier=defuzzifier)
        # a drastic product with less than 1 is a single position, which has no area
        cuts = (1.0,) if implication == "drastic_product" and defuzzifier != "mom" else (1.0, 0.6)
        for cut in cuts:
            assert value(output, [cut], implication) == pytest.approx(9.7, abs=1e-9), (defuzzifier, cut)


@pytest.mark.medium
@pytest.mark.parametrize("seed", range(8))
def test_clipped_curves_match_quadrature_for_cuts_of_any_size(seed):
    rng, compared = np.random.default_rng(seed), 0
    for case in random_cases(12, 1000 + seed):
        maxima = (("min", "max", name) for name in ("mom", "som", "lom"))
        for implication, aggregation, defuzzifier in (
            *itertools.product(("min", "prod"), ("max", "sum"), ("centroid",)), *maxima
        ):  # fmt: skip
            output = replace(case.output, defuzzifier=defuzzifier, aggregation=aggregation)
            (curves,) = ExactEngine(strengths_system(output, implication)).defuzzifiers
            slots = len(output.terms)
            x = rng.uniform(*output.universe, 20)
            degrees = np.array([term.membership.of_many(x) for term in output.terms])  # at which terms meet their cuts
            cuts = np.hstack([
                degrees, degrees * (1 - 1e-15), rng.random((slots, 20)), 10 ** rng.uniform(-300, 0, (slots, 20)),
                rng.choice([0.0, 1e-9, 0.5, 0.7, 0.7 - 1e-15, 1.0 - 1e-15, 0.999, 1.0], (slots, 20)),
            ])  # fmt: skip
            if defuzzifier != "centroid":  # near the top of a term its slope hides the position
                cuts = 10 ** np.hstack([rng.uniform(-300, -1, (slots, 50)), rng.uniform(-15, -1, (slots, 50))])
            cuts = cuts[:, cuts.max(axis=0) > 0.0]
            values = curves.values(cuts, np.zeros((cuts.shape[1], 0)))
            alone = [curves.value(row, ()) for row in cuts.T[::9]]  # the same bits in a batch of any other rows
            assert values[::9].tolist() == pytest.approx(alone, rel=0.0, abs=0.0, nan_ok=True)
            assert curves.values(cuts[:, :0], np.zeros((0, 0))).shape == (0,)
            expected = Quadrature(output, slots_of(strengths_system(output, implication), output)).values(cuts, cuts)
            assert values / (output.universe[1] - output.universe[0]) == pytest.approx(
                expected / (output.universe[1] - output.universe[0]), abs=1e-9, nan_ok=True
            )
            compared += isinstance(curves, ClippedCurves)
    assert compared > 15


@pytest.mark.parametrize(
    ("parameters", "cuts"),
    [
        (((17.9, 0.05), (2.0, 6.0)), (1.0, 0.4)),
        (((17.9, 0.05), (2.0, 6.0)), (0.8, 0.8)),
        (((2.0, 4.0), (12.0, 4.0), (22.0, 4.0)), (0.0051, 0.99646, 0.91242)),
        (((3.0, 2e-4), (20.0, 0.3)), (0.9, 0.01)),
    ],
)
def test_clipped_gaussians_match_scipy(parameters, cuts):
    output = gaussians(*parameters)

    def height(x):
        return max(min(cut, term.shape(x)) for cut, term in zip(cuts, output.terms, strict=True))

    near = [m + s * k / 20 for m, s in parameters for k in range(-200, 201)]
    pieces = list(itertools.pairwise(sorted({0.0, 25.0, *(x for x in near if 0 < x < 25)})))
    area = math.fsum(quad(height, a, b, epsabs=1e-15)[0] for a, b in pieces)
    moment = math.fsum(quad(lambda x: x * height(x), a, b, epsabs=1e-15)[0] for a, b in pieces)
    assert value(output, cuts) == pytest.approx(moment / area, abs=1e-9 * 25)


def test_a_narrow_difference_of_sigmoids_is_not_missed():
    """By the antiderivative of the logistic function."""
    left, right, slope = 11.0, 11.2, 80.0
    shape = curve("sigmoid_difference", left, slope, slope, right)
    output = Output("y", (0, 25), {"a": shape, "b": triangle(0, 2, 4)})
    area = right - left  # of the whole line, of which the universe lacks nothing that a float shows
    expected = (0.25 * 2 * 2 + area * (left + right) / 2) / (0.25 * 2 + area)
    assert value(output, [1.0, 0.25], "prod") == pytest.approx(expected, abs=1e-9)


@pytest.mark.parametrize("aggregation", ["probor", "sum", "einstein_sum", "normalized_sum"])
@pytest.mark.parametrize("defuzzifier", ["som", "lom", "mom"])
def test_a_height_may_be_greatest_beside_an_open_jump(defuzzifier, aggregation):
    """The first term is 0 up to 5 and 0.5 beyond; the second falls from 0.8 there."""
    terms = (Term("a", rising(0, 10)), Term("b", triangle(0, 4, 9)))
    output = Output("y", (0, 10), terms, None, defuzzifier, aggregation)
    found = value(output, [0.5, 0.85], "nilpotent_minimum")
    # a normalized sum is 1 until the second term is 0.5
    expected = {"som": 5.0, "lom": 6.5, "mom": 5.75}[defuzzifier] if aggregation == "normalized_sum" else 5.0
    assert found == pytest.approx(expected, abs=1e-9)


@pytest.mark.parametrize(
    ("kinds", "universe", "aggregation", "cuts"),
    [
        ((("sigmoid", 1.146, -660.435), ("gaussian", 1.414, 0.0667)), (-3, 7), "normalized_sum", (1e-9, 1e-9)),
        ((("s_shape", 85.0, 125.0), ("z_shape", 109.414, 109.602)), (100, 125), "probor", (0.5, 0.7)),
    ],
    ids=["flat", "close to the end of a panel"],
)
def test_the_place_of_a_maximum_is_as_high_as_any(kinds, universe, aggregation, cuts):
    terms = {f"t{i}": curve(*parameters) for i, parameters in enumerate(kinds)}
    output = Output("y", universe, terms, None, "lom", aggregation)
    x = np.concatenate([[value(output, cuts, "prod")], np.linspace(*universe, 1_000_001)])
    implied = [cut * term.shape.of_many(x) for cut, term in zip(cuts, output.terms, strict=True)]
    heights = AGGREGATIONS[aggregation].array(*implied)
    assert heights[0] >= heights.max() * (1 - 1e-12)


@settings(max_examples=examples(40), deadline=None, suppress_health_check=[HealthCheck.too_slow])
@given(st.lists(shapes(), min_size=1, max_size=3), st.data())
def test_a_sum_of_straight_terms_is_rational(drawn, data):
    terms = tuple(Term(f"t{j}", shape) for j, shape in enumerate(drawn))
    output = Output("y", (0.0, 1.0), terms, aggregation="sum")
    cuts = [data.draw(st.integers(1, 16)) / 16 for _ in terms]
    # the centroid of a sum is the mean of the centroids, weighted by the areas
    area = moment = Fraction(0)
    for term, cut in zip(terms, cuts, strict=True):
        alone = replace(output, terms=(term,), aggregation="max")
        own = reference.integrals(alone, [Fraction(cut)])
        area, moment = area + own[0], moment + own[1]
    engine = ExactEngine(strengths_system(output, "min"))
    assert engine.methods["y"] == "integrals of polynomials, to rounding"
    assert engine.centroids(cuts)[0] == pytest.approx(float(moment / area), abs=1e-13)


@settings(max_examples=examples(40), deadline=None, suppress_health_check=[HealthCheck.too_slow])
@given(st.lists(shapes(), min_size=1, max_size=3), st.data())
def test_piecewise_linear_terms_match_the_exact_sweep(drawn, data):
    """Which is rational, see test_exact."""
    output = Output("y", (0.0, 1.0), tuple(Term(f"t{j}", shape) for j, shape in enumerate(drawn)))
    cuts = [data.draw(st.integers(1, 16)) / 16 for _ in drawn]
    engine = ExactEngine(strengths_system(output, "min"))
    engine.defuzzifiers[0] = Quadrature(output, engine.firing.slots[0])
    exact = reference.centroid(output, list(map(Fraction, cuts)))
    assert engine.centroids(cuts)[0] == pytest.approx(float(exact), abs=1e-12)


@pytest.mark.medium(fast=18)
@pytest.mark.parametrize("aggregation", AGGREGATIONS)
@pytest.mark.parametrize("implication", T_NORMS)
@pytest.mark.parametrize("defuzzifier", ["centroid", "bisector", "mom", "som", "lom"])
def test_every_defuzzifier_is_the_limit_of_dense_sampling(defuzzifier, implication, aggregation):
    output = Output("y", (0, 10), TERMS, None, defuzzifier, aggregation)
    cuts = [0.9, 0.35, 0.6, 0.75]
    x, y = sampled(output, cuts, [implication] * 4, 400_000 if defuzzifier == "centroid" else 40_000)
    jumps = "drastic" in implication + aggregation or "nilpotent" in implication + aggregation
    if defuzzifier == "centroid":
        expected, off = (x * y).sum() / y.sum(), 1e-3 if jumps else 4e-9
    elif defuzzifier == "bisector":
        expected, off = x[np.searchsorted(np.cumsum(y), y.sum() / 2)], 1e-3
    else:
        top = x[y >= y.max() * (1 - 1e-9)]
        expected, off = {"mom": top.mean(), "som": top[0], "lom": top[-1]}[defuzzifier], 6e-3
    if implication == "drastic_product" and not (y > 0).mean() > 1e-4:
        return
    made = strengths_system(output, implication)
    assert ExactEngine(made).centroids(cuts)[0] == pytest.approx(expected, abs=off)
    grid = Arbiter(replace(made, points=4001), engine="grid")
    assert grid(cuts)[0] == pytest.approx(expected, abs=max(off, 6e-3))
    assert grid.batch([cuts, cuts]) == pytest.approx(np.array([grid(cuts)] * 2), abs=1e-12)


FOOT, TOP, SLOPE = 100.83920572947113, 100.87231839689323, 155.88537267578596
STEEP = Output("y", (100, 110), {"a": curve("sigmoid_product", FOOT, SLOPE, -SLOPE, TOP)})
PLATEAU = Output("y", (0, 10), {"t": triangle(0.0, 5.0, 8.0)})
CORNER = Output("y", (0, 10), {"t": triangle(4.0, 4.0, 10.0)})
HALVES = Output("y", (0, 10), {"a": triangle(0, 1, 2), "b": triangle(8, 9, 10)})
BESIDE = Output("y", (0, 10), {"a": triangle(0, 1, 2), "b": triangle(1, 2, 3)})
STEEP_EDGE = Output("y", (100, 101), {"t": trapezoid(100.3664914526739, 100.36649262908301, 100.375, 100.9)})
GAUSSIANS = gaussians((17.9, 0.05), (2.0, 6.0))


@pytest.mark.parametrize(
    ("output", "defuzzifier", "implication", "cuts", "expected"),
    [
        *((PLATEAU, name, "min", [0.5], place) for name, place in (("som", 2.5), ("lom", 6.5), ("mom", 4.5))),
        *((CORNER, name, "min", [1.0], 4.0) for name in ("som", "lom", "mom")),
        (CORNER, "bisector", "min", [1.0], 4 + 6 * (1 - math.sqrt(0.5))),  # half the area of a right triangle
        (HALVES, "bisector", "min", [0.7, 0.7], 5.0),  # the middle of the gap
        (STEEP, "bisector", "min", [1.0], (FOOT + TOP) / 2),  # of a symmetric curve, its tail in a wide panel
        *((BESIDE, "mom", "prod", [cut, cut], 1.5) for cut in (1.0, 1e-3, 1e-20)),
        (GAUSSIANS, "mom", "min", [1.0, 0.5], 17.9),
        (GAUSSIANS, "som", "min", [0.5, 0.5], 0.0),  # clipped alike, both are level: the wider from the start
        # a plateau beside a steep edge, whose degrees are rounded
        *(
            (STEEP_EDGE, name, word, [cut], place)
            for word, cut in (("min", 1.0), ("prod", 0.75))
            for name, place in (
                ("som", 100.36649262908301),
                ("lom", 100.375),
                ("mom", (100.36649262908301 + 100.375) / 2),
            )
        ),
    ],
)
def test_defuzzified_values_match_geometry(output, defuzzifier, implication, cuts, expected):
    assert value(replace(output, defuzzifier=defuzzifier), cuts, implication) == pytest.approx(expected, abs=1e-9)


def test_singletons_count_only_if_no_area_fires():
    output = Output("y", (0, 10), {"a": curve("singleton", 2.0), "b": curve("singleton", 8.0), "c": triangle(3, 4, 5)})
    assert value(output, [0.25, 0.75, 0.0]) == pytest.approx(6.5)
    assert value(output, [1.0, 1.0, 0.5]) == pytest.approx(4.0)


def test_rule_blocks_use_their_own_implication():
    output = Output("y", (0, 10), TERMS[:2])
    made = strengths_system(output, "min")
    rules = (replace(made.rules[0], operators=Operators(implication="prod")), made.rules[1])
    x, y = sampled(output, [0.5, 0.5], ["prod", "min"])
    engine = ExactEngine(replace(made, rules=rules))
    assert engine.centroids([0.5, 0.5])[0] == pytest.approx((x * y).sum() / y.sum(), abs=2e-9)


def test_one_term_concluded_twice_counts_twice_in_a_sum():
    output = Output("y", (0, 10), (Term("a", triangle(0, 2, 4)), Term("b", triangle(6, 8, 10))), aggregation="sum")
    made = strengths_system(output, "min")
    again = replace(made, rules=(*made.rules, Rule(Is("x0", "on"), (Is("y", "a"),))))
    assert ExactEngine(made).centroids([0.5, 0.5])[0] == pytest.approx(5.0)
    assert ExactEngine(again).centroids([0.5, 0.5])[0] == pytest.approx((2 * 2 + 8) / 3)
    most = replace(again, outputs=(replace(output, aggregation="max"),))
    assert ExactEngine(most).centroids([0.5, 0.5])[0] == pytest.approx(5.0)


def test_batches_equal_single_samples():
    made = strengths_system(Output("y", (0, 10), TERMS), "min")
    rows = np.random.default_rng(0).random((20, 4))
    engine = ExactEngine(made)
    assert engine.centroids_of_many(rows)[:, 0].tolist() == [engine.centroids(row)[0] for row in rows.tolist()]


def test_zero_area_gives_nan():
    assert value(Output("y", (0, 10), {"a": falling(0, 10)}), [1.0], "bounded_difference") == pytest.approx(10 / 3)
    # a cut and a degree that never sum to more than 1 leave nothing
    low = Output("y", (0, 10), {"a": curve("gaussian", 5, 1, height=0.5)})
    assert math.isnan(value(low, [0.25], "bounded_difference"))


def test_unintegrable_terms_are_rejected():
    with pytest.raises(EngineError, match="output 'y': its joined terms are too rough to be integrated to 1e-09"):
        value(Output("y", (0, 1), {"a": Formula("0.5 + 0.5 * sin(1e6 * x * x)")}), [0.6])


def test_arbiter_names_the_evaluation_method_of_each_output():
    made = strengths_system(Output("y", (0, 10), TERMS), "min")
    assert Arbiter(made).engine_reason.endswith("'y': integrals of polynomials, within 1e-09 of the universe's width")
    formula = Output("y", (0, 10), {"a": Formula("max(0, 1 - abs(x - 3.001) * 50)"), "b": triangle(4, 5, 6)})
    assert "without a bound" in Arbiter(strengths_system(formula, "min")).engine_reason
    straight = strengths_system(Output("y", (0, 10), TERMS[3:]), "min")
    assert Arbiter(straight).engine_reason.startswith("there is no closed form: ")
    assert "quadrature" not in Arbiter(straight).engine_reason


def test_the_worst_error_of_each_defuzzifier_is_printed(capsys):
    print_worst(5, seed=0)
    lines = capsys.readouterr().out.splitlines()
    assert [line.split()[0] for line in lines[1:]] == list(DEFUZZIFIERS)
    assert all(line.split()[1] == "1" and line.split()[-1] == "0" for line in lines[1:])
