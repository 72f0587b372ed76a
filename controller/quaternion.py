"""Unit quaternions, scalar first, rotating body vectors into the world: equations (1)-(9), (23), (24)."""

# Functions take and return float64 arrays; those of parts and rows return tuples, which C keeps in registers, where an
# array costs it a place in memory. The sign of the last term of (3) is that which (6), (7) and (10) need: the printed
# matrix is the transpose.

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
Vector3 = tuple[float, float, float]
Vector4 = tuple[float, float, float, float]


def from_axis_angle(axis: Array, angle: float) -> Array:
    """Return the quaternion of a rotation by `angle` [rad] about a unit `axis`, shape (3,): (1), (2).

    Examples
    --------
    >>> import numpy as np
    >>> from controller.quaternion import from_axis_angle
    >>> from_axis_angle(np.array([0.0, 0.0, 1.0]), np.pi).round(6)
    array([0., 0., 0., 1.])
    """
    e = np.empty(4)
    e[0] = np.cos(angle / 2.0)
    e[1:] = axis * np.sin(angle / 2.0)
    return e


def skew(a: Array) -> Array:
    """Return S(a), shape (3, 3), such that S(a) b = a x b: (4), with the property (5)."""
    return np.array([[0.0, -a[2], a[1]], [a[2], 0.0, -a[0]], [-a[1], a[0], 0.0]])


def rotation_rows(e: Array | Sequence[float]) -> tuple[Vector3, Vector3, Vector3]:
    """Return the rows of R, from body to world, of a unit quaternion `e`: (3)."""
    e0, e1, e2, e3 = e[0], e[1], e[2], e[3]
    return (
        (1.0 - 2.0 * (e2 * e2 + e3 * e3), 2.0 * (e1 * e2 - e0 * e3), 2.0 * (e1 * e3 + e0 * e2)),
        (2.0 * (e1 * e2 + e0 * e3), 1.0 - 2.0 * (e1 * e1 + e3 * e3), 2.0 * (e2 * e3 - e0 * e1)),
        (2.0 * (e1 * e3 - e0 * e2), 2.0 * (e2 * e3 + e0 * e1), 1.0 - 2.0 * (e1 * e1 + e2 * e2)),
    )


def write_rotation(e: Array, R: Array) -> None:
    """Write R, shape (3, 3), from body to world, of a unit quaternion: (3)."""
    (R[0, 0], R[0, 1], R[0, 2]), (R[1, 0], R[1, 1], R[1, 2]), (R[2, 0], R[2, 1], R[2, 2]) = rotation_rows(e)


def rotation_matrix(e: Array) -> Array:
    """Return R, shape (3, 3), from body to world, of a unit quaternion `e`: (3).

    Examples
    --------
    >>> import numpy as np
    >>> from controller.quaternion import rotation_matrix
    >>> rotation_matrix(np.array([0.0, 1.0, 0.0, 0.0])).diagonal()
    array([ 1., -1., -1.])
    """
    R = np.empty((3, 3))
    write_rotation(e, R)
    return R


def kinematic_matrix(e: Array) -> Array:
    """Return E(e), shape (4, 3): (7), with the properties (8)."""
    e0, e1, e2, e3 = e
    return np.array([[-e1, -e2, -e3], [e0, -e3, e2], [e3, e0, -e1], [-e2, e1, e0]])


def rate_parts(e: Array, omega: Array) -> Vector4:
    """Return the parts of de/dt of `e` at the body angular velocity `omega` [rad/s]: (6), (24)."""
    e0, e1, e2, e3, p, q, r = e[0], e[1], e[2], e[3], omega[0], omega[1], omega[2]
    return (
        0.5 * (-e1 * p - e2 * q - e3 * r),
        0.5 * (e0 * p - e3 * q + e2 * r),
        0.5 * (e3 * p + e0 * q - e1 * r),
        0.5 * (-e2 * p + e1 * q + e0 * r),
    )


def rate(e: Array, omega: Array) -> Array:
    """Return de/dt, shape (4,), of `e` at the body angular velocity `omega` [rad/s]: (6), (24)."""
    e_dot = np.empty(4)
    e_dot[0], e_dot[1], e_dot[2], e_dot[3] = rate_parts(e, omega)
    return e_dot


def angular_velocity(e: Array, e_dot: Array) -> Array:
    """Return the body angular velocity [rad/s], shape (3,), that turns `e` at `e_dot`: (9)."""
    return 2.0 * kinematic_matrix(e).T @ e_dot


def multiply(a: Array, b: Array) -> Array:
    """Return the quaternion product of `a` and `b`, shape (4,), for (23): first the rotation `b`, then `a`."""
    return np.array(
        [
            a[0] * b[0] - a[1] * b[1] - a[2] * b[2] - a[3] * b[3],
            a[0] * b[1] + a[1] * b[0] + a[2] * b[3] - a[3] * b[2],
            a[0] * b[2] - a[1] * b[3] + a[2] * b[0] + a[3] * b[1],
            a[0] * b[3] + a[1] * b[2] - a[2] * b[1] + a[3] * b[0],
        ]
    )


def error_parts(desired: Array, actual: Array) -> Vector4:
    """Return the parts of desired^-1 * actual, the error of the shortest rotation (scalar part >= 0): (23)."""
    d0, d1, d2, d3 = desired[0], desired[1], desired[2], desired[3]
    a0, a1, a2, a3 = actual[0], actual[1], actual[2], actual[3]
    e0 = d0 * a0 + d1 * a1 + d2 * a2 + d3 * a3
    e1 = d0 * a1 - d1 * a0 - d2 * a3 + d3 * a2
    e2 = d0 * a2 + d1 * a3 - d2 * a0 - d3 * a1
    e3 = d0 * a3 - d1 * a2 + d2 * a1 - d3 * a0
    return (-e0, -e1, -e2, -e3) if e0 < 0.0 else (e0, e1, e2, e3)


def error(desired: Array, actual: Array) -> Array:
    """Return the error quaternion desired^-1 * actual, shape (4,), of the shortest rotation (scalar part >= 0)."""
    # (23).
    #
    # In body coordinates, so that it moves with the body rates by (24).
    e = np.empty(4)
    e[0], e[1], e[2], e[3] = error_parts(desired, actual)
    return e


def down_parts(e: Array) -> Vector3:
    """Return the parts of k = R^T e3: the direction of gravity seen from the body, for (12)."""
    e0, e1, e2, e3 = e[0], e[1], e[2], e[3]
    return 2.0 * (e1 * e3 - e0 * e2), 2.0 * (e2 * e3 + e0 * e1), 1.0 - 2.0 * (e1 * e1 + e2 * e2)


def down_in_body(e: Array) -> Array:
    """Return k = R^T e3, shape (3,), at the attitude `e`: the direction of gravity seen from the body, for (12)."""
    k = np.empty(3)
    k[0], k[1], k[2] = down_parts(e)
    return k
