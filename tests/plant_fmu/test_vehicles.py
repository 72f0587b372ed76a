"""The shipped vehicles: published values converted independently, and physical validity."""

import dataclasses

import fmpy.validation
import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from plant_fmu import build_fmu, load_vehicle
from plant_fmu.__main__ import main
from plant_fmu.autopilot import Autopilot, effort_of_pulse, pulse_of_effort
from plant_fmu.build import neutral_members
from plant_fmu.errors import VehicleError
from plant_fmu.vehicle import shipped_vehicles
from tests.plant_fmu.conftest import EACH_VEHICLE
from tests.plant_fmu.test_build import ODIN, written

VEHICLES = shipped_vehicles()
MATRIX = ODIN[ODIN.index("matrix = [") : ODIN.index("force_min")]
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
    driven = np.delete(vehicle.thruster_matrix, 4, axis=0) if name == "bluerov2" else vehicle.thruster_matrix
    assert np.linalg.matrix_rank(driven) == len(driven)  # the six-thruster one leaves pitch to the righting moment
    assert vehicle.righting_moment > 0.0
    assert (vehicle.thrust_min < 0).all() and (vehicle.thrust_max > 0).all()


@pytest.mark.parametrize("axis", ["roll", "pitch"])
@pytest.mark.parametrize("name", EACH_VEHICLE)
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


@pytest.mark.parametrize(
    ("name", "vertical"), [("bluerov2", [(0.0, 0.109)]), ("bluerov2_heavy_trimmed", [(0.118, 0.215), (-0.118, 0.215)])]
)
def test_bluerov2_ignition_thrusters_and_centers_match_the_source(name, vertical):
    """Its configs.yaml, from its center of gravity 0.011 m above the level thrusters; x forward, y left, z up there."""
    level = [((x, y, 0.011), (np.sign(x), -np.sign(y), 0)) for x in (0.14, -0.15) for y in (0.092, -0.092)]
    upright = [((x, side * y, 0.0), (0, 0, -1)) for x, y in vertical for side in (1, -1)]
    expected = [np.array([*d, *np.cross(r, d)]) / np.linalg.norm(d) for r, d in level + upright]
    vehicle = load_vehicle(name)
    np.testing.assert_allclose(vehicle.thruster_matrix, np.array(expected).T, atol=1e-12)
    np.testing.assert_array_equal(vehicle.r_G, 0)


def test_bluerov2_follows_ardusubs_frame_vectored():
    """Roll, yaw, throttle (up), forward and lateral factor of each motor in AP_Motors6DOF.cpp, SUB_FRAME_VECTORED."""
    motors = [
        (0, 1, 0, -1, 1),
        (0, -1, 0, -1, -1),
        (0, -1, 0, 1, 1),
        (0, 1, 0, 1, -1),
        (1, 0, -1, 0, 0),
        (-1, 0, -1, 0, 0),
    ]
    vehicle = load_vehicle("bluerov2")
    assert vehicle.autopilot.frame == "vectored" and vehicle.autopilot.sign_of_each(6) == (-1,) * 6
    signs = -np.sign(np.where(np.abs(vehicle.thruster_matrix) > 0.05, vehicle.thruster_matrix, 0.0)).T
    ours = [(roll, yaw, -down, forward, right) for forward, right, down, roll, _, yaw in signs]
    np.testing.assert_array_equal(ours, motors)


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


INVALID = [  # text of the file, its replacement, words of the message after the file's name
    *(('name = "odin"', f'name = "{name}"', f"name is '{name[:30]}")
      for name in ("3odin", "-odin", "", "a" * 65, "int", "Con", "my boat", "bötchen", "../x")),
    ('title = "ODIN', 'title = "\\u0001 ODIN', "title is text with '\\x01', expected printable"),
    ("Rest no", "\\u0007 Rest no", "source is text with '\\x07', expected printable"),
    ("mass = 125.0 ", "mass = -125.0 ", "rigid_body.mass is -125.0, expected above 0 kg, at most 1e+15 kg"),
    ("mass = 125.0 ", "mass = inf ", "rigid_body.mass is inf, expected above 0"),
    ("mass = 125.0 ", 'mass = "heavy" ', "rigid_body.mass: expected a number, got a text (got 'heavy')"),
    ("mass = 125.0 ", "mas = 125.0 ", "rigid_body.mas: unknown key; did you mean 'mass'?"),
    ("mass = 125.0 ", "# ", "rigid_body.mass is missing"),
    ("weight = ", "weight = -", "rigid_body.weight is -"),
    ("buoyancy = 1", "buoyancy = -1", "hydrostatics.buoyancy is -"),
    ("[0.0, 0.0, 0.05] ", "[0.0, 0.0, nan] ", "rigid_body.center_of_gravity[2] is nan, expected -1e+15 to"),
    ("[0.0, 0.0, 0.05] ", "[0.0, 0.0, 0.3] ", "rigid-body mass matrix is not positive definite (smallest eig"),
    ("[62.5, 62.5, 62.5, 0.0, 0.0, 0.0]", "[-200.0, 62.5, 62.5, 0.0, 0.0, 0.0]",
     "mass matrix with added mass is not positive definite (smallest eig"),
    ("[8.0, 8.0, 8.0]", "[8.0, 8.0, nan]", "rigid_body.inertia[2] is nan, expected -1e+15 to 1e+15"),
    ("[8.0, 8.0, 8.0]", "[[8, 1, 0], [0, 8, 0], [0, 0, 8]]", "rigid_body.inertia is not symmetric"),
    ("[8.0, 8.0, 8.0]", "[8.0, [1.0, 2.0, 3.0], 8.0]", "rigid_body.inertia is 3 rows of [0, 3] numbers"),
    ("[8.0, 8.0, 8.0]", "[8.0, 8.0]", "rigid_body.inertia is 2 numbers, expected a diagonal of 3, or 3 by 3"),
    ("[8.0, 8.0, 8.0]", "[[], [], []]", "rigid_body.inertia is 3 rows of [0] numbers"),
    ("[48.0, 48.0, 48.0, 80.0, 80.0, 80.0]", "[48.0, -48.0, 48.0, 80.0, 80.0, 80.0]",
     "hydrodynamics.quadratic_damping[1] is -48.0, expected 0 to 1e+15"),
    ("[0.508, -0.508, 0.508, -0.508, 0, 0, 0, 0],", "", "thrusters.matrix is 5 rows of [8] numbers, expected 6 rows"),
    ("[0.508, -0.508, 0.508, -0.508, 0, 0, 0, 0],", "[0.508],", "thrusters.matrix is 6 rows of [1, 8] numbers"),
    ("[0.508, -0.508,", "[nan, -0.508,", "thrusters.matrix[5][0] is nan, expected"),
    ("matrix = [", "matrix = []\nmatrix_was = [", "thrusters.matrix_was: unknown key"),
    (MATRIX, "matrix = []\n", "thrusters.matrix is 0 rows of [] numbers, expected 6 rows"),
    (MATRIX, "matrix = [[], [], [], [], [], []]\n", "thrusters.matrix is 6 rows of [0] numbers, expected 6 rows"),
    ("force_min = -27.0 ", "force_min = [-27.0, -27.0] ", "thrusters.force_min is 2 numbers, expected one, or 8"),
    ("force_min = -27.0 ", "force_min = 28.0 ", "thrusters.force_min is above force_max"),
    ("force_max = 27.0 ", "force_max = inf ", "thrusters.force_max is inf, expected"),
    ("time_constant = 0.0 ", "time_constant = -0.1 ", "thrusters.time_constant is -0.1, expected 0 to"),
    ("force_min =", "rate_limit = -5.0\nforce_min =", "thrusters.rate_limit is -5.0, expected 0 to"),
    ("force_min =", "dead_band = 1.5\nforce_min =", "thrusters.dead_band is 1.5, expected 0 to 1"),
    ("force_min =", "curve = -1.0\nforce_min =", "thrusters.curve is -1.0, expected 0 to 1"),
    ("radius = 0.315", "radius = -1.0", "hull.radius is -1.0, expected 0 to"),
    ('shape = "sphere"', 'shape = "egg"', "hull.shape: expected one of 'frame', 'sphere' (got 'egg')"),
    ("[hydrostatics]", "[hydrostatics", "not valid TOML: "),
    *(("[hull]", f"[autopilot]\nframe = 'x'\n{lines}\n[hull]", f"autopilot.{words}") for lines, words in (
        ("signs = 2", "signs is (2, 2, 2, 2, 2, 2, 2, 2), expected 1 or -1"),
        ("curve = 'cubic'", "curve: expected one of 'linear', 'quadratic'"),
        ("sign = 1", "sign: unknown key; did you mean 'signs'"),
        ("signs = [1, -1]", "signs is 2 numbers, expected 8"),
        ("channels = [1, 2]", "channels is 2 numbers, expected 8"),
        ("channels = [1, 1, 3, 4, 5, 6, 7, 8]", "channels is (1, 1, 3, 4, 5, 6, 7, 8), expected each servo output on"),
        ("channels = [1, 2, 3, 4, 5, 6, 7, 33]", "channels is (1, 2, 3, 4, 5, 6, 7, 33), expected 1 to 32, or 0 for"),
        ("pwm_dead_band = -1", "pwm_dead_band is -1, expected 0 us or above"),
        ("pwm_dead_band = 400", "pwm_dead_band is 400 us, expected less than pwm_span"),
        ("pwm_span = 0", "pwm_span is 0, expected above 0 us"),
        *((f"pwm_neutral = {neutral}\npwm_span = {span}",
           f"pwm_neutral and pwm_span is {neutral} and {span} us, expected pulses of 800 to 2200 us")
          for neutral, span in ((1199, 400), (1801, 400), (1500, 701))),
    )),
    ("[hull]", "[autopilot]\nsigns = 1\n[hull]", "autopilot.frame is missing"),
    ("[hull]", "[autopilot]\nframe = 'a\\tb'\n[hull]".replace("'", '"'), "autopilot.frame is 'a\\tb', expected a name"),
]  # fmt: skip


@pytest.mark.parametrize(("old", "new", "words"), INVALID)
def test_invalid_files_are_rejected_by_key(tmp_path, capsys, old, new, words):
    path, out = written(tmp_path, (old, new)), tmp_path / "boat.fmu"
    assert main(["build", "--vehicle", str(path), "--out", str(out)]) == 2
    said = capsys.readouterr().err
    assert said.count("\n") == 1 and not out.exists()
    with pytest.raises(VehicleError) as caught:
        load_vehicle(path)
    assert str(caught.value).startswith(f"{path}: {words}")


@pytest.mark.parametrize(
    ("old", "new", "words"),
    [("mass = 125.0 ", "mass = 1e-4 ", "mass is 0.0001 kg, expected 0.001 to 1e+09"),
     ("force_max = 27.0 ", "force_max = 2e9 ", "thrust_max[1] is 2e+09 N, expected -1e+09 to 1e+09")],
)  # fmt: skip
def test_numbers_outside_the_domain_of_the_plant_are_rejected(tmp_path, capsys, old, new, words):
    path = written(tmp_path, (old, new))
    assert main(["build", "--vehicle", str(path), "--out", str(tmp_path / "boat.fmu")]) == 2
    assert capsys.readouterr().err == f"plant_fmu: odin: {words}\n"


def test_autopilot_accepts_every_pulse_of_a_speed_controller(tmp_path):
    for neutral, span in ((1200, 400), (1800, 400), (1500, 700)):
        table = f"[autopilot]\nframe = 'x'\nsigns = -1\npwm_neutral = {neutral}\npwm_span = {span}\n[hull]"
        found = load_vehicle(written(tmp_path, ("[hull]", table))).autopilot
        assert (found.channels, found.signs) == (tuple(range(1, 9)), (-1,) * 8)


def test_hull_shape_defaults_to_frame():
    assert {name: load_vehicle(name).hull_shape for name in ("odin", "rexrov")} == {"odin": "sphere", "rexrov": "frame"}


@pytest.mark.parametrize("curve", ["linear", "quadratic"])
@pytest.mark.parametrize("sign", [-1, 1])
def test_pulse_and_effort_are_inverse_functions(curve, sign):
    """Outside the dead band each is the other's inverse; beyond the ends a pulse stays at them, and NaN is neutral."""
    table = Autopilot("vectored_6dof", curve=curve)
    pulse, effort = pulse_of_effort(table, sign), effort_of_pulse(table, sign)
    for fraction in (-1.0, -0.64, -0.25, 0.36, 0.81, 1.0):
        assert effort(pulse(fraction)) == pytest.approx(fraction, rel=1e-12)
    ends = [table.pwm_neutral - sign * table.pwm_span, table.pwm_neutral + sign * table.pwm_span]
    assert [pulse(-1.0), pulse(1.0)] == ends == [pulse(-7.0), pulse(7.0)]
    assert pulse(0.0) == pulse(float("nan")) == table.pwm_neutral


def test_mass_and_size_suffice(tmp_path):
    """Two numbers begin an identification: neutral, upright, box-like; what the file says is kept."""
    file = tmp_path / "pool.toml"
    file.write_text(
        'name = "pool"\nrigid_body.mass = 12.0\nhull.size = [0.6, 0.4, 0.3]\nhydrostatics.buoyancy = 119.0\n'
    )
    vehicle = load_vehicle(file)
    assert np.diag(vehicle.inertia) == pytest.approx([0.25, 0.45, 0.52])  # of a solid box, by hand
    assert vehicle.weight == pytest.approx(117.72) and vehicle.buoyancy == 119.0 and vehicle.r_B[2] < 0.0
    assert vehicle.quadratic_damping[:3] == pytest.approx([60.0, 90.0, 120.0])
    assert not vehicle.thruster_matrix.any()
    file.write_text('name = "pool"\nrigid_body.mass = 12.0\nhull.size = [0.6, "wide", 0.3]\n')
    with pytest.raises(VehicleError, match=r"hull\.size"):
        load_vehicle(file)
    file.write_text('name = "pool"\nrigid_body.mass = 12.0\n')
    with pytest.raises(VehicleError, match="missing"):
        load_vehicle(file)
