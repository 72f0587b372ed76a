"""The attitude loop against the equations in matrices, by SciPy's rotations, with nothing symmetric."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from controller.laws.deployable import attitude as loop
from controller.laws.deployable.estimate import make_estimate
from controller.laws.deployable.gains import DeployableGains
from controller.regions import Orientation, Region, Sphere, Visibility, pack
from tests.controller.deployable.scenery import ODIN, askew
from tests.controller.test_baseline_laws import random_unit

PERIOD = 0.02
GAINS = DeployableGains()
NOWHERE = np.zeros(3)


def rotation(e):
    return Rotation.from_quat([e[1], e[2], e[3], e[0]])


def down(e):
    return rotation(e).as_matrix()[2]


def loop_of(rng):
    attitude = loop.empty_attitude(random_unit(rng))
    attitude.last_omega[:] = rng.normal(size=3)
    return attitude


def drag(dynamics, omega):
    return (dynamics.linear_damping[3:] + dynamics.quadratic_damping[3:] * abs(omega)) * omega


def seen_by(rng):
    estimate = make_estimate(ODIN)
    estimate.velocity[:], estimate.acceleration[:] = rng.normal(size=(2, 3))
    estimate.water_velocity[:2], estimate.moments[:] = rng.normal(size=2), rng.normal(size=3) * 20.0
    return estimate


def test_measured_moment_is_the_residual_of_the_equation_of_motion():
    """M nu_r' = wrench without thrust + thrust and weight: the lower half of it, by plain matrices."""
    rng = np.random.default_rng(1)
    for _ in range(30):
        attitude, dynamics, R = loop_of(rng), askew(rng), rotation(random_unit(rng)).as_matrix()
        estimate, omega = seen_by(rng), rng.normal(size=3) * 0.5
        mean, before = 0.5 * (omega + attitude.last_omega), attitude.last_omega.copy()
        assert not loop.measure_moment(attitude, dynamics, R, before, estimate, PERIOD)  # the first rates that it sees
        assert loop.measure_moment(attitude, dynamics, R, omega, estimate, PERIOD)
        relative = np.r_[R.T @ (estimate.velocity - estimate.water_velocity), mean]
        change = np.r_[R.T @ estimate.acceleration - np.cross(mean, relative[:3]), (omega - before) / PERIOD]

        def known(relative, dynamics=dynamics, mean=mean):
            momentum = dynamics.mass @ relative
            munk = np.cross(relative[:3], momentum[:3])
            return -drag(dynamics, mean) - np.cross(mean, momentum[3:]) - munk

        expected = (dynamics.mass @ change)[3:] - known(relative)
        assert attitude.measured_moment == pytest.approx(expected, rel=1e-9, abs=1e-9)
        for axis in range(2):
            step = np.r_[R.T @ np.eye(3)[axis], np.zeros(3)]
            slope = (known(relative - 1e-4 * step) - known(relative + 1e-4 * step)) / 2e-4
            assert attitude.by_current[:, axis] == pytest.approx(slope, abs=2.0)  # a one-sided quotient of 0.01 m/s
        assert np.array_equal(attitude.last_omega, omega)


def test_desired_moment_takes_the_shortest_rotation_with_feedforward():
    rng, w = np.random.default_rng(4), GAINS.attitude_bandwidth
    for _ in range(20):
        attitude, dynamics, e, omega = loop_of(rng), askew(rng), random_unit(rng), rng.normal(size=3)
        off = (rotation(attitude.desired).inv() * rotation(e)).as_rotvec()  # at most half a turn
        off *= np.sin(np.linalg.norm(off) / 2.0) / np.linalg.norm(off)
        free = rng.normal(size=6)
        expected = -free[3:] - drag(dynamics, omega)
        expected -= 2.0 * np.diag(dynamics.mass)[3:] * (w * w * off + w * omega)
        out = loop.compute_moment(attitude, dynamics, e, omega, free, GAINS)
        assert out == pytest.approx(expected, rel=1e-9, abs=1e-9)


def after(e, turn, period=PERIOD):
    """Return the rotation after a turn at a steady body rate."""
    return rotation(e) * Rotation.from_rotvec(turn * period)


def apart(e, expected):
    return np.linalg.norm((rotation(e).inv() * expected).as_rotvec())


def test_held_attitude_returns_at_one_fifth_per_second():
    rng, gains = np.random.default_rng(6), GAINS._replace(tilt=np.pi)
    for _ in range(10):
        attitude = loop_of(rng)
        back = Rotation.from_rotvec(rng.normal(size=3) * 0.02)
        x, y, z, w = (rotation(attitude.preferred) * back).as_quat()
        attitude.desired[:] = w, x, y, z
        loop.update_desired(attitude, pack([]), NOWHERE, np.ones(6), gains, PERIOD)
        expected = rotation(attitude.preferred) * Rotation.from_rotvec(back.as_rotvec() * (1.0 - 0.2 * PERIOD))
        assert apart(attitude.desired, expected) < 1e-6 * back.magnitude() + 1e-9


def test_held_attitude_is_constant_bit_for_bit():
    rng = np.random.default_rng(10)
    for _ in range(50):
        attitude = loop.empty_attitude(random_unit(rng))
        loop.update_desired(attitude, pack([]), NOWHERE, np.ones(6), GAINS, PERIOD)
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


def test_desired_attitude_moves_into_attitude_regions():
    rng = np.random.default_rng(7)
    gains, position = GAINS._replace(tilt=np.pi, turning_rate=1e3), np.array([0.3, -0.2, 0.1])
    for _ in range(20):
        attitude = loop_of(rng)
        attitude.desired[:] = random_unit(rng)
        regions = [
            Region("face", Orientation(tuple(random_unit(rng)), 0.3), "in"),
            Region("see", Visibility((2.0, 1.0, 0.5), (1.0, 0.2, -0.1), 0.4, (0.2, 0.1, 0.3)), "in"),
        ]
        expected = after(attitude.desired, asked_turn(attitude, regions, position), 1e-4)
        loop.update_desired(
            attitude,
            pack([Region("ball", Sphere((1.0, 1.0, 1.0), 1.0), "out"), *regions]),
            position,
            np.ones(6),
            gains,
            1e-4,
        )
        assert apart(attitude.desired, expected) < 1e-7


def test_half_a_turn_away_the_rotation_is_about_the_vertical():
    for held, away in (((1.0, 0.0, 0.0, 0.0), (0.0, 0.0, 0.0, 1.0)), ((0.96, 0.28, 0.0, 0.0), (0.0, 0.0, 0.8, -0.6))):
        attitude, regions = loop.empty_attitude(np.array(held)), pack([Region("back", Orientation(away, 0.1), "in")])
        before = attitude.desired.copy()
        loop.update_desired(attitude, regions, NOWHERE, np.ones(6), GAINS, PERIOD)
        assert apart(attitude.desired, after(before, GAINS.turning_rate * down(before))) < 1e-6


def test_at_maximum_tilt_the_rotation_is_about_the_vertical():
    rng, tried = np.random.default_rng(9), 0
    for _ in range(60):
        attitude = loop.empty_attitude(np.array([1.0, 0.0, 0.0, 0.0]))
        axis = rng.normal(size=2)
        axis *= GAINS.tilt / np.linalg.norm(axis)
        x, y, z, w = (Rotation.from_rotvec([0, 0, rng.uniform(-2, 2)]) * Rotation.from_rotvec([*axis, 0.0])).as_quat()
        attitude.desired[:] = w, x, y, z
        region = Region("tilt", Orientation(tuple(random_unit(rng)), 0.1), "in")
        turn = asked_turn(attitude, [region], NOWHERE)
        turn *= min(1.0, GAINS.turning_rate / np.linalg.norm(turn))
        free = after(attitude.desired, turn)
        before, k = attitude.desired.copy(), down(attitude.desired)
        loop.update_desired(attitude, pack([region]), NOWHERE, np.ones(6), GAINS, PERIOD)
        if free.as_matrix()[2, 2] < np.cos(GAINS.tilt) - 1e-6:
            tried += 1
            assert apart(attitude.desired, after(before, (k @ turn) * k)) < 1e-4 * np.linalg.norm(turn) * PERIOD + 1e-5
            assert down(attitude.desired)[2] == pytest.approx(np.cos(GAINS.tilt), abs=1e-6)
        elif free.as_matrix()[2, 2] > np.cos(GAINS.tilt) + 1e-6:
            assert apart(attitude.desired, free) < 1e-5
    assert tried > 20
