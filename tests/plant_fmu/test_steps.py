"""The number of substeps of a step, and the stability limit on the motion."""

import numpy as np
import pytest
from fmpy.fmi1 import FMICallException

from tests.plant_fmu.conftest import STATES, UNDAMPED

CENTERED, SPHERE = {f"r_{p}.{a}": 0.0 for p in "GB" for a in "xyz"}, {f"inertia.{a}{a}": 8.0 for a in "xyz"}
MOVING = {"velocity.u": 0.8, "velocity.v": -0.5, "velocity.r": 0.4, "thrust_time_constant[1]": 0.0}


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
    assert after_one(make_slave, 0.0, 0.25, 0.1) == after_one(make_slave, 0.0, 0.25, 0.25 / 3.0)
    assert after_one(make_slave, 0.0, 0.25, 0.1) != after_one(make_slave, 0.0, 0.25, 0.125)


LOOKING = {
    "x": (1.0, 0.0, 0.0, 0.0),
    "y": (np.sqrt(0.5), 0.0, 0.0, np.sqrt(0.5)),
    "z": (np.sqrt(0.5), 0.0, -np.sqrt(0.5), 0.0),
}


def fares(make_slave, substep, **values):
    """Return whether a step is taken."""
    slave = make_slave().start(**values, substep=substep)
    try:
        slave.step(substep)
    except FMICallException:
        assert "too long for this motion" in slave.said[-1][1]
        return False
    return True


@pytest.mark.parametrize("ahead", "xyz")
def test_stability_limit_uses_relative_velocity_in_body_axes(make_slave, ahead):
    """Damped along its own x axis alone, which looks along each axis of the world: only a current along that one.

    Its thrusters hold it where it is; where it goes with the water, there is nothing to follow.
    """
    e = dict(zip((f"quaternion.e{i}" for i in range(4)), LOOKING[ahead], strict=True))
    damping = UNDAMPED | {"quadratic_damping[1]": 2000.0, "weight": 1226.25, "buoyancy": 1226.25, "position.z": 20.0}
    damping |= CENTERED
    damping |= {"wrench_time_constant": 0.0, "wrench_force_limit": 1e9}
    for axis in "xyz":
        for sign in (1.0, -1.0):
            current = {f"current.{axis}": sign}  # 2 d |v| / m = 21 1/s
            held = {"wrench.X": -2000.0 * sign if axis == ahead else 0.0}
            assert fares(make_slave, 0.2, **e, **damping, **current, **held) == (axis != ahead)
            assert fares(make_slave, 0.2, **e, **damping, **current, **{"velocity.u": sign * (axis == ahead)})


@pytest.mark.parametrize("axis", range(6))
@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_stability_limit_depends_on_velocity(make_slave, axis, sign):
    """Linear and quadratic add up: h (d1 + 2 d2 |v|) / m on either side of 2.5."""
    mass = 187.5 if axis < 3 else 8.0
    for rate, taken in ((10.0, True), (14.0, False)):
        damping = UNDAMPED | {
            f"linear_damping[{axis + 1}]": 4.0 * mass,
            f"quadratic_damping[{axis + 1}]": (rate - 4.0) * mass,
        }
        damping |= SPHERE | {f"velocity.{'uvwpqr'[axis]}": 0.5 * sign}
        damping |= CENTERED | {"position.z": 20.0}
        assert fares(make_slave, 0.2, **damping) == taken


def test_stability_limit_includes_bottom_contact(make_slave):
    """2 / T beside the damping, T four substeps at the least: half of what is allowed."""
    damping = UNDAMPED | {
        "linear_damping[3]": 11.0 * 187.5,
        "bottom_time_constant": 0.0,
        "hull_radius": 0.3,
        "position.z": 9.75,
    }
    assert fares(make_slave, 0.2, **damping, bottom_depth=10.1)
    assert not fares(make_slave, 0.2, **damping, bottom_depth=10.0)


@pytest.mark.parametrize("free_surface", [False, True])
def test_stability_limit_includes_the_righting_frequency(make_slave, free_surface):
    """Upright, at rest: h sqrt(k max M^-1) on either side of 1, with k of the righting arms and of floating."""
    r_G, r_B, W = np.array([0.02, -0.03, 0.05]), np.array([0.02, -0.03, -0.06]), 1226.25
    k = np.linalg.norm(r_G * W - r_B * W)
    if free_surface:
        k += 0.75 * W / 0.3 * (1.0 + np.linalg.norm(r_B)) ** 2
    S = np.array([[0, -r_G[2], r_G[1]], [r_G[2], 0, -r_G[0]], [-r_G[1], r_G[0], 0]])
    M = np.block([[187.5 * np.eye(3), -125.0 * S], [125.0 * S, 8.0 * np.eye(3)]])
    swing = np.sqrt(k * np.abs(np.linalg.inv(M)).sum(axis=1).max())
    values = UNDAMPED | SPHERE | {"weight": W, "buoyancy": W, "hull_radius": 0.3}
    values |= {f"r_G.{a}": x for a, x in zip("xyz", r_G, strict=True)}
    values |= {f"r_B.{a}": x for a, x in zip("xyz", r_B, strict=True)}
    values |= {"free_surface": free_surface, "position.z": 20.0, "bottom_depth": 100.0}
    assert fares(make_slave, 0.99 / swing, **values)
    assert not fares(make_slave, 1.01 / swing, **values)


def test_stability_limit_includes_the_angular_rate(make_slave):
    values = UNDAMPED | CENTERED | SPHERE
    for spin in ((6.0, 0.0, 0.0), (0.0, -6.0, 0.0), (0.0, 0.0, 6.0), (2.0, 4.0, -4.0)):
        rates = {f"velocity.{a}": x for a, x in zip("pqr", spin, strict=True)}
        assert fares(make_slave, 0.99 / 6.0, **values, **rates)
        assert not fares(make_slave, 1.01 / 6.0, **values, **rates)


def test_stability_limit_uses_the_current_at_the_step_end(make_slave):
    """Held in place by its thrusters: the speed through the water is the current's, which falls all the way."""
    values = {"current_variation.x": 1.0, "current_variation_period": 10.0, "current_correlation_time": 20.0}
    values |= UNDAMPED | {"position.z": 20.0, "wrench_time_constant": 0.0, "wrench_force_limit": 1e9}
    values |= CENTERED
    for seed in range(40):
        slave = make_slave().start(**values, substep=1.0, seed=seed)
        before = slave.get("water_velocity.x")[0]
        slave.step(1.0)
        fall = 1.0 - slave.get("water_velocity.x")[0] / before
        if abs(before) < 0.3 or not 0.1 < fall < 0.3:
            continue
        d = 2.4 * 187.5 / (2.0 * abs(before))  # h 2 d |v| / m = 2.4 of 2.5
        slave = make_slave().start(**values | {"quadratic_damping[1]": d}, substep=1.0, seed=seed)
        slave.set_values({"wrench.X": -d * before * abs(before)})
        slave.step(1.0)
        return
    pytest.fail("no current falls")
