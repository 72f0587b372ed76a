"""Memberships of criteria against the same in NumPy."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from cosim.simulation.memberships import compute_memberships

lengths = st.floats(-2.0, 2.0) | st.sampled_from([np.nan, np.inf, -np.inf, 0.0, 0.2])


@given(arrays(np.float64, 5, elements=lengths), arrays(np.int64, 5, elements=st.integers(0, 2)), st.floats(1e-3, 1.0))
def test_a_criterion_asks_as_its_most_pressing_region_does(clearances, criteria, width):
    found = np.full(3, 7.0)
    compute_memberships(clearances, criteria, width, found)
    for criterion, membership in enumerate(found):
        mine = clearances[(criteria == criterion) & ~np.isnan(clearances)]
        expected = np.clip(1.0 - mine / width, 0.0, 1.0).max(initial=0.0)
        assert membership == pytest.approx(expected, abs=1e-15)


def test_a_crisp_membership_is_one_up_to_the_surface():
    found = np.empty(3)
    compute_memberships(np.array([0.0, 1e-300, -1.0]), np.arange(3), 0.0, found)
    assert found.tolist() == [1.0, 0.0, 1.0]


def test_without_regions_nothing_asks():
    found = np.ones(3)
    compute_memberships(np.empty(0), np.empty(0, np.int64), 0.2, found)
    assert not found.any()
