"""The grid engine: sums over samples of an output's joined terms; see also test_quadrature, test_other_libraries."""

import numpy as np
import pytest

from fuzzy_arbiter import Arbiter, Output, System, Variable, curve, rising, triangle
from fuzzy_arbiter.errors import EngineError


def arbiter(points=11, defuzzifier="centroid", implication="min", **terms):
    """A rule for each term, whose strength is an input of its own."""
    inputs = [Variable(name, (0, 1), {"on": rising(0, 1)}) for name in terms]
    rules = [f"if {name} is on then y is {name}" for name in terms]
    output = Output("y", (0, 10), terms, defuzzifier=defuzzifier)
    return Arbiter(System(inputs, [output], rules, points=points, implication=implication), engine="grid")


@pytest.mark.parametrize(
    ("defuzzifier", "value"),
    [("centroid", (1 * 0.5 + 2 + 3 * 0.5) / 2), ("bisector", 2), ("mom", 2), ("som", 2), ("lom", 2)],
)
def test_value_is_that_of_the_samples(defuzzifier, value):
    assert arbiter(defuzzifier=defuzzifier, low=triangle(0, 2, 4))(low=1.0) == (value,)


def test_maxima_of_a_plateau():
    for defuzzifier, value in (("mom", 5), ("som", 4), ("lom", 6)):
        made = arbiter(defuzzifier=defuzzifier, a=triangle(2, 5, 8), b=triangle(0, 1, 2))
        assert made(a=0.5, b=0.25) == (value,)
        assert np.isnan(made(a=0.0, b=0.0)).all()


@pytest.mark.parametrize("defuzzifier", ["centroid", "bisector", "mom", "som", "lom"])
def test_no_height_is_no_value(defuzzifier):
    made = arbiter(defuzzifier=defuzzifier, implication="bounded_difference", a=curve("gaussian", 12, 2))
    assert np.isnan(made.batch([[0.25], [1.0]])).tolist() == [[True], [False]]


def test_batches_equal_single_samples_however_long():
    made = arbiter(5001, a=curve("gaussian", 3, 1), b=triangle(4, 8, 9))
    rows = np.random.default_rng(0).random((500, 2))
    assert made.batch(rows) == pytest.approx(np.array([made(row) for row in rows]), abs=1e-12)
    assert made.batch(np.empty((0, 2))).shape == (0, 1)


def test_universes_that_cannot_be_sampled_are_refused():
    with pytest.raises(EngineError, match="'thin' is 0 at all 11 points"):
        arbiter(thin=triangle(5.1, 5.5, 5.9))
    with pytest.raises(EngineError, match="1000000000 points are too many"):
        arbiter(1_000_000_000, thin=triangle(5.1, 5.5, 5.9))
