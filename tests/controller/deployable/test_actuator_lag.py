"""Forces behind a lag, and the state ahead of it, against the differential equation."""

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from controller.laws.deployable import actuator_lag
from controller.laws.deployable.actuator_lag import PredictedState, predict_state
from controller.laws.deployable.estimate import EFFECTIVENESS, LAG, make_estimate
from controller.laws.deployable.model import make_thrusters
from tests.controller.deployable.scenery import LEVEL, ODIN

PERIOD = 0.02
CEILING = EFFECTIVENESS + 8


def lagging(lag, spread):
    estimate = make_estimate(ODIN)
    estimate.state[LAG], estimate.covariance[LAG, LAG] = lag, spread**2
    estimate.covariance[CEILING:, CEILING:] = 0.0  # the limits are known
    return estimate, make_thrusters(ODIN)


@pytest.mark.parametrize("lag", [0.0, 0.004, 0.05, 0.3])
def test_forces_follow_the_first_order_lag(lag):
    rng, (estimate, thrusters) = np.random.default_rng(1), lagging(lag, 1e-6)
    actual = np.zeros(8)
    for _ in range(30):
        thrusters.forces[:] = commanded = rng.uniform(-20.0, 20.0, 8)
        mean, end = commanded, commanded
        if lag:
            start = np.r_[actual, np.zeros(8)]

            def rates(t, y, u=commanded):
                return np.r_[(u - y[:8]) / lag, y[:8]]

            solved = solve_ivp(rates, (0.0, PERIOD), start, rtol=1e-9, atol=1e-9).y[:, -1]
            end, mean = solved[:8], solved[8:] / PERIOD
        actuator_lag.update_forces(estimate, thrusters, PERIOD)
        assert thrusters.acting == pytest.approx(mean, abs=2e-3)
        assert thrusters.acting_now == pytest.approx(end, abs=2e-3)
        actual = end


def test_secant_and_curvature_span_one_standard_deviation_of_the_lag():
    rng, (estimate, thrusters) = np.random.default_rng(2), lagging(0.2, 0.1)
    (less, behind_less), (same, behind), (more, behind_more) = (lagging(lag, 1e-7) for lag in (0.1, 0.2, 0.3))
    for _ in range(20):
        given = (estimate, thrusters), (less, behind_less), (same, behind), (more, behind_more)
        commanded = rng.uniform(-20.0, 20.0, 8)
        for one, forces in given:
            forces.forces[:] = commanded
            actuator_lag.update_forces(one, forces, PERIOD)
    assert estimate.by_lag == pytest.approx((behind_more.acting - behind_less.acting) / 0.2, abs=1e-3)
    curvature = behind.acting - 0.5 * (behind_less.acting + behind_more.acting)
    assert estimate.curvature == pytest.approx(curvature, abs=1e-3) and np.abs(curvature).max() > 0.1


def test_lag_estimate_change_moves_the_estimated_forces():
    """As if the lag had always been what it is now taken for: exactly where the forces were propagated for it."""
    for now in (0.1, 0.2, 0.3):
        rng, (estimate, thrusters) = np.random.default_rng(3), lagging(0.2, 0.1)
        other, expected = lagging(now, 1e-7)
        for _ in range(20):
            thrusters.forces[:] = expected.forces[:] = rng.uniform(-20.0, 20.0, 8)
            actuator_lag.update_forces(estimate, thrusters, PERIOD)
            actuator_lag.update_forces(other, expected, PERIOD)
        estimate.state[LAG], estimate.covariance[LAG, LAG] = now, 1e-14
        thrusters.forces[:] = expected.forces[:] = 5.0
        actuator_lag.update_forces(estimate, thrusters, PERIOD)
        actuator_lag.update_forces(other, expected, PERIOD)
        assert thrusters.acting_now == pytest.approx(expected.acting_now, abs=1e-3)


def test_predicted_point_responds_to_commands_without_lag():
    """p'' = f, tau f' = u - f: the second derivative of p + tau p' is u, at every instant."""
    lag, ahead = 0.4, PredictedState()

    def command(t):
        return np.array([np.sin(3.0 * t), 1.0, -t, 0.2 * np.cos(t), 0.1, -0.1 * t])

    def rates(t, y):
        return np.r_[y[6:12], y[12:], (command(t) - y[12:]) / lag]

    times = np.arange(0.0, 1.0, 0.001)
    solved = solve_ivp(rates, (0.0, 1.0), np.zeros(18), t_eval=times, rtol=1e-10, atol=1e-12).y.T
    positions, velocities = [], []
    for y in solved:
        predict_state(ahead, y[:3], y[6:9], LEVEL, y[9:12], y[12:], lag)
        positions.append(ahead.position.copy())
        velocities.append(ahead.velocity.copy())
    speeds, pushes = np.gradient(positions, times, axis=0), np.gradient(velocities, times, axis=0)
    assert speeds[5:-5] == pytest.approx(np.array(velocities)[5:-5, :3], abs=1e-5)
    assert pushes[5:-5] == pytest.approx(np.array([command(t) for t in times])[5:-5], abs=1e-4)


def test_predicted_attitude_rotation_is_limited_to_half_a_radian():
    ahead, still = PredictedState(), np.zeros(3)
    for rate, angle in ((0.5, 0.1), (9.0, 0.5)):
        predict_state(ahead, still, still, LEVEL, np.array([0.0, 0.0, rate]), np.zeros(6), 0.2)
        assert 2.0 * np.arctan2(ahead.quaternion[3], ahead.quaternion[0]) == pytest.approx(angle, rel=0.03)
