"""The pace of simulated time, by a clock of the test's own."""

import pytest

from cosim.simulation.pace import Pace


def test_periods_keep_to_the_clock_and_a_long_delay_is_not_caught_up():
    now = [5.0]
    pace = Pace(0.002, clock=lambda: now[0], sleep=lambda time: now.__setitem__(0, now[0] + time))
    for _ in range(250):
        pace.wait()
    assert now[0] == pytest.approx(5.5)
    now[0] += 0.05  # a short one is
    for _ in range(100):
        pace.wait()
    assert now[0] == pytest.approx(5.7)
    now[0] += 3.0
    for _ in range(100):
        pace.wait()
    assert now[0] == pytest.approx(8.8, abs=0.003)
