"""Properties 1-3 and (12) of the vehicles, against cross products and linear algebra written here."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from controller.theory.equations_of_motion import (
    asymmetry,
    coriolis,
    damping,
    least_inertia,
    restoring_defect,
    skew_defect,
)
from plant_fmu import load_vehicle
from plant_fmu.vehicle import shipped_vehicles

rng = np.random.default_rng(5)
EACH = pytest.mark.parametrize("name", shipped_vehicles())


@EACH
def test_property_1_mass_matrix_is_symmetric_positive_definite(name):
    mass = load_vehicle(name).mass_matrix
    assert asymmetry(mass) < 1e-9
    assert 0.0 < least_inertia(mass) == pytest.approx(1.0 / np.linalg.norm(np.linalg.inv(mass), 2))


@EACH
def test_property_2_coriolis_matrix_is_skew_symmetric(name):
    """C is skew-symmetric, and C nu is the rate of the momentum in turning axes (Kirchhoff)."""
    mass = load_vehicle(name).mass_matrix
    for nu in rng.normal(size=(20, 6)):
        v, w = nu[:3], nu[3:]
        a, b = np.split(mass @ nu, 2)
        expected = np.concatenate([np.cross(w, a), np.cross(v, a) + np.cross(w, b)])
        assert coriolis(mass, nu) @ nu == pytest.approx(expected, rel=1e-9, abs=1e-9)
        assert skew_defect(mass, nu) == 0.0
        assert abs(nu @ coriolis(mass, nu) @ nu) < 1e-9 * np.abs(mass).max()


@EACH
def test_property_3_holds_where_every_velocity_is_other_than_zero(name):
    vehicle = load_vehicle(name)
    for nu in rng.normal(size=(20, 6)):
        diagonal = damping(vehicle.linear_damping, vehicle.quadratic_damping, nu)
        assert diagonal.min() > 0.0
        assert diagonal == pytest.approx([d + q * abs(x) for d, q, x in zip(
            vehicle.linear_damping, vehicle.quadratic_damping, nu, strict=True)])  # fmt: skip


def test_property_3_fails_at_rest_for_odin_which_has_no_linear_drag_of_translation():
    odin = load_vehicle("odin")
    assert damping(odin.linear_damping, odin.quadratic_damping, np.zeros(6)).min() == 0.0


def test_asymmetry_sees_an_asymmetric_matrix():
    lopsided = np.eye(6)
    lopsided[0, 1] = 0.5
    assert asymmetry(lopsided) == 0.5


@EACH
def test_restoring_forces_are_linear_in_phi(name):
    v = load_vehicle(name)
    for rotation in Rotation.random(20, random_state=3):
        quaternion = rotation.as_quat(scalar_first=True)
        assert restoring_defect(v.weight, v.buoyancy, v.r_G, v.r_B, quaternion) < 1e-9 * v.weight
