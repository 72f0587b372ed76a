"""Hysteresis: latches by hand, scans against calls, and chatter removal."""

import copy
import math
import pickle
import runpy
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

import fuzzy_arbiter
from fuzzy_arbiter import Arbiter, Output, Shape, System, Variable, falling, propositions, rising
from fuzzy_arbiter.criteria import Criterion
from fuzzy_arbiter.errors import DefinitionError, InputError
from fuzzy_arbiter.hysteresis import HysteresisArbiter

EXAMPLE = Path(__file__).parents[2] / "examples" / "chatter.py"


def steady(**settings):
    return HysteresisArbiter(Arbiter(), **{"enter": 0.8, "release": 0.2, **settings})


@pytest.mark.parametrize(
    ("dwell", "degrees", "weights"),
    [
        (0.0, [0, 0.79, 0.8, 0.5, 0.21, 0.2, 0.5, 0.79, 1, 0], [0, 0, 1, 1, 1, 0, 0, 0, 1, 0]),
        # closed at 0.125, it may open 0.375 later, at 0.5
        (0.375, [0, 1, 0, 0, 0, 0, 1, 0], [0, 1, 1, 1, 0, 0, 1, 1]),
        # a degree that stays between the thresholds never opens it
        (0.25, [1, 0.5, 0.5, 0.5, 0.2], [1, 1, 1, 1, 0]),
    ],
)
def test_latch_closes_at_enter_and_opens_at_release_after_the_dwell(dwell, degrees, weights):
    h = steady(dwell=dwell)
    assert [h([degree, 0.0, 0.0], i * 0.125)[0] for i, degree in enumerate(degrees)] == weights


def test_graded_mode_uses_the_degree_until_the_latch_sets():
    h = steady(graded=True)
    for i, (degree, counted) in enumerate([(0.5, 0.5), (0.8, 1.0), (0.3, 1.0), (0.2, 0.2)]):
        assert h([degree, 0.25, 0.0], i) == Arbiter()([counted, 0.25, 0.0])


def test_thresholds_can_differ_by_criterion():
    names = ("obstacle", "shape", "depth")
    h = HysteresisArbiter(
        Arbiter(), enter={"obstacle": 0.5, "shape": 0.9, "depth": 1}, release=dict.fromkeys(names, 0.25), dwell=0.0
    )
    h({"obstacle": 0.5, "shape": 0.8, "depth": 0.99}, 0.0)
    assert h.active == {"obstacle": True, "shape": False, "depth": False}
    h({"obstacle": 0.25, "shape": 0.9, "depth": 1.0}, 1.0)
    assert h.active == {"obstacle": False, "shape": True, "depth": True}
    h.reset()
    assert h.active == dict.fromkeys(names, False)
    assert h([0, 0, 0], -5.0) == (0, 0, 0)  # the time begins anew


def test_criteria_with_memberships_accept_measured_values():
    near = Criterion("near", on="yes", off="no", membership=falling(1.0, 2.0))  # m
    deep = Criterion("deep", on="yes", off="no", membership=rising(10.0, 12.0))
    h = HysteresisArbiter(Arbiter([near, deep], outside="clip"), enter=1.0, release=0.0)
    assert h([5.0, 0.0], 0) == (0, 0)
    assert h([0.5, 0.0], 1) == (1, 0)
    assert h([1.9, 20.0], 2) == (1, 0)
    assert h([2.0, 11.0], 3) == (0, 1)
    assert h.active == {"near": False, "deep": True}


@pytest.mark.parametrize("form", ["hierarchical", "minimal", "conjunctive", "complete"])
def test_active_terms_are_derived_from_the_rules(form):
    criteria = [Criterion("a", on="z", off="b"), Criterion("b", on="c", off="d"), Criterion("c")]
    h = HysteresisArbiter(Arbiter(criteria, form=form), enter=1, release=0)
    assert "on={'a': 'z', 'b': 'c', 'c': 'on'}" in repr(h)


CROSSED = (falling(0, 1), rising(0, 1))


def plain(rules, shapes=CROSSED):
    x = Variable("x", (0, 1), dict(zip(("off", "on", "more"), shapes, strict=False)))
    y = Output("y", (0, 1), {"low": falling(0, 1), "high": rising(0, 1)})
    return Arbiter(System((x,), (y,), rules, normalization="range"))


def test_terms_can_be_given_explicitly_where_rules_do_not_determine_them():
    arbiter = plain(("if x is on or x is off then y is high",))
    with pytest.raises(DefinitionError, match="on: the rules do not determine"):
        HysteresisArbiter(arbiter, enter=1, release=0)
    assert HysteresisArbiter(arbiter, enter=1, release=0, on={"x": "off"})([0.0], 0) == (1,)


@pytest.mark.medium
@given(
    st.lists(st.tuples(*[st.sampled_from([0, 0.1, 0.2, 0.5, 0.8, 0.9, 1])] * 3, st.floats(0, 0.2)), max_size=40),
    st.integers(0, 40),
    st.sampled_from([0.0, 0.1, 0.3]),
    st.booleans(),
)
def test_scan_equals_successive_calls(rows, cut, dwell, graded):
    one, other = (steady(dwell=dwell, graded=graded) for _ in range(2))
    inputs = np.array([row[:3] for row in rows], dtype=float).reshape(-1, 3)
    times = np.cumsum([row[3] for row in rows])
    calls = np.array([one(x, t) for x, t in zip(inputs, times, strict=True)]).reshape(-1, 3)
    parts = [other.scan(inputs[:cut], times[:cut]), other.scan(inputs[cut:], times[cut:])]  # the state goes on
    np.testing.assert_allclose(np.vstack(parts), calls, atol=1e-15, rtol=0)
    assert one.active == other.active


@given(st.lists(st.floats(0, 1), min_size=1, max_size=60), st.sampled_from([(0.8, 0.2), (1.0, 0.0), (0.5, 0.4)]))
def test_noise_within_the_band_changes_nothing(noise, band):
    enter, release = band
    h = HysteresisArbiter(Arbiter(), enter=enter, release=release)
    h([enter, 0, 0], 0.0)
    kept = [release + (enter - release) * max(x, 1e-3) for x in noise]
    weights = {h([min(x, 1.0), 0, 0], 1.0 + i) for i, x in enumerate(kept)}
    assert weights == {(1, 0, 0)}


def test_copies_have_independent_state():
    h = steady()
    h([1, 0, 0], 0)
    for twin in (copy.deepcopy(h), pickle.loads(pickle.dumps(h))):
        assert twin([0.5, 0, 0], 1) == copy.deepcopy(h)([0.5, 0, 0], 1)
        assert twin.active == h.active
        twin.reset()
        assert h.active["obstacle"]


@pytest.mark.parametrize(
    ("ask", "match"),
    [
        (lambda h: h([math.nan, 0, 0], 2), "obstacle: input is nan"),
        (lambda h: h([0, 0], 2), "inputs: got 2, expected 3"),
        (lambda h: h({"obstacle": 0}, 2), "shape: input is missing"),
        (lambda h: h([0, 0, 0], 0.5), "time is 0.5 after 1"),
        (lambda h: h([0, 0, 0], math.nan), "time is nan"),
        (lambda h: h([0, 0, 0], "2"), "time is '2'"),
        (lambda h: h.scan([[0, 0, 0], [math.nan, 0, 0]], [2, 3]), "row 1: obstacle"),
        (lambda h: h.scan([[0, 0]], [2]), "shape"),
        (lambda h: h.scan([[0, 0, 0]], [2, 3]), r"times have the shape \(2,\), expected \(1,\)"),
        (lambda h: h.scan([[0, 0, 0]] * 2, [2, 1.5]), "row 1: time is 1.5 after 2"),
        (lambda h: h.scan([[0, 0, 0]], [0.5]), "row 0: time is 0.5 after 1"),
        (lambda h: h.scan([[0, 0, 0]], [math.nan]), "row 0: time is nan"),
        (lambda h: h.scan([[0, 0, 0]], ["x"]), "times: "),
        (lambda h: h.batch([[0, 0, 0]]), "batch: .*scan"),
    ],
)
def test_invalid_samples_leave_the_state_unchanged(ask, match):
    h = steady()
    h([1, 0, 0], 1)
    with pytest.raises(InputError, match=match):
        ask(h)
    assert h.active == {"obstacle": True, "shape": False, "depth": False}
    assert h([0.5, 0, 0], 1) == (1, 0, 0)  # the same time may come again


def test_an_output_without_a_firing_rule_is_nan():
    h = HysteresisArbiter(plain(("if x is off then y is low",)), enter=0.5, release=0, on={"x": "on"})
    assert np.isnan(h([1.0], 0.0)).tolist() == np.isnan(h.scan([[1.0]], [0.0])[0]).tolist() == [True]
    assert h.active == {"x": True}


@pytest.mark.parametrize(
    ("settings", "match"),
    [
        ({"enter": 0.0}, r"enter: got 0.0, expected a number in \(0, 1\]"),
        ({"enter": math.nan}, "enter: got nan"),
        ({"release": -0.1}, r"release: got -0.1, expected a number in \[0, 1\)"),
        ({"release": 0.8}, "release: got 0.8 for 'obstacle', expected less than enter, 0.8"),
        ({"enter": {"obstacle": 0.9, "shape": 0.9, "depth": 0.1}}, "release: got 0.2 for 'depth'"),
        ({"dwell": -1}, "dwell: got -1, expected seconds, at least 0"),
        ({"enter": {"obstacle": 0.9}}, "enter: got nothing for 'shape', expected obstacle, shape, depth"),
        ({"dwell": {"wind": 1}}, "dwell: 'wind' is no input"),
        ({"dwell": {"obstacle": 1, "shape": 1, "depth": "long"}}, "dwell: got 'long' for 'depth'"),
        ({"graded": 1}, "graded is 1, expected True or False"),
        ({"on": "exist"}, "on is 'exist', expected a term for each of obstacle, shape, depth"),
        ({"on": {"obstacle": "exist", "shape": "round", "depth": "maintain"}}, "on: got 'round' for 'shape'"),
    ],
)  # fmt: skip
def test_invalid_settings_are_rejected(settings, match):
    with pytest.raises(DefinitionError, match=match):
        steady(**settings)


@pytest.mark.parametrize(
    ("shapes", "match"),
    [
        ((falling(0, 0.5), rising(0.5, 1)), "input 'x': its terms are no criterion"),
        ((falling(0, 0.5), Shape(((0, 0), (0.5, 1), (1, 0))), rising(0.5, 1)), "input 'x': its terms are no criterion"),
        ((Shape(((0, 1), (1, 0.25))), Shape(((0, 0), (1, 0.75)))), "input 'x': it is fully on nowhere"),
        ((Shape(((0, 0.75), (1, 0))), Shape(((0, 0.25), (1, 1)))), "input 'x': it is fully off nowhere"),
    ],
)
def test_systems_without_criteria_are_rejected(shapes, match):
    with pytest.raises(DefinitionError, match=match):
        HysteresisArbiter(plain(("if x is on then y is high", "if x is off then y is low"), shapes), 0.5, 0)
    with pytest.raises(DefinitionError, match="expected an Arbiter"):
        HysteresisArbiter(3, enter=1, release=0)


def test_repr_round_trips():
    h = steady(dwell=0.5, graded=True)
    names = {name: getattr(fuzzy_arbiter, name) for name in fuzzy_arbiter.__all__} | vars(fuzzy_arbiter.criteria)
    assert repr(eval(repr(h), {**names, **vars(propositions)})) == repr(h)


def test_hysteresis_removes_chatter():
    rows = runpy.run_path(str(EXAMPLE), run_name="chatter")["table"]()
    noisy = {name: whole for name, whole, _, _ in rows}
    crisp, narrow, wide, outside, latched, eased, held = noisy.values()
    assert crisp > 2 * narrow > 4 * wide > 8 * outside / 2 > 8 * eased
    assert crisp > 20 * held > 20 * latched
    assert latched == 4.0  # the two changes that there are
    assert [switches for *_, switches, _ in rows][4] == 2
    assert all(quiet <= 4.0 for *_, quiet in rows)


def test_without_a_dwell_no_time_is_needed():
    rows = [[m, 0.0, 0.0] for m in (0.7, 0.9, 0.3, 0.1, 0.9, 0.1)]
    timed, untimed, waiting = steady(), steady(), steady(dwell=1.0)
    expected = [timed(row, float(i)) for i, row in enumerate(rows)]
    assert [untimed(row) for row in rows] == expected
    assert untimed(rows[1], -5.0) == expected[1]  # the first time that is given
    untimed.reset()
    assert list(map(tuple, untimed.scan(rows))) == expected
    with pytest.raises(InputError, match="time is missing"):
        waiting(rows[0])
    with pytest.raises(InputError, match="times are missing"):
        waiting.scan(rows)
