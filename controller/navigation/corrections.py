"""Corrections of the estimate by a sample of one sensor: depth, velocity, heading or position."""

# A late measurement is compared with the estimate of its time, and corrects by the growth of the errors since then: an
# error of the position then is that of now less the effect of the velocity's error, and so on. Samples farther off than
# `_GATE` standard deviations are rejected. After `_REJECTED_IN_A_ROW` of them the estimate counts as wrong, perhaps by
# an outlier while it was uncertain: its covariance is then that of the start. If that does not help either, the filter
# starts again.

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from controller.arithmetic import arctangent, square
from controller.navigation.estimate import (
    ACCELERATION_BIAS,
    ATTITUDE,
    DEPTH_BIAS,
    GYRO_BIAS,
    HEADING_BIAS,
    N_ERRORS,
    POSITION,
    VELOCITY,
    VELOCITY_SCALE,
    NavigationMemory,
    set_first_covariance,
)
from controller.navigation.inertial import estimate_at, rotate
from controller.navigation.measurements import DEPTH, DEPTH_SENSOR, DVL, HEADING, USBL, Measurements, SensorModel
from controller.navigation.measurements import POSITION as MEASURED_POSITION
from controller.navigation.measurements import VELOCITY as MEASURED_VELOCITY
from controller.quaternion import rotation_matrix
from controller.stack_array import zeros

Array = NDArray[np.float64]

_GATE = 4.0  # number of standard deviations of an innovation beyond which a sample is rejected
_UNKNOWN = 10.0  # ratio of the velocity's deviation to a sample's above which the sample is nearer to the truth
_REJECTED_IN_A_ROW = 3  # number of successive rejected samples that is rare where one in fifty is an outlier
CONFIRMED = 3.0  # number of accepted samples after which a sample that contradicts them is an outlier
_RESETS = 4.0  # number of resets of the covariance without a confirmed sample in between before the filter starts again
_STEEP = 0.1  # squared cosine of the pitch below which a compass is not used
_HALF_TURN, _TURN = 3.141592653589793, 6.283185307179586  # rad
_LEAST_SCALE = 1e-3  # least noise of a sensor, in its unit, which keeps the covariance positive


def correct_by_sensor(memory: NavigationMemory, measurements: Measurements, sensor: int, sensors: SensorModel) -> None:
    """Correct the estimate by the last sample of a sensor."""
    count = 3 if sensor in (DVL, USBL) else 1
    position, velocity, quaternion, innovation = zeros(3), zeros(3), zeros(4), zeros(3)
    rows = zeros(3, 18)
    if not estimate_at(memory, measurements.times[sensor], position, velocity, quaternion):
        memory.innovations[sensor, 2] += 1.0
        return
    R = rotation_matrix(quaternion)
    noise = _predict_sample(memory, measurements, sensor, sensors, position, velocity, R, innovation, rows)
    if noise < 0.0:
        return
    age = memory.time[0] - measurements.times[sensor]
    for i in range(count):
        _age_row(rows, i, age, memory.acceleration, R, sensors.gravity)
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
    error = zeros(18)
    for i in range(count):
        for k in range(N_ERRORS):
            memory.row[k] = rows[i, k]
        _correct_number(memory, error, innovation[i], noise, sensor)
    _apply(memory, error)


def _predict_sample(
    memory: NavigationMemory,
    measurements: Measurements,
    sensor: int,
    sensors: SensorModel,
    position: Array,
    velocity: Array,
    R: Array,
    innovation: Array,
    rows: Array,
) -> float:
    """Write innovations and rows at the time of the sample; return its noise, or -1 for an unusable sample."""
    values = measurements.values
    if sensor == DEPTH_SENSOR:
        innovation[0] = values[DEPTH] - position[2] - memory.constants[DEPTH_BIAS - GYRO_BIAS]
        rows[0, POSITION + 2] = rows[0, DEPTH_BIAS] = 1.0
        return max(sensors.depth, _LEAST_SCALE)
    if sensor == USBL:
        for i in range(3):
            innovation[i] = values[MEASURED_POSITION + i] - position[i]
            rows[i, POSITION + i] = 1.0
        return max(sensors.position, _LEAST_SCALE)
    if sensor == DVL:
        scale, world_velocity = 1.0 + memory.constants[VELOCITY_SCALE - GYRO_BIAS], zeros(3)
        noise, unknown = max(sensors.velocity, _LEAST_SCALE), 0.0
        for k in range(3):
            unknown = max(unknown, memory.covariance[VELOCITY + k, VELOCITY + k])
            world_velocity[k] = velocity[k]
        # an error of attitude acts on the true velocity, to which the sample is nearer
        if unknown > square(_UNKNOWN * noise):
            for k in range(3):
                world_velocity[k] = 0.0
                for i in range(3):
                    world_velocity[k] += R[k, i] * values[MEASURED_VELOCITY + i] / scale
        for i in range(3):
            body = 0.0
            for k in range(3):
                body += R[k, i] * velocity[k]
                rows[i, VELOCITY + k] = scale * R[k, i]
                a, b = (k + 1) % 3, (k + 2) % 3  # R^T S(v) dtheta
                rows[i, ATTITUDE + k] = scale * (R[a, i] * world_velocity[b] - R[b, i] * world_velocity[a])
            rows[i, VELOCITY_SCALE] = (
                R[0, i] * world_velocity[0] + R[1, i] * world_velocity[1] + R[2, i] * world_velocity[2]
            )
            innovation[i] = values[MEASURED_VELOCITY + i] - scale * body
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


def _age_row(rows: Array, i: int, age: float, acceleration: Array, R: Array, gravity: float) -> None:
    """Transform a row for the errors at the sample's time to those of now, `age` [s] later, to first order in it."""
    f, of_position, of_velocity, of_attitude = zeros(3), zeros(3), zeros(3), zeros(3)
    for k in range(3):
        f[k] = acceleration[k] - (gravity if k == 2 else 0.0)
        of_position[k] = rows[i, POSITION + k]
        of_velocity[k] = rows[i, VELOCITY + k]
        of_attitude[k] = rows[i, ATTITUDE + k]
    for k in range(3):
        rows[i, VELOCITY + k] -= age * of_position[k]
        a, b = (k + 1) % 3, (k + 2) % 3  # S(f)^T of the velocity's row
        rows[i, ATTITUDE + k] -= age * (f[a] * of_velocity[b] - f[b] * of_velocity[a])
        for j in range(3):
            rows[i, ACCELERATION_BIAS + k] += age * of_velocity[j] * R[j, k]
            rows[i, GYRO_BIAS + k] += age * of_attitude[j] * R[j, k]


def _is_outlier(P: Array, rows: Array, innovation: Array, noise: float, count: int) -> bool:
    """Return True if an innovation is beyond the gate, or not a number."""
    for n in range(count):
        variance = square(noise)
        for i in range(N_ERRORS):
            if rows[n, i] != 0.0:
                for k in range(N_ERRORS):
                    variance += rows[n, i] * P[i, k] * rows[n, k]
        if not abs(innovation[n]) <= _GATE * np.sqrt(variance):
            return True
    return False


def restart(memory: NavigationMemory) -> None:
    """Clear the estimate, so that the filter starts again with the next fixes."""
    memory.started[0] = 0.0
    memory.previous_fix[:] = np.nan


def _reset_covariance(memory: NavigationMemory, sensor: int, innovation: Array, sensors: SensorModel) -> None:
    """Reset the covariance to the start's; that of the position stays, and grows by a fix's or depth's innovation."""
    variances = zeros(3)
    for i in range(3):
        variances[i] = memory.covariance[POSITION + i, POSITION + i]
    if sensor == USBL:
        for i in range(3):
            variances[i] += square(innovation[i])
    elif sensor == DEPTH_SENSOR:
        variances[2] += square(innovation[0])
    set_first_covariance(memory, sensors)
    memory.accepted[sensor] = 0.0
    for i in range(3):
        memory.covariance[POSITION + i, POSITION + i] = variances[i]


def _correct_number(memory: NavigationMemory, error: Array, innovation: float, noise: float, sensor: int) -> None:
    """Correct error, shape (18,), and covariance by one measured number, whose `row` is set."""
    P, row, gain = memory.covariance, memory.row, memory.gain
    variance = square(noise)
    for i in range(N_ERRORS):
        gain[i] = 0.0
        for k in range(N_ERRORS):
            gain[i] += P[i, k] * row[k]
    for i in range(N_ERRORS):
        variance += row[i] * gain[i]
        innovation -= row[i] * error[i]
    memory.innovations[sensor, 0] += square(innovation) / variance
    memory.innovations[sensor, 1] += 1.0
    for i in range(N_ERRORS):
        share = gain[i] / variance
        error[i] += share * innovation
        for k in range(N_ERRORS):
            P[i, k] -= share * gain[k]


def _apply(memory: NavigationMemory, error: Array) -> None:
    """Add an estimated error, shape (18,), to the estimate."""
    R, turn = rotation_matrix(memory.quaternion), zeros(3)
    for i in range(3):
        memory.position[i] += error[POSITION + i]
        memory.velocity[i] += error[VELOCITY + i]
        for k in range(3):  # from world to body axes
            turn[i] += R[k, i] * error[ATTITUDE + k]
    rotate(memory.quaternion, turn)
    for i in range(N_ERRORS - GYRO_BIAS):
        memory.constants[i] += error[GYRO_BIAS + i]
