"""Curves against the formulas of their manuals, computed here."""

import math
import pickle
from collections import deque

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.integrate import quad
from scipy.special import expit
from scipy.stats import norm

from fuzzy_arbiter import rising
from fuzzy_arbiter.errors import DefinitionError
from fuzzy_arbiter.terms.curves import Curve, curve
from fuzzy_arbiter.terms.kinds import KINDS
from fuzzy_arbiter.terms.values import Formula


def rises(x, a, b):
    """MATLAB's smf."""
    if x <= a:
        return 0.0
    if x >= b:
        return 1.0
    share = (x - a) / (b - a)
    return 2 * share**2 if share <= 0.5 else 1 - 2 * (1 - share) ** 2


def bump(x, mean, deviation):
    return norm.pdf(x, mean, deviation) / norm.pdf(mean, mean, deviation)


# kind, parameters, and the manual's formula: MATLAB's where it has one, else fuzzylite's
MANUALS = [
    ("gaussian", (3.0, 0.7), lambda x: bump(x, 3.0, 0.7)),
    ("gaussian2", (3.0, 0.5, 5.0, 1.5),
     lambda x: bump(x, 3.0, 0.5) if x < 3 else bump(x, 5.0, 1.5) if x > 5 else 1.0),
    ("gaussian2", (5.0, 1.5, 3.0, 0.5),
     lambda x: (bump(x, 5.0, 1.5) if x < 5 else 1.0) * (bump(x, 3.0, 0.5) if x > 3 else 1.0)),
    ("bell", (4.0, 1.5, 2.5), lambda x: 1 / (1 + (abs(x - 4.0) / 1.5) ** 5)),
    ("sigmoid", (4.0, -3.0), lambda x: expit(-3.0 * (x - 4.0))),
    ("sigmoid_difference", (2.0, 4.0, 5.0, 7.0), lambda x: abs(expit(4 * (x - 2)) - expit(5 * (x - 7)))),
    ("sigmoid_product", (2.0, 4.0, -5.0, 7.0), lambda x: expit(4 * (x - 2)) * expit(-5 * (x - 7))),
    ("z_shape", (2.0, 6.0), lambda x: 1 - rises(x, 2.0, 6.0)),
    ("s_shape", (2.0, 6.0), lambda x: rises(x, 2.0, 6.0)),
    ("pi_shape", (1.0, 3.0, 5.0, 9.0), lambda x: rises(x, 1.0, 3.0) * (1 - rises(x, 5.0, 9.0))),
    ("pi_shape", (1.0, 6.0, 3.0, 9.0), lambda x: rises(x, 1.0, 6.0) * (1 - rises(x, 3.0, 9.0))),
    ("cosine", (4.0, 5.0), lambda x: math.cos(math.pi * (x - 4) / 5) ** 2 if abs(x - 4) < 2.5 else 0.0),
    ("spike", (4.0, 5.0), lambda x: math.exp(-2 * abs(x - 4))),
    ("concave", (2.0, 6.0), lambda x: 4 / (10 - x) if x < 6 else 1.0),
    ("concave", (6.0, 2.0), lambda x: 4 / (2 + x) if x > 2 else 1.0),
    ("arc", (2.0, 6.0), lambda x: 0.0 if x < 2 else math.sin(math.acos((6 - x) / 4)) if x < 6 else 1.0),
    ("arc", (6.0, 2.0), lambda x: 1.0 if x < 2 else math.sin(math.acos((x - 2) / 4)) if x < 6 else 0.0),
    ("semi_ellipse", (2.0, 6.0), lambda x: math.sin(math.acos((x - 4) / 2)) if 2 < x < 6 else 0.0),
    ("singleton", (4.0,), lambda x: float(x == 4)),
]  # fmt: skip


@pytest.mark.medium(fast=2)
@pytest.mark.parametrize(("kind", "parameters", "formula"), MANUALS)
def test_curve_values_match_the_manual(kind, parameters, formula):
    made = curve(kind, *parameters)
    places = np.linspace(0.0, 10.0, 4001)
    expected = [formula(x) for x in places.tolist()]
    assert [made(x) for x in places.tolist()] == pytest.approx(expected, abs=3e-8 if "arc" in kind else 1e-14)
    assert made.of_many(places) == pytest.approx([made(x) for x in places.tolist()], abs=1e-15)
    half = curve(kind, *parameters, height=0.5)
    assert half.of_many(places) == pytest.approx(made.of_many(places) / 2, abs=1e-15)
    # smooth between its breaks, so that an independent quadrature told of them finds the same area
    area = quad(formula, 0.0, 10.0, points=[*made.breaks((0.0, 10.0))] or None, epsabs=1e-12, limit=400)[0]
    assert made.area((0.0, 10.0)) == pytest.approx(area, abs=2e-3 if kind in ("arc", "semi_ellipse") else 1e-9)


@pytest.mark.medium(fast=6)
@pytest.mark.parametrize("kind", [kind for kind, face in KINDS.items() if face.inverse])
@pytest.mark.parametrize("parameters", [(1.0, 3.0), (3.0, 1.0)])
@given(share=st.floats(0.05, 0.999))
def test_inverse_returns_a_position_of_the_degree(kind, parameters, share):
    if kind in ("s_shape", "z_shape") and parameters[0] > parameters[1]:
        return
    made = curve(kind, *parameters, height=0.8)
    assert made(made.place_of(0.8 * share)) == pytest.approx(0.8 * share, abs=1e-7)


@pytest.mark.parametrize(
    ("kind", "parameters", "fault"),
    [
        ("gauss", (0, 1), "curve is 'gauss', expected one of gaussian, gaussian2"),
        ("gaussian", (0,), r"gaussian of mean, deviation: got \(0,\), expected 2 finite numbers"),
        ("gaussian", (0, math.inf), "expected 2 finite numbers"),
        ("gaussian", ("0", 1), "expected 2 finite numbers"),
        ("gaussian", (0, 0), "expected a deviation other than 0"),
        ("bell", (0, 0, 1), "expected a width other than 0"),
        ("s_shape", (2, 1), "expected a start that is not above the end"),
        ("pi_shape", (2, 1, 3, 4), "expected each foot on the outer side of its top"),
        ("cosine", (2, -1), "expected a width above 0"),
        ("arc", (2, 2), "expected two positions"),
    ],
)
def test_invalid_curve_parameters_are_rejected(kind, parameters, fault):
    with pytest.raises(DefinitionError, match=fault):
        curve(kind, *parameters)
    for height in (0, -1, 1.5, math.nan, "1"):
        with pytest.raises(DefinitionError, match="height is"):
            curve("gaussian", 0, 1, height=height)


def test_extreme_inputs_are_in_range_and_nan_stays_nan():
    assert {kind for kind, _, _ in MANUALS} == set(KINDS)
    for kind, parameters, _ in MANUALS:
        made = curve(kind, *parameters)
        places = [-1e308, -1e200, 1e200, 1e308, math.nan]
        degrees = [made(x) for x in places]
        assert all(0.0 <= degree <= 1.0 for degree in degrees[:4]) and math.isnan(degrees[4]), kind
        assert made.of_many(np.array(places)) == pytest.approx(degrees, nan_ok=True), kind


def test_step_takes_the_greater_degree_at_its_jump():
    step = curve("s_shape", 4.0, 4.0)
    assert (step(3.999), step(4.0), step(4.001)) == (0.0, 1.0, 1.0)
    assert step.of_many(np.array([4.0]))[0] == 1.0
    for term in (step, rising(3.0, 5.0), Formula("x / 8")):  # any sequence, such as a column of a data frame
        assert term(deque([3.5, 4.0])).tolist() == [term(3.5), term(4.0)]
    assert step.jumps and not curve("s_shape", 3.0, 4.0).jumps


def test_curves_are_values():
    made = Curve("gaussian", (3, 1))
    assert pickle.loads(pickle.dumps(made)) == made == eval(repr(made))
    assert hash(made) == hash(Curve("gaussian", (3.0, 1.0)))
    assert made != Curve("gaussian", (3.0, 1.0), 0.5)
