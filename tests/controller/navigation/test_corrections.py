"""Corrections against finite differences of the sensor models and a Kalman filter in plain matrices."""

import copy

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from controller.navigation.corrections import correct_by_sensor
from controller.navigation.inertial import propagate
from controller.navigation.measurements import COMPASS, DEPTH_SENSOR, DVL, USBL, SensorModel, empty_measurements
from controller.navigation.navigation_memory import N_ERRORS, empty_memory, set_first_covariance
from tests.controller.navigation.test_inertial import rotation

SENSORS = SensorModel()
PLACES = {DEPTH_SENSOR: slice(0, 1), DVL: slice(1, 4), COMPASS: slice(11, 12), USBL: slice(12, 15)}
NOISE = {DEPTH_SENSOR: 0.002, DVL: 0.005, COMPASS: 0.0035, USBL: 0.15}


def ideal_measurement(memory, sensor):
    """Return the noise-free measurement of the state that a memory estimates."""
    R = rotation(memory.quaternion)
    if sensor == DEPTH_SENSOR:
        return np.array([memory.position[2] + memory.constants[7]])
    if sensor == DVL:
        return (1.0 + memory.constants[8]) * R.inv().apply(memory.velocity)
    if sensor == COMPASS:
        return np.array([R.as_euler("ZYX")[0] + memory.constants[6]])
    return memory.position.copy()


def moved(memory, error):
    """The state that is an error off the estimate of a memory."""
    off = copy.deepcopy(memory)
    off.position[:] += error[:3]
    off.velocity[:] += error[3:6]
    off.quaternion[:] = (Rotation.from_rotvec(error[6:9]) * rotation(off.quaternion)).as_quat()[[3, 0, 1, 2]]
    off.constants[:] += error[9:]
    return off


def begun(rng, age=0.0):
    """An estimate that has moved for some time; with the estimate `age` before."""
    memory = empty_memory()
    memory.position[:], memory.velocity[:] = rng.normal(size=3), rng.normal(size=3)
    tilted = Rotation.from_euler("ZYX", rng.uniform([-3.0, -0.6, -0.6], [3.0, 0.6, 0.6]))
    memory.quaternion[:] = tilted.as_quat()[[3, 0, 1, 2]]
    memory.constants[:] = rng.normal(size=9) * [*[0.01] * 3, *[0.1] * 3, 0.02, 0.02, 0.01]
    memory.time = memory.started = 1.0
    samples = rng.normal(size=3) * 0.3 + [0.0, 0.0, -9.8], rng.normal(size=3) * 0.2
    memory.omega[:] = samples[1]
    propagate(memory, *samples, SENSORS, 0.01)
    before = copy.deepcopy(memory)
    for _ in range(round(age / 0.01)):
        propagate(memory, *samples, SENSORS, 0.01)
    half = rng.normal(size=(N_ERRORS, N_ERRORS))
    scale = np.sqrt([*[0.1] * 3, *[0.05] * 3, *[0.02] * 3, *[0.002] * 3, *[0.02] * 3, 0.02, 0.02, 0.005])
    memory.covariance[:] = half @ half.T / N_ERRORS * np.outer(scale, scale) * 0.002
    return memory, before


def rows_by_differences(memory, sensor):
    step, rows = 1e-6, []
    for i in range(N_ERRORS):
        error = np.zeros(N_ERRORS)
        error[i] = step
        difference = ideal_measurement(moved(memory, error), sensor) - ideal_measurement(moved(memory, -error), sensor)
        rows.append((difference + np.pi) % (2.0 * np.pi) - np.pi if sensor == COMPASS else difference)
    return np.array(rows).T / (2.0 * step)


def test_first_covariance_is_that_of_a_start_at_rest_with_constant_errors_of_the_data_sheets():
    memory = empty_memory()
    memory.covariance[:] = 7.0
    sensors = SensorModel(*range(2, 13), gravity=9.8)
    set_first_covariance(memory, sensors)
    deviations = [np.hypot(0.1, sensors.position)] * 3 + [0.3] * 3 + [0.05, 0.05, 0.3]
    deviations += [sensors.angular_velocity_bias] * 3 + [sensors.acceleration_bias] * 3
    deviations += [sensors.heading_bias, sensors.depth_bias, sensors.velocity_scale]
    assert memory.covariance == pytest.approx(np.diag(np.square(deviations)), rel=1e-12)


def correct(memory, sensor, sample, time):
    """Correct a memory by a sample of a sensor, taken at a time [s]."""
    measurements = empty_measurements()
    measurements.values[PLACES[sensor]], measurements.times[sensor] = sample, time
    correct_by_sensor(memory, measurements, sensor, SENSORS)


def assert_estimate(memory, expected, covariance):
    """Assert that a memory has the motion and the constants of another one, and a covariance."""
    assert memory.covariance == pytest.approx(covariance, rel=1e-5, abs=1e-9)
    for ours, theirs in zip(memory[:4], expected[:4], strict=True):
        assert ours == pytest.approx(theirs, abs=2e-6)


@pytest.mark.parametrize("axis", range(3))
def test_attitude_is_corrected_by_the_measured_velocity_while_the_estimated_one_is_unknown(axis):
    """Along one axis of the world: the derivatives are those of a vehicle with the velocity of the sample."""
    memory, _ = begun(np.random.default_rng(20 + axis))
    memory.covariance[3 + axis, 3 + axis] += 0.3**2
    error = np.zeros(N_ERRORS)
    error[3 + axis] = 0.4
    truth, P = moved(memory, error), memory.covariance.copy()
    H, off = rows_by_differences(truth, DVL), ideal_measurement(truth, DVL) - ideal_measurement(memory, DVL)
    K = P @ H.T @ np.linalg.inv(H @ P @ H.T + NOISE[DVL] ** 2 * np.eye(3))
    expected = moved(memory, K @ off), (np.eye(N_ERRORS) - K @ H) @ P
    correct(memory, DVL, ideal_measurement(truth, DVL), memory.time)
    assert_estimate(memory, *expected)


@pytest.mark.parametrize("age", [0.0, 0.1])
@pytest.mark.parametrize("sensor", list(PLACES))
def test_sample_corrects_as_by_plain_matrices(sensor, age):
    """By H (I - t F) with H of the sample's time, t before now, and F of the growth of the errors since."""
    rng = np.random.default_rng(30 + sensor)
    memory, before = begun(rng, age)
    R, F = rotation(before.quaternion).as_matrix(), np.zeros((N_ERRORS, N_ERRORS))
    F[0:3, 3:6], F[3:6, 12:15], F[6:9, 9:12] = np.eye(3), -R, -R
    F[3:6, 6:9] = -np.cross(memory.acceleration - [0.0, 0.0, SENSORS.gravity], np.eye(3)).T  # -S(R f)
    H, P = rows_by_differences(before, sensor) @ (np.eye(N_ERRORS) - age * F), memory.covariance.copy()
    S = H @ P @ H.T + NOISE[sensor] ** 2 * np.eye(len(H))
    off, K = rng.multivariate_normal(np.zeros(len(H)), S) * 0.5, P @ H.T @ np.linalg.inv(S)
    expected = moved(memory, K @ off), (np.eye(N_ERRORS) - K @ H) @ P
    correct(memory, sensor, ideal_measurement(before, sensor) + off, before.time)
    assert_estimate(memory, *expected)
    assert memory.innovations[sensor] == pytest.approx([off @ np.linalg.inv(S) @ off, len(H), 0.0], rel=1e-5)
    assert (memory.accepted[sensor], memory.rejected[sensor], memory.resets[sensor]) == (1.0, 0.0, 0.0)


@pytest.mark.parametrize("sensor", list(PLACES))
def test_sample_from_before_the_history_counts_as_rejected_alone(sensor):
    memory, _ = begun(np.random.default_rng(9))
    expected, measurements = copy.deepcopy(memory), empty_measurements()
    measurements.times[sensor] = memory.time - 1.0
    expected.innovations[sensor, 2] = 1.0
    correct_by_sensor(memory, measurements, sensor, SENSORS)
    for ours, theirs in zip(memory, expected, strict=True):
        assert np.array_equal(ours, theirs, equal_nan=True)


def test_single_outlier_is_rejected_and_third_consecutive_is_accepted():
    memory, _ = begun(np.random.default_rng(5))
    set_first_covariance(memory, SENSORS)
    memory.covariance[:3, :3], memory.accepted[USBL] = 1e-4 * np.eye(3), 3.0
    before, measurements = memory.position.copy(), empty_measurements()
    measurements.values[12:15] = before + np.array([5.0, 0.0, 0.0])
    for k in range(2):
        measurements.times[USBL] = memory.time
        correct_by_sensor(memory, measurements, USBL, SENSORS)
        assert np.array_equal(memory.position, before) and memory.rejected[USBL] == k + 1.0
    measurements.times[USBL] = memory.time
    correct_by_sensor(memory, measurements, USBL, SENSORS)
    assert memory.position[0] == pytest.approx(before[0] + 5.0, abs=0.05) and memory.rejected[USBL] == 0.0
    assert memory.innovations[USBL, 2] == 3.0
    measurements.values[12:15] = before  # which was an outlier, too: the next contradicts it
    correct_by_sensor(memory, measurements, USBL, SENSORS)
    assert memory.position[0] == pytest.approx(before[0], abs=0.05)


@pytest.mark.parametrize("sensor", [DEPTH_SENSOR, USBL])
def test_third_consecutive_outlier_widens_the_position_by_its_innovation(sensor):
    """Before it corrects; all other errors start again, as a Kalman filter in plain matrices does then."""
    memory, _ = begun(np.random.default_rng(8))
    set_first_covariance(memory, SENSORS)
    start = memory.covariance.copy()
    memory.covariance[:3, :3], memory.accepted[sensor] = 1e-4 * np.eye(3), 3.0
    H, off = rows_by_differences(memory, sensor), np.array([0.3, 1.2, -0.1])[-len(ideal_measurement(memory, sensor)) :]
    measurements = empty_measurements()
    measurements.values[PLACES[sensor]] = ideal_measurement(memory, sensor) + off
    for _ in range(3):
        measurements.times[sensor] = memory.time
        correct_by_sensor(memory, measurements, sensor, SENSORS)
    assert (memory.accepted[sensor], memory.rejected[sensor], memory.resets[sensor]) == (1.0, 0.0, 1.0)
    P = start
    P[:3, :3] = 1e-4 * np.eye(3)
    P[range(3), range(3)] += H[:, :3].T @ off**2
    K = P @ H.T @ np.linalg.inv(H @ P @ H.T + NOISE[sensor] ** 2 * np.eye(len(H)))
    assert memory.covariance == pytest.approx((np.eye(N_ERRORS) - K @ H) @ P, rel=1e-5, abs=1e-9)


@pytest.mark.parametrize("side", [1.0, -1.0])
def test_heading_innovation_wraps_around(side):
    memory, _ = begun(np.random.default_rng(6))
    set_first_covariance(memory, SENSORS)
    memory.quaternion[:] = Rotation.from_euler("Z", side * (np.pi - 0.01)).as_quat()[[3, 0, 1, 2]]
    memory.constants[6] = 0.0
    measurements = empty_measurements()
    measurements.values[11] = -side * (np.pi - 0.01)
    measurements.times[COMPASS] = memory.time
    correct_by_sensor(memory, measurements, COMPASS, SENSORS)
    yaw = rotation(memory.quaternion).as_euler("ZYX")[0] + memory.constants[6]
    assert abs((yaw - side * (np.pi + 0.01) + np.pi) % (2 * np.pi) - np.pi) < 1e-3


def test_compass_sample_is_ignored_at_vertical_pitch():
    memory, _ = begun(np.random.default_rng(7))
    memory.quaternion[:] = Rotation.from_euler("Y", 1.5).as_quat()[[3, 0, 1, 2]]
    before = copy.deepcopy(memory)
    measurements = empty_measurements()
    measurements.times[COMPASS] = memory.time
    correct_by_sensor(memory, measurements, COMPASS, SENSORS)
    for ours, theirs in zip(memory, before, strict=True):
        assert np.array_equal(ours, theirs, equal_nan=True)
