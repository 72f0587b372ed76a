"""Convert frames and units of a log to SI, NED and FRD."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from typing import Any

import numpy as np
from scipy.spatial.transform import Rotation

from cosim.simulation.signals import Array

ReadComponents = Callable[[Callable[[str], Any]], Sequence[float]]  # from a function that returns a message's field

WORLDS = {  # matrix from the named world frame to NED
    "NED": np.eye(3),
    "ENU": np.array([[0.0, 1.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, -1.0]]),
    "NWU": np.diag([1.0, -1.0, -1.0]),
}
BODIES = {  # matrix from the named body frame to FRD
    "FRD": np.eye(3),
    "FLU": np.diag([1.0, -1.0, -1.0]),
    "RFU": np.array([[0.0, 1.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, -1.0]]),
}
UNITS = {  # factors to SI units, by the SI unit
    "m": {"m": 1.0, "cm": 0.01, "mm": 0.001, "ft": 0.3048},
    "m/s": {"m/s": 1.0, "cm/s": 0.01, "mm/s": 0.001, "knot": 1852.0 / 3600.0},
    "rad": {"rad": 1.0, "deg": math.pi / 180.0},
    "rad/s": {"rad/s": 1.0, "deg/s": math.pi / 180.0, "mrad/s": 0.001},
    "m/s2": {"m/s2": 1.0, "g": 9.80665, "mg": 0.00980665},
    "Pa": {"Pa": 1.0, "hPa": 100.0, "mbar": 100.0, "kPa": 1000.0, "bar": 1e5},
    "N": {"N": 1.0, "kgf": 9.80665, "kN": 1000.0},
    "N, N m": {"N, N m": 1.0},
    "us": {"us": 1.0, "ms": 1000.0},
    "V": {"V": 1.0, "mV": 0.001},
    "": {"": 1.0, "percent": 0.01, "permille": 0.001},
    "s": {"s": 1.0, "ms": 1e-3, "us": 1e-6, "ns": 1e-9},
}


def quaternions_of_angles(angles: Array, order: str) -> Array:
    """Return unit quaternions of Euler angles; angles (n, 3) [rad]."""
    quaternions: Array = Rotation.from_euler(order, angles).as_quat(scalar_first=True)
    return quaternions


def convert_quaternions(quaternions: Array, world: str, body: str) -> Array:
    """Convert attitudes between other frames to attitudes from FRD to NED; quaternions (n, 4), returns (n, 4)."""
    R = Rotation.from_quat(quaternions, scalar_first=True)
    to_ned = Rotation.from_matrix(WORLDS[world]) * R * Rotation.from_matrix(BODIES[body].T)
    result: Array = to_ned.as_quat(scalar_first=True)
    return result


def euler_zyx(quaternions: Array) -> Array:
    """Return roll, pitch and yaw [rad], shape (n, 3), of quaternions from body to world, shape (n, 4)."""
    w, x, y, z = quaternions.T
    roll = np.arctan2(2.0 * (w * x + y * z), 1.0 - 2.0 * (x * x + y * y))
    pitch = np.arcsin(np.clip(2.0 * (w * y - z * x), -1.0, 1.0))
    yaw = np.arctan2(2.0 * (w * z + x * y), 1.0 - 2.0 * (y * y + z * z))
    return np.column_stack([roll, pitch, yaw])


def rotate_to_body(quaternions: Array, vectors: Array) -> Array:
    """Rotate vectors from world to body, shape (n, 3), by quaternions from body to world, shape (n, 4)."""
    w, r = quaternions[:, :1], -quaternions[:, 1:]
    t = 2.0 * np.cross(r, vectors)
    rotated: Array = vectors + w * t + np.cross(r, t)
    return rotated


def unit_quaternion(components: Sequence[float]) -> list[float]:
    """Return the unit quaternion of components, NaN if they are zero."""
    length = math.hypot(*components)
    return [x / length if length > 0.0 else math.nan for x in components]


def quaternion_of_angles(roll: float, pitch: float, yaw: float) -> Sequence[float]:
    """Return the unit quaternion of roll, pitch and yaw [rad], scalar first, for one sample; NaN if one is infinite."""
    if math.inf in (abs(roll), abs(pitch), abs(yaw)):
        return (math.nan,) * 4
    cr, sr = math.cos(0.5 * roll), math.sin(0.5 * roll)
    cp, sp = math.cos(0.5 * pitch), math.sin(0.5 * pitch)
    cy, sy = math.cos(0.5 * yaw), math.sin(0.5 * yaw)
    return (
        cr * cp * cy + sr * sp * sy,
        sr * cp * cy - cr * sp * sy,
        cr * sp * cy + sr * cp * sy,
        cr * cp * sy - sr * sp * cy,
    )


def scale_fields(fields: str, factor: float = 1.0) -> ReadComponents:
    """Make a function that reads these fields of a message and multiplies them by a factor."""
    names = fields.split()
    return lambda field: [factor * field(name) for name in names]


def attitude_of_angles(fields: str, factor: float = 1.0) -> ReadComponents:
    """Return a function from roll, pitch and yaw of a message, times a factor [rad], to the unit quaternion."""
    angles = scale_fields(fields, factor)
    return lambda field: quaternion_of_angles(*angles(field))


def attitude_of_quaternion(fields: str) -> ReadComponents:
    """Return a function from the components of a quaternion, or a list of them, to the unit quaternion."""
    names = fields.split()
    return lambda field: unit_quaternion(field(fields) if len(names) == 1 else [field(name) for name in names])
