"""The memory of the navigation filter: motion and constant errors, their covariance, and the recent past."""

# The covariance is that of the errors, true less estimated: position and velocity in world axes, attitude as a small
# rotation in world axes, then the constant errors of gyros, accelerometers, compass, pressure sensor and DVL.

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from controller.arithmetic import square
from controller.navigation.measurements import N_SENSORS, SensorModel

Array = NDArray[np.float64]

# index of the first error of each kind
POSITION, VELOCITY, ATTITUDE, GYRO_BIAS, ACCELERATION_BIAS = 0, 3, 6, 9, 12
HEADING_BIAS, DEPTH_BIAS, VELOCITY_SCALE, N_ERRORS = 15, 16, 17, 18

# standard deviations at the start, when only samples of unknown age are known
_FIRST_POSITION, _FIRST_VELOCITY = 0.1, 0.3  # m in addition to the noise of a fix; m/s
_FIRST_TILT, _FIRST_HEADING = 0.05, 0.3  # rad; an acceleration looks like a tilt
_REMEMBERED = 128  # number of IMU samples in the history, for late measurements


class NavigationMemory(NamedTuple):
    """Estimate and covariance."""

    position: Array  # (3,) m, NED
    velocity: Array  # (3,) m/s over ground, NED
    quaternion: Array  # (4,) from body to world
    constants: Array  # (9,) errors of gyros [rad/s] (3), accelerometers [m/s2] (3), compass [rad], depth [m], DVL
    covariance: Array  # (18, 18) covariance of the errors
    time: Array  # (1,) s, time of the estimate: that of the last IMU sample; NaN before the first
    acceleration: Array  # (3,) m/s2 over ground, NED, at the last IMU sample
    omega: Array  # (3,) rad/s, body axes, at the last IMU sample
    sample_times: Array  # (5,) s, times of the last samples used
    previous_fix: Array  # (3,) m, NED, the last fix before the start; NaN: none yet
    rejected: Array  # (5,) samples rejected in a row
    resets: Array  # (5,) resets of the covariance by each sensor since it was confirmed
    accepted: Array  # (5,) samples accepted since the start, or since the sensor reset the covariance
    innovations: Array  # (5, 3) a row a sensor: sum of normalized squared innovations, their degrees, rejected samples
    started: Array  # (1,) 1 once there is an estimate
    imu_motion: Array  # (10,) change of position, velocity and attitude by the IMU alone, since the start
    imu_history: Array  # (128, 11) time and `imu_motion` of the last IMU samples
    recorded: NDArray[np.int64]  # (1,) number of recorded samples
    row: Array  # (18,) derivative of a measured number by the errors
    gain: Array  # (18,) covariance times `row`: Kalman gain before its division by the variance


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
        row=np.zeros(N_ERRORS),
        gain=np.zeros(N_ERRORS),
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
