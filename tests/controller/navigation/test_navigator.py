"""The complete navigation filter on measurements of a known motion."""

import numpy as np
import pytest
from scipy.integrate import cumulative_trapezoid
from scipy.spatial.transform import Rotation

from controller import VehicleState
from controller.navigation import Navigator, SensorModel
from controller.navigation.measurements import COMPASS, DEPTH_SENSOR, DVL, IMU, SENSORS, USBL
from controller.navigation.navigation_memory import empty_memory
from controller.navigation.navigator import _write_state

MODEL = SensorModel()


def make_vehicle_state():
    return VehicleState(np.zeros(3), np.zeros(4), np.zeros(6), np.ones(8), np.zeros(12))


def level(navigator, time, position=(1.0, 2.0, 5.0), heading=0.4, sensors=range(5)):
    """Write the measurements of a vehicle at rest."""
    values, times = navigator.measurements
    values[0], values[1:4], values[5:8], values[8:11] = position[2], 0.0, (0.0, 0.0, -9.81), 0.0
    values[11], values[12:15] = heading, position
    for sensor in sensors:
        times[sensor] = time


def rest(navigator, seconds, first=0.0, sensors=range(5)):
    for k in range(round(seconds / 0.01)):  # the USBL once a second
        level(navigator, first + 0.01 * k, sensors=[sensor for sensor in sensors if sensor != USBL or k % 100 == 0])
        navigator.step(first + 0.01 * k)
    return navigator.state


@pytest.mark.parametrize("missing", [DEPTH_SENSOR, IMU, COMPASS, USBL])
def test_state_is_nan_until_every_required_sensor_has_a_sample(missing):
    navigator = Navigator(MODEL, make_vehicle_state())
    for time in (0.0, 0.5, 1.0):
        level(navigator, time, sensors=[sensor for sensor in range(5) if sensor != missing])
        navigator.step(time)
        for part in navigator.state[:3]:
            assert np.isnan(part).all(), SENSORS[missing]
    for time in (1.5, 2.0):
        level(navigator, time)
        navigator.step(time)
    for part in navigator.state[:3]:
        assert np.isfinite(part).all(), SENSORS[missing]


def test_known_constant_errors_of_the_imu_cause_no_motion():
    navigator = Navigator(MODEL, make_vehicle_state())
    rest(navigator, 1.2)
    memory, before = navigator.memory, [part.copy() for part in navigator.memory[:3]]
    assert navigator.started and before[0] == pytest.approx([1.0, 2.0, 5.0], abs=1e-3)
    memory.constants[:6] = 0.01, -0.02, 0.03, 0.1, 0.2, -0.3
    for k in range(1, 11):
        level(navigator, 1.19 + 0.01 * k, sensors=[IMU])
        navigator.measurements.values[5:11] += memory.constants[[3, 4, 5, 0, 1, 2]]
        navigator.step(1.19 + 0.01 * k)
    assert navigator.started and memory.time == pytest.approx(1.29)
    for part, was in zip(memory[:3], before, strict=True):
        assert part == pytest.approx(was, abs=1e-4)


def test_state_of_a_resting_vehicle_is_estimated():
    state = rest(Navigator(MODEL, make_vehicle_state()), 5.0)
    assert state.position == pytest.approx([1.0, 2.0, 5.0], abs=1e-3)
    assert state.velocity_body == pytest.approx(np.zeros(6), abs=1e-3)
    yaw, pitch, roll = Rotation.from_quat(state.quaternion[[1, 2, 3, 0]]).as_euler("ZYX")
    assert (yaw, pitch, roll) == pytest.approx((0.4, 0.0, 0.0), abs=1e-3)
    assert state.deviation[2] == pytest.approx(MODEL.depth_bias, rel=0.1)  # a constant error is not averaged out
    assert state.deviation[8] == pytest.approx(MODEL.heading_bias, rel=0.1)
    assert state.deviation[:2].max() < 0.08 and state.deviation[3:6].max() < 0.002


@pytest.mark.parametrize("tilt", [0.0, 1.0, 3.0])
def test_alignment_works_at_any_attitude(tilt):
    navigator, turned = Navigator(MODEL, make_vehicle_state()), Rotation.from_euler("ZYX", [0.4, 0.3, tilt])
    for time in (0.0, 0.5):
        level(navigator, time)
        navigator.measurements.values[5:8] = turned.inv().apply([0.0, 0.0, -9.81])
        navigator.step(time)
    ours = Rotation.from_quat(navigator.state.quaternion[[1, 2, 3, 0]])
    assert (ours * turned.inv()).magnitude() < 1e-9


def test_long_unmeasured_states_become_nan_and_measured_ones_stay():
    """DVL and USBL are out: velocity and position become NaN, depth and attitude do not."""
    navigator = Navigator(MODEL, make_vehicle_state())
    rest(navigator, 3.0)
    lost_velocity = lost_position = None
    for k in range(60):
        state = rest(navigator, 1.0, 3.0 + k, sensors=[DEPTH_SENSOR, IMU, COMPASS])
        if lost_velocity is None and np.isnan(state.velocity_body[0]):
            lost_velocity = k
        if lost_position is None and np.isnan(state.position[0]):
            lost_position = k
        assert state.position[2] == pytest.approx(5.0, abs=0.01)
        assert np.isfinite(state.quaternion).all() and np.isfinite(state.velocity_body[3:]).all()
    assert lost_velocity is not None and lost_velocity > 10
    assert lost_position is not None and lost_position > 10
    state = rest(navigator, 3.0, 63.0)
    assert state.position == pytest.approx([1.0, 2.0, 5.0], abs=0.05)


def test_imu_outage_makes_the_state_nan_and_recovery_realigns():
    navigator = Navigator(MODEL, make_vehicle_state())
    rest(navigator, 1.0)
    state = rest(navigator, 2.0, 1.0, sensors=[DEPTH_SENSOR, DVL, COMPASS, USBL])
    assert np.isnan(state.position).all() and np.isnan(state.quaternion).all()
    state = rest(navigator, 2.0, 3.0)
    assert state.position == pytest.approx([1.0, 2.0, 5.0], abs=0.01)


def test_contradicted_first_position_fix_is_rejected():
    navigator = Navigator(MODEL, make_vehicle_state())
    for k in range(301):
        level(navigator, 0.01 * k, sensors=[DEPTH_SENSOR, DVL, IMU, COMPASS])
        if k % 100 == 0:
            level(navigator, 0.01 * k, position=(1.0, 2.0 + (7.0 if k == 0 else 0.0), 5.0), sensors=[USBL])
        navigator.step(0.01 * k)
        assert np.isnan(navigator.state.position[0]) == (k < 200)
    assert navigator.state.position[1] == pytest.approx(2.0, abs=1e-3)


def test_initial_position_is_the_mean_of_two_fixes_with_their_spread():
    for apart, deviation in ((0.3, np.hypot(0.1, 0.15 / np.sqrt(2.0))), (1.2, np.hypot(0.6, 0.146))):
        navigator = Navigator(MODEL, make_vehicle_state())
        for time, north in ((0.0, 1.0), (1.0, 1.0 + apart)):
            level(navigator, time, position=(north, 1.0 + north, 5.0))
            navigator.step(time)
        assert navigator.state.position == pytest.approx([1.0 + 0.5 * apart, 2.0 + 0.5 * apart, 5.0], abs=1e-9)
        assert navigator.state.deviation[:2] == pytest.approx([deviation] * 2, rel=0.01)
        rates = np.hypot(MODEL.angular_velocity_bias, MODEL.angular_velocity)
        assert navigator.state.deviation[9:] == pytest.approx(np.full(3, rates), rel=0.01)


def test_written_state_is_the_estimate_with_the_deviation_of_each_axis():
    memory, state, turned = empty_memory(), make_vehicle_state(), Rotation.from_euler("ZYX", [0.4, -0.3, 0.2])
    memory.started = memory.time = 1.0
    memory.quaternion[:], memory.velocity[:] = turned.as_quat()[[3, 0, 1, 2]], (0.3, -0.2, 0.1)
    deviation = 0.01 * np.arange(1.0, 19.0)
    memory.covariance[:] = np.diag(deviation**2)
    _write_state(memory, MODEL, 1.0, state)
    assert state.velocity_body[:3] == pytest.approx(turned.inv().apply([0.3, -0.2, 0.1]), abs=1e-12)
    assert state.deviation[:9] == pytest.approx(deviation[:9], rel=1e-12)
    assert state.deviation[9:] == pytest.approx(np.hypot(deviation[9:12], MODEL.angular_velocity), rel=1e-12)
    for axis in range(3):  # which is unknown along one axis alone
        memory.covariance[3:6, 3:6] = np.diag(np.where(np.arange(3) == axis, 0.6, 0.1) ** 2)
        _write_state(memory, MODEL, 1.0, state)
        assert np.isnan(state.velocity_body[:3]).all()


def test_inconsistent_estimate_is_reset_and_realigned():
    """Its attitude is wrong by 40 degrees, more than the covariance of a start holds: the DVL contradicts for ever."""
    navigator = Navigator(MODEL, make_vehicle_state())
    rest(navigator, 0.01)
    rest(navigator, 1.2, first=0.01)
    memory, lost = navigator.memory, []
    memory.accepted[DVL] = memory.resets[DVL] = 0.0
    turned = Rotation.from_quat(memory.quaternion[[1, 2, 3, 0]]) * Rotation.from_euler("y", 40.0, degrees=True)
    memory.quaternion[:] = turned.as_quat()[[3, 0, 1, 2]]
    for k in range(500):
        level(navigator, 1.3 + 0.01 * k, sensors=[s for s in range(5) if s != USBL or k % 100 == 0])
        navigator.step(1.3 + 0.01 * k)
        lost.append(not navigator.started)
    assert any(lost) and navigator.started
    assert navigator.state.position == pytest.approx([1.0, 2.0, 5.0], abs=0.01)
    _, pitch, roll = Rotation.from_quat(navigator.state.quaternion[[1, 2, 3, 0]]).as_euler("ZYX")
    assert (pitch, roll) == pytest.approx((0.0, 0.0), abs=1e-3)


@pytest.mark.medium
def test_filter_is_consistent_on_simulated_motion():
    """Circles with a swell, by 30 sets of noise and constant errors; NEES and NIS within 99.9 % of a consistent one."""
    rng, h, runs = np.random.default_rng(11), 0.01, 30
    nees, nis = [], np.zeros((5, 2))
    for _ in range(runs):
        state = make_vehicle_state()
        navigator = Navigator(MODEL, state)
        scale = [*[MODEL.angular_velocity_bias] * 3, *[MODEL.acceleration_bias] * 3, MODEL.heading_bias,
                 MODEL.depth_bias, MODEL.velocity_scale]  # fmt: skip
        constants, phase = rng.normal(size=9) * scale, rng.uniform(0.0, 6.0)
        values, times = navigator.measurements
        yaw = 0.3 * np.arange(0, 12.0, h) + phase
        R = Rotation.from_euler("ZYX", np.c_[yaw, 0.1 * np.sin(yaw), 0.15 * np.cos(2.0 * yaw)])
        t = np.arange(len(yaw)) * h
        velocity = np.c_[0.6 * np.cos(yaw), 0.6 * np.sin(yaw), 0.1 * np.sin(0.7 * t)]
        position = np.array([1.0, 2.0, 5.0]) + cumulative_trapezoid(velocity, dx=h, axis=0, initial=0.0)
        acceleration = np.diff(velocity, axis=0, prepend=velocity[:1]) / h
        turn = (R[:-1].inv() * R[1:]).as_rotvec() / h
        omega = np.r_[turn[:1], 0.5 * (turn + np.r_[turn[1:], turn[-1:]])]
        middle = Rotation.concatenate([R[:1], R[:-1] * Rotation.from_rotvec(0.5 * h * turn)])
        for k in range(len(t)):
            values[5:8] = middle[k].inv().apply(acceleration[k] - [0.0, 0.0, 9.81]) + constants[3:6]
            values[5:8] += rng.normal(size=3) * MODEL.acceleration
            values[8:11] = omega[k] + constants[:3] + rng.normal(size=3) * MODEL.angular_velocity
            times[IMU] = t[k]
            if k % 5 == 0:
                values[0], times[DEPTH_SENSOR] = position[k, 2] + constants[7] + rng.normal() * MODEL.depth, t[k]
            if k % 12 == 0:
                body = (1.0 + constants[8]) * R[k].inv().apply(velocity[k])
                values[1:4], times[DVL] = body + rng.normal(size=3) * MODEL.velocity, t[k]
            if k % 10 == 0:
                values[11], times[COMPASS] = yaw[k] + constants[6] + rng.normal() * MODEL.heading, t[k]
            if k % 100 == 30 or k == 35:  # 0.3 s late; the first twice, to be accepted
                values[12:15] = position[k - 30] + rng.normal(size=3) * MODEL.position
                times[USBL] = t[k] - 0.3
            navigator.step(t[k])
        memory = navigator.memory
        left = (R[-1] * Rotation.from_quat(memory.quaternion[[1, 2, 3, 0]]).inv()).as_rotvec()
        error = np.r_[
            position[-1] - memory.position, velocity[-1] - memory.velocity, left, constants - memory.constants
        ]
        nees.append(error @ np.linalg.solve(memory.covariance, error))
        nis += memory.innovations[:, :2]
    deviation = np.sqrt(2.0 * 18.0 / runs)
    assert np.mean(nees) == pytest.approx(18.0, abs=3.3 * deviation)
    for sensor in (DEPTH_SENSOR, DVL, COMPASS, USBL):
        total, degrees = nis[sensor]
        assert total / degrees == pytest.approx(1.0, abs=3.3 * np.sqrt(2.0 / degrees) + 0.02), SENSORS[sensor]
