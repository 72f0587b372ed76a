"""Frames and units of logs, against elementary rotations and pymavlink's own."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from pymavlink.rotmat import Matrix3

from controller.quaternion import rotation_matrix
from cosim.logs.frames import (
    BODIES,
    WORLDS,
    convert_quaternions,
    euler_zyx,
    quaternion_of_angles,
    quaternions_of_angles,
    rotate_to_body,
)

ANGLES = st.tuples(*[st.floats(-3.0, 3.0)] * 3)


def about(axis, angle):
    """The elementary rotation about an axis."""
    c, s = np.cos(angle), np.sin(angle)
    i, j = {"x": (1, 2), "y": (2, 0), "z": (0, 1)}[axis]
    R = np.eye(3)
    R[i, i] = R[j, j] = c
    R[i, j], R[j, i] = -s, s
    return R


@pytest.mark.parametrize("order", ["ZYX", "XYZ", "ZXZ", "YXZ", "zyx", "xyz"])
@given(angles=ANGLES)
def test_euler_angles_are_products_of_elementary_rotations(order, angles):
    parts = [about(axis.lower(), angle) for axis, angle in zip(order, angles, strict=True)]
    expected = parts[0] @ parts[1] @ parts[2] if order.isupper() else parts[2] @ parts[1] @ parts[0]
    R = rotation_matrix(quaternions_of_angles(np.array([angles]), order)[0])
    np.testing.assert_allclose(R, expected, atol=1e-12)


@given(roll=st.floats(-3.1, 3.1), pitch=st.floats(-1.5, 1.5), yaw=st.floats(-3.1, 3.1))
def test_roll_pitch_yaw_match_pymavlink(roll, pitch, yaw):
    m = Matrix3()
    m.from_euler(roll, pitch, yaw)
    expected = [[getattr(row, axis) for axis in "xyz"] for row in (m.a, m.b, m.c)]
    q = np.array(quaternion_of_angles(roll, pitch, yaw))
    np.testing.assert_allclose(rotation_matrix(q), expected, atol=1e-12)
    np.testing.assert_allclose(euler_zyx(q[None])[0], (roll, pitch, yaw), atol=1e-7)


def test_heading_north_in_enu_is_heading_north_in_ned():
    """In ENU and FLU, yaw counts from east to north: north is a yaw of 90 degrees; in NED and FRD it is none."""
    north = quaternions_of_angles(np.array([[np.pi / 2.0, 0.0, 0.0]]), "ZYX")
    q = convert_quaternions(north, "ENU", "FLU")
    np.testing.assert_allclose(euler_zyx(q)[0], 0.0, atol=1e-12)
    bow_up = quaternions_of_angles(np.array([[np.pi / 2.0, -0.3, 0.0]]), "ZYX")  # about the axis to port
    np.testing.assert_allclose(euler_zyx(convert_quaternions(bow_up, "ENU", "FLU"))[0], (0.0, 0.3, 0.0), atol=1e-12)


@pytest.mark.medium(fast=5)
@pytest.mark.parametrize("world", WORLDS)
@pytest.mark.parametrize("body", BODIES)
@given(angles=ANGLES)
def test_vector_rotation_commutes_with_frame_conversion(world, body, angles):
    q = quaternions_of_angles(np.array([angles]), "ZYX")
    vector = np.array([0.3, -0.7, 1.1])  # in that body frame
    expected = WORLDS[world] @ rotation_matrix(q[0]) @ vector
    turned = rotation_matrix(convert_quaternions(q, world, body)[0]) @ (BODIES[body] @ vector)
    np.testing.assert_allclose(turned, expected, atol=1e-12)


@given(angles=ANGLES)
def test_world_vectors_are_rotated_to_the_body(angles):
    q = quaternions_of_angles(np.array([angles]), "ZYX")
    vector = np.array([[0.3, -0.7, 1.1]])
    np.testing.assert_allclose(rotate_to_body(q, vector)[0], rotation_matrix(q[0]).T @ vector[0], atol=1e-12)


@pytest.mark.parametrize("matrix", [*WORLDS.values(), *BODIES.values()])
def test_frame_conversions_are_proper_rotations(matrix):
    np.testing.assert_allclose(matrix @ matrix.T, np.eye(3))
    assert np.linalg.det(matrix) == pytest.approx(1.0)
