"""Corrections of the estimate by a sample of one sensor: depth, velocity, heading or position."""

# A late measurement is compared with the estimate of its time, and corrects by the growth of the errors since then: an
# error of the position then is that of now less the effect of the velocity's error, and so on. Samples farther off than
# `_GATE` standard deviations are rejected. After `_REJECTED_IN_A_ROW` of them the estimate counts as wrong, perhaps by
# an outlier while it was uncertain: its covariance is then that of the start. If that does not help either, the filter
# starts again.

from __future__ import annotations

import numpy as np

from controller.arithmetic import arctangent, square
from controller.linear_algebra import cross
from controller.navigation.inertial import estimate_at, rotate
from controller.navigation.measurements import DEPTH, DEPTH_SENSOR, DVL, HEADING, USBL, Measurements, SensorModel
from controller.navigation.measurements import POSITION as MEASURED_POSITION
from controller.navigation.measurements import VELOCITY as MEASURED_VELOCITY
from controller.navigation.navigation_memory import (
    ACCELERATION_BIAS,
    ATTITUDE,
    DEPTH_BIAS,
    GYRO_BIAS,
    HEADING_BIAS,
    N_ERRORS,
    POSITION,
    VELOCITY,
    VELOCITY_SCALE,
    ErrorMatrix,
    ErrorRows,
    Errors,
    NavigationMemory,
    set_first_covariance,
)
from controller.quaternion import multiply, rotation_matrix, skew
from controller.stack_array import Matrix3, Vector3, Vector4, array, zeros

_GATE = 4.0  # number of standard deviations of an innovation beyond which a sample is rejected
_UNKNOWN = 10.0  # ratio of the velocity's deviation to a sample's above which the sample is nearer to the truth
_REJECTED_IN_A_ROW = 3  # number of successive rejected samples that is rare where one in fifty is an outlier
CONFIRMED = 3.0  # number of accepted samples after which a sample that contradicts them is an outlier
_RESETS = 4.0  # number of resets of the covariance without a confirmed sample in between before the filter starts again
_SHORT = 0.02  # s, over which the attitude's change gives the angular velocity of a late sample
_STEEP = 0.1  # squared cosine of the pitch below which a compass is not used
_HALF_TURN, _TURN = 3.141592653589793, 6.283185307179586  # rad
_LEAST_SCALE = 1e-3  # least noise of a sensor, in its unit, which keeps the covariance positive


def correct_by_sensor(memory: NavigationMemory, measurements: Measurements, sensor: int, sensors: SensorModel) -> None:
    """Correct the estimate by the last sample of a sensor."""
    count = 3 if sensor in (DVL, USBL) else 1
    position, velocity, quaternion, innovation = zeros(3), zeros(3), zeros(4), zeros(3)
    rows = zeros(3, N_ERRORS)
    if not estimate_at(memory, measurements.times[sensor], position, velocity, quaternion):
        memory.innovations[sensor, 2] += 1.0
        return
    R = rotation_matrix(quaternion)
    noise = _predict_sample(memory, measurements, sensor, sensors, position, velocity, quaternion, R, innovation, rows)
    if noise < 0.0:
        return
    age = memory.time - measurements.times[sensor]
    for i in range(count):
        _age_row(rows[i], age, memory.acceleration, R, sensors.gravity)
    if _is_outlier(memory.covariance, rows, innovation, noise, count):
        memory.innovations[sensor, 2] += 1.0
        memory.rejected[sensor] += 1.0
        believed = memory.accepted[sensor] >= CONFIRMED  # else one of the few before may be the outlier as well
        if believed and memory.rejected[sensor] < _REJECTED_IN_A_ROW:
            return
        memory.resets[sensor] += 1.0
        if memory.resets[sensor] > _RESETS:  # the covariance of a start does not cover such errors
            restart(memory)
            return
        _reset_covariance(memory, sensor, innovation, sensors)
    memory.rejected[sensor] = 0.0
    memory.accepted[sensor] += 1.0
    if memory.accepted[sensor] >= CONFIRMED:
        memory.resets[sensor] = 0.0
    error = zeros(N_ERRORS)
    for i in range(count):
        _correct_number(memory, error, rows[i], innovation[i], noise, sensor)
    _apply(memory, error)


def _predict_sample(
    memory: NavigationMemory,
    measurements: Measurements,
    sensor: int,
    sensors: SensorModel,
    position: Vector3,
    velocity: Vector3,
    quaternion: Vector4,
    R: Matrix3,
    innovation: Vector3,
    rows: ErrorRows,
) -> float:
    """Write innovations and rows at the time of the sample; return its noise, or -1 for an unusable sample."""
    values = measurements.values
    if sensor == DEPTH_SENSOR:
        innovation[0] = values[DEPTH] - position[2] - memory.constants[DEPTH_BIAS - GYRO_BIAS]
        rows[0, POSITION + 2] = rows[0, DEPTH_BIAS] = 1.0
        return max(sensors.depth, _LEAST_SCALE)
    if sensor == USBL:
        innovation[:] = values[MEASURED_POSITION : MEASURED_POSITION + 3] - position
        for i in range(3):
            rows[i, POSITION + i] = 1.0
        return max(sensors.position, _LEAST_SCALE)
    if sensor == DVL:
        scale = 1.0 + memory.constants[VELOCITY_SCALE - GYRO_BIAS]
        sample = values[MEASURED_VELOCITY : MEASURED_VELOCITY + 3]
        P, noise = memory.covariance, max(sensors.velocity, _LEAST_SCALE)
        unknown = max(P[VELOCITY, VELOCITY], P[VELOCITY + 1, VELOCITY + 1], P[VELOCITY + 2, VELOCITY + 2])
        lever_velocity = cross(_turn_rate(memory, measurements.times[DVL], quaternion), sensors.dvl_position)
        # an error of attitude acts on the true velocity, to which the sample is nearer
        body_velocity = sample - scale * lever_velocity
        world_velocity = R @ body_velocity / scale if unknown > square(_UNKNOWN * noise) else velocity
        innovation[:] = sample - scale * (R.T @ velocity + lever_velocity)
        rows[:, VELOCITY : VELOCITY + 3] = scale * R.T
        rows[:, ATTITUDE : ATTITUDE + 3] = scale * (R.T @ skew(world_velocity))
        rows[:, VELOCITY_SCALE] = R.T @ world_velocity
        return noise
    level = square(R[0, 0]) + square(R[1, 0])  # the bow, x of the body, seen from above
    if level < _STEEP:
        return -1.0
    off = values[HEADING] - arctangent(R[1, 0], R[0, 0]) - memory.constants[HEADING_BIAS - GYRO_BIAS]
    while off > _HALF_TURN:
        off -= _TURN
    while off < -_HALF_TURN:
        off += _TURN
    innovation[0] = off
    rows[0, ATTITUDE] = -R[2, 0] * R[0, 0] / level
    rows[0, ATTITUDE + 1] = -R[2, 0] * R[1, 0] / level
    rows[0, ATTITUDE + 2] = rows[0, HEADING_BIAS] = 1.0
    return max(sensors.heading, _LEAST_SCALE)


def _turn_rate(memory: NavigationMemory, time: float, quaternion: Vector4) -> Vector3:
    """Return the angular velocity [rad/s] at a time [s] and the attitude there, by its change from shortly before."""
    before = zeros(4)
    if time >= memory.time or not estimate_at(memory, time - _SHORT, zeros(3), zeros(3), before):
        return memory.omega.copy()
    change = multiply(array(before[0], -before[1], -before[2], -before[3]), quaternion)
    return (2.0 / _SHORT) * change[1:]


def _age_row(row: Errors, age: float, acceleration: Vector3, R: Matrix3, gravity: float) -> None:
    """Transform a row for the errors at the sample's time to those of now, `age` [s] later, to first order in it."""
    by_velocity, by_attitude = row[VELOCITY : VELOCITY + 3].copy(), row[ATTITUDE : ATTITUDE + 3].copy()
    row[VELOCITY : VELOCITY + 3] -= age * row[:3]
    row[ATTITUDE : ATTITUDE + 3] -= age * cross(acceleration - array(0.0, 0.0, gravity), by_velocity)
    row[ACCELERATION_BIAS : ACCELERATION_BIAS + 3] += age * (by_velocity @ R)
    row[GYRO_BIAS : GYRO_BIAS + 3] += age * (by_attitude @ R)


def _is_outlier(P: ErrorMatrix, rows: ErrorRows, innovation: Vector3, noise: float, count: int) -> bool:
    """Return True if an innovation is beyond the gate, or not a number."""
    for n in range(count):
        variance = square(noise) + rows[n] @ (P @ rows[n])
        if not abs(innovation[n]) <= _GATE * np.sqrt(variance):
            return True
    return False


def restart(memory: NavigationMemory) -> None:
    """Clear the estimate, so that the filter starts again with the next fixes."""
    memory.started = 0.0
    memory.previous_fix[:] = np.nan


def _reset_covariance(memory: NavigationMemory, sensor: int, innovation: Vector3, sensors: SensorModel) -> None:
    """Reset the covariance to the start's; that of the position stays, and grows by a fix's or depth's innovation."""
    P = memory.covariance
    variances = array(P[0, 0], P[1, 1], P[2, 2])
    if sensor == USBL:
        variances += innovation**2
    elif sensor == DEPTH_SENSOR:
        variances[2] += square(innovation[0])
    set_first_covariance(memory, sensors)
    memory.accepted[sensor] = 0.0
    for i in range(3):
        P[POSITION + i, POSITION + i] = variances[i]


def _correct_number(
    memory: NavigationMemory, error: Errors, row: Errors, innovation: float, noise: float, sensor: int
) -> None:
    """Correct error and covariance by one measured number, whose derivative by the errors is `row`."""
    P = memory.covariance
    gain = P @ row
    variance = square(noise) + gain @ row
    innovation -= float(row @ error)
    memory.innovations[sensor, 0] += square(innovation) / variance
    memory.innovations[sensor, 1] += 1.0
    for i in range(N_ERRORS):
        fraction = gain[i] / variance
        error[i] += fraction * innovation
        P[i] -= fraction * gain


def _apply(memory: NavigationMemory, error: Errors) -> None:
    """Add an estimated error to the estimate."""
    memory.position += error[:3]
    memory.velocity += error[VELOCITY : VELOCITY + 3]
    turn = rotation_matrix(memory.quaternion).T @ error[ATTITUDE : ATTITUDE + 3]  # from world to body axes
    rotate(memory.quaternion, turn)
    memory.constants += error[GYRO_BIAS:]
