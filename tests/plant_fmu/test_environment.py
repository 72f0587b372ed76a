"""Water, surface and bottom in time; test_derivatives has their forces."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from tests.plant_fmu.conftest import STATES, UNDAMPED
from tests.plant_fmu.philox import normal

NEUTRAL = {"weight": 1228.25, "r_G.z": 0.0}
GAUSS_MARKOV = {"current_correlation_time": 5.0, "current_variation_period": 0.5, "current_variation.y": 0.2}


def run(slave, n, h):
    """Step n times; yield after each."""
    for k in range(n):
        slave.fmu.doStep(k * h, h)
        yield


# ---- current ----


def test_the_variation_is_a_gauss_markov_process(make_slave, fmi):
    """Knot by knot: w' = w exp(-dt/T) + s sqrt(1 - exp(-2 dt/T)) n, straight between the knots."""
    T, dt, s = 5.0, 0.5, 0.2
    slave = make_slave(fmi=fmi).start(**GAUSS_MARKOV, seed=42, **{"current.y": 0.1})
    kept, fresh = np.exp(-dt / T), s * np.sqrt(1 - np.exp(-2 * dt / T))
    stream, knots = 15 + 1, [s * normal(42, 16, 0)]
    for k in range(1, 30):
        knots.append(kept * knots[-1] + fresh * normal(42, stream, k))
    for k in range(100):
        t = 0.1 * k
        expected = 0.1 + np.interp(t, dt * np.arange(30), knots)
        assert slave.get("water_velocity.y")[0] == pytest.approx(expected, abs=1e-12)
        slave.fmu.doStep(t, 0.1)


def test_axis_variation_switched_on_late_starts_from_the_stationary_distribution(make_slave, fmi):
    """At once, which makes a knot of that time, by numbers of a stream of its own; so does switching it on again."""
    T, dt, s = 5.0, 0.5, 0.3
    slave = make_slave(fmi=fmi).start(**GAUSS_MARKOV, seed=42)
    slave.step(0.7)
    for on, off, knot in ((0.4, 0.2, 2), (0.1, 0.0, 4)):  # after knots at 0 and 0.5 s, and one at each switch
        slave.set_values({"current_variation.z": s})
        slave.step(on)
        begin = s * normal(42, 15 + 2 + 3, knot)
        then = np.exp(-dt / T) * begin + s * np.sqrt(1 - np.exp(-2 * dt / T)) * normal(42, 15 + 2, knot + 1)
        assert slave.get("water_velocity.z")[0] == pytest.approx(begin + (then - begin) * on / dt, abs=1e-12)
        if off:
            slave.set_values({"current_variation.z": 0.0})
            slave.step(off)
            assert slave.get("water_velocity.z")[0] == 0.0


def test_changed_knot_period_keeps_the_current_continuous(make_slave, fmi):
    slow = {"current_variation.x": 1.0, "current_correlation_time": 1000.0, "current_variation_period": 100.0}
    slave = make_slave(fmi=fmi).start(**slow, seed=3)
    slave.step(50.0)
    before = slave.get("water_velocity.x")[0]
    slave.set_values({"current_variation_period": 1.0})
    slave.step(1e-6)
    assert slave.get("water_velocity.x")[0] == pytest.approx(before, abs=1e-6)


# ---- surface and bottom ----

SINKING = {"weight": 1300.0, "bottom_depth": 10.0, "hull_radius": 0.3}


@pytest.mark.medium(fast=11)
@pytest.mark.parametrize("substep", [0.001, 0.02, 0.2])
@pytest.mark.parametrize("speed", [0.1, 3.0, 100.0])
@pytest.mark.parametrize("time_constant", [0.0, 0.02, 0.5])
def test_bottom_contact_is_stable(make_slave, substep, speed, time_constant):
    """Thrown at the bottom, at any speed and substep: no energy is gained, nor depth beyond a flight of T."""
    slave = make_slave().start(
        **SINKING | NEUTRAL | UNDAMPED | {"position.z": 9.0, "velocity.w": speed, "velocity.u": speed},
        substep=substep,
        bottom_time_constant=time_constant,
        bottom_friction=1.0,
    )
    motion = ("position.z", "velocity.u", "velocity.v", "velocity.w")
    rows = np.array([slave.get(*motion) for _ in run(slave, 400, 0.2)])
    assert np.linalg.norm(rows[:, 1:], axis=1).max() <= speed * np.sqrt(2) * (1 + 1e-9)
    assert rows[:, 0].max() - 9.7 <= speed * max(time_constant, 4 * substep)


def test_default_plant_has_no_bottom_and_no_force_limit(make_slave, fmi):
    slave = make_slave(fmi=fmi).start(**{"position.z": 5e5, "hull_radius": 0.3})
    slave.set_values({"wrench.X": 9e8})
    assert slave.get("altitude", "actuation.X") == [5e5, 9e8]
    assert not slave.flag("bottom_contact") and not slave.flag("wrench_saturated")


def test_hull_starting_inside_the_bottom_is_pushed_out_slowly(make_slave, fmi):
    """However it got there: the bottom's spring is no catapult."""
    slave = make_slave(fmi=fmi, logging_on=True).start(**SINKING | NEUTRAL | {"position.z": 12.0})
    assert "the hull starts 2.3 m deep in the bottom" in [text for _, text in slave.said]
    assert -2.5 < min(slave.get("velocity.w")[0] for _ in run(slave, 2000, 0.005)) < -0.5
    assert slave.get("altitude")[0] > 0.3


def test_energy_of_a_rolling_float_is_conserved(make_slave):
    """Buoyancy fades with the depth of the point it acts at, so that it has a potential."""
    r, B, W = 0.3, 1228.25, 900.0
    r_B = np.array([0.0, 0.1, -0.1])
    slave = make_slave().start(**{
        "weight": W, "r_G.z": 0.05, "r_B.y": r_B[1], "r_B.z": r_B[2], "free_surface": True, "hull_radius": r,
        "position.z": 0.2, "quaternion.e0": np.cos(0.4), "quaternion.e1": np.sin(0.4), "substep": 0.001, **UNDAMPED,
    })  # fmt: skip
    M = np.diag([187.5] * 3 + [8.0] * 3)
    S = np.array([[0, -0.05, 0], [0.05, 0, 0], [0, 0, 0]])  # of r_G
    M[:3, 3:], M[3:, :3] = -125.0 * S, 125.0 * S

    def energy():
        x = np.array(slave.get(*STATES))
        R = Rotation.from_quat(np.roll(x[3:7], -1)).as_matrix()
        z_G, z_B = x[2] + R[2] @ [0, 0, 0.05], x[2] + R[2] @ r_B
        part = np.clip((z_B + r) / (2 * r), 0, 1)  # the integral of 3 s^2 - 2 s^3 over the depth
        lifted = 2 * r * (part**3 - part**4 / 2) + max(z_B - r, 0.0)
        return 0.5 * x[7:] @ M @ x[7:] - W * z_G + B * lifted

    before = energy()
    assert [energy() for _ in run(slave, 600, 0.1)] == pytest.approx([before] * 600, abs=1e-4)
