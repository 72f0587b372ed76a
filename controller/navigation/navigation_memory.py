"""The memory of the navigation filter: motion and constant errors, their covariance, and the recent past."""

# The covariance is that of the errors, true less estimated: position and velocity in world axes, attitude as a small
# rotation in world axes, then the constant errors of gyros, accelerometers, compass, pressure sensor and DVL.

from __future__ import annotations

from typing import Annotated, NamedTuple

import numpy as np
from numpy.typing import NDArray

from controller.arithmetic import square
from controller.navigation.measurements import N_SENSORS, SensorModel
from controller.stack_array import Array, Number, Shape, Vector3, Vector4

# index of the first error of each kind
POSITION, VELOCITY, ATTITUDE, GYRO_BIAS, ACCELERATION_BIAS = 0, 3, 6, 9, 12
HEADING_BIAS, DEPTH_BIAS, VELOCITY_SCALE, N_ERRORS = 15, 16, 17, 18

# standard deviations at the start, when only samples of unknown age are known
_FIRST_POSITION, _FIRST_VELOCITY = 0.1, 0.3  # m in addition to the noise of a fix; m/s
_FIRST_TILT, _FIRST_HEADING = 0.05, 0.3  # rad; an acceleration looks like a tilt
_REMEMBERED = 128  # number of IMU samples in the history, for late measurements

Errors = Annotated[NDArray[np.float64], Shape(N_ERRORS)]
ErrorMatrix = Annotated[NDArray[np.float64], Shape(N_ERRORS, N_ERRORS)]
ErrorRows = Annotated[NDArray[np.float64], Shape(3, N_ERRORS)]
Constants = Annotated[NDArray[np.float64], Shape(9)]
ImuMotion = Annotated[NDArray[np.float64], Shape(10)]
ImuHistory = Annotated[NDArray[np.float64], Shape(_REMEMBERED, 11)]


class NavigationMemory(NamedTuple):
    """Estimate and covariance."""

    position: Vector3  # m, NED
    velocity: Vector3  # m/s over ground, NED
    quaternion: Vector4  # from body to world
    constants: Constants  # errors of gyros [rad/s] (3), accelerometers [m/s2] (3), compass [rad], depth [m], DVL
    covariance: ErrorMatrix  # covariance of the errors
    time: Number  # s, time of the estimate: that of the last IMU sample; NaN before the first
    acceleration: Vector3  # m/s2 over ground, NED, at the last IMU sample
    omega: Vector3  # rad/s, body axes, at the last IMU sample
    sample_times: Array  # (5,) s, times of the last samples used
    previous_fix: Vector3  # m, NED, the last fix before the start; NaN: none yet
    rejected: Array  # (5,) samples rejected in a row
    resets: Array  # (5,) resets of the covariance by each sensor since it was confirmed
    accepted: Array  # (5,) samples accepted since the start, or since the sensor reset the covariance
    innovations: Array  # (5, 3) a row a sensor: sum of normalized squared innovations, their degrees, rejected samples
    started: Number  # 1 once there is an estimate
    imu_motion: ImuMotion  # change of position, velocity and attitude by the IMU alone, since the start
    imu_history: ImuHistory  # time and `imu_motion` of the last IMU samples
    recorded: NDArray[np.int64]  # (1,) number of recorded samples


def empty_memory() -> NavigationMemory:
    """Return the filter's memory before the first sample."""
    motion = np.zeros(10)
    motion[6] = 1.0
    return NavigationMemory(
        position=np.zeros(3),
        velocity=np.zeros(3),
        quaternion=np.array([1.0, 0.0, 0.0, 0.0]),
        constants=np.zeros(9),
        covariance=np.zeros((N_ERRORS, N_ERRORS)),
        time=np.array([np.nan]),
        acceleration=np.zeros(3),
        omega=np.zeros(3),
        sample_times=np.full(N_SENSORS, -1e11),
        previous_fix=np.full(3, np.nan),
        rejected=np.zeros(N_SENSORS),
        resets=np.zeros(N_SENSORS),
        accepted=np.zeros(N_SENSORS),
        innovations=np.zeros((N_SENSORS, 3)),
        started=np.zeros(1),
        imu_motion=motion,
        imu_history=np.zeros((_REMEMBERED, 11)),
        recorded=np.zeros(1, np.int64),
    )


def set_first_covariance(memory: NavigationMemory, sensors: SensorModel) -> None:
    """Set the covariance of the start, with constant errors from the data sheets."""
    P = memory.covariance
    P[:, :] = 0.0
    for i in range(3):
        P[POSITION + i, POSITION + i] = square(_FIRST_POSITION) + square(sensors.position)
        P[VELOCITY + i, VELOCITY + i] = square(_FIRST_VELOCITY)
        P[ATTITUDE + i, ATTITUDE + i] = square(_FIRST_TILT if i < 2 else _FIRST_HEADING)
        P[GYRO_BIAS + i, GYRO_BIAS + i] = square(sensors.angular_velocity_bias)
        P[ACCELERATION_BIAS + i, ACCELERATION_BIAS + i] = square(sensors.acceleration_bias)
    P[HEADING_BIAS, HEADING_BIAS] = square(sensors.heading_bias)
    P[DEPTH_BIAS, DEPTH_BIAS] = square(sensors.depth_bias)
    P[VELOCITY_SCALE, VELOCITY_SCALE] = square(sensors.velocity_scale)
