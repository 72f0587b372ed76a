"""The shipped vehicles: published values converted independently, and physical validity."""

import dataclasses
from importlib import resources

import fmpy.validation
import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from plant_fmu import build_fmu, load_vehicle, shipped_vehicles
from plant_fmu.build import neutral_members
from plant_fmu.errors import TableError, VehicleError
from tests.plant_fmu.test_build import written

VEHICLES = shipped_vehicles()
FLU_TO_FRD = Rotation.from_euler("x", 180, degrees=True)  # y left, z up into y right, z down

# Berg 2012 as uuv_simulator publishes it: rexrov_base.xacro, rexrov.gazebo.xacro, rexrov_actuators.xacro
REXROV_INERTIA_FLU = [[525.39, 1.44, 33.41], [1.44, 794.20, 2.6], [33.41, 2.6, 691.23]]
REXROV_ADDED_MASS = """
    779.79  -6.8773 -103.32  8.5426 -165.54 -7.8033
   -6.8773   1222     51.29  409.44 -5.8488  62.726
   -103.32   51.29   3659.9  6.1112 -386.42  10.774
    8.5426  409.44   6.1112   534.9 -10.027  21.019
   -165.54 -5.8488  -386.42 -10.027  842.69 -1.1162
   -7.8033  62.726   10.775  21.019 -1.1162  224.32"""
REXROV_THRUSTERS_FLU = [  # position m; pitch and yaw of the axis of thrust, degrees
    ((-0.890895, 0.334385, 0.528822), -74.53, -53.21),
    ((-0.890895, -0.334385, 0.528822), -74.53, 53.21),
    ((0.890895, 0.334385, 0.528822), -105.47, 53.21),
    ((0.890895, -0.334385, 0.528822), -105.47, -53.21),
    ((-0.412125, 0.505415, 0.129), 0, 45),
    ((-0.412125, -0.505415, 0.129), 0, -45),
    ((0.412125, 0.505415, 0.129), 0, 135),
    ((0.412125, -0.505415, 0.129), 0, -135),
]


@pytest.mark.parametrize("name", VEHICLES)
def test_vehicle_parameters_are_physically_valid(name):
    vehicle = load_vehicle(name)
    for matrix in (vehicle.mass_matrix, vehicle.added_mass + 1e-12 * np.eye(6)):
        assert np.array_equal(matrix, matrix.T)
        np.linalg.cholesky(matrix)
    moments = np.linalg.eigvalsh(vehicle.inertia)
    assert moments[2] <= moments[0] + moments[1]  # true of every body
    assert vehicle.weight == pytest.approx(9.81 * vehicle.mass, rel=0.002)
    assert vehicle.buoyancy == pytest.approx(vehicle.weight, rel=0.02)
    assert np.linalg.matrix_rank(vehicle.thruster_matrix) == 6
    assert (vehicle.thrust_min < 0).all() and (vehicle.thrust_max > 0).all()


@pytest.mark.parametrize("axis", ["roll", "pitch"])
@pytest.mark.parametrize("name", ["odin", *(pytest.param(v, marks=pytest.mark.slow) for v in VEHICLES if v != "odin")])
def test_vehicle_rights_itself(name, axis, make_slave):
    """Released at 60 degrees, a vehicle returns upright, and its oscillation decays."""
    e0, e = Rotation.from_euler("x", 60, degrees=True).as_quat()[[3, 0]]
    slave = make_slave(name).start(**{"quaternion.e0": e0, f"quaternion.e{1 + (axis == 'pitch')}": e})
    angles = []
    for _ in range(600):
        slave.step(0.1)
        angles.append(slave.get(f"attitude.{axis}")[0])
    assert angles[0] < np.radians(60)
    assert np.abs(angles).max() <= np.radians(60)
    rest = np.mean(angles[-200:])
    assert abs(rest) < np.radians(5)
    assert np.ptp(angles[-200:]) < 0.5 * np.ptp(angles[:200])


@pytest.mark.medium(fast=1)
@pytest.mark.parametrize("fmi", [2, 3])
def test_autopilot_table_does_not_change_the_fmu(fmi):
    vehicle = load_vehicle("bluerov2_heavy")
    assert vehicle.autopilot
    assert neutral_members(dataclasses.replace(vehicle, autopilot=None), fmi) == neutral_members(vehicle, fmi)


def test_bluerov2_wu_parameters_match_the_published_values():
    """Facts as github.com/OsloMet-OceanLab/BlueROV2 gives them, with Fossen's signs."""
    vehicle = load_vehicle("bluerov2_heavy_wu")
    assert (vehicle.mass, vehicle.weight, vehicle.buoyancy) == (11.5, 112.8, 114.8)
    np.testing.assert_array_equal(vehicle.r_G, [0, 0, 0.02])
    np.testing.assert_array_equal(vehicle.r_B, [0, 0, 0])
    np.testing.assert_array_equal(vehicle.inertia, 0.16 * np.eye(3))
    np.testing.assert_array_equal(-vehicle.added_mass, np.diag([-5.5, -12.7, -14.57, -0.12, -0.12, -0.12]))
    np.testing.assert_array_equal(-vehicle.linear_damping, [-4.03, -6.22, -5.18, -0.07, -0.07, -0.07])
    np.testing.assert_array_equal(-vehicle.quadratic_damping, [-18.18, -21.66, -36.99, -1.55, -1.55, -1.55])


def test_both_sets_of_the_bluerov2_have_the_same_thrusters():
    one, other = load_vehicle("bluerov2_heavy"), load_vehicle("bluerov2_heavy_wu")
    for key in ("thruster_matrix", "thrust_min", "thrust_max", "thrust_time_constant"):
        np.testing.assert_array_equal(getattr(one, key), getattr(other, key))


def test_bluerov2_thruster_positions_match_the_source():
    """The level ones at 45 degrees, pushing ahead in front and aback behind; the upright ones push up."""
    level = [((x, y, 0.085), (np.sign(x), -np.sign(y), 0)) for x in (0.156, -0.156) for y in (0.111, -0.111)]
    upright = [((x, y, 0.0), (0, 0, -1)) for x in (0.12, -0.12) for y in (0.218, -0.218)]
    expected = [np.array([*d, *np.cross(r, d)]) / np.linalg.norm(d) for r, d in level + upright]
    np.testing.assert_allclose(load_vehicle("bluerov2_heavy").thruster_matrix, np.array(expected).T, atol=1e-12)


def test_rexrov_body_is_that_of_uuv_simulator():
    vehicle = load_vehicle("rexrov")
    turn = FLU_TO_FRD.as_matrix()
    assert vehicle.mass == 1862.87
    np.testing.assert_allclose(vehicle.inertia, turn @ REXROV_INERTIA_FLU @ turn.T, atol=1e-9)
    np.testing.assert_allclose(vehicle.r_B, FLU_TO_FRD.apply([0, 0, 0.3]), atol=1e-12)
    np.testing.assert_array_equal(vehicle.r_G, 0)
    assert vehicle.weight == pytest.approx(1862.87 * 9.81, abs=0.01)
    assert vehicle.buoyancy == pytest.approx(1.83826 * 1028 * 9.81, abs=0.01)
    np.testing.assert_array_equal(vehicle.linear_damping, [74.82, 69.48, 728.4, 268.8, 309.77, 105])
    np.testing.assert_array_equal(vehicle.quadratic_damping, [748.22, 992.53, 1821.01, 672, 774.44, 523.27])


def test_rexrov_added_mass_is_as_published():
    published = np.array(REXROV_ADDED_MASS.split(), dtype=float).reshape(6, 6)
    added = load_vehicle("rexrov").added_mass
    np.testing.assert_allclose(added, (published + published.T) / 2, rtol=1e-15)
    assert np.abs(published - published.T).max() == pytest.approx(0.001)


def test_rexrov_added_mass_center_is_above_the_center_of_gravity():
    """The sign of its coupling terms shows whether z is up or down: added mass acts at the center of buoyancy."""
    vehicle = load_vehicle("rexrov")
    A = vehicle.added_mass
    for z in (A[0, 4] / A[0, 0], -A[1, 3] / A[1, 1]):  # of masses A11, A22 that sit at z
        assert z < vehicle.r_G[2]
        assert abs(z - vehicle.r_B[2]) < 0.1


def test_rexrov_thrusters_match_uuv_simulator():
    columns = []
    for position, pitch, yaw in REXROV_THRUSTERS_FLU:
        axis = Rotation.from_euler("ZY", [yaw, pitch], degrees=True).apply([1, 0, 0])
        moment = np.cross(position, axis)
        columns.append([*FLU_TO_FRD.apply(axis), *FLU_TO_FRD.apply(moment)])
    vehicle = load_vehicle("rexrov")
    np.testing.assert_allclose(vehicle.thruster_matrix, np.array(columns).T, atol=1e-9)
    # the first column as that project's own thruster manager has it, y left and z up
    manager = [0.15974268848, -0.21361011546, 0.96377019671, 0.43523202570, 0.94309349741, 0.13688862492]
    np.testing.assert_allclose(vehicle.thruster_matrix[:, 0] * [1, -1, -1, 1, -1, -1], manager, atol=1e-6)


@pytest.mark.medium
@pytest.mark.parametrize("fmi", [2, 3])
def test_vehicle_names_may_have_hyphens(tmp_path, fmi):
    fmu = build_fmu(
        load_vehicle(written(tmp_path, ('name = "odin"', 'name = "my-rov-2"'))), fmi, tmp_path / "my-rov-2.fmu"
    )
    assert fmpy.read_model_description(fmu).coSimulation.modelIdentifier == "my_rov_2"  # as FMI wants it
    assert fmpy.validation.validate_fmu(fmu) == []
    result = fmpy.simulate_fmu(fmu, stop_time=0.1, start_values={"wrench.X": 20.0}, output=["velocity.u"])
    assert result["velocity.u"][-1] > 0.005


@pytest.mark.parametrize("name", ["3odin", "-odin", "", "a" * 65, "int", "Con", "my boat", "bötchen", "../x"])
def test_invalid_vehicle_names_are_rejected(tmp_path, name):
    with pytest.raises(VehicleError, match=r"^\S+boat.toml: name is '.*', expected ") as caught:
        load_vehicle(written(tmp_path, ('name = "odin"', f'name = "{name}"')))
    assert len(str(caught.value)) < 400


@pytest.mark.parametrize(
    ("change", "words"),
    [
        (("mass = 125.0 ", "mass = inf "), "rigid_body.mass is not finite"),
        (("[0.0, 0.0, 0.05] ", "[0.0, 0.0, nan] "), "rigid_body.center_of_gravity is not finite"),
        (("[0.0, 0.0, 0.05] ", "[0.0, 0.0, 0.9] "), r"rigid-body mass matrix is not positive definite \(smallest eig"),
        (("[0.0, 0.0, 0.05] ", "[0.0, 0.0, 0.3] "), r"rigid-body mass matrix is not positive definite \(smallest eig"),
        (("force_max = 27.0 ", "force_max = inf "), "thrusters.force_max is not finite"),
        (("[0.508, -0.508,", "[nan, -0.508,"), "thrusters.matrix is not finite"),
        (("[8.0, 8.0, 8.0]", "[[8, 1, 0], [0, 8, 0], [0, 0, 8]]"), "rigid_body.inertia is not symmetric"),
        (("[8.0, 8.0, 8.0]", "[8.0, [1.0, 2.0, 3.0], 8.0]"), r"rigid_body.inertia is 3 rows of \[0, 3\] numbers"),
        (("[8.0, 8.0, 8.0]", "[8.0, 8.0]"), r"rigid_body.inertia is 2 numbers, expected a diagonal of 3, or 3 by 3"),
        (("[8.0, 8.0, 8.0]", "[[], [], []]"), r"rigid_body.inertia is 3 rows of \[0\] numbers"),
        (("matrix = [", "matrix = []\nmatrix_was = ["), "matrix_was: unknown key"),
        (("Rest no", "\\u0007 Rest no"), r"source is text with '\\x07', expected printable"),
        (("time_constant = 0.0 ", "time_constant = -0.1 "), "thrusters.time_constant is negative"),
        (
            ("force_min =", "rate_limit = -5.0\nforce_min ="),
            "thrusters.rate_limit is negative, -5, expected 0 or above",
        ),
        (("force_min =", "dead_band = 1.5\nforce_min ="), "thrusters.dead_band is 1.5, expected at most 1"),
        (("force_min =", "curve = -1.0\nforce_min ="), "thrusters.curve is negative"),
        (("radius = 0.315", "radius = -1.0"), "hull.radius is negative"),
    ],
)
def test_invalid_parameters_are_rejected_by_key(tmp_path, change, words):
    with pytest.raises(Exception, match=words) as caught:
        load_vehicle(written(tmp_path, change))
    assert "boat.toml: " in str(caught.value) and "\n" not in str(caught.value)


@pytest.mark.parametrize("rows", ["[]", "[[], [], [], [], [], []]"])
def test_a_vehicle_has_a_thruster(tmp_path, rows):
    text = (written(tmp_path)).read_text()
    matrix = text[text.index("matrix = [") : text.index("force_min")]
    with pytest.raises(VehicleError, match=r"thrusters.matrix is \d rows of \[0?\] numbers, expected 6 rows"):
        load_vehicle(written(tmp_path, (matrix, f"matrix = {rows}\n")))


def test_hull_shape_defaults_to_frame(tmp_path):
    assert {name: load_vehicle(name).hull_shape for name in ("odin", "rexrov")} == {"odin": "sphere", "rexrov": "frame"}
    odin = (resources.files("plant_fmu") / "vehicles" / "odin.toml").read_text()
    (tmp_path / "egg.toml").write_text(odin.replace('shape = "sphere"', 'shape = "egg"'))
    with pytest.raises(TableError, match=r"hull\.shape: expected one of 'frame', 'sphere' \(got 'egg'\)"):
        load_vehicle(tmp_path / "egg.toml")
