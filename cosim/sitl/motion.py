"""What an autopilot is told of the vehicle: where it is, how it moves, and what its IMU feels."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from controller.quaternion import rotation_matrix
from cosim.simulation.stepped_plant import SteppedPlant

Three = tuple[float, float, float]

_MEASURED = ("p", "q", "r")
_NAMES = (
    *(f"measured.angular_velocity.{name}" for name in _MEASURED),
    *(f"measured.acceleration.{axis}" for axis in "xyz"),
    *(f"position.{axis}" for axis in "xyz"),
    *(f"attitude.{name}" for name in ("roll", "pitch", "yaw")),
    "measured.altitude",
    *(f"measured.velocity.{name}" for name in "uvw"),
)
_GRAVITY = 9.81  # m/s2, as ArduPilot and PX4 have it, near enough


class Motion(NamedTuple):
    """The vehicle at one instant."""

    time: float  # s, simulated
    gyro: Three  # rad/s, body frame, as the IMU measures it
    specific_force: Three  # m/s2, body frame, as the IMU measures it; (0, 0, -9.81) at rest
    position_ned: Three  # m
    velocity_ned: Three  # m/s, over ground
    attitude: Three  # rad, roll, pitch, yaw
    quaternion: tuple[float, float, float, float]  # from body to world, scalar first
    altitude: float | None  # m, above the bottom as the DVL measures it; None where there is no bottom
    dvl: Three  # m/s, over ground, body frame, as the DVL measures it


class MotionReader:
    """Reads the motion off a plant's outputs.

    Parameters
    ----------
    plant : SteppedPlant
        Initialised.
    bottom : bool
        Whether there is one.
    """

    def __init__(self, plant: SteppedPlant, bottom: bool) -> None:
        names = plant.outputs.names
        self._values, self._bottom = plant.outputs.values, bottom
        self._at = np.array([names.index(name) for name in _NAMES])
        e0, u = names.index("quaternion.e0"), names.index("velocity.u")
        self._quaternion, self._velocity_body = self._values[e0 : e0 + 4], self._values[u : u + 3]

    def read(self, time: float) -> Motion:
        """Return the motion as it is after the plant's last step, which ended at a time [s]."""
        p, q, r, fx, fy, fz, x, y, z, roll, pitch, yaw, altitude, u, v, w = self._values[self._at].tolist()
        e0, e1, e2, e3 = self._quaternion.tolist()
        vx, vy, vz = (rotation_matrix(self._quaternion) @ self._velocity_body).tolist()  # (15)
        return Motion(
            time, (p, q, r), (fx, fy, fz), (x, y, z), (vx, vy, vz), (roll, pitch, yaw), (e0, e1, e2, e3),
            altitude if self._bottom else None, (u, v, w),
        )  # fmt: skip


def at_rest(motion: Motion) -> Motion:
    """Return the motion of a vehicle that is held where it is: the IMU feels gravity alone."""
    fx, fy, fz = (rotation_matrix(np.array(motion.quaternion)).T @ np.array([0.0, 0.0, -_GRAVITY])).tolist()
    still = (0.0, 0.0, 0.0)
    return motion._replace(gyro=still, specific_force=(fx, fy, fz), velocity_ned=still, dvl=still)
