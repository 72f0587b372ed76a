"""Range normalization expressed by the universe."""

from dataclasses import replace
from fractions import Fraction

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from fuzzy_arbiter import Arbiter, Output, System, Variable, falling, rising, trapezoid, triangle
from fuzzy_arbiter.criteria import prioritized
from fuzzy_arbiter.engines.exact import ExactEngine
from fuzzy_arbiter.errors import EngineError, UnsupportedError
from fuzzy_arbiter.formats import fold_normalization
from fuzzy_arbiter.formats.native import range_ends

EPS = np.finfo(float).eps
PAIRS = {
    "triangles": (falling(0, 1), rising(0, 1)),
    "trapezoids": (falling(0.3, 0.7), rising(0.3, 0.7)),
    "skew": (falling(0.2, 0.55), rising(0.37, 0.83)),
    "apart": (triangle(0, 0.1, 0.3), trapezoid(0.6, 0.7, 0.8, 1)),
}


def weight(pair, universe=(0.0, 1.0), default=None):
    return Output("w", universe, dict(zip(("low", "high"), PAIRS[pair], strict=True)), default)


def test_triangles_extend_one_width_beyond_both_ends_which_are_exact():
    output = fold_normalization(prioritized()).outputs[0]
    assert output.universe == (-1.0, 2.0)
    assert [term.shape for term in output.terms] == [falling(-1, 2), rising(-1, 2)]
    assert range_ends(weight("triangles")) == (Fraction(1, 3), Fraction(2, 3))


@pytest.mark.medium(fast=2)
@pytest.mark.parametrize("pair", PAIRS)
@given(st.lists(st.floats(0, 1), min_size=3, max_size=3))
def test_its_centroids_are_the_weights(pair, memberships):
    system = prioritized(weight=weight(pair))
    centroids = ExactEngine(fold_normalization(system)).weights(memberships)
    assert np.clip(centroids, 0, 1) == pytest.approx(ExactEngine(system).weights(memberships), abs=16 * EPS)


def test_a_default_is_mapped_and_held_within_the_range():
    for default, mapped in ((0.5, 0.5), (0.0, 0.0), (1.0, 1.0), (0.4, 0.2)):
        output = fold_normalization(prioritized(weight=weight("triangles", default=default))).outputs[0]
        assert output.default == pytest.approx(mapped, abs=EPS)


def test_system_without_normalization_is_unchanged():
    system = prioritized(normalization="none")
    assert fold_normalization(system) is system


NEAR = Output("w", (0, 1), {"low": falling(0, 1e-200), "high": falling(0, 2e-200)})
TWIN = Output("w", (0, 1), {"low": triangle(0, 0.5, 1), "high": trapezoid(0, 0.4, 0.6, 1)})
APART = {"low": falling(-2, -1), "high": rising(0, 1)}


def folded_range(output):
    made = System((Variable("x", (0, 1), {"on": rising(0, 1)}),), (output,), ("if x is on then y is high",))
    return replace(made, normalization="range")


@pytest.mark.parametrize(
    ("system", "fault"),
    [
        *((prioritized(normalization=n), f"no universe can say the normalization '{n}'") for n in ("sum", "max")),
        (prioritized(weight=TWIN), r"output 'w_1': its terms have one centroid, 0\.5"),
        (prioritized(weight=NEAR), "too far apart, or too close"),
        (
            folded_range(Output("y", (0, 1), {"high": rising(0, 1)}, defuzzifier="bisector")),
            "'y' has the defuzzifier bisector",
        ),
        (folded_range(Output("y", (0, 1), APART, defuzzifier="average")), "'y' has the defuzzifier average"),
    ],
)
def test_what_no_universe_can_fold_is_refused(system, fault):
    with pytest.raises(UnsupportedError, match=fault):
        fold_normalization(system)


def test_locks_survive_folding():
    made = prioritized()
    locked = replace(made, outputs=tuple(replace(v, lock_range=True, lock_previous=True) for v in made.outputs))
    assert all(v.lock_range and v.lock_previous for v in fold_normalization(locked).outputs)


def test_an_output_without_rules_has_no_range():
    y, z = (Output(name, (0, 1), {"high": rising(0, 1)}, aggregation="probor") for name in "yz")
    made = System((Variable("x", (0, 1), {"on": rising(0, 1)}),), (y, z), ("if x is on then y is high",))
    with pytest.raises(EngineError, match="output 'z': no rule concludes on it"):
        Arbiter(replace(made, outputs=(z, y), normalization="range"))
