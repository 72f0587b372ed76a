"""Norms and hedges, against their definitions in rational numbers and the laws that make them norms."""

import itertools
from fractions import Fraction
from math import sqrt

import numpy as np
import pytest
from hypothesis import assume, given
from hypothesis import strategies as st

from fuzzy_arbiter.terms.norms import AGGREGATIONS, HEDGES, S_NORMS, T_NORMS

# Klement, Mesiar, Pap: Triangular Norms, 2000; and fuzzylite's manual for the normalized sum
DEFINED = {
    "min": min,
    "prod": lambda a, b: a * b,
    "bounded_difference": lambda a, b: max(0, a + b - 1),
    "drastic_product": lambda a, b: min(a, b) if max(a, b) == 1 else 0,
    "einstein_product": lambda a, b: a * b / (1 + (1 - a) * (1 - b)),
    "hamacher_product": lambda a, b: 0 if a == b == 0 else a * b / (a + b - a * b),
    "nilpotent_minimum": lambda a, b: min(a, b) if a + b > 1 else 0,
    "max": max,
    "probor": lambda a, b: 1 - (1 - a) * (1 - b),
    "bounded_sum": lambda a, b: min(1, a + b),
    "drastic_sum": lambda a, b: max(a, b) if min(a, b) == 0 else 1,
    "einstein_sum": lambda a, b: (a + b) / (1 + a * b),
    "hamacher_sum": lambda a, b: 1 if a == b == 1 else (a + b - 2 * a * b) / (1 - a * b),
    "nilpotent_maximum": lambda a, b: max(a, b) if a + b < 1 else 1,
    "normalized_sum": lambda a, b: (a + b) / max(1, a + b),
    "sum": lambda a, b: a + b,
}
GRID = [Fraction(i, 16) for i in range(17)]
NORMS = {**T_NORMS, **AGGREGATIONS}


@pytest.mark.parametrize("name", NORMS)
def test_a_norm_is_as_defined_for_numbers_and_arrays(name):
    pairs = list(itertools.product(GRID, GRID))
    expected = [float(DEFINED[name](a, b)) for a, b in pairs]
    a, b = np.array(pairs, dtype=float).T
    assert [NORMS[name].number(*map(float, pair)) for pair in pairs] == pytest.approx(expected, abs=1e-15)
    assert NORMS[name].array(a, b) == pytest.approx(expected, abs=1e-15)


# of which each operation is monotone as it is rounded, and so are they; others may fall by a few units of rounding
MONOTONE = {*T_NORMS, "max", "bounded_sum", "drastic_sum", "nilpotent_maximum", "normalized_sum"}
ROUNDING = 2.0**-51
# and next to 1 and 1/2, where rounding shows
degrees = (
    st.floats(0, 1)
    | st.builds(lambda x, k: min(x + k * 2.0**-53, 1.0), st.sampled_from([0.25, 0.5, 1.0]), st.integers(-40, 40))
    | st.floats(-20, 0).map(lambda power: 10.0**power)
    | st.floats(-17, 0).map(lambda power: 1.0 - 10.0**power)
)


@pytest.mark.medium(fast=10)
@pytest.mark.parametrize("name", {**T_NORMS, **S_NORMS})
@given(degrees, degrees, degrees)
def test_norm_axioms_hold(name, a, b, c):
    of = NORMS[name].number
    assert of(a, b) == of(b, a)  # to the last bit
    assert 0.0 <= of(a, b) <= 1.0
    assert of(a, 1.0 if name in T_NORMS else 0.0) == pytest.approx(a, abs=1e-15)
    low, high = sorted((b, c))
    assert of(a, low) <= of(a, high) + (0.0 if name in MONOTONE else ROUNDING)


@pytest.mark.parametrize("name", {**T_NORMS, **S_NORMS})
@given(degrees, degrees)
def test_it_is_as_defined_in_rational_numbers_to_rounding(name, a, b):
    if "nilpotent" in name:
        assume(Fraction(a + b) == Fraction(a) + Fraction(b) or a + b != 1.0)  # else rounding decides on the jump
    exact = DEFINED[name](Fraction(a), Fraction(b))
    for found in (NORMS[name].number(a, b), float(NORMS[name].array(np.array([a]), np.array([b]))[0])):
        assert abs(Fraction(found) - exact) <= Fraction(ROUNDING)


HEDGED = {
    "very": lambda a: a**2,
    "somewhat": sqrt,
    "extremely": lambda a: 2 * a**2 if a <= 0.5 else 1 - 2 * (1 - a) ** 2,
    "cubed": lambda a: a**3,
    "cube_root": lambda a: a ** (1 / 3),
    "seldom": lambda a: sqrt(a / 2) if a <= 0.5 else 1 - sqrt((1 - a) / 2),
}


@pytest.mark.parametrize("hedge", HEDGES)
def test_a_hedge_is_as_defined(hedge):
    degrees = np.linspace(0.0, 1.0, 101)
    expected = [HEDGED[hedge](a) for a in degrees.tolist()]
    assert [HEDGES[hedge].number(a) for a in degrees.tolist()] == pytest.approx(expected, abs=1e-15)
    assert HEDGES[hedge].array(degrees) == pytest.approx(expected, abs=1e-15)
