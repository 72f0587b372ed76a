"""Rates, bins and paired differences against numbers that are worked out otherwise."""

import itertools
import math

import numpy as np
import pytest

from cosim.campaigns.scene_rows import row_of
from cosim.campaigns.statistics import bins, median_difference, paired, rate
from cosim.campaigns.worst import worst_rows
from cosim.scene_run import Score
from tests.cosim.campaigns.scenes import results_of


@pytest.mark.parametrize(("k", "n"), [(0, 7), (3, 7), (200, 200), (1, 1)])
def test_the_interval_is_where_the_score_test_turns(k, n):
    found = rate(np.arange(n) < k)
    z = 1.959963984540054
    for end in (found["low"], found["high"]):
        assert abs(k / n - end) == pytest.approx(z * math.sqrt(end * (1.0 - end) / n), abs=1e-9)
    assert found["low"] <= found["share"] <= found["high"]
    assert rate(np.zeros(0, bool))["share"] is None


def test_bins_hold_every_row_once_and_about_as_many():
    rng = np.random.default_rng(1)
    for values in (
        rng.normal(size=500),
        rng.integers(0, 4, 500).astype(float),
        np.ones(3),
        rng.integers(0, 9, 50) * 1.0,
    ):
        parts = list(bins(values))
        assert np.array_equal(sum(part.rows.astype(int) for part in parts), np.ones(len(values)))
        assert all(one.high < other.low for one, other in itertools.pairwise(parts))
        assert all(part.low <= part.middle <= part.high for part in parts)
    assert [part.rows.sum() for part in bins(np.arange(600.0))] == [100] * 6
    assert [part.low for part in bins(np.array([2.0, 1.0, 2.0]))] == [1.0, 2.0]


def test_the_exact_test_counts_how_coins_fall():
    one, other = np.array([1, 1, 1, 1, 0, 1, 0], bool), np.array([0, 0, 0, 0, 1, 1, 0], bool)
    found = paired(one, other)
    assert (found["both"], found["only_one"], found["only_other"], found["neither"]) == (1, 4, 1, 1)
    as_uneven = sum(abs(sum(coins) - 2.5) >= 1.5 for coins in itertools.product((0, 1), repeat=5))
    assert found["p"] == pytest.approx(as_uneven / 32)
    assert paired(one, one)["p"] is None


def test_the_interval_of_a_median_holds_it_as_often_as_it_says():
    rng = np.random.default_rng(2)
    found = [median_difference(rng.exponential(size=25) - math.log(2.0)) for _ in range(300)]
    held = np.mean([of["low"] <= 0.0 <= of["high"] for of in found])
    assert 0.93 < held < 1.0
    assert median_difference(np.zeros(0))["median"] is None
    assert median_difference(np.array([1.0, 2.0]))["low"] is None  # too few for an interval


def test_the_worst_come_in_the_order_that_is_told(tmp_path):
    scores = {
        1: Score(True, 30.0, 0.2, 1.0, 1.0, 0.0, -1),
        2: Score(True, 50.0, 0.2, 1.0, 1.0, 0.0, -1),
        3: Score(False, math.inf, 0.3, 1.0, 1.0, 0.0, -1),
        4: Score(True, 5.0, -0.1, 1.0, 1.0, 0.0, -1),
        5: Score(False, math.inf, -0.4, 1.0, 1.0, 0.0, -1),
        6: Score(False, math.inf, 0.4, 1.0, 1.0, 0.0, 150),
        7: Score(False, math.inf, 0.1, 1.0, 1.0, 0.0, -1),
    }
    results = results_of(tmp_path / "r.parquet", [row_of(seed, s, 0.01) for seed, s in scores.items()])
    worst = worst_rows(results)
    assert [w.key for w in worst] == [5, 4, 6, 3, 7, 2, 1]
    assert [w.why for w in worst[:3]] == ["violated, 0.400 m deep", "violated, 0.100 m deep", "stopped at 1.50 s"]
    assert worst[3].why == "not reached" and worst[5].why == "reached at 50.00 s"
    assert worst_rows(results, 2) == worst[:2] and worst_rows(results, 0) == []
