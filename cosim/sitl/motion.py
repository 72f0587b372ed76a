"""The vehicle's motion for an autopilot: pose, velocity, and measurements of IMU and DVL."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from controller.quaternion import rotation_matrix
from cosim.scenario.region_tables import Vector3
from cosim.simulation.stepped_plant import SteppedPlant
from cosim.sitl.rangefinder import Rangefinder

_MEASURED = ("p", "q", "r")
_NAMES = (
    *(f"measured.angular_velocity.{name}" for name in _MEASURED),
    *(f"measured.acceleration.{axis}" for axis in "xyz"),
    *(f"position.{axis}" for axis in "xyz"),
    *(f"attitude.{name}" for name in ("roll", "pitch", "yaw")),
    "measured.altitude",
    *(f"measured.velocity.{name}" for name in "uvw"),
)
_GRAVITY = 9.81  # m/s2, close to ArduPilot's and PX4's
_SURFACE_TIME = 4.0  # s, in which an autopilot calibrates its sensors
_MAX_SPEED, _MAX_DURATION = 1.0, 6.0  # m/s, s: maximum speed of lowering, unless it would take longer


class Motion(NamedTuple):
    """The vehicle at one instant."""

    time: float  # s, simulated
    gyro: Vector3  # rad/s, body frame, as the IMU measures it
    specific_force: Vector3  # m/s2, body frame, as the IMU measures it; (0, 0, -9.81) at rest
    position_ned: Vector3  # m
    velocity_ned: Vector3  # m/s, over ground
    attitude: Vector3  # rad, roll, pitch, yaw
    quaternion: tuple[float, float, float, float]  # from body to world, scalar first
    altitude: float | None  # m, distance along the body's vertical axis to bottom or region; None without either
    dvl: Vector3  # m/s, over ground, body frame, as the DVL measures it


class MotionReader:
    """Reads the motion from a plant's outputs."""

    def __init__(self, plant: SteppedPlant, rangefinder: Rangefinder) -> None:
        names = plant.outputs.names
        self._values, self._rangefinder = plant.outputs.values, rangefinder
        x = names.index("position.x")
        self._position = self._values[x : x + 3]
        self._indices = np.array([names.index(name) for name in _NAMES])
        e0, u = names.index("quaternion.e0"), names.index("velocity.u")
        self._quaternion, self._velocity_body = self._values[e0 : e0 + 4], self._values[u : u + 3]

    def read(self, time: float) -> Motion:
        """Return the motion after the plant's last step, which ended at `time` [s]."""
        p, q, r, fx, fy, fz, x, y, z, roll, pitch, yaw, altitude, u, v, w = self._values[self._indices].tolist()
        e0, e1, e2, e3 = self._quaternion.tolist()
        sensor = self._rangefinder
        distance = sensor.measure(self._position, self._quaternion, altitude) if sensor.is_fitted else None
        vx, vy, vz = (rotation_matrix(self._quaternion) @ self._velocity_body).tolist()  # (15)
        return Motion(
            time, (p, q, r), (fx, fy, fz), (x, y, z), (vx, vy, vz), (roll, pitch, yaw), (e0, e1, e2, e3),
            distance, (u, v, w),
        )  # fmt: skip


def at_rest(motion: Motion) -> Motion:
    """Return the motion of a vehicle that is held in place: the IMU measures gravity alone."""
    return with_vertical_motion(motion, motion.position_ned[2], 0.0, 0.0)


def with_vertical_motion(motion: Motion, depth: float, speed: float, acceleration: float) -> Motion:
    """Return the motion of a vehicle that is moved down at the horizontal position and attitude of another motion."""
    # Units of arguments: depth, speed, acceleration [m, m/s, m/s2]
    to_body = rotation_matrix(np.array(motion.quaternion)).T
    fx, fy, fz = (to_body @ np.array([0.0, 0.0, acceleration - _GRAVITY])).tolist()
    u, v, w = (to_body @ np.array([0.0, 0.0, speed])).tolist()
    x, y, z = motion.position_ned
    return motion._replace(
        gyro=(0.0, 0.0, 0.0), specific_force=(fx, fy, fz), position_ned=(x, y, depth), velocity_ned=(0.0, 0.0, speed),
        altitude=None if motion.altitude is None else motion.altitude + z - depth, dvl=(u, v, w),
    )  # fmt: skip


class Lowering:
    """Trajectory of a vehicle from the surface, where it is switched on, to the depth at which a scenario starts."""

    # ArduSub calibrates its depth sensor when it is switched on, and again whenever it rises above that depth.

    def __init__(self, depth: float) -> None:
        self._depth = max(0.0, depth)
        self._duration = min(0.5 * math.pi * self._depth / _MAX_SPEED, _MAX_DURATION)

    def at(self, time: float) -> Vector3:
        """Return depth, speed and acceleration [m, m/s, m/s2] at a time [s] after the vehicle was switched on."""
        if self.is_over(time) or time <= _SURFACE_TIME:
            return (self._depth if self.is_over(time) else 0.0), 0.0, 0.0
        rate = math.pi / self._duration
        phase, half = rate * (time - _SURFACE_TIME), 0.5 * self._depth
        return half * (1.0 - math.cos(phase)), half * rate * math.sin(phase), half * rate**2 * math.cos(phase)

    def is_over(self, time: float) -> bool:
        """Return True if the vehicle has reached its start depth at a time [s]."""
        return self._depth == 0.0 or time >= _SURFACE_TIME + self._duration
