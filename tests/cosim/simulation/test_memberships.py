"""Memberships of criteria against the same in NumPy, and against the terms themselves."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from controller.regions import Orientation, Region, Sphere
from cosim.scenario.criteria import PAPER, check_criteria
from cosim.scenario.tables import CriterionEntry, SecondaryRegion
from cosim.simulation.memberships import compute_memberships, pack_memberships
from fuzzy_arbiter import Shape

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
def test_a_criterion_asks_as_its_most_pressing_region_does(clearances, criteria, width):
    found = memberships_of(clearances, [NAMES[i] for i in criteria], width)
    for criterion, membership in enumerate(found):
        mine = clearances[(criteria == criterion) & ~np.isnan(clearances)]
        expected = np.clip(1.0 - mine / width, 0.0, 1.0).max(initial=0.0)
        assert membership == pytest.approx(expected, abs=1e-15)


def test_a_crisp_membership_is_one_up_to_the_surface():
    assert memberships_of([0.0, 1e-300, -1.0], NAMES, 0.0).tolist() == [1.0, 0.0, 1.0]


def test_without_regions_nothing_asks():
    assert not memberships_of([], [], 0.2).any()


POINTS = st.lists(st.floats(-3.0, 3.0), min_size=2, max_size=6, unique=True).map(sorted)


@given(POINTS, st.data())
def test_a_term_over_clearance_or_time_is_the_term_itself(places, data):
    degrees = data.draw(st.lists(st.floats(0.0, 1.0), min_size=len(places), max_size=len(places)))
    if len(set(degrees)) == 1 or min(np.diff(places)) < 1e-9:
        return
    points = [list(point) for point in zip(places, degrees, strict=True)]
    _, setups = check_criteria(
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


def test_the_strongest_reason_counts_each_of_regions_in_its_unit():
    membership = {
        "clearance": {"falling": [0.0, 1.0]},
        "angle": {"falling": [0.0, 0.1]},
        "approach_time": {"falling": [2.0, 4.0]},
    }
    _, setups = check_criteria((CriterionEntry("view", membership=membership),))
    assert memberships_of([0.5], ["view"], 0.2, setups, [9.0]).tolist() == [0.5]
    assert memberships_of([0.5], ["view"], 0.2, setups, [2.5]).tolist() == [0.75]
    level = Orientation((1.0, 0.0, 0.0, 0.0), 0.1)
    assert memberships_of([0.5], ["view"], 0.2, setups, [np.inf], shape=level).tolist() == [0.0]
    assert memberships_of([0.05], ["view"], 0.2, setups, [np.inf], shape=level).tolist() == [0.5]


def test_criteria_without_a_reason_follow_the_ramp_of_the_arbiter_and_others_do_not():
    _, setups = check_criteria((CriterionEntry("a"), CriterionEntry("b", membership={"ramp": 0.4})))
    assert memberships_of([0.1, 0.1], ["a", "b"], 0.2, setups).tolist() == [0.5, 0.75]
    assert pack_memberships(regions(["a", "b"]), setups, 0.2).follows.tolist() == [True, False]
