"""The PD law with observer and barriers: observer poles, barrier inequality, and closed-loop behavior."""

import copy
import math

import numpy as np
import pytest

from controller import VehicleState
from controller.laws import pid_cbf
from controller.laws.deployable import model
from controller.quaternion import error as quaternion_error
from controller.quaternion import rotation_matrix
from controller.regions import DepthBand, Region, Sphere, pack
from tests.controller.deployable import scenery
from tests.controller.deployable.scenery import GOAL, LEVEL, Sea
from tests.controller.test_baseline_laws import law_of as baseline

PERIOD = 0.02
BAND = Region("band", DepthBand(3.65, 3.35), "in")
BALL = Region("ball", Sphere((4.0, 0.6, 2.3), 0.7), "out")


def law_of(regions=(), **gains):
    return baseline("pid_cbf", regions, **gains)


def fly(law, sea, seconds, regions=()):
    """Fly in a sea; return positions before each period, and forces."""
    positions = []
    steps = round(seconds / PERIOD)
    forces = scenery.fly(law, sea, regions=regions, steps=steps, each=lambda _: positions.append(sea.position.copy()))
    return np.array(positions), forces


@pytest.mark.parametrize(
    "ball",
    [
        Region("ball", Sphere((4.0, 0.6, 2.3), 0.7), "out", (-0.1, 0.05, 0.02)),
        Region("ball", Sphere((2.6, -0.9, 2.9), 0.6), "out", (0.0, 0.1, -0.05)),
    ],
)
def test_step_is_its_equations(ball):
    """Observer, nominal forces and barrier in plain matrices; turned, near a ball."""
    law, rng, forces = law_of((ball,)), np.random.default_rng(3), np.zeros(8)
    memory, gains = law.memory, law.gains
    turned = np.array([0.9, 0.2, -0.3, 0.1]) / np.linalg.norm([0.9, 0.2, -0.3, 0.1])
    memory.started, memory.position[:], memory.velocity[:] = 1.0, (3.1, 0.0, 2.4), rng.normal(size=6) * 0.2
    memory.velocity[:3] += np.array(ball.shape.center) - memory.position
    memory.disturbance[:], memory.thrusters.forces[:] = rng.normal(size=6) * 0.05, rng.normal(size=8) * 5.0
    R = rotation_matrix(turned)
    measured = np.r_[R.T @ memory.velocity[:3], memory.velocity[3:]] + rng.normal(size=6) * 0.05
    state = VehicleState(np.array([3.1, 0.01, 2.39]), turned, measured, np.ones(8))
    before = copy.deepcopy(memory)
    law.step(state, pack([GOAL]), pack([ball]), np.ones(1), forces)
    p, v, d, M = memory.position, memory.velocity, memory.disturbance, memory.dynamics.mass
    # observer
    turning = np.kron(np.diag([1, 0]), R) + np.kron(np.diag([0, 1]), np.eye(3))
    pushes = turning @ memory.dynamics.inverse_mass @ memory.thrusters.matrix
    still = model.Loads(np.zeros(3), 0.0, np.zeros(3), 0.0, 1.0)
    free = model.free_acceleration(memory.dynamics, R, before.velocity[:3], before.velocity[3:], still)
    z, change = 1.0 / (1.0 + gains.observer * PERIOD), free + pushes @ before.thrusters.forces + before.disturbance
    predicted = before.velocity + PERIOD * change
    off = turning @ measured - predicted
    assert p == pytest.approx(
        z * (before.position + PERIOD * before.velocity[:3]) + (1.0 - z) * state.position, rel=1e-9
    )
    assert v == pytest.approx(predicted + (1.0 - z**2) * off, rel=1e-9)
    assert d == pytest.approx(before.disturbance + (1.0 - z) ** 2 / PERIOD * off, rel=1e-9)
    free = model.free_acceleration(memory.dynamics, R, v[:3], v[3:], still)
    # nominal forces
    error, away = p - GOAL.shape.center, p - ball.shape.center
    error *= min(1.0, gains.limit / gains.k_p1 / np.linalg.norm(error))
    n, h = away / np.linalg.norm(away), np.linalg.norm(away) - ball.shape.radius
    force = -gains.k_p1 * error - gains.k_v1 * v[:3] - np.trace(M[:3, :3]) / 3.0 * d[:3]
    force += gains.repulsion * max(gains.reach - h, 0.0) * n
    moment = -gains.k_p2 * quaternion_error(LEVEL, turned)[1:] - gains.k_v2 * v[3:] - np.diag(M)[3:] * d[3:]
    nominal = memory.thrusters.allocator @ np.r_[R.T @ force, moment]
    assert memory.program.nominal == pytest.approx(nominal, rel=1e-9)
    # barrier
    relative = v[:3] - ball.velocity
    rate = n @ relative
    rhs = -(gains.pull_in + gains.brake) * rate - gains.pull_in * gains.brake * (h - gains.margin)
    rhs -= n @ (free + d)[:3] + (relative @ relative - rate**2) / np.linalg.norm(away)
    assert memory.program.rows[0] == pytest.approx(n @ pushes[:3], rel=1e-9, abs=1e-15)
    assert memory.program.rhs[0] == pytest.approx(rhs, rel=2e-3)


@pytest.mark.medium
@pytest.mark.parametrize("net_weight", [-14.0, 9.0])
def test_net_weight_and_current_leave_no_steady_error(net_weight):
    law, sea = law_of(), Sea(current=(0.1, -0.2, 0.0), restoring=net_weight)
    positions, _ = fly(law, sea, 60.0)
    assert positions[-1] == pytest.approx(GOAL.shape.center, abs=5e-3)
    assert law.estimate[0] == pytest.approx(net_weight, abs=0.1)


@pytest.mark.medium
@pytest.mark.parametrize(
    ("velocity", "center"), [((0.0, 0.0, 0.0), (2.5, 0.05, 2.5)), ((-0.1, 0.05, 0.0), (3.0, -0.2, 2.4))]
)
def test_clearances_satisfy_the_barrier_inequality(velocity, center):
    """h'' by differences of true clearances, of a plant integrated apart: never below, and equal while it acts."""
    gains = {"pull_in": 0.6, "brake": 1.5, "margin": 0.1, "repulsion": 0.0, "limit": 60.0}
    region = Region("ball", Sphere(center, 0.7), "out", velocity)
    law, sea = law_of((region,), **gains), Sea(current=(0.0, 0.0, 0.0), restoring=0.0)
    positions, forces = fly(law, sea, 14.0, (region,))
    times = PERIOD * np.arange(len(positions))
    h = np.linalg.norm(positions - center - np.outer(times, velocity), axis=1) - 0.7 - 0.1
    rate = (h[2:] - h[:-2]) / (2.0 * PERIOD)
    second = (h[2:] - 2.0 * h[1:-1] + h[:-2]) / PERIOD**2
    psi = second + (0.6 + 1.5) * rate + 0.6 * 1.5 * h[1:-1]
    ample = (np.abs(forces) < 26.9).all(axis=1)[1:-1]
    assert h.min() > -1e-3
    assert psi[ample].min() > -0.02
    assert np.sum(np.abs(psi[ample]) < 0.02) > 50  # it acts for a second and more


@pytest.mark.medium
def test_without_barrier_the_same_obstacle_is_hit():
    region = Region("ball", Sphere((2.5, 0.05, 2.5), 0.7), "out", hard=False)
    positions, _ = fly(law_of((region,), repulsion=0.0, limit=60.0), Sea((0.0, 0.0, 0.0), 0.0), 14.0, (region,))
    assert np.linalg.norm(positions - [2.5, 0.05, 2.5], axis=1).min() < 0.6


@pytest.mark.medium
def test_obstacles_are_avoided_under_noise_and_goal_is_reached():
    regions = (BALL, Region("drifting", Sphere((5.8, -0.9, 2.2), 0.5), "out", (-0.03, 0.05, 0.0)), BAND)
    positions, forces = fly(law_of(regions), Sea(noise=(0.02, 0.01), seed=3), 60.0, regions)
    assert np.linalg.norm(positions - BALL.shape.center, axis=1).min() > 0.7
    assert np.linalg.norm(positions[-200:] - GOAL.shape.center, axis=1).max() < 0.5
    assert np.abs(forces).max() <= 27.0


@pytest.mark.medium
def test_attitude_is_held_against_a_righting_moment():
    law, sea = law_of(observer=3.0), Sea(current=(0.0, 0.0, 0.0), restoring=0.0)
    sea.quaternion = np.array([math.cos(0.2), math.sin(0.2), 0.0, 0.0])
    fly(law, sea, 45.0)
    assert sea.quaternion == pytest.approx(LEVEL, abs=1e-3)


def test_reported_failed_thruster_gets_zero_command():
    law, forces, health = law_of(), np.zeros(8), np.ones(8)
    health[2] = 0.0
    law.step(VehicleState(np.zeros(3), LEVEL, np.zeros(6), health), pack([GOAL]), pack([]), np.zeros(0), forces)
    assert forces[2] == 0.0 and np.abs(forces).max() > 1.0


@pytest.mark.parametrize("at", range(9))
def test_observer_ignores_a_measurement_with_a_number_that_is_not_finite(at):
    law, numbers = law_of(), np.array([1.0, 2.0, 3.0, 0.4, -0.3, 0.2, 0.1, -0.1, 0.2])
    numbers[at] = math.nan
    memory = law.memory
    pid_cbf.observe(memory, VehicleState(numbers[:3], LEVEL, numbers[3:], np.ones(8)), np.eye(3), law.gains)
    assert memory.started == 0.0
    memory.started, memory.velocity[0] = 1.0, 0.5
    pid_cbf.observe(memory, VehicleState(numbers[:3], LEVEL, numbers[3:], np.ones(8)), np.eye(3), law.gains)
    assert memory.position.tolist() == [0.5 * PERIOD, 0.0, 0.0] and not memory.disturbance.any()


def test_missing_position_is_propagated_by_the_model():
    law, sea, goal, forces = law_of(), Sea(current=(0.0, 0.0, 0.0), restoring=5.0), pack([GOAL]), np.zeros(8)
    fly(law, sea, 5.0)
    for _ in range(50):
        measured = sea.measured()
        measured.position[1] = math.nan
        law.step(measured, goal, pack([]), np.zeros(0), forces)
        assert np.isfinite(forces).all()
        sea.step(forces, PERIOD)
    assert law.memory.position == pytest.approx(sea.position, abs=0.05)
