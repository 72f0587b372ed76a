"""The grid engine equals scikit-fuzzy at any number of points."""

import itertools
import pickle
from fractions import Fraction

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from fuzzy_arbiter import Output, Rule, Shape, System, Term, Variable, prioritised, triangle
from fuzzy_arbiter.engines.grid import LEAST_AREA, GridEngine, sampled
from fuzzy_arbiter.engines.scikit import ScikitEngine
from fuzzy_arbiter.errors import DefinitionError, EngineError
from fuzzy_arbiter.hierarchy import WEIGHT
from tests.fuzzy_arbiter.engines.test_scikit import TIP, TIPPING, gap, mixed

BAR = 1e-13  # of the greatest place, for a cut of 1
degrees = st.floats(0.0, 1.0)


def one_output(output, points):
    """A system whose cuts the tests choose themselves."""
    x = Variable("x", (0, 1), (Term("any", triangle(0, 1, 1)),))
    rule = Rule(x["any"], (output[output.terms[0].name],))
    return System((x,), (output,), (rule,), normalization="none", points=points)


def exact_centroid(output, cuts):
    """In rational numbers: between any two places where one of the lines can meet another, the outline is straight."""
    low, high = map(Fraction, output.universe)
    cuts = [Fraction(cut) for cut in cuts]
    curves = []
    for term in output.terms:
        points = [(Fraction(x), Fraction(y)) for x, y in term.shape.points]
        curves.append([(min(low, points[0][0]), points[0][1]), *points, (max(high, points[-1][0]), points[-1][1])])

    def line(curve, place):  # slope and offset just right of a place
        (x0, y0), (x1, y1) = next(p for p in itertools.pairwise(curve) if p[0][0] <= place < p[1][0])
        return (y1 - y0) / (x1 - x0), y0 - x0 * (y1 - y0) / (x1 - x0)

    knots = sorted({low, high, *(x for curve in curves for x, _ in curve if low < x < high)})
    area = moment = Fraction(0)
    for start, end in itertools.pairwise(knots):
        lines = [*(line(curve, start) for curve in curves), *((Fraction(0), cut) for cut in cuts)]
        meet = {(d - b) / (a - c) for (a, b), (c, d) in itertools.combinations(lines, 2) if a != c}
        for x0, x1 in itertools.pairwise(sorted({start, end, *(x for x in meet if start < x < end)})):
            y0, y1 = (max(min(a * x + b, c) for (a, b), c in zip(lines, cuts, strict=False)) for x in (x0, x1))
            area += (x1 - x0) * (y0 + y1) / 2
            moment += (x1 - x0) * (x0 * (2 * y0 + y1) + x1 * (y0 + 2 * y1)) / 6
    return moment / area


def rule_of_scikit_fuzzy(output, points, cuts):
    """In rational numbers: lines between samples, at the grid and where a term crosses its own cut."""
    grid, samples = sampled(output, points)
    grid, cuts = [Fraction(x) for x in grid.tolist()], [Fraction(cut) for cut in cuts]
    samples = [[Fraction(y) for y in term] for term in samples.tolist()]
    area = moment = Fraction(0)
    for i, (a, b) in enumerate(itertools.pairwise(grid)):
        terms = [(term[i], term[i + 1] - term[i], cut) for term, cut in zip(samples, cuts, strict=True)]
        own = {(cut - y) / rise for y, rise, cut in terms if (y < cut) != (y + rise < cut)}
        for s0, s1 in itertools.pairwise(sorted({Fraction(0), *own, Fraction(1)})):
            y0, y1 = (max(min(y + rise * share, cut) for y, rise, cut in terms) for share in (s0, s1))
            x0, x1 = a + s0 * (b - a), a + s1 * (b - a)
            area += (x1 - x0) * (y0 + y1) / 2
            moment += (x1 - x0) * (x0 * (2 * y0 + y1) + x1 * (y0 + 2 * y1)) / 6
    return float(moment / max(area, Fraction(LEAST_AREA)))


def random_output(rng):
    """Terms that overlap or do not, with knots on and off the grid, plateaus below 1, jumps, and slopes at the ends."""
    low = rng.choice([0.0, -1.0, 3.7, -250.0])
    span = rng.choice([1.0, 0.013, 20.0, 777.7])
    terms = []
    for i in range(rng.integers(1, 6)):
        places = np.sort(np.where(rng.random(4) < 0.5, rng.uniform(-0.2, 1.2, 4), rng.integers(0, 21) / 20))
        shapes = (
            [(places[0], 0), (places[1], 1), (places[2], 1), (places[3], 0)],
            [(places[0], 0), (places[1], 1), (places[3], 0)],
            [(places[1], rng.random()), (places[2], rng.random()), (places[3], rng.random())],
            [(places[0], 0), (places[0], rng.random()), (places[2], 1), (places[3], 0.5), (places[3], 0)],
        )
        points = shapes[rng.integers(len(shapes))]
        if len({x for x, _ in points}) == 1:
            points = [(0.1, 0), (0.4, 1), (0.9, 0)]
        elif any(a[0] == b[0] == c[0] for a, b, c in zip(points, points[1:], points[2:], strict=False)):
            points = points[:2]
        terms.append(Term(f"t{i}", Shape(tuple((low + span * x, y) for x, y in points))))
    return Output("y", (low, low + span), tuple(terms))


def random_engines(rng, points):
    """Return both engines on an output that scikit-fuzzy can run, and cuts for it, some of them low."""
    while True:
        try:
            system = one_output(random_output(rng), points)
            engines = GridEngine(system), ScikitEngine(system)
        except DefinitionError:  # a term is 0 on the grid, or has no area
            continue
        cuts = rng.random((len(system.outputs[0].terms), 12)) * rng.choice([1, 1, 1, 1e-2, 1e-4, 1e-6], 12)
        cuts[rng.random(cuts.shape) < 0.2] = 0.0
        cuts[rng.random(cuts.shape) < 0.1] = rng.choice([1.0, 0.5])
        return *engines, cuts[:, cuts.any(axis=0)]


@pytest.mark.medium(fast=1)
@pytest.mark.parametrize("points", [3, 10, 11, 101, 1001])
def test_centroid_equals_scikit_fuzzy(points):
    rng = np.random.default_rng(points)
    for _ in range(40 if points < 1001 else 8):
        grid, scikit, cuts = random_engines(rng, points)
        output = grid.system.outputs[0]
        # the lower the cuts, the more scikit-fuzzy rounds
        bars = BAR * max(map(abs, output.universe)) / cuts.max(axis=0)
        found = grid.centroid_of_many(0, cuts)
        assert (np.abs(found - scikit.centroid_of_many(0, cuts)) <= bars).all(), output
        assert found.tolist() == [grid.centroid(0, column) for column in cuts.T.tolist()]


@pytest.mark.medium(fast=1)
@pytest.mark.parametrize("points", [3, 10, 37])
def test_centroid_matches_the_scikit_fuzzy_formula_to_rounding(points):
    rng = np.random.default_rng(points)
    for _ in range(25):
        grid, _, cuts = random_engines(rng, points)
        output = grid.system.outputs[0]
        for column in cuts.T.tolist()[:4]:
            error = abs(grid.centroid(0, column) - rule_of_scikit_fuzzy(output, points, column))
            assert error <= 1e-14 * max(map(abs, output.universe)), output


@pytest.mark.parametrize(
    "system", [prioritised(), mixed(), mixed("prod", "probor", 37), mixed("min", "probor", 100), TIPPING, gap(5.5)]
)
def test_any_system_equals_scikit_fuzzy(system):
    grid, scikit = GridEngine(system), ScikitEngine(system)
    low, high = np.array([v.universe for v in system.inputs]).T
    rows = low + (high - low) * np.random.default_rng(5).random((40, len(low)))
    assert np.abs(grid.centroids_of_many(rows) - scikit.centroids_of_many(rows)).max() <= 30 * BAR
    one_by_one = [grid.weights(row) for row in rows.tolist()]
    assert grid.weights_of_many(rows) == pytest.approx(np.array(one_by_one), abs=1e-14)


@given(high=degrees, low=degrees, points=st.integers(3, 300))
def test_section_vi_at_any_number_of_points(high, low, points):
    if not high and not low:
        low = 1.0
    system = one_output(WEIGHT, points)
    grid = GridEngine(system)
    ours = grid.centroid(0, [low, high])
    assert ours == pytest.approx(ScikitEngine(system).centroid(0, [low, high]), abs=BAR)
    assert ours == pytest.approx(grid.centroid_of_many(0, np.array([[low], [high]]))[0], abs=BAR)


@pytest.mark.medium(fast=3)
@pytest.mark.parametrize("points", [3, 11, 101, 1001])
def test_section_vi_is_off_the_exact_centroid_by_a_sixth_of_the_squared_step_at_most(points):
    step = 1 / (points - 1)
    engine = GridEngine(prioritised(points=points))
    rng = np.random.default_rng(points)
    strengths = np.concatenate([rng.random(150), step * rng.random(30), 1 - step * rng.random(30), [0, 0.5, 1]])
    exact = np.array([float(exact_centroid(WEIGHT, [1 - Fraction(h), h])) for h in strengths])
    found = engine.centroid_of_many(0, np.array([1 - strengths, strengths]))
    assert np.abs(found - exact).max() <= step**2 / 6 + 1e-15
    weights = engine.weights_of_many(np.stack([strengths, strengths * 0, strengths * 0], axis=1))[:, 0]
    assert np.abs(weights - (3 * exact - 1)).max() <= step**2 / 2 + 3e-15
    # and no better than half of that, so that the bound means something
    assert np.abs(found - exact).max() >= step**2 / 12


@pytest.mark.parametrize("points", [11, 101, 1001])
def test_scikit_fuzzy_satisfies_the_error_bound(points):
    step = 1 / (points - 1)
    engine = ScikitEngine(prioritised(points=points))
    for h in np.random.default_rng(points).random(40):
        found = engine.centroid(0, [1 - h, h])
        assert found == pytest.approx(float(exact_centroid(WEIGHT, [1 - Fraction(h), h])), abs=step**2 / 6 + 1e-13)


@pytest.mark.parametrize("n", [0, 1, 2, 4097])
def test_batch_rows_equal_single_samples_bit_for_bit(n):
    engine = GridEngine(one_output(TIP, 40))
    cuts = np.random.default_rng(n).random((3, n))
    found = engine.centroid_of_many(0, cuts).tolist()
    assert len(found) == n
    assert found[-3:] == [engine.centroid(0, column) for column in cuts.T.tolist()[-3:]]


def test_nearly_flat_term_is_evaluated():
    flat = Output("y", (0, 1), (Term("a", Shape(((0, 0), (1, 1e-310)))), Term("b", triangle(0, 0.5, 1))))
    engine = GridEngine(one_output(flat, 11))
    cuts = np.array([[1.0, 0.3], [0.7, 0.2]])
    expected = ScikitEngine(engine.system).centroid_of_many(0, cuts)
    assert engine.centroid_of_many(0, cuts) == pytest.approx(expected, abs=BAR)
    assert [engine.centroid(0, column) for column in cuts.T.tolist()] == pytest.approx(expected, abs=BAR)


def test_crisp_rows_give_exactly_zero_and_one():
    for points in (3, 10, 101):
        engine = GridEngine(prioritised(points=points))
        rows = list(itertools.product((0.0, 1.0), repeat=3))
        expected = [tuple(float(1.0 in row and k == row.index(1.0)) for k in range(3)) for row in rows]
        assert [engine.weights(row) for row in rows] == expected
        assert engine.weights_of_many(np.array(rows)).tolist() == [list(row) for row in expected]


def test_the_cost_does_not_grow_with_the_points():
    sizes = {
        points: [len(p.own) + len(p.foreign) for p in GridEngine(one_output(TIP, points))._pieces[0]]
        for points in (101, 1001, 100_001)
    }
    assert max(map(sum, sizes.values())) < 60
    assert len(sizes[100_001]) <= 12


def test_tiny_areas_are_floored_as_in_scikit_fuzzy():
    system = one_output(WEIGHT, 11)
    cuts = [0.0, 1e-17]
    theirs = ScikitEngine(system).centroid(0, cuts)
    assert theirs < 0.1
    assert GridEngine(system).centroid(0, cuts) == pytest.approx(theirs, abs=1e-15)
    assert GridEngine(system).centroid_of_many(0, np.array([cuts]).T)[0] == pytest.approx(theirs, abs=1e-15)


def test_a_jump_of_an_input_is_exact_and_of_an_output_a_slope_over_one_cell():
    x = Variable("x", (0, 1), (Term("step", Shape(((0.5, 0), (0.5, 1)))),))
    y = Output("y", (0, 1), (Term("half", Shape(((0.5, 0), (0.5, 1)))),))
    engine = GridEngine(System((x,), (y,), (Rule(x["step"], y["half"]),), normalization="none", points=11))
    # the triangle over (0.4, 0.5) and the rectangle over (0.5, 1)
    assert engine.centroids([0.5])[0] == pytest.approx((0.05 * (0.4 + 0.2 / 3) + 0.5 * 0.75) / 0.55)


def test_systems_unsupported_by_scikit_fuzzy_are_rejected_by_name():
    with pytest.raises(EngineError, match="'grid': implication is 'prod'"):
        GridEngine(System(TIPPING.inputs, TIPPING.outputs, TIPPING.rules, implication="prod"))
    with pytest.raises(EngineError, match="'thin' is 0 at all 11 points"):
        GridEngine(one_output(Output("y", (0, 1), (Term("thin", triangle(0.51, 0.55, 0.59)),)), 11))


def test_an_engine_can_be_sent_to_another_process():
    engine = GridEngine(mixed())
    assert pickle.loads(pickle.dumps(engine)).centroids([3.0, 4.0]) == engine.centroids([3.0, 4.0])
