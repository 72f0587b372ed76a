"""The observer against a Kalman filter in plain matrices."""

import copy

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from controller.laws.deployable import observer
from controller.laws.deployable.gains import DeployableGains
from controller.laws.deployable.model import free_acceleration, make_dynamics, make_thrusters, thrust_acceleration
from tests.controller.deployable.scenery import ODIN, Sea

GAINS = DeployableGains()
PERIOD = 0.02


def started(position=(0.0, 0.0, 2.0), velocity=(0.0, 0.0, 0.0), model=ODIN):
    estimate = observer.empty_estimate()
    observer.initialize(estimate, np.array(position), np.array(velocity), GAINS)
    return estimate, make_dynamics(model, np.ones(9)), make_thrusters(model)


def predict(estimate, dynamics, thrusters):
    observer.predict(estimate, dynamics, thrusters, np.eye(3), np.zeros(3), GAINS, PERIOD)


def test_covariance_and_gains_are_those_of_a_kalman_filter():
    """F P F^T + Q, and a joint update with both measurements, of which ours takes one after the other."""
    rng = np.random.default_rng(1)
    model = ODIN._replace(linear_damping=np.array([4.0, 6.0, 11.0, 30.0, 30.0, 30.0]))  # ODIN has none along its axes
    estimate, dynamics, thrusters = started(velocity=(0.6, -0.4, 0.1), model=model)
    mass = dynamics.translational_mass[0]
    linear, quadratic = model.linear_damping[:3].mean(), model.quadratic_damping[:3].mean()
    H, N = np.eye(3)[:2], np.diag([GAINS.position_noise**2, GAINS.velocity_noise**2])
    for _ in range(60):
        P, speed = estimate.covariance.copy(), abs(estimate.velocity - estimate.water_velocity)
        predict(estimate, dynamics, thrusters)
        before = [
            estimate.position.copy(),
            estimate.velocity.copy(),
            np.r_[estimate.water_velocity[:2], estimate.net_weight],
        ]
        expected = np.empty((3, 3, 3))
        for axis in range(3):
            slope = (linear + 2.0 * quadratic * max(speed[axis], 0.15)) / mass
            unknown = slope if axis < 2 else 1.0 / mass
            F = np.array([[1.0, PERIOD, 0.0], [0.0, 1.0 - slope * PERIOD, unknown * PERIOD], [0.0, 0.0, 1.0]])
            drift = GAINS.restoring_drift if axis == 2 else GAINS.current_drift
            expected[axis] = F @ P[axis] @ F.T + np.diag([0.0, 0.03**2, drift**2]) * PERIOD
        assert estimate.covariance == pytest.approx(expected, rel=1e-10, abs=1e-18)
        position = estimate.position + 0.02 * rng.normal(size=3)
        velocity = estimate.velocity + 0.01 * rng.normal(size=3)
        assert observer.correct(estimate, position, velocity, GAINS)
        after = np.array(
            [estimate.position, estimate.velocity, np.r_[estimate.water_velocity[:2], estimate.net_weight]]
        )
        for axis in range(3):
            S = H @ expected[axis] @ H.T + N
            K = expected[axis] @ H.T @ np.linalg.inv(S)
            x = np.array([b[axis] for b in before])
            x = x + K @ (np.array([position[axis], velocity[axis]]) - H @ x)
            assert after[:, axis] == pytest.approx(x, rel=1e-9, abs=1e-12)
            assert estimate.covariance[axis] == pytest.approx((np.eye(3) - K @ H) @ expected[axis], rel=1e-8, abs=1e-16)


def test_current_and_weight_are_found():
    """To the accuracy that the filter itself states, in noise."""
    sea = Sea(current=(0.3, -0.2, 0.0), restoring=11.0, noise=(0.02, 0.01))
    estimate, dynamics, thrusters = started(sea.position)
    rng = np.random.default_rng(4)
    for k in range(3000):
        if k % 50 == 0:
            thrusters.forces[:] = rng.uniform(-12.0, 12.0, 8)
            thrusters.forces[5:] = thrusters.forces[4]
            thrusters.forces[2:4] = -thrusters.forces[:2]
        sea.step(thrusters.forces, PERIOD)
        sea.omega[:], sea.quaternion[:] = 0.0, (1.0, 0.0, 0.0, 0.0)
        predict(estimate, dynamics, thrusters)
        assert observer.correct(estimate, *noisy(sea), GAINS)
    spread = np.sqrt(estimate.covariance[:, 2, 2])
    assert np.all(spread < [0.1, 0.1, 3.0])
    assert np.all(abs(estimate.water_velocity[:2] - sea.current[:2]) < 4.0 * spread[:2])
    assert abs(estimate.net_weight[0] - 11.0) < 4.0 * spread[2]


def noisy(sea):
    return sea.position + 0.02 * sea.rng.normal(size=3), sea.velocity + 0.01 * sea.rng.normal(size=3)


def test_unknowns_stay_within_their_bounds():
    """A vehicle that is held fast while the thrusters push: nothing winds up."""
    estimate, dynamics, thrusters = started()
    thrusters.forces[:] = 27.0
    for _ in range(2000):
        predict(estimate, dynamics, thrusters)
        observer.correct(estimate, np.array([0.0, 0.0, 2.0]), np.zeros(3), GAINS)
        if estimate.time_since_measurement[0] > GAINS.coast:
            observer.initialize(estimate, np.array([0.0, 0.0, 2.0]), np.zeros(3), GAINS)
        assert np.all(abs(estimate.water_velocity) <= GAINS.current_bound)
        assert abs(estimate.net_weight[0]) <= GAINS.restoring_bound


@pytest.mark.parametrize("which", [0, 1])
def test_a_measurement_that_cannot_be_is_not_believed_and_changes_nothing(which):
    estimate, dynamics, thrusters = started()
    predict(estimate, dynamics, thrusters)
    before = [np.copy(part) for part in estimate]
    for wrong in (5.0, np.nan, np.inf):
        measured = [estimate.position.copy(), estimate.velocity.copy()]
        measured[which][1] += wrong
        assert not observer.correct(estimate, *measured, GAINS)
    for part, was in zip(estimate, before, strict=True):
        assert np.array_equal(part, was, equal_nan=True)
    assert estimate.time_since_measurement[0] == pytest.approx(PERIOD)


def test_the_prediction_follows_the_vehicles_model():
    """Turned and turning, with thrust: position and velocity after a period of steady acceleration."""
    rng, omega = np.random.default_rng(5), np.array([0.2, -0.3, 0.4])
    estimate, dynamics, thrusters = started(velocity=(0.6, -0.4, 0.1))
    R = Rotation.from_euler("zyx", [0.7, -0.3, 0.2]).as_matrix()
    estimate.water_velocity[:2], estimate.net_weight[0] = (0.2, -0.1), 7.0
    thrusters.forces[:] = rng.uniform(-20.0, 20.0, 8)
    free, pushed = np.empty(3), np.empty(6)
    free_acceleration(dynamics, R, estimate.velocity, omega, estimate.water_velocity, 7.0, free)
    thrust_acceleration(dynamics, thrusters, R, thrusters.forces, pushed)
    a, v, p = free + pushed[:3], estimate.velocity.copy(), estimate.position.copy()
    observer.predict(estimate, dynamics, thrusters, R, omega, GAINS, PERIOD)
    assert estimate.acceleration == pytest.approx(a, rel=1e-12)
    assert estimate.position == pytest.approx(p + PERIOD * v + 0.5 * PERIOD**2 * a, rel=1e-12)
    assert estimate.velocity == pytest.approx(v + PERIOD * a, rel=1e-12)
    assert estimate.time_since_measurement[0] == PERIOD


def test_innovation_spread_and_gain_are_those_of_the_velocity():
    estimate, dynamics, thrusters = started(velocity=(0.1, -0.2, 0.3))
    for _ in range(3):
        predict(estimate, dynamics, thrusters)
    P, before, off = estimate.covariance[:, 1, 1].copy(), estimate.velocity.copy(), np.array([0.01, -0.02, 0.005])
    assert observer.correct(estimate, estimate.position.copy(), before + off, GAINS)
    variance = P + GAINS.velocity_noise**2
    assert estimate.innovation == pytest.approx(off, abs=1e-12)
    assert estimate.innovation_deviation == pytest.approx(np.sqrt(variance), rel=1e-12)
    assert estimate.gain == pytest.approx(P / variance, rel=1e-12)


def test_what_is_measured_is_believed_up_to_six_standard_deviations_and_five_hundredths():
    for which, noise in ((0, GAINS.position_noise), (1, GAINS.velocity_noise)):
        for part, believed in ((0.98, True), (1.02, False)):
            estimate, dynamics, thrusters = started()
            predict(estimate, dynamics, thrusters)
            gate = 6.0 * np.sqrt(estimate.covariance[1, which, which] + noise**2) + 0.05
            for sign in (1.0, -1.0):
                seen = copy.deepcopy(estimate)
                measured = [seen.position.copy(), seen.velocity.copy()]
                measured[which][1] += sign * part * gate
                assert observer.correct(seen, *measured, GAINS) == believed


def test_bounds_hold_on_either_side():
    for sign in (1.0, -1.0):
        estimate, _, _ = started()
        estimate.covariance[:, 2, 2] = 1e9
        estimate.covariance[:, 1, 2] = estimate.covariance[:, 2, 1] = 1e3
        assert observer.correct(estimate, estimate.position.copy(), np.full(3, 0.04 * sign), GAINS)
        bound = [GAINS.current_bound, GAINS.current_bound, GAINS.restoring_bound]
        assert [*estimate.water_velocity[:2], estimate.net_weight[0]] == (sign * np.array(bound)).tolist()


def test_doubt_widens_what_is_to_be_found_anew():
    estimate, _, _ = started()
    before = estimate.covariance.copy()
    observer.inflate_covariance(estimate, 0.01)
    widened = np.zeros((3, 3, 3))
    widened[:, 1, 1], widened[:, 2, 2] = 0.01, (0.04, 0.04, 25.0)
    assert estimate.covariance == pytest.approx(before + widened, rel=1e-12)
    estimate.covariance[:, 0, 0] = 0.04, 0.09, 0.01
    assert observer.position_spread(estimate) == pytest.approx(0.3)
