"""Inertial navigation against SciPy's rotations and integrators, and its covariance against plain matrices."""

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from scipy.spatial.transform import Rotation

from controller.navigation.inertial import estimate_at, propagate, rotate
from controller.navigation.measurements import SensorModel
from controller.navigation.navigation_memory import N_ERRORS, empty_memory

SENSORS = SensorModel()
GRAVITY = np.array([0.0, 0.0, 9.81])


def begun(rng):
    memory = empty_memory()
    memory.position[:], memory.velocity[:] = rng.normal(size=3), rng.normal(size=3)
    memory.quaternion[:] = Rotation.random(random_state=rng).as_quat()[[3, 0, 1, 2]]
    memory.omega[:] = rng.normal(size=3) * 0.3
    half = rng.normal(size=(N_ERRORS, N_ERRORS))
    memory.covariance[:] = half @ half.T * 1e-3
    memory.time = 0.0
    return memory


def rotation(quaternion):
    return Rotation.from_quat(np.asarray(quaternion)[[1, 2, 3, 0]])


def skew(a):
    return np.array([[0.0, -a[2], a[1]], [a[2], 0.0, -a[0]], [-a[1], a[0], 0.0]])


def test_small_rotations_are_exact_to_1e_7():
    """Of half a radian, about any axis."""
    rng = np.random.default_rng(4)
    for _ in range(20):
        quaternion, axis = Rotation.random(random_state=rng).as_quat()[[3, 0, 1, 2]], rng.normal(size=3)
        turn = 0.5 * axis / np.linalg.norm(axis)
        expected = rotation(quaternion) * Rotation.from_rotvec(turn)
        rotate(quaternion, turn)
        assert abs(quaternion @ expected.as_quat()[[3, 0, 1, 2]]) == pytest.approx(1.0, abs=1e-14)
        assert (rotation(quaternion).inv() * expected).magnitude() < 2e-7


def test_strapdown_integration_matches_scipy():
    """Of smooth rates and forces, sampled at 200 Hz for 2 s: what SciPy integrates from the same functions."""
    rng = np.random.default_rng(1)
    memory = begun(rng)
    a, b, c, d = rng.normal(size=(4, 3)) * 0.5

    def omega(t):
        return a * np.sin(1.3 * t) + b

    def force(t):
        return c * np.cos(0.9 * t) + d - np.array([0.0, 0.0, 9.8])

    def rate(t, x):
        R = rotation(x[6:] / np.linalg.norm(x[6:])).as_matrix()
        w, q = omega(t), x[6:]
        spin = 0.5 * np.array([-q[1:] @ w, *(q[0] * w + np.cross(q[1:], w))])
        return np.r_[x[3:6], R @ force(t) + GRAVITY, spin]

    memory.omega[:] = omega(0.0)
    start = np.r_[memory.position, memory.velocity, memory.quaternion]
    truth = solve_ivp(rate, (0.0, 2.02), start, rtol=1e-11, atol=1e-12, dense_output=True).sol
    h = 0.005
    for k in range(400):  # the force is the mean of each period
        propagate(memory, force((k + 0.5) * h), omega((k + 1) * h), SENSORS, h)
    end = truth(2.0)
    assert memory.position == pytest.approx(end[:3], abs=2e-4)
    assert memory.velocity == pytest.approx(end[3:6], abs=2e-4)
    assert (rotation(memory.quaternion) * rotation(end[6:]).inv()).magnitude() < 2e-5
    assert memory.time == pytest.approx(2.0)

    # the recent past, between two samples, from the present estimate
    position, velocity, quaternion = np.zeros(3), np.zeros(3), np.zeros(4)
    for time in (1.9975, 1.8, 1.5013, 1.4):
        assert estimate_at(memory, time, position, velocity, quaternion)
        then = truth(time)
        assert position == pytest.approx(then[:3], abs=3e-4)
        assert velocity == pytest.approx(then[3:6], abs=3e-4)
        assert (rotation(quaternion) * rotation(then[6:]).inv()).magnitude() < 1e-4
    assert not estimate_at(memory, 1.2, position, velocity, quaternion)  # 128 samples are remembered
    assert estimate_at(memory, 2.01, position, velocity, quaternion)
    assert position == pytest.approx(truth(2.01)[:3], abs=3e-4)
    assert velocity == pytest.approx(truth(2.01)[3:6], abs=3e-4)
    assert (rotation(quaternion) * rotation(truth(2.01)[6:]).inv()).magnitude() < 2e-4


def test_past_motion_is_interpolated_between_its_two_samples():
    """With forces that change at random from sample to sample."""
    memory, rng, motions = begun(np.random.default_rng(5)), np.random.default_rng(5), np.zeros((6, 10))
    for _ in range(6):
        propagate(memory, rng.normal(size=3) * 20.0, rng.normal(size=3), SENSORS, 0.01)
    for motion, time in zip(motions, (0.02, 0.023, 0.03, 0.05, 0.053, 0.06), strict=True):
        assert estimate_at(memory, time, motion[:3], motion[3:6], motion[6:])
    for before, between, after in (motions[:3, :6], motions[3:, :6]):
        assert between == pytest.approx(0.7 * before + 0.3 * after, rel=1e-9, abs=1e-12)


def test_the_covariance_is_propagated_as_by_plain_matrices():
    rng, sensors = np.random.default_rng(2), SENSORS._replace(acceleration_bias=3.0, angular_velocity_bias=2.0)
    for _ in range(10):
        memory, h = begun(rng), rng.uniform(0.005, 0.05)
        P, omega, force = memory.covariance.copy(), rng.normal(size=3), rng.normal(size=3) * 5.0
        middle = rotation(memory.quaternion) * Rotation.from_rotvec(0.25 * h * (memory.omega + omega))
        R = middle.as_matrix()
        F = np.eye(N_ERRORS)
        F[0:3, 3:6] = h * np.eye(3)
        F[3:6, 6:9], F[3:6, 12:15] = -h * skew(R @ force), -h * R
        F[6:9, 9:12] = -h * R
        Q = np.zeros(N_ERRORS)
        Q[3:6], Q[6:9] = (SENSORS.acceleration * h) ** 2, (SENSORS.angular_velocity * h) ** 2
        Q[9:12] = (1e-3 * sensors.angular_velocity_bias) ** 2 * h
        Q[12:15] = (1e-3 * sensors.acceleration_bias) ** 2 * h
        propagate(memory, force, omega, sensors, h)
        assert memory.covariance == pytest.approx(F @ P @ F.T + np.diag(Q), rel=1e-9, abs=1e-12)


@pytest.mark.medium
def test_error_growth_matches_the_covariance_transition():
    """A small initial error of each state and constant grows as the transition of the covariance."""
    rng = np.random.default_rng(3)
    for i in range(15):
        right, wrong, error = begun(np.random.default_rng(i)), begun(np.random.default_rng(i)), np.zeros(N_ERRORS)
        error[i] = 1e-5
        wrong.covariance[:] = np.outer(error, error)  # true less estimated
        wrong.position[:] -= error[:3]
        wrong.velocity[:] -= error[3:6]
        turned = Rotation.from_rotvec(-error[6:9]) * rotation(wrong.quaternion)
        wrong.quaternion[:] = turned.as_quat()[[3, 0, 1, 2]]
        wrong.omega[:] += error[9:12]  # the error of the gyro is taken off the one that is right
        for _ in range(40):
            force, omega = rng.normal(size=3) * 4.0, rng.normal(size=3)
            propagate(right, force, omega, SENSORS, 0.01)
            propagate(wrong, force + error[12:15], omega + error[9:12], SENSORS._replace(
                acceleration=0.0, angular_velocity=0.0, acceleration_bias=0.0, angular_velocity_bias=0.0
            ), 0.01)  # fmt: skip
        left = (rotation(right.quaternion) * rotation(wrong.quaternion).inv()).as_rotvec()
        grown = np.r_[right.position - wrong.position, right.velocity - wrong.velocity, left]
        variance, sign = np.diag(wrong.covariance)[:9], np.sign(wrong.covariance[:9, i])
        largest = np.abs(grown).max()
        assert np.sqrt(variance) * sign == pytest.approx(grown, abs=0.02 * largest)
