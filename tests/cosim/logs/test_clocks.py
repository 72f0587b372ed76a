"""Clocks that drift, jump and begin anew, beside the times that are known because they were made."""

import numpy as np
import pytest

from cosim.logs.cleaning.clocks import Clock, VehicleClock


def put(clock, stamps, written):
    for pair in zip(stamps.tolist(), written.tolist(), strict=True):
        clock.put(*pair)


def test_clock_drift_and_delays_are_corrected():
    rng = np.random.default_rng(1)
    true = np.sort(rng.uniform(0.0, 1800.0, 20_000))
    stamps = 37.0 + true * (1.0 - 4e-5)  # the vehicle's clock is slow
    written = 1.7e9 + true + 0.002 + rng.exponential(0.05, true.size)  # never quicker than 2 ms
    clock = VehicleClock()
    put(clock, stamps, written)
    error = clock.times(stamps, written) - 1.7e9 - true - 0.002
    assert np.abs(error).max() < 0.003  # where what was written is off by up to half a second
    assert "+40 ppm" in clock.summary()


def test_vehicle_restart_starts_a_new_clock_fit():
    clock = VehicleClock()
    first, second = np.arange(100.0, 160.0), np.arange(5.0, 60.0)
    stamps = np.concatenate([first, second])
    written = np.concatenate([first + 1000.0, second + 1200.0])
    put(clock, stamps, written)
    np.testing.assert_allclose(clock.times(stamps, written), written)
    assert clock.restarts == [1205.0]


def test_messages_without_stamp_use_the_log_time():
    clock = VehicleClock()
    clock.put(1.0, 11.0)
    assert clock.times(np.array([np.nan, 2.0]), np.array([50.0, 50.0])).tolist() == [50.0, 12.0]


@pytest.mark.parametrize("sizes", [[-5000.0], [-2.0], [86400.0], [1.7e9], [1e5, -1e5 - 30.0]])
def test_clock_jumps_become_one_second_pauses_in_any_blocks(sizes):
    stamps, jumps = np.arange(0.0, 20.0, 0.1), [120, 130][: len(sizes)]
    for k, size in zip(jumps, sizes, strict=True):
        stamps[k:] += size
    one, many = Clock(), Clock()
    singly = np.array([one.time(t) for t in stamps.tolist()])
    together = np.concatenate([many.times(part) for part in np.split(stamps, [50, 121])])
    np.testing.assert_allclose(singly, together)
    assert np.flatnonzero(np.isnan(together)).tolist() == jumps  # until the next one confirms it
    steps = np.diff(together[~np.isnan(together)])
    after = np.array(jumps) - 1 - np.arange(len(jumps))
    np.testing.assert_allclose(steps, np.where(np.isin(np.arange(len(steps)), after), 1.1, 0.1), atol=1e-6)
    assert [by for _, by in one.jumps] == [by for _, by in many.jumps]
    assert one.jumps[0][1] == pytest.approx(sizes[0] + 0.1)


def test_pauses_and_unordered_messages_are_no_jumps():
    stamps = np.array([0.0, 1.0, 0.4, 2.0, 3000.0, 3000.1])
    clock = Clock()
    assert clock.times(stamps).tolist() == stamps.tolist()
    assert clock.jumps == []


def test_a_damaged_reading_moves_no_other():
    stamps = 1.7e9 + np.arange(100.0)
    stamps[[20, 50, 51]] = 0.0, 1e12, 7.0
    clock = Clock()
    times = clock.times(stamps)
    assert np.flatnonzero(np.isnan(times)).tolist() == [20, 50, 51] and clock.jumps == []
    assert (times == stamps)[~np.isnan(times)].all()


def test_topics_stored_one_after_the_other_share_a_clock():
    clock = Clock()
    times = [clock.time(t, topic) for topic in "ab" for t in np.arange(0.0, 100.0)]
    assert times == [*np.arange(100.0), *np.arange(100.0)] and clock.jumps == []
