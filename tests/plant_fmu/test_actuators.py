"""From commands to forces in time: lags and rate limits; test_derivatives has limits, curves and failures."""

import numpy as np
import pytest

from tests.plant_fmu.test_dynamics import MASS, asymmetric


@pytest.mark.parametrize("time_constant", [1e-6, 0.02, 3.0])
def test_thruster_lag_is_exact_for_any_time_constant(make_slave, time_constant):
    slave = make_slave().start(**{"thrust_time_constant[1]": time_constant})
    slave.set_values({"thrust[1]": 20.0})
    for k in range(1, 20):
        slave.step(0.05)
        expected = 20.0 * -np.expm1(-0.05 * k / time_constant)
        assert slave.get("thruster_force[1]")[0] == pytest.approx(expected, rel=1e-12)


def test_lagged_thrust_motion_matches_the_analytic_integral(make_slave):
    """Double integral of f (1 - exp(-t/T)) / m, which the substeps must meet to fourth order."""
    T, f, m, t = 0.4, 15.0, MASS, 3.0
    slave = make_slave().start(**asymmetric(
        weight=0.0, buoyancy=0.0, wrench_time_constant=T, substep=0.005,
        **{f"added_mass[{i + 1},{j + 1}]": 0.0 for i in range(6) for j in range(i, 6)},
        **{f"r_G.{a}": 0.0 for a in "xyz"},
    ))  # fmt: skip
    slave.set_values({"wrench.X": f})
    slave.step(t)
    assert slave.get("position.x")[0] == pytest.approx(f / m * (t**2 / 2 - T * t - T**2 * np.expm1(-t / T)), rel=1e-10)


@pytest.mark.medium
@pytest.mark.parametrize(("T", "sign"), [(0.3, 1.0), (0.0, -1.0)])
def test_a_rate_limit_ramps_then_settles(make_slave, fmi, T, sign):
    """f' = (25 - f) / lag, at most 20: a ramp, then an exponential; the shortest lag is 1 ms."""
    limit, lag, times = 20.0, max(T, 1e-3), np.arange(1, 61) * 0.05
    slave = make_slave(fmi=fmi).start(**{"thrust_time_constant[1]": T, "thrust_rate_limit[1]": limit})
    slave.set_values({"thrust[1]": sign * 25.0})
    ramp = 25.0 / limit - lag
    expected = np.where(times <= ramp, limit * times, 25.0 - limit * lag * np.exp(np.minimum(ramp - times, 0.0) / lag))
    forces = []
    for _ in times:
        slave.step(0.05)
        forces += slave.get("thruster_force[1]")
    assert forces == pytest.approx(list(sign * expected), abs=1e-9)


def test_actuator_states_start_at_their_start_values(make_slave, fmi):
    """Thrusters may be running when a simulation begins."""
    slave = make_slave(fmi=fmi).start(**{"thrust_time_constant[1]": 1.0, "actuator.thrust[1]": 10.0})
    assert slave.get("thruster_force[1]") == [10.0]
    slave.step(1.0)
    assert slave.get("thruster_force[1]")[0] == pytest.approx(10.0 / np.e)
