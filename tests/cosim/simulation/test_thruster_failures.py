"""Thruster failures in a run: commanded and actual forces."""

import numpy as np
import pytest

from cosim import load_scenario
from tests.cosim.simulation.keep import kept_rows

GIVEN = ["actuation.through=thrusters", "time.duration=3.0", "law.name=pd"]


def flown(failures, *more):
    """Return what each thruster was commanded and what it gave, a row a step."""
    kept = kept_rows(load_scenario("paper", [*GIVEN, f"failures={failures}", *more]))
    return [np.column_stack([kept[f"{kind}[{j + 1}]"] for j in range(8)]) for kind in ("thrust", "thruster_force")]


@pytest.mark.medium
def test_partial_failure_scales_the_thruster_force():
    asked, given = flown("[{thruster=3, time=1.0, effectiveness=0.3}]")
    left = np.array([1.0, 1.0, 0.3, 1.0, 1.0, 1.0, 1.0, 1.0])
    ratio = given[1100:] / asked[1100:]  # a step apart, which changes little
    assert np.median(ratio, axis=0) == pytest.approx(left, rel=1e-3)
    assert np.median(given[100:900] / asked[100:900], axis=0) == pytest.approx(np.ones(8), rel=1e-3)


@pytest.mark.medium
@pytest.mark.parametrize("order", ["gauss-seidel", "jacobi"])
def test_stuck_thruster_keeps_its_last_force(order):
    asked, given = flown("[{thruster=5, time=1.0, stuck=true}]", f"master.order={order}")
    assert np.ptp(given[1003:, 4]) == 0.0 and np.ptp(asked[1003:, 4]) > 1.0  # while it is asked for another
    assert given[1003, 4] == pytest.approx(asked[1000, 4], abs=0.05)
    assert np.ptp(given[1003:, 0]) > 1.0
