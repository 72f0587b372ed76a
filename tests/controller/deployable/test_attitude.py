"""The attitude loop against the equations in matrices, by SciPy's rotations, with nothing symmetric."""

import numpy as np
import pytest
from scipy.linalg import expm
from scipy.spatial.transform import Rotation

from controller.laws.deployable import attitude as loop
from controller.laws.deployable.gains import DeployableGains
from controller.laws.deployable.model import Dynamics, make_thrusters
from controller.regions import Orientation, Region, Sphere, Visibility, pack
from tests.controller.deployable.scenery import ODIN

PERIOD = 0.02
GAINS = DeployableGains()
NOWHERE = np.zeros(3)


def turned(rng):
    e = rng.normal(size=4)
    return e / np.linalg.norm(e)


def rotation(e):
    return Rotation.from_quat([e[1], e[2], e[3], e[0]])


def down(e):
    return rotation(e).as_matrix()[2]


def askew(rng):
    root = rng.normal(size=(6, 6))
    mass = root @ root.T + np.diag([90.0, 80.0, 70.0, 9.0, 8.0, 7.0])
    damping = rng.uniform(1.0, 30.0, (2, 6))
    return Dynamics(mass, np.linalg.inv(mass), *damping, np.array([np.trace(mass[:3, :3]) / 3.0]), np.ones(9))


def loop_of(rng):
    attitude = loop.empty_attitude(turned(rng))
    for part in (attitude.moments, attitude.last_omega, attitude.munk_moment):
        part[:] = rng.normal(size=3)
    return attitude


def drag(dynamics, omega):
    return (dynamics.linear_damping[3:] + dynamics.quadratic_damping[3:] * abs(omega)) * omega


@pytest.mark.parametrize("bound", [1e9, 1.5])
def test_what_the_model_misses_drives_the_moments(bound):
    rng, gains = np.random.default_rng(1), GAINS._replace(moment_bound=bound)
    thrusters = make_thrusters(ODIN)
    for _ in range(30):
        attitude, dynamics, e, omega = loop_of(rng), askew(rng), turned(rng), rng.normal(size=3) * 0.5
        thrusters.forces[:] = rng.uniform(-20.0, 20.0, 8)
        attitude.started[0] = 1.0
        phi, last, k = attitude.moments.copy(), attitude.last_omega.copy(), down(e)
        tau = ODIN.thruster_matrix[3:] @ thrusters.forces
        missed = dynamics.mass[3:, 3:] @ (omega - last) / PERIOD
        missed -= tau + attitude.munk_moment - drag(dynamics, last) - np.cross(k, phi)
        missed = np.clip(missed, -bound, bound)
        phi = np.clip(phi + 0.5 * PERIOD * np.cross(k, missed), -bound, bound)
        loop.adapt(attitude, dynamics, thrusters, e, omega, gains, PERIOD)
        assert attitude.residual == pytest.approx(missed, rel=1e-10, abs=1e-10)
        assert attitude.moments == pytest.approx(phi, rel=1e-10, abs=1e-10)
        assert np.array_equal(attitude.last_omega, omega)


def test_munks_moment_is_that_of_the_momentum():
    rng = np.random.default_rng(2)
    attitude, dynamics, e, velocity, water = loop_of(rng), askew(rng), turned(rng), *rng.normal(size=(2, 3))
    R = rotation(e).as_matrix()
    relative = R.T @ (velocity - water)
    loop.update_munk_moment(attitude, dynamics, R, velocity, water)
    assert attitude.munk_moment == pytest.approx(-np.cross(relative, dynamics.mass[:3, :3] @ relative), rel=1e-12)


def test_turning_without_thrust_is_eulers_equation():
    rng, out = np.random.default_rng(3), np.empty(3)
    attitude, dynamics, e, omega = loop_of(rng), askew(rng), turned(rng), rng.normal(size=3)
    moments = attitude.munk_moment - drag(dynamics, omega) - np.cross(down(e), attitude.moments)
    moments -= np.cross(omega, dynamics.mass[3:, 3:] @ omega)
    loop.free_angular_acceleration(attitude, dynamics, e, omega, out)
    assert out == pytest.approx(dynamics.inverse_mass[3:, 3:] @ moments, rel=1e-10)


def test_the_wanted_moment_turns_the_short_way_and_carries_what_is_known():
    rng, out, w = np.random.default_rng(4), np.empty(3), GAINS.attitude_bandwidth
    for _ in range(20):
        attitude, dynamics, e, omega = loop_of(rng), askew(rng), turned(rng), rng.normal(size=3)
        off = (rotation(attitude.desired).inv() * rotation(e)).as_rotvec()  # at most half a turn
        off *= np.sin(np.linalg.norm(off) / 2.0) / np.linalg.norm(off)
        expected = np.cross(down(e), attitude.moments) - attitude.munk_moment
        expected -= 2.0 * np.diag(dynamics.mass)[3:] * (w * w * off + w * omega)
        loop.compute_moment(attitude, dynamics, e, omega, GAINS, out)
        assert out == pytest.approx(expected, rel=1e-9, abs=1e-9)


def after(e, turn, period=PERIOD):
    """Return the rotation after a turn at a steady body rate."""
    return rotation(e) * Rotation.from_rotvec(turn * period)


def apart(e, expected):
    return np.linalg.norm((rotation(e).inv() * expected).as_rotvec())


def test_a_turn_is_that_of_the_exponential():
    rng = np.random.default_rng(5)
    e, omega = turned(rng), rng.normal(size=3)
    before = rotation(e).as_matrix()
    loop.integrate_attitude(e, omega, 1e-3, e)
    S = np.array([[0, -omega[2], omega[1]], [omega[2], 0, -omega[0]], [-omega[1], omega[0], 0]])
    assert rotation(e).as_matrix() == pytest.approx(before @ expm(1e-3 * S), abs=1e-8)
    assert np.linalg.norm(e) == pytest.approx(1.0, abs=1e-14)


def test_the_held_attitude_goes_back_at_a_fifth_of_the_way_a_second():
    rng, gains = np.random.default_rng(6), GAINS._replace(tilt=np.pi)
    for _ in range(10):
        attitude = loop_of(rng)
        back = Rotation.from_rotvec(rng.normal(size=3) * 0.02)
        x, y, z, w = (rotation(attitude.preferred) * back).as_quat()
        attitude.desired[:] = w, x, y, z
        loop.update_desired(attitude, pack([]), NOWHERE, gains, PERIOD)
        expected = rotation(attitude.preferred) * Rotation.from_rotvec(back.as_rotvec() * (1.0 - 0.2 * PERIOD))
        assert apart(attitude.desired, expected) < 1e-6 * back.magnitude() + 1e-9


def test_an_attitude_that_is_kept_stays_to_the_last_bit():
    rng = np.random.default_rng(10)
    for _ in range(50):
        attitude = loop.empty_attitude(turned(rng))
        loop.update_desired(attitude, pack([]), NOWHERE, GAINS, PERIOD)
        assert np.array_equal(attitude.desired, attitude.preferred)


def asked_turn(attitude, regions, position):
    """Return the turn asked for, by differences of each clearance over small turns."""
    off = (rotation(attitude.preferred).inv() * rotation(attitude.desired)).as_rotvec()
    turn = -0.4 * off * np.sinc(np.linalg.norm(off) / 2.0 / np.pi) / 2.0

    def clearances(about):
        values, room = np.empty(len(regions)), np.empty((2, len(regions), 3))
        clear = np.empty(len(regions))
        x, y, z, w = (rotation(attitude.desired) * Rotation.from_rotvec(about)).as_quat()
        pack(regions).evaluate(position, np.array([w, x, y, z]), values, *room, clear)
        return clear

    here = clearances(np.zeros(3))
    slopes = np.array([(clearances(1e-6 * axis) - clearances(-1e-6 * axis)) / 2e-6 for axis in np.eye(3)]).T
    for clearance, slope in zip(here, slopes, strict=True):
        if clearance < GAINS.comfort:
            turn = turn + 4.0 * (GAINS.comfort - clearance) * slope / np.linalg.norm(slope)
    return turn


def test_it_turns_to_where_regions_of_attitude_have_comfort():
    rng = np.random.default_rng(7)
    gains, position = GAINS._replace(tilt=np.pi, turning_rate=1e3), np.array([0.3, -0.2, 0.1])
    for _ in range(20):
        attitude = loop_of(rng)
        attitude.desired[:] = turned(rng)
        regions = [
            Region("face", Orientation(tuple(turned(rng)), 0.3), "in"),
            Region("see", Visibility((2.0, 1.0, 0.5), (1.0, 0.2, -0.1), 0.4, (0.2, 0.1, 0.3)), "in"),
        ]
        expected = after(attitude.desired, asked_turn(attitude, regions, position), 1e-4)
        loop.update_desired(
            attitude, pack([Region("ball", Sphere((1.0, 1.0, 1.0), 1.0), "out"), *regions]), position, gains, 1e-4
        )
        assert apart(attitude.desired, expected) < 1e-7


def test_it_turns_no_faster_than_allowed():
    attitude = loop.empty_attitude(np.array([1.0, 0.0, 0.0, 0.0]))
    before = attitude.desired.copy()
    aside = Region("aside", Orientation((np.cos(0.75), 0.0, 0.0, np.sin(0.75)), 0.1), "in")
    loop.update_desired(attitude, pack([aside]), NOWHERE, GAINS, PERIOD)
    assert apart(attitude.desired, after(before, np.array([0.0, 0.0, GAINS.turning_rate]))) < 1e-6


def test_half_a_turn_away_it_turns_about_the_vertical():
    for held, away in (((1.0, 0.0, 0.0, 0.0), (0.0, 0.0, 0.0, 1.0)), ((0.96, 0.28, 0.0, 0.0), (0.0, 0.0, 0.8, -0.6))):
        attitude, regions = loop.empty_attitude(np.array(held)), pack([Region("back", Orientation(away, 0.1), "in")])
        before = attitude.desired.copy()
        loop.update_desired(attitude, regions, NOWHERE, GAINS, PERIOD)
        assert apart(attitude.desired, after(before, GAINS.turning_rate * down(before))) < 1e-6


def test_tilted_as_far_as_allowed_it_turns_about_the_vertical_alone():
    rng, tried = np.random.default_rng(9), 0
    for _ in range(60):
        attitude = loop.empty_attitude(np.array([1.0, 0.0, 0.0, 0.0]))
        axis = rng.normal(size=2)
        axis *= GAINS.tilt / np.linalg.norm(axis)
        x, y, z, w = (Rotation.from_rotvec([0, 0, rng.uniform(-2, 2)]) * Rotation.from_rotvec([*axis, 0.0])).as_quat()
        attitude.desired[:] = w, x, y, z
        region = Region("tilt", Orientation(tuple(turned(rng)), 0.1), "in")
        turn = asked_turn(attitude, [region], NOWHERE)
        turn *= min(1.0, GAINS.turning_rate / np.linalg.norm(turn))
        free = after(attitude.desired, turn)
        before, k = attitude.desired.copy(), down(attitude.desired)
        loop.update_desired(attitude, pack([region]), NOWHERE, GAINS, PERIOD)
        if free.as_matrix()[2, 2] < np.cos(GAINS.tilt) - 1e-6:
            tried += 1
            assert apart(attitude.desired, after(before, (k @ turn) * k)) < 1e-4 * np.linalg.norm(turn) * PERIOD + 1e-5
            assert down(attitude.desired)[2] == pytest.approx(np.cos(GAINS.tilt), abs=1e-6)
        elif free.as_matrix()[2, 2] > np.cos(GAINS.tilt) + 1e-6:
            assert apart(attitude.desired, free) < 1e-5
    assert tried > 20
