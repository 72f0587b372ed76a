"""Conservation laws of the plant in time; test_derivatives has its equations."""

import contextlib

import numpy as np
import pytest
from fmpy.fmi1 import FMICallException
from scipy.spatial.transform import Rotation

from tests.plant_fmu.conftest import STATES

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


def energy(state, weight):
    M_RB, M_A = mass_matrices()
    position, e, nu = np.array(state[:3]), np.array(state[3:7]), np.array(state[7:])
    R = Rotation.from_quat(np.roll(e, -1)).as_matrix()
    depth_G, depth_B = position[2] + (R @ R_G)[2], position[2] + (R @ R_B)[2]
    return 0.5 * nu @ (M_RB + M_A) @ nu - weight * depth_G + 199.0 * depth_B


@pytest.mark.parametrize(
    ("weight", "steps", "length", "tolerance"),
    [(196.2, 6, 10.0, 1e-9), pytest.param(199.0, 72, 100.0, 1e-6, marks=pytest.mark.slow)],
    ids=["a minute", "two hours"],
)
def test_energy_and_quaternion_norm_are_conserved_without_damping(make_slave, weight, steps, length, tolerance):
    """Of a tumbling pendulum, in substeps of 1 ms."""
    slave = make_slave().start(**asymmetric(**START, weight=weight), substep=0.001)
    before = energy(slave.get(*STATES), weight)
    for k in range(steps):
        slave.fmu.doStep(length * k, length)
        assert np.linalg.norm(slave.get(*STATES[3:7])) == pytest.approx(1.0, abs=1e-15)
    assert energy(slave.get(*STATES), weight) == pytest.approx(before, rel=tolerance)


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
