"""Rates, bins and paired differences against independently computed values."""

import itertools
import math

import numpy as np
import pytest
from scipy.stats import f as f_test
from scipy.stats import f_oneway

from cosim.campaigns.analysis.campaign_summary import worst_table
from cosim.campaigns.analysis.statistics import bins, count_pairs, effect, median_difference, rate
from cosim.campaigns.scenes.flyer import Score
from cosim.campaigns.scenes.scene_rows import row_of
from tests.cosim.campaigns.scene_data import results_of


@pytest.mark.parametrize(("k", "n"), [(0, 7), (3, 7), (200, 200), (1, 1)])
def test_interval_ends_where_the_score_test_rejects(k, n):
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
        assert all(values[one.rows].max() < values[other.rows].min() for one, other in itertools.pairwise(parts))
        assert all(part.median == np.median(values[part.rows]) for part in parts)
    assert [part.rows.sum() for part in bins(np.arange(600.0))] == [100] * 6
    assert [part.median for part in bins(np.array([2.0, 1.0, 2.0]))] == [1.0, 2.0]


def ishigami(x, a=7.0, b=0.1):
    """Return Ishigami's function of columns of even numbers from -pi to pi, and its first-order indices (1990)."""
    one, three = (1.0 + b * math.pi**4 / 5.0) ** 2 / 2.0, 8.0 * b**2 * math.pi**8 / 225.0
    total = one + a**2 / 8.0 + three
    y = np.sin(x[:, 0]) + a * np.sin(x[:, 1]) ** 2 + b * x[:, 2] ** 4 * np.sin(x[:, 0])
    return y, [one / total, a**2 / 8.0 / total, 0.0]


@pytest.mark.parametrize(("n", "times", "within"), [(100, 100, 0.04), (1000, 10, 0.02), (20_000, 1, 0.01)])
def test_effects_are_the_first_order_indices_of_ishigami(n, times, within):
    rng = np.random.default_rng(3)
    found, detected = [], []
    for _ in range(times):
        x = rng.uniform(-math.pi, math.pi, (n, 3))
        y, known = ishigami(x)
        effects = [effect(column, y) for column in x.T]
        found.append([each["share"] for each in effects])
        detected.append(effects[1]["share"] > effects[1]["floor"])  # of sin², which a rank correlation misses
    assert np.mean(found, axis=0) == pytest.approx(known, abs=within)
    assert np.mean(detected) > 0.97


@pytest.mark.medium(fast=1)
@pytest.mark.parametrize("values", [None, 4], ids=["range", "four values"])
@pytest.mark.parametrize(
    "draw",
    [
        lambda rng: rng.exponential(size=100) ** 2,
        lambda rng: (rng.random(100) < 0.05).astype(float),
        lambda rng: 1e9 + rng.random(100),
    ],
    ids=["skewed", "rare", "far from 0"],
)
def test_noise_exceeds_the_floor_at_the_stated_rate(draw, values):
    rng = np.random.default_rng(6)
    found = [effect(rng.uniform(size=100) if values is None else rng.integers(0, values, 100) * 1.0, draw(rng))
             for _ in range(500)]  # fmt: skip
    assert np.mean([of["share"] > of["floor"] for of in found if of]) < 0.03
    assert np.mean([of["share"] for of in found if of]) == pytest.approx(0.0, abs=0.01)


@pytest.mark.medium
def test_effect_floor_matches_analysis_of_variance():
    rng = np.random.default_rng(7)
    decided = []
    for _ in range(200):
        x = rng.integers(0, 5, 60).astype(float)
        y = 0.2 * x + rng.normal(size=60)
        found = effect(x, y)
        test = f_oneway(*(y[x == value] for value in range(5)))
        assert (found["share"] > found["floor"]) == (test.pvalue < 0.01)
        f = test.statistic
        assert found["share"] == pytest.approx(4 * (f - 1.0) / (4 * f + 55))  # Kelley (1935)
        decided.append(test.pvalue < 0.01)
    assert 0.1 < np.mean(decided) < 0.9, "both are asked"


def test_effect_share_is_the_adjusted_r_squared_of_binwise_lines():
    rng = np.random.default_rng(8)
    x, y = rng.uniform(size=(2, 100))
    of = np.argsort(np.argsort(x)) // 20
    fit = np.column_stack([(of == i) * power for i in range(5) for power in (np.ones(100), x)])
    rest = np.linalg.lstsq(fit, y)[1][0]
    found = effect(x, y)
    assert found["share"] == pytest.approx(1.0 - (rest / 90.0) / np.var(y, ddof=1))
    at_floor = (1.0 - found["floor"]) * 90.0 / 99.0  # of the variance is left by a fit that is at the floor
    assert f_test.sf((1.0 - at_floor) / 9.0 / (at_floor / 90.0), 9, 90) == pytest.approx(0.01)


def test_constant_or_few_samples_have_no_effect():
    x = np.linspace(0.0, 1.0, 50)
    assert effect(x, np.full(50, 0.1)) is None and effect(np.ones(50), x) is None
    assert effect(x[:15], x[:15]) is None and effect(x[:0], x[:0]) is None
    assert effect(x, 1e9 + x)["share"] == pytest.approx(1.0)


def test_exact_test_matches_the_binomial_distribution():
    one, other = np.array([1, 1, 1, 1, 0, 1, 0], bool), np.array([0, 0, 0, 0, 1, 1, 0], bool)
    found = count_pairs(one, other)
    assert (found["both"], found["only_one"], found["only_other"], found["neither"]) == (1, 4, 1, 1)
    as_uneven = sum(abs(sum(coins) - 2.5) >= 1.5 for coins in itertools.product((0, 1), repeat=5))
    assert found["p"] == pytest.approx(as_uneven / 32)
    assert count_pairs(one, one)["p"] is None


@pytest.mark.medium
def test_median_interval_has_its_stated_coverage():
    rng = np.random.default_rng(2)
    found = [median_difference(rng.exponential(size=25) - math.log(2.0)) for _ in range(300)]
    held = np.mean([of["low"] <= 0.0 <= of["high"] for of in found])
    assert 0.93 < held < 1.0
    assert median_difference(np.zeros(0))["median"] is None
    assert median_difference(np.array([1.0, 2.0]))["low"] is None  # too few for an interval


def test_worst_rows_are_ranked_in_the_documented_order(tmp_path):
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
    worst = worst_table(results, tmp_path)
    assert [w["row"] for w in worst] == [5, 4, 6, 3, 7, 2, 1]
    assert [w["why"] for w in worst[:3]] == ["violated, 0.400 m deep", "violated, 0.100 m deep", "stopped at 1.50 s"]
    assert worst[3]["why"] == "not reached" and worst[5]["why"] == "reached at 50.00 s"
    assert worst_table(results, tmp_path, 2) == worst[:2] and worst_table(results, tmp_path, 0) == []
