"""Unit quaternions, scalar first, rotating body vectors into the world: equations (1)-(9), (23), (24)."""

# The sign of the last term of (3) is that which (6), (7) and (10) need: the printed matrix is the transpose.

from __future__ import annotations

import numpy as np

from controller.stack_array import Array, Matrix3, Vector3, Vector4, array


def from_axis_angle(axis: Array, angle: float) -> Array:
    """Return the quaternion of a rotation by `angle` [rad] about a unit `axis`, shape (3,): (1), (2).

    Examples
    --------
    >>> import numpy as np
    >>> from controller.quaternion import from_axis_angle
    >>> from_axis_angle(np.array([0.0, 0.0, 1.0]), np.pi).round(6)
    array([0., 0., 0., 1.])
    """
    return np.concatenate(([np.cos(angle / 2.0)], axis * np.sin(angle / 2.0)))


def skew(a: Vector3) -> Matrix3:
    """Return S(a) such that S(a) b = a x b: (4), with the property (5)."""
    return array((0.0, -a[2], a[1]), (a[2], 0.0, -a[0]), (-a[1], a[0], 0.0))


def rotation_matrix(e: Vector4) -> Matrix3:
    """Return R, from body to world, of a unit quaternion `e`: (3).

    Examples
    --------
    >>> import numpy as np
    >>> from controller.quaternion import rotation_matrix
    >>> rotation_matrix(np.array([0.0, 1.0, 0.0, 0.0])).diagonal()
    array([ 1., -1., -1.])
    """
    e0, e1, e2, e3 = e
    return array(
        (1.0 - 2.0 * (e2 * e2 + e3 * e3), 2.0 * (e1 * e2 - e0 * e3), 2.0 * (e1 * e3 + e0 * e2)),
        (2.0 * (e1 * e2 + e0 * e3), 1.0 - 2.0 * (e1 * e1 + e3 * e3), 2.0 * (e2 * e3 - e0 * e1)),
        (2.0 * (e1 * e3 - e0 * e2), 2.0 * (e2 * e3 + e0 * e1), 1.0 - 2.0 * (e1 * e1 + e2 * e2)),
    )


def kinematic_matrix(e: Vector4) -> Array:
    """Return E(e), shape (4, 3): (7), with the properties (8)."""
    e0, e1, e2, e3 = e
    return array((-e1, -e2, -e3), (e0, -e3, e2), (e3, e0, -e1), (-e2, e1, e0))


def rate(e: Vector4, omega: Vector3) -> Vector4:
    """Return de/dt of `e` at the body angular velocity `omega` [rad/s]: (6), (24)."""
    return 0.5 * (kinematic_matrix(e) @ omega)


def angular_velocity(e: Vector4, e_dot: Vector4) -> Vector3:
    """Return the body angular velocity [rad/s] that turns `e` at `e_dot`: (9)."""
    return 2.0 * kinematic_matrix(e).T @ e_dot


def multiply(a: Vector4, b: Vector4) -> Vector4:
    """Return the quaternion product of `a` and `b`, for (23): first the rotation `b`, then `a`."""
    return array(
        a[0] * b[0] - a[1] * b[1] - a[2] * b[2] - a[3] * b[3],
        a[0] * b[1] + a[1] * b[0] + a[2] * b[3] - a[3] * b[2],
        a[0] * b[2] - a[1] * b[3] + a[2] * b[0] + a[3] * b[1],
        a[0] * b[3] + a[1] * b[2] - a[2] * b[1] + a[3] * b[0],
    )


def error(desired: Vector4, actual: Vector4) -> Vector4:
    """Return the error quaternion desired^-1 * actual, of the shortest rotation (scalar part >= 0): (23)."""
    # In body coordinates, so that it moves with the body rates by (24).
    d0, d1, d2, d3 = desired
    a0, a1, a2, a3 = actual
    e = array(
        d0 * a0 + d1 * a1 + d2 * a2 + d3 * a3,
        d0 * a1 - d1 * a0 - d2 * a3 + d3 * a2,
        d0 * a2 + d1 * a3 - d2 * a0 - d3 * a1,
        d0 * a3 - d1 * a2 + d2 * a1 - d3 * a0,
    )
    return -e if e[0] < 0.0 else e


def down_in_body(e: Vector4) -> Vector3:
    """Return k = R^T e3 at the attitude `e`: the direction of gravity seen from the body, for (12)."""
    e0, e1, e2, e3 = e
    return array(2.0 * (e1 * e3 - e0 * e2), 2.0 * (e2 * e3 + e0 * e1), 1.0 - 2.0 * (e1 * e1 + e2 * e2))
