"""Samples of the sensors, and standard deviations of their errors."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from controller.stack_array import Vector3

Array = NDArray[np.float64]

DEPTH_SENSOR, DVL, IMU, COMPASS, USBL, N_SENSORS = 0, 1, 2, 3, 4, 5  # indices in `Measurements.times`
SENSORS = ("depth_sensor", "dvl", "imu", "compass", "usbl")

# index of the first value of each quantity in `Measurements.values`
DEPTH, VELOCITY, ALTITUDE, ACCELERATION, ANGULAR_VELOCITY, HEADING, POSITION, N_VALUES = 0, 1, 4, 5, 8, 11, 12, 15
VALUES = (
    "depth", "velocity.u", "velocity.v", "velocity.w", "altitude", "acceleration.x", "acceleration.y", "acceleration.z",
    "angular_velocity.p", "angular_velocity.q", "angular_velocity.r", "heading", "position.x", "position.y",
    "position.z",
)  # fmt: skip


class Measurements(NamedTuple):
    """The last sample of each sensor, and its time; in the order of the plant's ``measured`` outputs."""

    values: (
        Array  # (15,) depth [m]; velocity over ground, body [m/s] (3); altitude [m]; specific force, body [m/s2] (3)
    )
    # angular velocity, body [rad/s] (3); heading [rad]; position, NED [m] (3)
    times: Array  # (5,) s: times of pressure sensor, DVL, IMU, compass, USBL; a later one marks a new sample


class SensorModel(NamedTuple):
    """Standard deviations of the sensors' errors, from data sheets: of each sample, and of constant errors."""

    depth: float = 0.002  # m
    velocity: float = 0.005  # m/s
    acceleration: float = 0.006  # m/s2
    angular_velocity: float = 0.0017  # rad/s
    heading: float = 0.0035  # rad
    position: float = 0.15  # m
    depth_bias: float = 0.02  # m
    velocity_scale: float = 0.005  # dimensionless, scale error of the velocity
    acceleration_bias: float = 0.02  # m/s2
    angular_velocity_bias: float = 0.0017  # rad/s
    heading_bias: float = 0.0175  # rad
    gravity: float = 9.81  # m/s2
    dvl_position: Vector3 = np.zeros(3)  # m, body frame


def empty_measurements() -> Measurements:
    """Return measurements before the first samples."""
    return Measurements(np.zeros(N_VALUES), np.full(N_SENSORS, -np.inf))
