"""The memory of the navigation filter: motion and constant errors, their covariance, and the recent past."""

# The covariance is that of the errors, true less estimated: position and velocity in world axes, attitude as a small
# rotation in world axes, then the constant errors of gyros, accelerometers, compass, pressure sensor and DVL.

from __future__ import annotations

from typing import Annotated

import numpy as np
from numpy.typing import NDArray

from controller.arithmetic import square
from controller.navigation.measurements import N_SENSORS, SensorModel
from controller.stack_array import Shape, Vector3, Vector4
from controller.state import State

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
PerSensor = Annotated[NDArray[np.float64], Shape(N_SENSORS)]
Innovations = Annotated[NDArray[np.float64], Shape(N_SENSORS, 3)]
Constants = Annotated[NDArray[np.float64], Shape(9)]
ImuMotion = Annotated[NDArray[np.float64], Shape(10)]
ImuHistory = Annotated[NDArray[np.float64], Shape(_REMEMBERED, 11)]


class NavigationMemory(State):
    """Estimate and covariance."""

    position: Vector3  # m, NED
    velocity: Vector3  # m/s over ground, NED
    quaternion: Vector4  # from body to world
    constants: Constants  # errors of gyros [rad/s] (3), accelerometers [m/s2] (3), compass [rad], depth [m], DVL
    covariance: ErrorMatrix  # covariance of the errors
    now: float  # s, time for which the state is estimated
    time: float = np.nan  # s, time of the estimate: that of the last IMU sample; NaN before the first
    acceleration: Vector3  # m/s2 over ground, NED, at the last IMU sample
    omega: Vector3  # rad/s, body axes, at the last IMU sample
    sample_times: PerSensor  # s, times of the last samples used
    previous_fix: Vector3  # m, NED, the last fix before the start; NaN: none yet
    rejected: PerSensor  # samples rejected in a row
    resets: PerSensor  # resets of the covariance by each sensor since it was confirmed
    accepted: PerSensor  # samples accepted since the start, or since the sensor reset the covariance
    innovations: Innovations  # a row a sensor: sum of normalized squared innovations, their degrees, rejected samples
    started: float  # 1 once there is an estimate
    imu_motion: ImuMotion  # change of position, velocity and attitude by the IMU alone, since the start
    imu_history: ImuHistory  # time and `imu_motion` of the last IMU samples
    recorded: int  # number of recorded samples


def empty_memory() -> NavigationMemory:
    """Return the filter's memory before the first sample."""
    memory = NavigationMemory()
    memory.quaternion[0] = memory.imu_motion[6] = 1.0
    memory.sample_times[:], memory.previous_fix[:] = -1e11, np.nan
    return memory


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
