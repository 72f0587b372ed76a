"""The plant as physical laws."""

import contextlib

import numpy as np
import pytest
from fmpy.fmi1 import FMICallException
from scipy.integrate import solve_ivp
from scipy.spatial.transform import Rotation

from tests.plant_fmu.conftest import STATES, WRENCH

# a body with nothing symmetric about it
MASS, INERTIA = 20.0, np.array([[1.1, -0.06, 0.05], [-0.06, 1.4, 0.09], [0.05, 0.09, 1.7]])
R_G, R_B = np.array([0.03, -0.02, 0.05]), np.array([-0.01, 0.02, -0.04])
rng = np.random.default_rng(7)
_root = rng.normal(size=(6, 6))
ADDED = _root @ _root.T * 0.4 + np.diag([9, 12, 16, 0.3, 0.4, 0.5])


def asymmetric(**more):
    values = {"mass": MASS, "weight": 196.2, "buoyancy": 199.0}
    values |= {f"inertia.{a}{b}": INERTIA[i, j] for i, a in enumerate("xyz") for j, b in enumerate("xyz") if i <= j}
    values |= {f"r_G.{a}": x for a, x in zip("xyz", R_G, strict=True)}
    values |= {f"r_B.{a}": x for a, x in zip("xyz", R_B, strict=True)}
    values |= {f"added_mass[{i + 1},{j + 1}]": ADDED[i, j] for i in range(6) for j in range(i, 6)}
    values |= {f"{kind}_damping[{i + 1}]": 0.0 for kind in ("linear", "quadratic") for i in range(6)}
    return values | more


def skew(a):
    return np.cross(np.eye(3), a)


def mass_matrices():
    rigid = np.block([[MASS * np.eye(3), -MASS * skew(R_G)], [MASS * skew(R_G), INERTIA]])
    return rigid, ADDED


START = dict(zip(STATES[3:], (0.6, 0.5, -0.4, 0.48, 0.7, -0.3, 0.4, 0.5, -0.6, 0.3), strict=True))


@pytest.mark.medium
@pytest.mark.parametrize("fmi", [pytest.param(2, marks=pytest.mark.slow), 3], ids=["fmi2", "fmi3"])
def test_asymmetric_vehicle_follows_fossens_matrix_equation(make_slave, fmi):
    """A direct transcription with C(nu) from the parametrization theorem (Fossen 2011, 3.46), integrated by SciPy."""
    M_RB, M_A = mass_matrices()
    current, tau = np.array([0.3, -0.2, 0.1]), np.array([3.0, -2.0, 4.0, 0.4, -0.5, 0.3])
    linear, quadratic = np.array([2, 3, 4, 0.1, 0.2, 0.3]), np.array([5, 6, 7, 0.4, 0.5, 0.6])

    def C(M, nu):
        a = M[:3, :3] @ nu[:3] + M[:3, 3:] @ nu[3:]
        b = M[3:, :3] @ nu[:3] + M[3:, 3:] @ nu[3:]
        return np.block([[np.zeros((3, 3)), -skew(a)], [-skew(a), -skew(b)]])

    def rhs(t, x):
        e, nu = x[3:7], x[7:]
        R = Rotation.from_quat(np.roll(e, -1)).as_matrix()
        v_c = R.T @ current
        nu_r = nu - np.r_[v_c, 0, 0, 0]
        nu_c_dot = np.r_[-np.cross(nu[3:], v_c), 0, 0, 0]
        k = R.T @ [0, 0, 1]
        g = -np.r_[(196.2 - 199.0) * k, np.cross(R_G * 196.2 - R_B * 199.0, k)]
        force = (
            tau - C(M_RB, nu) @ nu - C(M_A, nu_r) @ nu_r - (linear + quadratic * abs(nu_r)) * nu_r - g + M_A @ nu_c_dot
        )
        w = nu[3:]
        e_dot = 0.5 * np.r_[-e[1:] @ w, e[0] * w + np.cross(e[1:], w)]
        return np.r_[R @ nu[:3], e_dot, np.linalg.solve(M_RB + M_A, force)]

    values = asymmetric(**START)
    values |= {f"current.{a}": c for a, c in zip("xyz", current, strict=True)}
    values |= {f"linear_damping[{i + 1}]": d for i, d in enumerate(linear)}
    values |= {f"quadratic_damping[{i + 1}]": d for i, d in enumerate(quadratic)}
    slave = make_slave(fmi=fmi).start(**values, substep=0.001)
    slave.set_values(dict(zip(WRENCH, tau, strict=True)))
    x0 = np.array(slave.get(*STATES))
    slave.step(6.0)
    expected = solve_ivp(rhs, (0, 6.0), x0, method="DOP853", rtol=1e-12, atol=1e-12).y[:, -1]
    assert np.abs(slave.get(*STATES) - expected).max() < 1e-8


def energy(state, weight=196.2):
    M_RB, M_A = mass_matrices()
    position, e, nu = np.array(state[:3]), np.array(state[3:7]), np.array(state[7:])
    R = Rotation.from_quat(np.roll(e, -1)).as_matrix()
    depth_G, depth_B = position[2] + (R @ R_G)[2], position[2] + (R @ R_B)[2]
    return 0.5 * nu @ (M_RB + M_A) @ nu - weight * depth_G + 199.0 * depth_B


def test_energy_is_conserved_without_damping(make_slave):
    slave = make_slave().start(**asymmetric(**START), substep=0.001)
    before = energy(slave.get(*STATES))
    slave.step(60.0)
    assert energy(slave.get(*STATES)) == pytest.approx(before, rel=1e-9)


def test_damping_takes_energy_out(make_slave):
    slave = make_slave().start(**asymmetric(**START, **{f"quadratic_damping[{i + 1}]": 5.0 for i in range(6)}))
    energies = []
    for _ in range(50):
        energies.append(energy(slave.get(*STATES)))
        slave.step(0.1)
    assert np.all(np.diff(energies) < 0.0)


def test_world_momentum_is_conserved_without_forces(make_slave):
    """Rigid body plus water: the total momentum, seen from the world, stays."""
    slave = make_slave().start(**asymmetric(**START, weight=0.0, buoyancy=0.0), substep=0.001)
    M = sum(mass_matrices())

    def momentum():
        state = np.array(slave.get(*STATES))
        R = Rotation.from_quat(np.roll(state[3:7], -1)).as_matrix()
        return R @ (M @ state[7:])[:3]

    before = momentum()
    slave.step(20.0)
    assert momentum() == pytest.approx(before, abs=1e-9)


def test_quaternion_stays_a_unit(make_slave):
    slave = make_slave("bluerov2_heavy").start(**START)
    slave.set_values({"wrench.K": 2.0, "wrench.M": -3.0, "wrench.N": 4.0})
    for _ in range(50):
        slave.step(0.5)
        assert np.linalg.norm(slave.get(*STATES[3:7])) == pytest.approx(1.0, abs=1e-15)


def test_quaternion_is_normalized_when_initialization_ends(make_slave):
    slave = make_slave().start(**{"quaternion.e0": 0.5, "quaternion.e1": 0.5})
    assert slave.get("quaternion.e0", "quaternion.e1") == pytest.approx([np.sqrt(0.5)] * 2)


def test_vehicle_drifts_with_the_current(make_slave):
    """At rest in moving water a neutral vehicle is at rest for the water."""
    slave = make_slave().start(**asymmetric(
        weight=196.2, buoyancy=196.2, **{"current.x": 0.4, "current.y": -0.3, "current.z": 0.2},
        **{"velocity.u": 0.4, "velocity.v": -0.3, "velocity.w": 0.2},
        **{f"r_{c}.{a}": 0.0 for c in "GB" for a in "xyz"},
        **{f"quadratic_damping[{i + 1}]": 9.0 for i in range(6)},
    ))  # fmt: skip
    slave.step(10.0)
    assert slave.get("position.x", "position.y", "position.z") == pytest.approx([4.0, -3.0, 2.0], abs=1e-12)


@pytest.mark.parametrize("initialized", [True, False])
def test_euler_angles_are_those_of_the_quaternion(make_slave, initialized):
    """Also while the quaternion is not normalized yet."""
    slave = make_slave()
    if initialized:
        slave.start(**START)
    else:
        slave.set_values({name: 0.5 * value for name, value in START.items()})
    e = slave.get(*STATES[3:7])
    yaw, pitch, roll = Rotation.from_quat(np.roll(e, -1)).as_euler("ZYX")
    assert slave.get("attitude.roll", "attitude.pitch", "attitude.yaw") == pytest.approx([roll, pitch, yaw], abs=1e-12)


def test_vertical_attitude_is_expressed_by_pitch_and_yaw(make_slave):
    """Where roll and yaw are one, the angles still give the attitude back."""
    slave = make_slave().start(**dict(zip(STATES[3:7], (0.5, -0.5, 0.5, 0.5), strict=True)))
    roll, pitch, yaw = slave.get("attitude.roll", "attitude.pitch", "attitude.yaw")
    assert (roll, pitch) == (0.0, pytest.approx(np.pi / 2))
    expected = Rotation.from_quat([-0.5, 0.5, 0.5, 0.5]).as_matrix()
    assert Rotation.from_euler("ZYX", [yaw, pitch, roll]).as_matrix() == pytest.approx(expected, abs=1e-12)


def test_the_guard_bounds_the_fastest_damping_of_any_mass_matrix(make_slave):
    """Coupled added mass damps faster than its diagonal suggests: such a step is rejected."""
    coupled = {f"added_mass[{i + 1},{j + 1}]": 0.0 for i in range(6) for j in range(i, 6)}
    coupled |= {f"added_mass[{i},{i}]": 90.0 for i in (1, 2, 3)} | {"added_mass[1,2]": 80.0, "added_mass[2,3]": 80.0}
    coupled |= {"added_mass[1,3]": 80.0, "mass": 10.0, "linear_damping[1]": 1.2e4, "linear_damping[2]": 1.2e4}
    slave = make_slave().start(**asymmetric(**coupled, **{"velocity.u": 1e-6, "velocity.v": -1e-6}))
    grown = 0.0
    with contextlib.suppress(FMICallException):
        for _ in range(40):
            slave.step(0.005)
            grown = max(grown, *np.abs(slave.get("velocity.u", "velocity.v")))
    assert grown < 1e-3


def test_substeps_are_snapped_to_the_step(make_slave):
    """A step that is a hair more than whole substeps takes no further one."""
    ends = []
    for h in (0.01, np.nextafter(0.01, 1.0)):
        slave = make_slave().start(**START, substep=0.005)
        slave.step(h)
        ends.append(slave.get(*STATES))
    assert ends[0] == pytest.approx(ends[1], abs=1e-15)


# ---- over hours ----


@pytest.mark.slow
def test_energy_and_quaternion_norm_are_conserved_over_two_hours(make_slave):
    """A tumbling pendulum without damping, in 7.2 million substeps of 1 ms: neither gains nor loses a millionth."""
    slave = make_slave().start(**asymmetric(**START, weight=199.0), substep=0.001)
    before = energy(slave.get(*STATES), 199.0)
    for k in range(72):
        slave.fmu.doStep(100.0 * k, 100.0)
        assert np.linalg.norm(slave.get(*STATES[3:7])) == pytest.approx(1.0, abs=1e-15)
    assert energy(slave.get(*STATES), 199.0) == pytest.approx(before, rel=1e-6)


@pytest.mark.slow
def test_work_and_dissipation_balance_over_one_hour(make_slave):
    """Kinetic and potential energy change by what actuators put in and damping takes out."""
    damping = {f"{kind}_damping[{i}]": 4.0 + i for kind in ("linear", "quadratic") for i in range(1, 7)}
    slave = make_slave().start(**asymmetric(**START) | damping, substep=0.005)
    D_l, D_q = np.array([4.0 + i for i in range(1, 7)]), np.array([4.0 + i for i in range(1, 7)])
    before, h, powers = energy(slave.get(*STATES)), 0.01, []

    def power(tau):
        nu = np.array(slave.get(*STATES[7:]))
        return tau @ nu - (D_l + D_q * abs(nu)) @ nu**2

    for k in range(36_000):
        if k % 400 == 0:  # the power jumps with the command, so each piece is integrated on its own
            phase = k / 400
            tau = np.array([3 * np.sin(phase), 2.0, 1 * np.cos(phase), 0.3, -0.2 * np.sin(2 * phase), 0.1])
            slave.set_values(dict(zip(WRENCH, tau, strict=True)))
        start = power(tau)
        slave.fmu.doStep(2 * k * h / 2, h / 2)
        middle = power(tau)
        slave.fmu.doStep((2 * k + 1) * h / 2, h / 2)
        powers.append((start + 4 * middle + power(tau)) * h / 6)  # Simpson
    gained = energy(slave.get(*STATES)) - before
    assert sum(powers) == pytest.approx(gained, abs=1e-6 * sum(np.abs(powers)))
