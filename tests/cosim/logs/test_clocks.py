"""Clocks that drift, jump and begin anew, beside the times that are known because they were made."""

import numpy as np
import pytest

from cosim.logs.clocks import Clock, VehicleClock


def test_clock_drift_and_delays_are_corrected():
    rng = np.random.default_rng(1)
    true = np.sort(rng.uniform(0.0, 1800.0, 20_000))
    stamps = 37.0 + true * (1.0 - 4e-5)  # the vehicle's clock is slow
    written = 1.7e9 + true + 0.002 + rng.exponential(0.05, true.size)  # never quicker than 2 ms
    clock = VehicleClock()
    for pair in zip(stamps.tolist(), written.tolist(), strict=True):
        clock.put(*pair)
    error = clock.times(stamps, written) - 1.7e9 - true - 0.002
    assert np.abs(error).max() < 0.003  # where what was written is off by up to half a second
    assert "+40 ppm" in clock.summary()


def test_vehicle_restart_starts_a_new_clock_fit():
    clock = VehicleClock()
    first, second = np.arange(100.0, 160.0), np.arange(5.0, 60.0)
    stamps = np.concatenate([first, second])
    written = np.concatenate([first + 1000.0, second + 1200.0])
    for pair in zip(stamps.tolist(), written.tolist(), strict=True):
        clock.put(*pair)
    np.testing.assert_allclose(clock.times(stamps, written), written)
    assert clock.restarts == [1205.0]


def test_messages_without_stamp_use_the_log_time():
    clock = VehicleClock()
    clock.put(1.0, 11.0)
    assert clock.times(np.array([np.nan, 2.0]), np.array([50.0, 50.0])).tolist() == [50.0, 12.0]


@pytest.mark.parametrize("by", [-5000.0, -2.0, 86400.0, 1.7e9])
def test_clock_jumps_become_one_second_pauses_in_any_blocks(by):
    said = np.arange(0.0, 20.0, 0.1)
    said[120:] += by
    one, many = Clock(), Clock()
    singly = np.array([one.time(t) for t in said.tolist()])
    together = np.concatenate([many.times(said[:50]), many.times(said[50:121]), many.times(said[121:])])
    np.testing.assert_allclose(singly, together)
    steps = np.diff(together)
    assert steps[119] == pytest.approx(1.0)
    np.testing.assert_allclose(np.delete(steps, 119), 0.1, atol=1e-6)
    assert [by_ for _, by_ in one.jumps] == pytest.approx([by + 0.1]) == [by_ for _, by_ in many.jumps]


def test_pauses_and_unordered_messages_are_no_jumps():
    said = np.array([0.0, 1.0, 0.4, 2.0, 3000.0, 3000.1])
    clock = Clock()
    assert clock.times(said).tolist() == said.tolist()
    assert clock.jumps == []


def test_two_jumps_within_a_block_are_found():
    said = np.concatenate([np.arange(0.0, 5.0, 0.5), np.arange(100000.0, 100005.0, 0.5), np.arange(3.0, 8.0, 0.5)])
    one, many = Clock(), Clock()
    np.testing.assert_allclose(many.times(said), [one.time(t) for t in said.tolist()])
    assert len(many.jumps) == 2
