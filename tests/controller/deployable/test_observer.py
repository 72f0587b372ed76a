"""The observer against a Kalman filter in plain matrices."""

import copy

import numpy as np
import pytest
from scipy.optimize import minimize
from scipy.spatial.transform import Rotation

from controller.laws.deployable import actuator_lag, observer
from controller.laws.deployable.estimate import (
    CURRENT,
    DRAG,
    EFFECTIVENESS,
    HEIGHT,
    LAG,
    MOMENTS,
    NET_WEIGHT,
    POSITION,
    VELOCITY,
    YAW_MOMENT,
    initialize,
    make_estimate,
    project,
    publish,
    reset,
    set_effectiveness,
)
from controller.laws.deployable.gains import DeployableGains
from controller.laws.deployable.model import (
    Loads,
    free_acceleration,
    make_dynamics,
    make_thrusters,
    thrust_acceleration,
)
from tests.controller.deployable.scenery import MODELS, ODIN, Sea, fly, law_for

GAINS = DeployableGains()
PERIOD = 0.02
RATES = np.array([0.001, 0.002, 0.0015])  # rad/s, standard deviation
CEILING = EFFECTIVENESS + 8
N = CEILING + 8


def started(position=(0.0, 0.0, 2.0), velocity=(0.0, 0.0, 0.0), model=ODIN):
    estimate = make_estimate(model)
    initialize(estimate, np.array(position), np.array(velocity), GAINS)
    return estimate, make_dynamics(model, np.ones(9)), make_thrusters(model)


def correct(estimate, position, velocity, gains=GAINS):
    """Correct by both, and return whether both were accepted."""
    position_used = observer.correct(estimate, POSITION, np.asarray(position, float), GAINS.position_noise, gains)
    return (
        observer.correct(estimate, VELOCITY, np.asarray(velocity, float), GAINS.velocity_noise, gains) and position_used
    )


def pushes(dynamics, thrusters, R):
    """Return the acceleration of one newton of each thruster, (6, m)."""
    body = dynamics.inverse_mass @ thrusters.matrix
    return np.ascontiguousarray(np.vstack([R @ body[:3], body[3:]]))


def predict(estimate, dynamics, thrusters, R=None, omega=(0.0, 0.0, 0.0), gains=GAINS):
    R = np.eye(3) if R is None else R
    actuator_lag.update_forces(estimate, thrusters, PERIOD)
    given = pushes(dynamics, thrusters, R), R, np.array(omega)
    observer.predict(estimate, dynamics, thrusters, *given, gains, PERIOD)


def transition(estimate, dynamics, thrusters, by_force):
    """Return F of a period, from what the estimate is before it."""
    x, F, mass = estimate.state, np.eye(N), dynamics.translational_mass
    linear, quadratic = dynamics.linear_damping[:3].mean(), dynamics.quadratic_damping[:3].mean()
    for axis in range(3):
        speed = abs(estimate.velocity[axis] - estimate.water_velocity[axis])
        slope = x[DRAG] * (linear + 2.0 * quadratic * max(speed, 0.15)) / mass
        F[axis, VELOCITY + axis] = PERIOD
        row = F[VELOCITY + axis]
        row[VELOCITY + axis] -= slope * PERIOD
        row[CURRENT + axis if axis < 2 else NET_WEIGHT] = PERIOD * (slope if axis < 2 else 1.0 / mass)
        row[EFFECTIVENESS:CEILING] = PERIOD * by_force[axis] * thrusters.acting
        row[CEILING:] = PERIOD * by_force[axis] * estimate.by_ceiling[0] * x[EFFECTIVENESS:CEILING]
        row[LAG] = PERIOD * np.sum(by_force[axis] * estimate.by_lag * x[EFFECTIVENESS:CEILING])
    nu = estimate.velocity - estimate.water_velocity
    force = -(dynamics.linear_damping[:3] + dynamics.quadratic_damping[:3] * abs(nu)) * nu
    F[VELOCITY:CURRENT, DRAG] = PERIOD * (dynamics.inverse_mass[:3, :3] @ force)
    return F


def random_estimate(rng, thrusters):
    estimate, dynamics, _ = started(velocity=rng.normal(size=3) * 0.4)
    root = rng.normal(size=(N, N)) * 0.05
    estimate.covariance[:] = root @ root.T
    estimate.state[CURRENT : CURRENT + 2], estimate.state[NET_WEIGHT] = rng.normal(size=2) * 0.2, 4.0
    estimate.state[EFFECTIVENESS:CEILING], estimate.state[LAG] = rng.uniform(0.6, 1.0, 8), 0.15
    estimate.state[DRAG], estimate.drift[:] = 0.7, rng.uniform(2.0, 9.0, 6)
    estimate.state[CEILING:], estimate.by_ceiling[2] = rng.uniform(0.5, 0.9, (2, 8))
    estimate.by_ceiling[:2] = rng.uniform(0.0, 20.0, (2, 8))
    publish(estimate)
    thrusters.forces[:] = rng.uniform(-20.0, 20.0, 8)
    estimate.bracket[:] = rng.uniform(-20.0, 20.0, (2, 8))
    estimate.lags[:] = 0.1, 0.15, 0.3
    return estimate, dynamics


def test_prediction_covariance_matches_a_kalman_filter():
    """F P F^T + Q; the position goes by the velocity before the period, which enters P in two steps: G F."""
    rng, thrusters = np.random.default_rng(1), make_thrusters(ODIN)
    for _ in range(20):
        estimate, dynamics = random_estimate(rng, thrusters)
        dynamics.linear_damping[:] = rng.uniform(5.0, 50.0, 6)
        before, P = copy.deepcopy(estimate), estimate.covariance.copy()
        predict(estimate, dynamics, thrusters)
        before.by_lag[:], before.by_ceiling[:] = estimate.by_lag, estimate.by_ceiling
        by_force = pushes(dynamics, thrusters, np.eye(3))
        F, curvature = (
            transition(before, dynamics, thrusters, by_force),
            estimate.curvature * before.state[EFFECTIVENESS:CEILING],
        )
        expected = F @ P @ F.T
        Q, drift = np.zeros(N), estimate.drift
        Q[VELOCITY:CURRENT] = 0.03**2 * PERIOD + 0.9 * PERIOD * (by_force[:3] @ curvature) ** 2
        Q[CURRENT:NET_WEIGHT] = drift[:2] * GAINS.current_drift**2 * PERIOD
        Q[NET_WEIGHT] = drift[2] * (GAINS.restoring_drift * 125.0 / 50.0) ** 2 * PERIOD
        angular = (GAINS.adaptation * 0.019 * np.diag(dynamics.mass)[3:]) ** 2 * PERIOD
        Q[MOMENTS:YAW_MOMENT], Q[YAW_MOMENT] = max(drift[3:5]) * angular, drift[5] * angular[2]
        Q[DRAG] = 0.01**2 * PERIOD
        Q[LAG], Q[EFFECTIVENESS:] = 0.003**2 * PERIOD, 0.01**2 * PERIOD
        assert estimate.covariance == pytest.approx(expected + np.diag(Q), rel=1e-9, abs=1e-13)
        assert np.array_equal(estimate.covariance, estimate.covariance.T) or np.allclose(
            estimate.covariance, estimate.covariance.T, rtol=1e-12, atol=1e-18
        )


def test_deviations_of_hypotheses_grow_as_errors_of_the_state_do():
    """F d; where a thruster is stuck, also by the force that it lacks."""
    rng, thrusters = np.random.default_rng(7), make_thrusters(ODIN)
    estimate, dynamics = random_estimate(rng, thrusters)
    estimate.deviation[:], estimate.supposed[:] = rng.normal(size=(16, N)), rng.normal(size=(2, 8)) * [[1.0], [9.0]]
    before = copy.deepcopy(estimate)
    predict(estimate, dynamics, thrusters)
    before.by_lag[:], before.by_ceiling[:] = estimate.by_lag, estimate.by_ceiling
    by_force = pushes(dynamics, thrusters, np.eye(3))
    expected = before.deviation @ transition(before, dynamics, thrusters, by_force).T
    missing = before.supposed[0] * (before.supposed[1] - thrusters.acting)
    expected[8:, VELOCITY:CURRENT] += PERIOD * (by_force[:3] * missing).T
    assert estimate.deviation == pytest.approx(expected, rel=1e-9, abs=1e-12)


def test_correction_matches_the_joint_kalman_update():
    """With both measurements of three axes at once, of which ours takes one number after the other."""
    rng, thrusters = np.random.default_rng(2), make_thrusters(ODIN)
    H, noise = np.eye(6, N), np.diag([GAINS.position_noise**2] * 3 + [GAINS.velocity_noise**2] * 3)
    for _ in range(20):
        estimate, _ = random_estimate(rng, thrusters)
        P, x = estimate.covariance.copy(), estimate.state.copy()
        spread = np.sqrt(np.diag(P)[:6] + np.diag(noise))
        measured = x[:6] + spread * rng.uniform(-0.5, 0.5, 6)  # none so far off that it counts less
        assert correct(estimate, measured[:3], measured[3:], GAINS._replace(current_bound=9.0))
        K = P @ H.T @ np.linalg.inv(H @ P @ H.T + noise)
        theirs = x + K @ (measured - x[:6])
        if np.all((theirs[EFFECTIVENESS:] < 1.1) & (theirs[EFFECTIVENESS:] > 0.3)) and 0.0 < theirs[LAG] < 1.0:
            assert estimate.state == pytest.approx(theirs, rel=1e-8, abs=1e-10)
        assert estimate.covariance == pytest.approx((np.eye(N) - K @ H) @ P, rel=1e-6, abs=1e-12)


def test_moment_correction_matches_the_kalman_update():
    """moment = B diag(f) e - S(k) phi - m e3 x a z + what the current changes, by plain matrices; k of mid-period."""
    rng, thrusters = np.random.default_rng(3), make_thrusters(ODIN)
    for _ in range(20):
        estimate, dynamics = random_estimate(rng, thrusters)
        thrusters.acting[:] = rng.uniform(-20.0, 20.0, 8)
        estimate.by_lag[:], estimate.curvature[:] = rng.normal(size=8), 0.1 * rng.normal(size=8)
        estimate.by_ceiling[0] = rng.normal(size=8)
        estimate.acceleration[:], estimate.state[HEIGHT] = rng.normal(size=3), 0.02
        estimate.state[MOMENTS:HEIGHT] = rng.normal(size=4) * 20.0
        turned, omega, by_current = Rotation.random(random_state=rng), rng.normal(size=3), rng.normal(size=(3, 2))
        R, x, P = turned.as_matrix(), estimate.state.copy(), estimate.covariance.copy()
        k, e = R[2] + 0.5 * PERIOD * np.cross(omega, R[2]), x[EFFECTIVENESS:CEILING]
        H, given = np.zeros((3, N)), thrusters.matrix[3:] * thrusters.acting
        H[:, CURRENT:NET_WEIGHT] = by_current
        H[2, YAW_MOMENT] = 1.0
        H[:, MOMENTS:YAW_MOMENT] = -np.array([[0.0, -k[2], k[1]], [k[2], 0.0, -k[0]], [-k[1], k[0], 0.0]])
        H[:, HEIGHT] = -dynamics.rigid_mass * np.cross([0.0, 0.0, 1.0], R.T @ estimate.acceleration)
        H[:, LAG], H[:, EFFECTIVENESS:CEILING] = thrusters.matrix[3:] @ (estimate.by_lag * e), given
        H[:, CEILING:] = thrusters.matrix[3:] * estimate.by_ceiling[0] * e
        noise = (0.019 * np.diag(dynamics.mass)[3:]) ** 2 / PERIOD + np.sum((0.05 * given) ** 2, axis=1)
        noise += 0.9 / PERIOD * np.sum((thrusters.matrix[3:] * estimate.curvature) ** 2, axis=1)
        noise += 2.0 * (np.diag(dynamics.mass)[3:] * RATES / PERIOD) ** 2
        expected = (
            H @ x - H[:, CURRENT:NET_WEIGHT] @ x[CURRENT:NET_WEIGHT] - H[:, LAG] * x[LAG] - H[:, CEILING:] @ x[CEILING:]
        )
        moment = expected + 0.1 * np.sqrt(noise) * rng.uniform(-1.0, 1.0, 3)
        quaternion = turned.as_quat()[[3, 0, 1, 2]]
        seen = copy.deepcopy(estimate)
        given = seen, moment, by_current, RATES, dynamics, thrusters, R, quaternion, omega
        observer.correct_by_moment(*given, GAINS, PERIOD)
        K = P @ H.T @ np.linalg.inv(H @ P @ H.T + np.diag(noise))
        # each axis takes the row of the lag where the axis before has left the effectiveness
        assert seen.covariance == pytest.approx((np.eye(N) - K @ H) @ P, rel=1e-2, abs=2e-5)
        assert np.abs(seen.covariance - P).max() > 1e-2
        seen = copy.deepcopy(estimate)
        observer.correct_by_moment(seen, expected, *given[2:], GAINS, PERIOD)  # as predicted: nothing to correct
        assert seen.state == pytest.approx(x, rel=1e-7, abs=1e-9)


def test_bounds_are_enforced_by_the_most_likely_state():
    """The least of (x - x0)^T P^-1 (x - x0) with one number at its bound, by SciPy."""
    rng, thrusters = np.random.default_rng(4), make_thrusters(ODIN)
    for _ in range(5):
        estimate, _ = random_estimate(rng, thrusters)
        estimate.state[EFFECTIVENESS:CEILING] = 0.9
        estimate.state[EFFECTIVENESS + 3] = 1.13
        before, weight = estimate.state.copy(), np.linalg.inv(estimate.covariance)
        project(estimate, GAINS._replace(current_bound=9.0))
        free = [i for i in range(N) if i != EFFECTIVENESS + 3]

        def cost(rest, before=before, weight=weight, free=free):
            off = np.zeros(N)
            off[free], off[EFFECTIVENESS + 3] = rest, 1.1 - 1.13
            return off @ weight @ off, 2.0 * (weight @ off)[free]

        found = minimize(cost, np.zeros(N - 1), jac=True, method="BFGS", options={"gtol": 1e-9})
        assert estimate.state[EFFECTIVENESS + 3] == 1.1
        assert estimate.state[free] - before[free] == pytest.approx(found.x, abs=2e-4)


@pytest.mark.parametrize(("index", "bound"), [(CURRENT, 1.0), (NET_WEIGHT, 125.0), (MOMENTS, 937.5)])
@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_estimates_are_bounded_on_both_sides(index, bound, sign):
    """In N and N m those of the gains, for ODIN's mass of 125 kg: 50 N times 2.5, 150 N m times its square."""
    estimate, _, _ = started()
    estimate.state[index] = 1e5 * sign
    project(estimate, GAINS)
    assert estimate.state[index] == pytest.approx(sign * bound)


@pytest.mark.medium
def test_disturbances_are_estimated_within_the_stated_accuracy():
    """Current, W - B, righting moment, lag and effectiveness, in noise, while the law flies."""
    for name, lag in (("quick", 0.0), ("slow", 0.25)):
        sea, law = Sea(current=(0.1, -0.08, 0.0), restoring=11.0, noise=(0.02, 0.01), lag=lag), law_for([])
        sea.left[:] = np.linspace(0.75, 1.0, 8)
        sea.quaternion[:] = np.array([0.9, 0.3, -0.2, 0.1]) / np.linalg.norm([0.9, 0.3, -0.2, 0.1])
        fly(law, sea, regions=[], steps=900)
        x, spread = law.memory.state_estimate.state, np.sqrt(np.diag(law.memory.state_estimate.covariance))
        truth = {CURRENT: 0.1, CURRENT + 1: -0.08, NET_WEIGHT: 11.0, MOMENTS + 2: 30.0, LAG: lag}
        truth |= {EFFECTIVENESS + j: sea.left[j] for j in range(8)}
        for index, value in truth.items():
            assert abs(x[index] - value) < 4.0 * spread[index] + 0.02 * max(1.0, abs(value)), (name, index)
        assert np.all(spread[EFFECTIVENESS : EFFECTIVENESS + 4] < 0.1) and spread[LAG] < 0.15


@pytest.mark.medium
def test_estimates_do_not_wind_up():
    """A vehicle that is held fast while the thrusters push."""
    estimate, dynamics, thrusters = started()
    thrusters.forces[:] = 27.0
    for _ in range(2000):
        predict(estimate, dynamics, thrusters)
        if not correct(estimate, [0.0, 0.0, 2.0], np.zeros(3)):
            initialize(estimate, np.array([0.0, 0.0, 2.0]), np.zeros(3), GAINS)
        assert np.all(np.isfinite(estimate.state)) and np.all(abs(estimate.water_velocity) <= GAINS.current_bound)
    assert np.all(np.diag(estimate.covariance) >= 0.0)


@pytest.mark.parametrize(("first", "noise"), [(POSITION, GAINS.position_noise), (VELOCITY, GAINS.velocity_noise)])
def test_implausible_measurement_is_rejected_without_effect(first, noise):
    estimate, dynamics, thrusters = started()
    predict(estimate, dynamics, thrusters)
    before = [np.copy(part) for part in estimate]
    for wrong in (np.array([0.0, 5.0, 0.0]), np.array([np.nan, np.inf, 0.0]), np.full(3, np.nan)):
        measured = estimate.state[first : first + 3] + wrong
        assert not observer.correct(estimate, first, measured, noise, GAINS)
    for part, was in zip(estimate, before, strict=True):
        assert np.array_equal(part, was, equal_nan=True)
    assert estimate.time_since_measurement == pytest.approx(PERIOD)


def test_missing_components_do_not_affect_other_corrections():
    """A depth without a position corrects as the row of the depth alone does."""
    rng, thrusters = np.random.default_rng(6), make_thrusters(ODIN)
    estimate, _ = random_estimate(rng, thrusters)
    P, x = estimate.covariance.copy(), estimate.state.copy()
    measured = np.array([np.nan, np.nan, x[2] + 0.03])
    assert observer.correct(estimate, POSITION, measured, 0.02, GAINS._replace(current_bound=9.0))
    K = P[:, 2] / (P[2, 2] + 0.02**2)
    assert estimate.state[:EFFECTIVENESS] == pytest.approx((x + 0.03 * K)[:EFFECTIVENESS], rel=1e-9, abs=1e-12)
    assert estimate.covariance == pytest.approx(P - np.outer(K, P[2]), rel=1e-8, abs=1e-13)


def test_prediction_follows_the_vehicle_model():
    """Turned and turning, with thrust: position and velocity after a period of steady acceleration."""
    rng, omega = np.random.default_rng(5), np.array([0.2, -0.3, 0.4])
    for model in MODELS.values():
        estimate, dynamics, thrusters = started(velocity=(0.6, -0.4, 0.1), model=model)
        R, x = Rotation.from_euler("zyx", [0.7, -0.3, 0.2]).as_matrix(), estimate.state
        x[CURRENT:NET_WEIGHT], x[NET_WEIGHT], x[MOMENTS:HEIGHT] = (0.2, -0.1), 7.0, (0.3, -0.2, 4.0, 0.5)
        x[EFFECTIVENESS:CEILING], x[LAG], x[DRAG] = rng.uniform(0.5, 1.0, 8), 0.0, 0.6
        estimate.covariance[CEILING:] = 0.0  # the limits are known
        publish(estimate)
        thrusters.forces[:] = rng.uniform(-20.0, 20.0, 8)
        loads = Loads(estimate.water_velocity, 7.0, estimate.moments, 0.5, 0.6)
        free = free_acceleration(dynamics, R, estimate.velocity, omega, loads)
        pushed = thrust_acceleration(dynamics, thrusters, R, thrusters.forces * x[EFFECTIVENESS:CEILING])
        a, v, p = (free + pushed)[:3], estimate.velocity.copy(), estimate.position.copy()
        predict(estimate, dynamics, thrusters, R, omega)
        assert estimate.acceleration == pytest.approx(a, rel=1e-10)
        assert estimate.position == pytest.approx(p + PERIOD * v + 0.5 * PERIOD**2 * a, rel=1e-12)
        assert estimate.velocity == pytest.approx(v + PERIOD * a, rel=1e-12)
        assert thrusters.effectiveness == pytest.approx(x[EFFECTIVENESS:CEILING], rel=1e-12)
        assert estimate.time_since_measurement == PERIOD


def test_measurement_gate_is_six_standard_deviations_plus_0_05():
    for first, noise in ((POSITION, GAINS.position_noise), (VELOCITY, GAINS.velocity_noise)):
        for part, believed in ((0.98, True), (1.02, False)):
            estimate, dynamics, thrusters = started()
            predict(estimate, dynamics, thrusters)
            gate = 6.0 * np.sqrt(estimate.covariance[first + 1, first + 1] + noise**2) + 0.05
            for sign in (1.0, -1.0):
                seen = copy.deepcopy(estimate)
                measured = seen.state[first : first + 3] + np.array([0.0, sign * part * gate, 0.0])
                assert observer.correct(seen, first, measured, noise, GAINS) == believed


def test_observer_initializes_without_velocity():
    estimate = make_estimate(ODIN)
    initialize(estimate, np.array([1.0, 2.0, 3.0]), np.full(3, np.nan), GAINS)
    assert estimate.position.tolist() == [1.0, 2.0, 3.0] and not estimate.velocity.any()
    assert np.diag(estimate.covariance)[:6] == pytest.approx([0.02**2] * 3 + [0.3**2] * 3)


def test_reset_keeps_only_effectiveness_and_ceilings():
    estimate, dynamics, thrusters = started(velocity=(0.3, 0.0, 0.0))
    for _ in range(20):
        predict(estimate, dynamics, thrusters)
        correct(estimate, estimate.position + 0.01, estimate.velocity + 0.01)
    set_effectiveness(estimate, 2, 0.0)
    kept, estimate.drift[:], estimate.misfit = estimate.state[EFFECTIVENESS:].copy(), 9.0, 4.0
    reset(estimate)
    fresh = make_estimate(ODIN)
    assert np.array_equal(estimate.state[:EFFECTIVENESS], fresh.state[:EFFECTIVENESS])
    assert np.array_equal(estimate.covariance[:EFFECTIVENESS], fresh.covariance[:EFFECTIVENESS])
    assert np.array_equal(estimate.state[EFFECTIVENESS:], kept) and kept[2] == 0.0
    assert estimate.time_since_measurement == -1.0 and estimate.misfit == 1.0
    assert np.all(estimate.drift == 1.0) and not estimate.bias.any()


def test_disturbances_drift_faster_while_the_innovations_of_their_axis_are_biased():
    """The variance grows at 0.3 (b^2 / 0.02 - 1) a second, up to 400 times, and returns."""
    for axis, channel in enumerate([6, 7, 8, 0, 1, 2]):  # velocity, then moments
        estimate, dynamics, thrusters = started()
        estimate.bias[channel] = 0.2  # twice the usual mean square
        for _ in range(50):
            predict(estimate, dynamics, thrusters)
        expected = np.ones(6)
        expected[axis] = np.exp(0.3 * (0.2**2 / 0.02 - 1.0))
        assert estimate.drift == pytest.approx(expected, rel=1e-9)
        estimate.bias[channel] = 9.0
        estimate.drift[axis] = 399.9
        predict(estimate, dynamics, thrusters)
        assert estimate.drift[axis] == 400.0
        estimate.bias[channel], estimate.drift[axis] = 0.0, 1.001
        predict(estimate, dynamics, thrusters)
        assert estimate.drift[axis] == 1.0


def test_disturbances_stop_drifting_faster_after_a_sensor_is_lost():
    """Its last innovations were biased, and none corrects them."""
    estimate, dynamics, thrusters = started()
    estimate.bias[3:], seen = 0.5, []
    for _ in range(500):
        predict(estimate, dynamics, thrusters)
        seen.append(estimate.drift[:3].max())
    assert max(seen) < 30.0 and seen[-1] < 3.0 and estimate.misfit < 3.0


def test_drag_that_is_not_estimated_stays_the_vehicles():
    estimate, dynamics, thrusters = started(velocity=(0.8, 0.1, 0.0))
    for known, gains in ((False, GAINS), (True, GAINS._replace(drag_estimation=0.0))):
        seen = copy.deepcopy(estimate)
        for _ in range(50):
            predict(seen, dynamics, thrusters, gains=gains)
            correct(seen, seen.position, seen.velocity + 0.01, gains)
        assert (seen.drag == 1.0) == known
