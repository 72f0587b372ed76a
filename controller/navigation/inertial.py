"""Inertial navigation: propagate the estimate and its covariance from one IMU sample to the next."""

# p' = v, v' = R f + g e3, R' = R S(omega), with the specific force f and the rates omega less their constant errors.
# The errors, true less estimated, follow
#
#     dp' = dv,   dv' = -S(R f) dtheta - R db_a,   dtheta' = -R db_g,
#
# with dtheta the small rotation in world axes that turns the estimated attitude into the true one.

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from controller.arithmetic import square
from controller.navigation.estimate import (
    ACCELERATION_BIAS,
    ATTITUDE,
    GYRO_BIAS,
    N_ERRORS,
    POSITION,
    VELOCITY,
    NavigationMemory,
)
from controller.navigation.measurements import SensorModel
from controller.quaternion import rotation_matrix
from controller.stack_array import zeros

Array = NDArray[np.float64]

_DRIFT = 1e-3  # 1/sqrt(s), random walk of a constant error, as a fraction of its standard deviation


def propagate(memory: NavigationMemory, force: Array, omega: Array, sensors: SensorModel, period: float) -> None:
    """Propagate over a period [s] up to a sample of specific force [m/s2] and rates [rad/s], body axes, (3,) each."""
    # The force is that of the period before the sample; the rates change evenly within it.
    turn, f = zeros(3), zeros(3)
    for i in range(3):
        turn[i] = 0.5 * period * (memory.omega[i] + omega[i])
        f[i] = 0.5 * turn[i]
    rotate(memory.quaternion, f)  # to the middle of the period
    R = rotation_matrix(memory.quaternion)
    rotate(memory.quaternion, f)
    for axis in range(3):
        f[axis] = 0.0
        for k in range(3):
            f[axis] += R[axis, k] * force[k]
        acceleration = f[axis] + (sensors.gravity if axis == 2 else 0.0)
        step = period * (memory.velocity[axis] + 0.5 * period * acceleration)
        memory.position[axis] += step
        memory.velocity[axis] += period * acceleration
        memory.imu_motion[axis] += step
        memory.imu_motion[3 + axis] += period * acceleration
        memory.acceleration[axis] = acceleration
        memory.omega[axis] = omega[axis]
    rotate(memory.imu_motion[6:], turn)
    memory.time[0] += period
    _record(memory)
    _propagate_covariance(memory.covariance, R, f, sensors, period)


def rotate(quaternion: Array, turn: Array) -> None:
    """Turn an attitude, shape (4,), by a small rotation vector [rad] in body axes, shape (3,); exact to 1e-7 at 0.5."""
    s = square(turn[0]) + square(turn[1]) + square(turn[2])
    scale = 0.5 - s / 48.0 + square(s) / 3840.0
    _multiply_by(quaternion, 1.0 - s / 8.0 + square(s) / 384.0, scale * turn[0], scale * turn[1], scale * turn[2])


def _propagate_covariance(P: Array, R: Array, force: Array, sensors: SensorModel, period: float) -> None:
    """Propagate the covariance; the force [m/s2] is in world axes."""
    T = period
    for transposed in range(2):
        for k in range(N_ERRORS):
            for i in range(3):
                _add(P, POSITION + i, VELOCITY + i, k, T, transposed)
            for i in range(3):
                a, b = (i + 1) % 3, (i + 2) % 3
                _add(P, VELOCITY + i, ATTITUDE + b, k, -T * force[a], transposed)
                _add(P, VELOCITY + i, ATTITUDE + a, k, T * force[b], transposed)
                for j in range(3):
                    _add(P, VELOCITY + i, ACCELERATION_BIAS + j, k, -T * R[i, j], transposed)
            for i in range(3):
                for j in range(3):
                    _add(P, ATTITUDE + i, GYRO_BIAS + j, k, -T * R[i, j], transposed)
    for i in range(3):
        P[VELOCITY + i, VELOCITY + i] += square(sensors.acceleration * T)
        P[ATTITUDE + i, ATTITUDE + i] += square(sensors.angular_velocity * T)
        P[ACCELERATION_BIAS + i, ACCELERATION_BIAS + i] += square(_DRIFT * sensors.acceleration_bias) * T
        P[GYRO_BIAS + i, GYRO_BIAS + i] += square(_DRIFT * sensors.angular_velocity_bias) * T


def _add(P: Array, to: int, source: int, k: int, share: float, transposed: int) -> None:
    """Add a share of one row, or column if transposed, to another, in its element k."""
    if transposed:
        P[k, to] += share * P[k, source]
    else:
        P[to, k] += share * P[source, k]


def _record(memory: NavigationMemory) -> None:
    """Record the motion by the IMU alone."""
    i = memory.recorded[0] % memory.imu_history.shape[0]
    memory.imu_history[i, 0] = memory.time[0]
    for k in range(10):
        memory.imu_history[i, 1 + k] = memory.imu_motion[k]
    memory.recorded[0] += 1


def estimate_at(memory: NavigationMemory, time: float, position: Array, velocity: Array, quaternion: Array) -> bool:
    """Write position [m], velocity [m/s] and attitude at a time [s]; return False if the history does not reach it."""
    later, n = time - memory.time[0], memory.imu_history.shape[0]
    for i in range(4):
        quaternion[i] = memory.quaternion[i]
    if later >= 0.0:
        for i in range(3):
            position[i] = memory.position[i] + later * (memory.velocity[i] + 0.5 * later * memory.acceleration[i])
            velocity[i] = memory.velocity[i] + later * memory.acceleration[i]
        turn = zeros(3)
        for i in range(3):
            turn[i] = later * memory.omega[i]
        rotate(quaternion, turn)
        return True
    newest = memory.recorded[0] - 1
    oldest = max(memory.recorded[0] - n, 0)
    i = newest
    while i > oldest and memory.imu_history[i % n, 0] > time:
        i -= 1
    if memory.imu_history[i % n, 0] > time or i == newest:
        return False
    before, after, motion = i % n, (i + 1) % n, zeros(10)
    share = (time - memory.imu_history[before, 0]) / (memory.imu_history[after, 0] - memory.imu_history[before, 0])
    for k in range(10):
        motion[k] = memory.imu_history[before, 1 + k] + share * (
            memory.imu_history[after, 1 + k] - memory.imu_history[before, 1 + k]
        )
    for k in range(3):
        position[k] = memory.position[k] - (memory.imu_motion[k] - motion[k])
        velocity[k] = memory.velocity[k] - (memory.imu_motion[3 + k] - motion[3 + k])
    # attitude * imu_motion^-1 * motion
    _multiply_by(quaternion, memory.imu_motion[6], -memory.imu_motion[7], -memory.imu_motion[8], -memory.imu_motion[9])
    _multiply_by(quaternion, motion[6], motion[7], motion[8], motion[9])
    return True


def _multiply_by(quaternion: Array, w: float, x: float, y: float, z: float) -> None:
    """Multiply a quaternion by another from the right, and normalize it."""
    e0, e1, e2, e3 = quaternion[0], quaternion[1], quaternion[2], quaternion[3]
    quaternion[0] = e0 * w - e1 * x - e2 * y - e3 * z
    quaternion[1] = e0 * x + e1 * w + e2 * z - e3 * y
    quaternion[2] = e0 * y - e1 * z + e2 * w + e3 * x
    quaternion[3] = e0 * z + e1 * y - e2 * x + e3 * w
    length = np.sqrt(square(quaternion[0]) + square(quaternion[1]) + square(quaternion[2]) + square(quaternion[3]))
    for i in range(4):
        quaternion[i] /= length
