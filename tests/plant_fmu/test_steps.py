"""The number of substeps of a step, and the stability limit on the motion."""

import numpy as np
import pytest
from fmpy.fmi1 import FMICallException

from tests.plant_fmu.conftest import STATES, UNDAMPED

CENTERED, SPHERE = {f"r_{p}.{a}": 0.0 for p in "GB" for a in "xyz"}, {f"inertia.{a}{a}": 8.0 for a in "xyz"}
MOVING = {"velocity.u": 0.8, "velocity.v": -0.5, "velocity.r": 0.4, "thrust_time_constant[1]": 0.0}
FREE = {"wrench_time_constant": 0.0, "wrench_force_limit": 1e9, "position.z": 20.0}


def after_one(make_slave, start, length, substep):
    slave = make_slave()
    slave.set_values(MOVING | {"substep": substep})
    slave.begin(start)
    slave.fmu.doStep(start, length)
    return slave.get(*STATES)


@pytest.mark.parametrize("start", [0.0, 1e6, -1e6])
def test_a_step_as_long_as_the_substep_is_one_step(make_slave, start):
    """Whatever its end is rounded to: as with a substep that is longer; half of it is not the same."""
    one, whole, half = (after_one(make_slave, start, 0.2, substep) for substep in (0.2, 0.5, 0.1))
    assert one == whole
    assert one != half


def test_two_and_a_half_substeps_are_three_steps(make_slave):
    two_and_a_half, three, two = (after_one(make_slave, 0.0, 0.25, h) for h in (0.1, 0.25 / 3.0, 0.125))
    assert two_and_a_half == three != two


def fares(make_slave, substep, **values):
    """Return whether a step is taken."""
    slave = make_slave().start(**values, substep=substep)
    try:
        slave.step(substep)
    except FMICallException:
        assert "too long for this motion" in slave.said[-1][1]
        return False
    return True


HALF = np.sqrt(0.5)


@pytest.mark.parametrize(
    ("ahead", "e"), [("x", (1, 0, 0, 0)), ("y", (HALF, 0, 0, HALF)), ("z", (HALF, 0, -HALF, 0))], ids="xyz"
)
def test_stability_limit_uses_relative_velocity_in_body_axes(make_slave, ahead, e):
    """Damped along its own x axis alone, which looks along each axis of the world: only a current along that one.

    Its thrusters hold it where it is; where it goes with the water, there is nothing to follow.
    """
    values = UNDAMPED | CENTERED | FREE | {"quadratic_damping[1]": 2000.0, "weight": 1226.25, "buoyancy": 1226.25}
    values |= {f"quaternion.e{i}": float(x) for i, x in enumerate(e)}
    for axis in "xyz":
        for sign in (1.0, -1.0):
            values |= {f"current.{a}": sign * (a == axis) for a in "xyz"}  # 2 d |v| / m = 21 1/s
            held = {"wrench.X": -2000.0 * sign if axis == ahead else 0.0}
            assert fares(make_slave, 0.2, **values, **held) == (axis != ahead)
            assert fares(make_slave, 0.2, **values, **{"velocity.u": sign * (axis == ahead)})


def motions():
    """Motions, with a step that is just stable and one that is not."""
    for axis in range(6):  # h (d1 + 2 d2 |v|) / m on either side of 2.5: linear and quadratic add up
        mass, rate = (187.5 if axis < 3 else 8.0), 12.5
        damping = {f"linear_damping[{axis + 1}]": 4.0 * mass, f"quadratic_damping[{axis + 1}]": (rate - 4.0) * mass}
        for sign in (1.0, -1.0):
            yield UNDAMPED | SPHERE | CENTERED | damping | {f"velocity.{'uvwpqr'[axis]}": 0.5 * sign}, 0.16, 0.224
    for spin in ((6.0, 0.0, 0.0), (0.0, -6.0, 0.0), (0.0, 0.0, 6.0), (2.0, 4.0, -4.0)):
        rates = {f"velocity.{a}": x for a, x in zip("pqr", spin, strict=True)}
        yield UNDAMPED | CENTERED | SPHERE | rates, 0.99 / 6.0, 1.01 / 6.0
    r_G, r_B, W = np.array([0.02, -0.03, 0.05]), np.array([0.02, -0.03, -0.06]), 1226.25
    S = np.array([[0, -r_G[2], r_G[1]], [r_G[2], 0, -r_G[0]], [-r_G[1], r_G[0], 0]])
    M = np.block([[187.5 * np.eye(3), -125.0 * S], [125.0 * S, 8.0 * np.eye(3)]])
    arms = {f"r_{c}.{a}": x for c, r in (("G", r_G), ("B", r_B)) for a, x in zip("xyz", r, strict=True)}
    for free_surface in (False, True):  # h sqrt(k max M^-1) on either side of 1, k of righting arms and of floating
        k = np.linalg.norm(r_G * W - r_B * W) + free_surface * 0.75 * W / 0.3 * (1.0 + np.linalg.norm(r_B)) ** 2
        swing = np.sqrt(k * np.abs(np.linalg.inv(M)).sum(axis=1).max())
        body = {"weight": W, "buoyancy": W, "hull_radius": 0.3, "bottom_depth": 100.0, "free_surface": free_surface}
        yield UNDAMPED | SPHERE | arms | body, 0.99 / swing, 1.01 / swing


@pytest.mark.medium
@pytest.mark.parametrize(("values", "stable", "unstable"), list(motions()))
def test_stability_limit_is_that_of_damping_spin_and_righting(make_slave, values, stable, unstable):
    assert fares(make_slave, stable, **values, **{"position.z": 20.0})
    assert not fares(make_slave, unstable, **values, **{"position.z": 20.0})


def test_stability_limit_includes_bottom_contact(make_slave):
    """2 / T beside the damping, T four substeps at the least: half of what is allowed."""
    values = {"linear_damping[3]": 11.0 * 187.5, "bottom_time_constant": 0.0, "hull_radius": 0.3, "position.z": 9.75}
    assert fares(make_slave, 0.2, **UNDAMPED | values, bottom_depth=10.1)
    assert not fares(make_slave, 0.2, **UNDAMPED | values, bottom_depth=10.0)


def test_stability_limit_uses_the_current_at_the_step_end(make_slave):
    """Held in place by its thrusters: the speed through the water is the current's, which falls all the way."""
    values = {"current_variation.x": 1.0, "current_variation_period": 10.0, "current_correlation_time": 20.0}
    values |= UNDAMPED | CENTERED | FREE
    for seed in range(40):
        slave = make_slave().start(**values, substep=1.0, seed=seed)
        before = slave.get("water_velocity.x")[0]
        slave.step(1.0)
        fall = 1.0 - slave.get("water_velocity.x")[0] / before
        if abs(before) >= 0.3 and 0.1 < fall < 0.3:
            break
    d = 2.4 * 187.5 / (2.0 * abs(before))  # h 2 d |v| / m = 2.4 of 2.5
    slave = make_slave().start(**values | {"quadratic_damping[1]": d}, substep=1.0, seed=seed)
    slave.set_values({"wrench.X": -d * before * abs(before)})
    slave.step(1.0)
