"""Dirt in samples: held values, bursts, gaps, what is out of order, and units that cannot be."""

import contextlib

import numpy as np
import pytest

from cosim.errors import ImportLogError
from cosim.logs.cleaning.topics import clean
from cosim.logs.resampling import TopicReader


def cleaned(contents, tmp_path, quantity, times, values):
    values = np.asarray(values, float).reshape(len(times), -1)
    source = contents.source(quantity, "it", values.shape[1])
    for part in np.array_split(np.arange(len(times)), 7):
        source.put_many(np.asarray(times)[part], values[part])
    topic = clean(source, lambda stamps, written: written, None, tmp_path)
    rows = np.fromfile(topic.path).reshape(-1, 1 + topic.size)
    assert len(rows) == topic.count
    return topic, rows


def test_held_values_count_once(contents, tmp_path):
    """A sensor of 10 Hz in a table of 100 Hz."""
    times = np.arange(0.0, 30.0, 0.01)
    values = np.sin(np.floor(times * 10.0 + 1e-6) / 10.0)
    topic, rows = cleaned(contents, tmp_path, "depth", times, values)
    assert topic.count == 300 and topic.held == 2700
    assert topic.rate == pytest.approx(10.0, rel=1e-3)
    np.testing.assert_allclose(rows[:, 1], np.sin(rows[:, 0]), atol=1e-9)


def test_constant_value_causes_no_gap(contents, tmp_path):
    """A held sensor that sees nothing new for five seconds has no gap there."""
    k = np.arange(3000)
    values = np.where((k // 10 > 100) & (k // 10 < 150), 1.0, np.sin(0.1 * (k // 10)))
    topic, _ = cleaned(contents, tmp_path, "depth", 0.01 * k, values)
    assert topic.gap_count == 0 and topic.held > 2000


@pytest.mark.parametrize("quantity", ["depth", "pulses"])
def test_changing_values_and_commands_are_all_kept(contents, tmp_path, quantity):
    rng = np.random.default_rng(0)
    values = rng.normal(size=500) if quantity == "depth" else np.repeat(rng.uniform(1100, 1900, 50), 10)
    topic, rows = cleaned(contents, tmp_path, quantity, np.arange(500) * 0.1, values)
    assert topic.count == 500 and topic.held == 0
    np.testing.assert_array_equal(rows[:, 1], values)


def test_bursts_are_spread_over_the_preceding_time(contents, tmp_path):
    """Samples of 50 Hz that a link lets through ten at once."""
    true = np.arange(0.02, 40.0, 0.02)
    came = np.ceil(true / 0.2 - 1e-9) * 0.2 + 1e-4 * (np.arange(len(true)) % 10)
    topic, rows = cleaned(contents, tmp_path, "dvl", came, np.column_stack([true, true, true]) * 0.1)
    assert topic.burst >= 0.85 * len(true)
    # where stamps are off by up to 0.18 s; of the last burst one sample is missing
    assert np.abs(rows[:, 0] - true)[:-9].max() < 0.003
    assert topic.rate == pytest.approx(50.0, rel=0.02)


def test_gaps_are_counted_and_contain_no_row(contents, tmp_path):
    times = np.arange(0.0, 60.0, 0.1)
    times = times[~((times > 10.05) & (times < 12.95)) & ~((times > 40.05) & (times < 41.0))]
    topic, _ = cleaned(contents, tmp_path, "position", times, np.column_stack([times, times, times]))
    assert topic.gap_count == 2
    np.testing.assert_allclose(topic.gaps, [(10.0, 13.0), (40.0, 41.0)], atol=1e-6)
    grid = np.arange(0.0, 60.0, 0.05)
    for read in ("interpolate", "hold"):
        with contextlib.closing(TopicReader(topic)) as reader:
            parts = [getattr(reader, read)(part) for part in np.array_split(grid, 13)]
        values = np.vstack([part if read == "interpolate" else part[0] for part in parts])[:, 0]
        known = np.isfinite(values)
        assert not known[(grid > 10.35) & (grid < 12.95)].any()
        assert known[(grid > 13.05) & (grid < 39.9)].all()
        np.testing.assert_allclose(values[known], grid[known], atol=0.31 if read == "hold" else 1e-9)


def test_unordered_and_non_finite_samples_are_dropped_and_counted(contents, tmp_path):
    times, values = 0.1 * np.arange(100.0), np.arange(100.0)
    times[50:52] = times[46:48]
    values[[3, 7]] = np.nan, np.inf
    topic, rows = cleaned(contents, tmp_path, "depth", times, values)
    assert (topic.late, topic.broken, topic.count) == (2, 2, 96)
    assert (np.diff(rows[:, 0]) > 0.0).all() and np.isfinite(rows).all()


@pytest.mark.parametrize(
    ("quantity", "value"), [("rates", 80.0), ("depth", 2e4), ("pulses", 1.5e6), ("sticks", 1000.0)]
)
def test_implausible_magnitude_is_reported_as_a_wrong_unit(contents, tmp_path, quantity, value):
    with pytest.raises(ImportLogError, match=rf"it: {quantity} reaches .* expected at most .* check its unit"):
        cleaned(contents, tmp_path, quantity, np.arange(9.0), np.full((9, 3), value))


def test_attitudes_are_interpolated_along_the_shorter_arc(contents, tmp_path):
    angle = np.arange(0.0, 20.0, 0.5)
    q = np.column_stack([np.cos(angle / 2), 0 * angle, 0 * angle, np.sin(angle / 2)])
    q[::2] *= -1.0  # the same attitudes
    topic, _ = cleaned(contents, tmp_path, "attitude", angle, q)
    grid = np.arange(0.0, 19.5, 0.1)
    with contextlib.closing(TopicReader(topic)) as reader:
        found = reader.interpolate(grid)
    np.testing.assert_allclose(np.linalg.norm(found, axis=1), 1.0)
    expected = np.column_stack([np.cos(grid / 2), np.sin(grid / 2)])
    assert np.abs(np.abs((found[:, [0, 3]] * expected).sum(axis=1)) - 1.0).max() < 1e-4


def test_fast_phase_is_not_a_burst(contents, tmp_path):
    """A link that is quick for a while, and slow for the rest."""
    times = np.concatenate([np.arange(0.0, 5.0, 0.02), np.arange(5.0, 100.0, 0.5)])
    topic, rows = cleaned(contents, tmp_path, "depth", times, np.sin(times))
    assert topic.burst == 0
    np.testing.assert_array_equal(rows[:, 0], times)
