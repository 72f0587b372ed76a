"""Water, surface and bottom as physical laws."""

import numpy as np
import pytest
from scipy.optimize import brentq
from scipy.spatial.transform import Rotation

from tests.plant_fmu.conftest import STATES, UNDAMPED
from tests.plant_fmu.philox import normal

NEUTRAL = {"weight": 1228.25, "r_G.z": 0.0}
GAUSS_MARKOV = {
    "current_correlation_time": 5.0,
    "current_variation_period": 0.5,
    "current_variation.y": 0.2,
    "seed": 42,
}


def run(slave, n, h):
    """Step n times; yield after each."""
    for k in range(n):
        slave.fmu.doStep(k * h, h)
        yield


# ---- current ----


def test_the_current_grows_with_depth_from_the_surface(make_slave, fmi):
    shear = {"current.x": 0.5, "current_shear.x": -0.02, "current_shear.y": 0.01}
    for depth, expected in ((-3.0, [0.5, 0.0]), (0.0, [0.5, 0.0]), (10.0, [0.3, 0.1])):
        slave = make_slave(fmi=fmi).start(**shear, **{"position.z": depth})
        assert slave.get("water_velocity.x", "water_velocity.y") == pytest.approx(expected)


def test_a_sinking_vehicle_follows_the_sheared_current(make_slave):
    """Mean drift of a heavily damped body is the current at its depth."""
    slave = make_slave().start(
        **NEUTRAL,
        **{"current_shear.x": 0.05, "wrench.Z": 20.0, "position.z": 1.0},
        **{"quadratic_damping[1]": 5e3, "linear_damping[1]": 500.0},
    )
    slave.step(30.0)
    z, u = slave.get("position.z", "velocity.u")
    assert u == pytest.approx(0.05 * z, rel=0.05)


def test_the_variation_is_a_gauss_markov_process(make_slave, fmi):
    """Knot by knot: w' = w exp(-dt/T) + s sqrt(1 - exp(-2 dt/T)) n, straight between the knots."""
    T, dt, s = 5.0, 0.5, 0.2
    slave = make_slave(fmi=fmi).start(**GAUSS_MARKOV, **{"current.y": 0.1})
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
    """At once, which makes a knot of that time, by numbers of a stream of its own."""
    T, dt, s = 5.0, 0.5, 0.3
    slave = make_slave(fmi=fmi).start(**GAUSS_MARKOV)
    slave.fmu.doStep(0.0, 0.7)
    slave.set_values({"current_variation.z": s})
    slave.fmu.doStep(0.7, 0.4)
    begin = s * normal(42, 15 + 2 + 3, 2)
    then = np.exp(-dt / T) * begin + s * np.sqrt(1 - np.exp(-2 * dt / T)) * normal(42, 15 + 2, 3)
    assert slave.get("water_velocity.z")[0] == pytest.approx(begin + (then - begin) * 0.4 / dt, abs=1e-12)


@pytest.mark.medium
def test_current_variation_has_its_deviation_and_correlation_time(make_slave):
    T, s = 2.0, 0.3
    slave = make_slave().start(
        **{"current_variation.x": s, "current_correlation_time": T, "current_variation_period": 0.1, "substep": 0.5}
    )
    w = np.array([slave.get("water_velocity.x")[0] for _ in run(slave, 20_000, 0.5)])
    assert np.std(w) == pytest.approx(s, rel=0.05)
    assert np.corrcoef(w[4:], w[:-4])[0, 1] == pytest.approx(np.exp(-1.0), abs=0.05)


# ---- surface ----


@pytest.mark.parametrize(("depth", "part"), [(2.0, 1.0), (0.3, 1.0), (0.0, 0.5), (-0.3, 0.0), (-1.0, 0.0)])
def test_buoyancy_is_that_of_the_submerged_cap(make_slave, fmi, depth, part):
    slave = make_slave(fmi=fmi).start(**NEUTRAL, **{"free_surface": True, "hull_radius": 0.3, "position.z": depth})
    heave = 1228.25 * (1.0 - part) / (125.0 + 62.5)
    assert slave.get("der(velocity.w)")[0] == pytest.approx(heave, abs=1e-12)


def test_floating_hull_draft_follows_archimedes(make_slave, fmi):
    """Afloat with three quarters of the volume under water."""
    r = 0.3
    slave = make_slave(fmi=fmi).start(
        weight=0.75 * 1228.25,
        free_surface=True,
        hull_radius=r,
        **{"r_G.z": 0.05, "position.z": 1.0, "linear_damping[3]": 200.0},
    )
    slave.step(100.0)
    h = brentq(lambda h: h * h * (3 * r - h) / (4 * r**3) - 0.75, 0, 2 * r)
    assert slave.get("position.z")[0] == pytest.approx(h - r, abs=1e-6)


# ---- bottom ----

SINKING = {"weight": 1300.0, "bottom_depth": 10.0, "hull_radius": 0.3}


def test_a_heavy_vehicle_comes_to_rest_on_the_bottom(make_slave, fmi):
    slave = make_slave(fmi=fmi).start(**SINKING, **{"position.z": 8.0, "velocity.u": 0.5})
    slave.step(30.0)
    assert slave.get("velocity.w", "velocity.u") == pytest.approx([0.0, 0.0], abs=1e-6)
    sinks_in = (1300.0 - 1228.25) * 0.02**2 / (125.0 + 62.5)  # the contact's spring
    assert slave.get("altitude")[0] == pytest.approx(0.3 - sinks_in, rel=1e-3)
    assert slave.flag("bottom_contact")


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


def test_coulomb_friction_decelerates_a_slide(make_slave):
    slave = make_slave().start(
        **SINKING,
        **UNDAMPED,
        **{"position.z": 9.7, "velocity.u": 1.0, "bottom_friction": 0.5, "substep": 0.001, "r_G.z": 0.0},
    )
    slave.step(1.0)
    slowing = 0.5 * (1300.0 - 1228.25) / (125.0 + 62.5)
    assert slave.get("velocity.u")[0] == pytest.approx(1.0 - slowing * 1.0, abs=0.01)


def test_bottom_is_off_by_default(make_slave):
    slave = make_slave().start(**{"position.z": 5e5, "hull_radius": 0.3})
    assert not slave.flag("bottom_contact")
    assert slave.get("altitude")[0] == 5e5


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


# ---- changes on the way ----

VARYING = {"current_variation.x": 1.0, "current_correlation_time": 1000.0, "current_variation_period": 100.0, "seed": 3}


def test_changed_knot_period_keeps_the_current_continuous(make_slave, fmi):
    slave = make_slave(fmi=fmi).start(**VARYING)
    slave.step(50.0)
    before = slave.get("water_velocity.x")[0]
    slave.set_values({"current_variation_period": 1.0})
    slave.step(1e-6)
    assert slave.get("water_velocity.x")[0] == pytest.approx(before, abs=1e-6)


def test_axis_variation_switched_on_late_is_stationary(make_slave):
    """Over seeds, the deviation just after switching on (again) is the one asked for."""
    first, again, other = [], [], []
    slave = make_slave()
    for seed in range(300):
        slave.fmu.reset()
        slave.time = 0.0
        slave.start(**VARYING | {"seed": seed})
        slave.step(1.0)
        first.append(slave.get("water_velocity.x")[0])
        slave.set_values({"current_variation.x": 0.0})
        slave.step(1.0)
        assert slave.get("water_velocity.x")[0] == 0.0
        slave.set_values({"current_variation.x": 1.0, "current_variation.y": 1.0})
        slave.step(1.0)
        again.append(slave.get("water_velocity.x")[0])
        other.append(slave.get("water_velocity.y")[0])
    assert np.std(first) == pytest.approx(1.0, abs=0.12)
    assert np.std(again) == pytest.approx(1.0, abs=0.12)
    assert np.std(other) == pytest.approx(1.0, abs=0.12)
    assert abs(np.corrcoef(first, again)[0, 1]) < 0.2
