"""Portable arithmetic against series of fifty digits."""

import math
from decimal import Decimal, localcontext

import pytest
from hypothesis import example, given
from hypothesis import strategies as st

from controller import arithmetic

EPSILON = 2.0**-52


def exact_cosine(x):
    """Return cos x by Taylor's series."""
    square, term, total, n = Decimal(x) ** 2, Decimal(1), Decimal(1), 0
    while abs(term) > Decimal("1e-45"):
        n += 2
        term *= -square / (n * (n - 1))
        total += term
    return total


def exact_arctangent(t):
    """Return atan t by Euler's series, of an angle halved twice."""
    t = Decimal(t)
    for _ in range(2):
        t = t / (1 + (1 + t * t).sqrt())
    total, term, n = Decimal(0), t / (1 + t * t), 0
    while abs(term) > Decimal("1e-45"):
        total += term
        n += 1
        term *= Decimal(2 * n) / (2 * n + 1) * t * t / (1 + t * t)
    return 4 * total


@given(st.floats(-20.0, 20.0))
@example(math.pi / 2.0)
@example(3.0 * math.pi / 4.0)
@example(0.0)
def test_cosine_matches_reference(x):
    with localcontext(prec=60):
        assert abs(Decimal(arithmetic.cosine(x)) - exact_cosine(x)) < 2e-16


def test_cosine_of_large_angles_matches_reference():
    for x in (1e4, -99_999.5, 123_456.789):
        assert arithmetic.cosine(x) == pytest.approx(math.cos(x), abs=3e-16)


@given(st.floats(-700.0, 700.0))
@example(0.0)
@example(-6.0 * math.log(10.0))
def test_exponential_matches_reference(x):
    with localcontext(prec=60):
        exact = Decimal(x).exp()
        assert abs(Decimal(arithmetic.exponential(x)) / exact - 1) < Decimal(2.0 * EPSILON)


@given(st.floats(1e-9, 1e9), st.floats(1e-9, 1e9))
@example(1.0, 1.0)
@example(0.125, 1.0)
@example(1.0, 0.125)
def test_arctangent_matches_reference(y, x):
    with localcontext(prec=60):
        exact = exact_arctangent(Decimal(y) / Decimal(x))
        assert abs(Decimal(arithmetic.arctangent(y, x)) / exact - 1) < Decimal(3.0 * EPSILON)


def test_arctangent_matches_c_in_all_quadrants_and_special_values():
    numbers = (-math.inf, -2.0, -1.0, -1e-300, 0.0, 1e-300, 0.5, 1.0, 3.0, math.inf)
    for y in numbers:
        for x in numbers:
            if y == 0.0 and x == 0.0:
                continue  # C tells zeros of either sign apart
            assert arithmetic.arctangent(y, x) == pytest.approx(math.atan2(y, x), rel=1e-15, abs=1e-300)
    assert arithmetic.arctangent(0.0, 0.0) == 0.0
    assert math.isnan(arithmetic.arctangent(math.nan, 1.0)) and math.isnan(arithmetic.arctangent(1.0, math.nan))


def test_lengths_and_rounding_are_exact():
    assert arithmetic.square(-3.0) == 9.0
    assert arithmetic.hypotenuse(3.0, -4.0) == 5.0
    assert arithmetic.length3(2.0, -3.0, 6.0) == 7.0
    assert [arithmetic.nearest_integer(x) for x in (-2.5, -1.2, 0.0, 0.4, 0.5, 7.6)] == [-3, -1, 0, 0, 1, 8]
