"""Designs against those of SciPy and NumPy."""

import itertools
import json
import warnings

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.stats import qmc

from cosim.campaigns.sweeps.design import KINDS, MAX_ROWS, Design, Vary, design_of, vary_from
from cosim.errors import RunError
from tests.refusals import refusals

TWO = vary_from(["a=-2:2", "b=1:1000:log"])
KEYS = (("a", 1), ("b", 2), ("c", -1))  # of pairs, with a factor for each


def all_rows(design):
    return np.arange(design.rows)


@pytest.mark.parametrize(
    ("kind", "reference"),
    [
        ("random", lambda rng: rng.random((64, 2))),
        ("sobol", lambda rng: qmc.Sobol(2, scramble=True, seed=rng).random(64)),
        ("lhs", lambda rng: qmc.LatinHypercube(2, seed=rng).random(64)),
    ],
)
def test_values_are_those_of_numpy_and_scipy(kind, reference):
    fractions = reference(np.random.default_rng(7))
    with warnings.catch_warnings():
        warnings.simplefilter("error")  # a number of rows that is no power of two draws none
        values = Design(TWO, kind, 50, 7).values(np.arange(50))
        whole = Design(TWO, kind, 64, 7).values(np.arange(64))
    assert whole[:, 0] == pytest.approx(4.0 * fractions[:, 0] - 2.0, rel=1e-12)
    assert np.log10(whole[:, 1]) == pytest.approx(3.0 * fractions[:, 1], rel=1e-9)
    assert kind == "lhs" or np.array_equal(values, whole[:50])


def test_a_grid_is_every_value_with_every_other():
    found = Design(vary_from(["a=-1:1:3", "b=1:100:3:log", "c=5,2"]), "grid")
    expected = np.array(list(itertools.product([-1.0, 0.0, 1.0], [1.0, 10.0, 100.0], [5.0, 2.0])))
    values = found.values(all_rows(found))
    assert values == pytest.approx(expected) and found.rows == 18
    assert set(values[:, 0]) == {-1.0, 0.0, 1.0} and values[:, 1].max() == 100.0 and values[:, 1].min() == 1.0


def test_lists_are_drawn_from_evenly():
    found = Design(vary_from(["a=1,2,4", "b=0:1"]), "lhs", 300, 1)
    assert np.unique(found.values(all_rows(found))[:, 0], return_counts=True)[1].tolist() == [100, 100, 100]


def design_of_kind(kind, rows, seed):
    """Return a design of a number of rows, a multiple of 15, that varies three keys."""
    match kind:
        case "grid":
            vary, samples = ["a=-2:2:5", "b=1:1000:3:log", f"c=1:9:{rows // 15}"], None
        case "paired":
            vary, samples = [f"{key}={','.join(str(i * factor) for i in range(rows))}" for key, factor in KEYS], None
        case _:
            vary, samples = ["a=-2:2", "b=1:9:log", "c=1,2,3"], rows
    return Design(vary_from(vary), kind, samples, seed)


@pytest.mark.parametrize("kind", KINDS)
@given(st.sets(st.integers(0, 59)), st.integers(0, 2**63 - 1))
def test_row_values_do_not_depend_on_other_requested_rows(kind, rows, seed):
    found = design_of_kind(kind, 60, seed)
    asked = np.array(sorted(rows), dtype=np.int64)
    assert np.array_equal(found.values(asked), found.values(all_rows(found))[asked])
    assert np.array_equal(found.seeds(asked), found.seeds(all_rows(found))[asked])


@pytest.mark.parametrize("kind", ["random", "sobol", "lhs"])
def test_values_stay_in_range_and_differ_between_seeds(kind):
    one, other = (Design(TWO, kind, 1000, seed) for seed in (1, 2))
    values = one.values(all_rows(one))
    assert np.all((values >= [-2.0, 1.0]) & (values <= [2.0, 1000.0]))
    assert not np.any(values == other.values(all_rows(other)))


@pytest.mark.medium
def test_row_seeds_are_unique_31_bit_integers():
    found = Design(TWO, "random", MAX_ROWS, 5)
    seeds = found.seeds(np.arange(1_000_000))
    assert len(np.unique(seeds)) == 1_000_000 and seeds.min() >= 0 and seeds.max() < 2**31
    last = found.seeds(np.array([MAX_ROWS - 1]))
    assert 0 <= last[0] < 2**31
    assert np.mean(seeds == Design(TWO, "random", MAX_ROWS, 6).seeds(np.arange(1_000_000))) < 1e-3


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        ("k=-1:2", Vary("k", -1.0, 2.0)),
        (" a.0.b = 1e-3 : 2 : 7 : log ", Vary("a.0.b", 1e-3, 2.0, 7, True)),
        ("k=1:2:log", Vary("k", 1.0, 2.0, None, True)),
        ("k=3", Vary("k", values=(3.0,))),
        ("k=3,-1,2", Vary("k", values=(3.0, -1.0, 2.0))),
    ],
)
def test_varied_keys_are_parsed(text, expected):
    assert repr(vary_from([text])) == repr((expected,))


@pytest.mark.parametrize(
    ("text", "words"),
    [*refusals("ranges"), ("=1:2", ["expected key=low:high"]), ("k=1:2 k=2:3", ["k varies twice"])],
)
def test_invalid_varied_keys_are_rejected(text, words):
    with pytest.raises(RunError) as refused:
        vary_from(text.split())
    assert all(word in str(refused.value) for word in words)


@pytest.mark.parametrize(
    ("vary", "kind", "samples", "seed", "words"),
    [
        (["a=1:2"], "grid", None, 0, "a: a grid needs to know how many points, expected a=1:2:N"),
        (["a=1:2:3"], "grid", 5, 0, "expected none given"),
        (["a=1:2"], "sobol", None, 0, "samples is missing"),
        (["a=1:2"], "random", 0, 0, "samples is 0"),
        (["a=1:2"], "random", -1, 0, "samples is -1"),
        (["a=1:2:4"], "lhs", 10, 0, "4 points are given"),
        (["a=1:2"], "square", 10, 0, "design is 'square', expected one of grid, random, sobol, lhs"),
        (["a=1:2"], "random", 10, -1, "seed is -1"),
        (["a=1:2"], "random", MAX_ROWS + 1, 0, "10000001 rows, expected up to 10000000"),
        (["a=1:2:4000", "b=1:2:4000"], "grid", None, 0, "16000000 rows"),
        ([], "random", 10, 0, "nothing varies"),
    ],
)
def test_invalid_designs_are_rejected(vary, kind, samples, seed, words):
    with pytest.raises(RunError, match=words):
        Design(vary_from(vary), kind, samples, seed)


@pytest.mark.parametrize("kind", KINDS)
def test_design_round_trips_through_the_plan(kind):
    design = design_of_kind(kind, 30, 4)
    again = design_of(json.loads(json.dumps(design.table())))
    assert again.rows == design.rows
    assert np.array_equal(again.values(all_rows(design)), design.values(all_rows(design)))


@pytest.mark.parametrize("table", [{}, {"vary": 3}, {"vary": {"a": {}}, "design": "lhs", "samples": 3, "seed": 1}])
def test_unreadable_design_is_rejected(table):
    with pytest.raises(RunError, match="cannot be read"):
        design_of(table)
