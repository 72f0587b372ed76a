"""Quaternion algebra against SciPy's rotations and the paper's identities."""

import numpy as np
import pytest
from hypothesis import assume, given
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from controller import quaternion as q
from controller.restoring import parameters, regressor

component = st.floats(-1.0, 1.0)
vectors = st.lists(component, min_size=3, max_size=3).map(np.array)


@st.composite
def units(draw):
    e = np.array(draw(st.lists(component, min_size=4, max_size=4)))
    assume(np.linalg.norm(e) > 1e-2)
    return e / np.linalg.norm(e)


def scipy_of(e):
    return Rotation.from_quat(np.roll(e, -1))  # SciPy puts the scalar last


@given(units())
def test_rotation_matrix_is_scipys(e):
    assert q.rotation_matrix(e) == pytest.approx(scipy_of(e).as_matrix(), abs=1e-14)


@given(vectors, vectors)
def test_skew_is_the_cross_product(a, b):
    assert q.skew(a) @ b == pytest.approx(np.cross(a, b), abs=1e-14)
    assert a @ q.skew(a) == pytest.approx(np.zeros(3), abs=1e-14)  # (5)


@given(units())
def test_properties_of_the_kinematic_matrix(e):
    """(8)."""
    E = q.kinematic_matrix(e)
    assert pytest.approx(np.eye(3), abs=1e-14) == E.T @ E
    assert E.T @ e == pytest.approx(np.zeros(3), abs=1e-14)


@given(units(), vectors)
def test_rates_turn_the_matrix_as_the_body_turns(e, omega):
    """Rdot = R S(w), which decides the sign in (3)."""
    h = 1e-6
    ahead, behind = (e + s * h * q.rate(e, omega) for s in (1, -1))
    R_dot = (q.rotation_matrix(ahead / np.linalg.norm(ahead)) - q.rotation_matrix(behind / np.linalg.norm(behind))) / (
        2 * h
    )
    assert R_dot == pytest.approx(q.rotation_matrix(e) @ q.skew(omega), abs=1e-8)
    assert q.angular_velocity(e, q.rate(e, omega)) == pytest.approx(omega, abs=1e-14)  # (9)


@given(units(), units())
def test_product_composes_rotations(a, b):
    assert q.rotation_matrix(q.multiply(a, b)) == pytest.approx((scipy_of(a) * scipy_of(b)).as_matrix(), abs=1e-13)


@given(units(), units())
def test_error_is_the_shortest_rotation_from_desired_to_actual(desired, actual):
    e = q.error(desired, actual)
    assert e[0] >= 0.0
    assert q.rotation_matrix(e) == pytest.approx((scipy_of(desired).inv() * scipy_of(actual)).as_matrix(), abs=1e-13)


@given(units(), units(), vectors)
def test_error_moves_with_the_body_rates(desired, actual, omega):
    """(24): the error in body coordinates turns at the body's own rates."""
    e = q.error(desired, actual)
    assume(e[0] > 1e-3)  # away from the jump between the two shortest rotations
    h = 1e-6
    later = actual + h * q.rate(actual, omega)
    assert (q.error(desired, later / np.linalg.norm(later)) - e) / h == pytest.approx(q.rate(e, omega), abs=1e-5)


@given(vectors, st.floats(-3.0, 3.0))
def test_axis_and_angle(axis, angle):
    assume(np.linalg.norm(axis) > 1e-2)
    axis = axis / np.linalg.norm(axis)
    expected = Rotation.from_rotvec(axis * angle).as_matrix()
    assert q.rotation_matrix(q.from_axis_angle(axis, angle)) == pytest.approx(expected, abs=1e-13)


@given(units(), vectors, vectors)
def test_regressor_times_parameters_is_weight_and_buoyancy(e, r_G, r_B):
    """(12): g = Z phi is minus the wrench of gravity at r_G and buoyancy at r_B."""
    W, B = 130.0, 127.0
    R = scipy_of(e).as_matrix()
    down = R.T @ [0.0, 0.0, 1.0]
    wrench = np.r_[(W - B) * down, np.cross(r_G, W * down) - np.cross(r_B, B * down)]
    assert regressor(e) @ parameters(W, B, tuple(r_G), r_B) == pytest.approx(-wrench, abs=1e-11)


@pytest.mark.medium
def test_regressor_gives_the_plants_restoring_wrench():
    """At rest, in still water, the plant's acceleration is that of -Z phi: controller and FMU agree."""
    from plant_fmu import load_vehicle
    from plant_fmu.build import cached_fmu
    from tests.plant_fmu.conftest import STATES, CoSimulationInstance

    vehicle = load_vehicle("bluerov2_heavy")
    e = np.array([0.7, 0.3, -0.5, 0.41])
    e /= np.linalg.norm(e)
    slave = CoSimulationInstance(cached_fmu(vehicle, 3)).start(**dict(zip(STATES[3:7], e, strict=True)))
    h = 1e-6
    slave.step(h)
    acceleration = np.array(slave.get(*STATES[7:])) / h
    slave.close()
    phi = parameters(vehicle.weight, vehicle.buoyancy, vehicle.r_G, vehicle.r_B)
    assert vehicle.mass_matrix @ acceleration == pytest.approx(-regressor(e) @ phi, abs=1e-5)
