"""Frames of logs, against pymavlink's rotations and vectors that are turned alike."""

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
)

ANGLES = st.tuples(*[st.floats(-3.0, 3.0)] * 3)


@given(roll=st.floats(-3.1, 3.1), pitch=st.floats(-1.5, 1.5), yaw=st.floats(-3.1, 3.1))
def test_roll_pitch_yaw_match_pymavlink(roll, pitch, yaw):
    m = Matrix3()
    m.from_euler(roll, pitch, yaw)
    expected = [[getattr(row, axis) for axis in "xyz"] for row in (m.a, m.b, m.c)]
    q = np.array(quaternion_of_angles(roll, pitch, yaw))
    np.testing.assert_allclose(rotation_matrix(q), expected, atol=1e-12)
    np.testing.assert_allclose(euler_zyx(q[None])[0], (roll, pitch, yaw), atol=1e-7)


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
