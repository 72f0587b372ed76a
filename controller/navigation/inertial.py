"""Inertial navigation: propagate the estimate and its covariance from one IMU sample to the next."""

# p' = v, v' = R f + g e3, R' = R S(omega), with the specific force f and the rates omega less their constant errors.
# The errors, true less estimated, follow
#
#     dp' = dv,   dv' = -S(R f) dtheta - R db_a,   dtheta' = -R db_g,
#
# with dtheta the small rotation in world axes that turns the estimated attitude into the true one.

from __future__ import annotations

from controller.arithmetic import square
from controller.linear_algebra import norm
from controller.navigation.measurements import SensorModel
from controller.navigation.navigation_memory import (
    ACCELERATION_BIAS,
    ATTITUDE,
    GYRO_BIAS,
    HEADING_BIAS,
    VELOCITY,
    ErrorMatrix,
    NavigationMemory,
)
from controller.quaternion import multiply, rotation_matrix, skew
from controller.stack_array import Matrix3, Vector3, Vector4, array

_DRIFT = 1e-3  # 1/sqrt(s), random walk of a constant error, as a fraction of its standard deviation


def propagate(memory: NavigationMemory, force: Vector3, omega: Vector3, sensors: SensorModel, period: float) -> None:
    """Propagate over a period [s] up to a sample of specific force [m/s2] and rates [rad/s], body axes."""
    # The force is that of the period before the sample; the rates change evenly within it.
    turn = 0.5 * period * (memory.omega + omega)
    rotate(memory.quaternion, 0.5 * turn)  # to the middle of the period
    R = rotation_matrix(memory.quaternion)
    rotate(memory.quaternion, 0.5 * turn)
    f = R @ force
    acceleration = f + array(0.0, 0.0, sensors.gravity)
    step = period * (memory.velocity + 0.5 * period * acceleration)
    memory.position += step
    memory.velocity += period * acceleration
    memory.imu_motion[:3] += step
    memory.imu_motion[3:6] += period * acceleration
    rotate(memory.imu_motion[6:], turn)
    memory.acceleration, memory.omega = acceleration, omega
    memory.time += period
    i = memory.recorded % memory.imu_history.shape[0]  # the motion by the IMU alone
    memory.imu_history[i, 0], memory.imu_history[i, 1:] = memory.time, memory.imu_motion
    memory.recorded += 1
    _propagate_covariance(memory.covariance, R, f, sensors, period)


def rotate(quaternion: Vector4, turn: Vector3) -> None:
    """Turn an attitude by a small rotation vector [rad] in body axes; exact to 1e-7 at 0.5."""
    s = turn @ turn
    part = (0.5 - s / 48.0 + s * s / 3840.0) * turn
    _multiply_by(quaternion, array(1.0 - s / 8.0 + s * s / 384.0, part[0], part[1], part[2]))


def _multiply_by(quaternion: Vector4, other: Vector4) -> None:
    """Multiply a quaternion by another from the right, and normalize it."""
    e = multiply(quaternion, other)
    quaternion[:] = e / norm(e)


def _propagate_covariance(P: ErrorMatrix, R: Matrix3, force: Vector3, sensors: SensorModel, T: float) -> None:
    """Propagate the covariance over a period [s]; the force [m/s2] is in world axes."""
    S = skew(force)
    P[:3] += T * P[VELOCITY:ATTITUDE]
    P[VELOCITY:ATTITUDE] -= T * (S @ P[ATTITUDE:GYRO_BIAS] + R @ P[ACCELERATION_BIAS:HEADING_BIAS])
    P[ATTITUDE:GYRO_BIAS] -= T * (R @ P[GYRO_BIAS:ACCELERATION_BIAS])
    P[:, :3] += T * P[:, VELOCITY:ATTITUDE]
    P[:, VELOCITY:ATTITUDE] -= T * (P[:, ATTITUDE:GYRO_BIAS] @ S.T + P[:, ACCELERATION_BIAS:HEADING_BIAS] @ R.T)
    P[:, ATTITUDE:GYRO_BIAS] -= T * (P[:, GYRO_BIAS:ACCELERATION_BIAS] @ R.T)
    for i in range(3):
        P[VELOCITY + i, VELOCITY + i] += square(sensors.acceleration * T)
        P[ATTITUDE + i, ATTITUDE + i] += square(sensors.angular_velocity * T)
        P[ACCELERATION_BIAS + i, ACCELERATION_BIAS + i] += square(_DRIFT * sensors.acceleration_bias) * T
        P[GYRO_BIAS + i, GYRO_BIAS + i] += square(_DRIFT * sensors.angular_velocity_bias) * T


def estimate_at(
    memory: NavigationMemory, time: float, position: Vector3, velocity: Vector3, quaternion: Vector4
) -> bool:
    """Write position [m], velocity [m/s] and attitude at a time [s]; return False if the history does not reach it."""
    later, history, n = time - memory.time, memory.imu_history, memory.imu_history.shape[0]
    quaternion[:] = memory.quaternion
    if later >= 0.0:
        position[:] = memory.position + later * (memory.velocity + 0.5 * later * memory.acceleration)
        velocity[:] = memory.velocity + later * memory.acceleration
        rotate(quaternion, later * memory.omega)
        return True
    newest = memory.recorded - 1
    oldest = max(memory.recorded - n, 0)
    i = newest
    while i > oldest and history[i % n, 0] > time:
        i -= 1
    if history[i % n, 0] > time or i == newest:
        return False
    before, after = history[i % n], history[(i + 1) % n]
    motion = before[1:] + (time - before[0]) / (after[0] - before[0]) * (after[1:] - before[1:])
    position[:] = memory.position - (memory.imu_motion[:3] - motion[:3])
    velocity[:] = memory.velocity - (memory.imu_motion[3:6] - motion[3:6])
    # attitude * imu_motion^-1 * motion
    q = memory.imu_motion[6:]
    _multiply_by(quaternion, array(q[0], -q[1], -q[2], -q[3]))
    _multiply_by(quaternion, motion[6:])
    return True
