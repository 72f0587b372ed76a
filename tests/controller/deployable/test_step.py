"""A step of the deployable law is its stages, put together as its equations say."""

import copy

import numpy as np
import pytest

from controller.laws.deployable import (
    actuator_lag,
    attitude,
    barrier,
    clearance_bound,
    deployable_law,
    input_validation,
    model,
)
from controller.laws.deployable.attraction import desired_acceleration, desired_velocity
from controller.laws.deployable.estimate import CURRENT, EFFECTIVENESS, LAG, MOMENTS, VELOCITY, publish
from controller.laws.deployable.gains import DeployableGains
from controller.laws.deployable.path_planning.planner import improve_path
from controller.laws.deployable.path_planning.search import PathLimits
from controller.quadratic_program import solve
from controller.quaternion import rotation_matrix
from controller.regions import HalfSpace, Orientation, Region, Sphere, pack
from controller.regions.region_set import clearance_at
from tests.controller.deployable.scenery import GOAL, ODIN, REGIONS, Sea, fly, law_for

# of the generator of random numbers, on purpose
pytestmark = pytest.mark.filterwarnings("ignore:overflow encountered:RuntimeWarning")

GAINS = DeployableGains()
ALL = [*REGIONS, Region("face", Orientation((0.98, 0.0, 0.0, 0.2), 0.1), "in")]


def expected(memory, state, goal, regions, weights):
    """Return what the second half of a step should write, from the memory before it."""
    thrusters, dynamics, seen = memory.thrusters, memory.dynamics, memory.state_estimate
    input_validation.process_measurement(memory, state, GAINS)
    R, omega, ahead = rotation_matrix(memory.quaternion), memory.omega, memory.predicted
    loads = model.Loads(seen.water_velocity, seen.net_weight, seen.moments, seen.yaw_moment, seen.drag)
    free = model.free_acceleration(dynamics, R, seen.velocity, omega, loads)
    pushing = model.thrust_acceleration(dynamics, thrusters, R, thrusters.acting_now)
    motion = seen.position, seen.velocity, memory.quaternion, omega, free + pushing
    actuator_lag.predict_state(ahead, *motion, seen.state[LAG])
    position, velocity, turn = ahead.position, ahead.velocity[:3], ahead.velocity[3:]
    R = rotation_matrix(ahead.quaternion)
    free = model.free_acceleration(dynamics, R, velocity, turn, loads)
    goal, regions = (r._replace(shifts=r.shifts + seen.state[LAG] * r.velocities) for r in (goal, regions))
    variance = np.diag(seen.covariance)[:3] + state.deviation[:3] ** 2
    wider = 3.0 * np.sqrt(variance.max())
    limits = PathLimits(GAINS.clearance + wider, GAINS.margin + wider, GAINS.speed, GAINS.depth)
    improve_path(memory.plan, position, goal, regions, limits, 0.02)
    wanted = desired_velocity(memory.plan, position, goal.velocities[0], GAINS)
    wanted *= min(1.0, GAINS.speed / np.linalg.norm(wanted))
    acceleration = desired_acceleration(wanted, velocity, GAINS)
    barrier.observe_regions(memory.observation, regions, position, ahead.quaternion, ahead.velocity)
    pushed = memory.filtered_acceleration + 0.02 / (0.02 + GAINS.smoothing) * (
        acceleration - free[:3] - memory.filtered_acceleration
    )
    attitude.update_desired(memory.attitude, regions, position, np.ones(6), GAINS, 0.02)
    against = model.free_wrench(dynamics, R, velocity, turn, loads)
    moment = attitude.compute_moment(memory.attitude, dynamics, ahead.quaternion, turn, against, GAINS)
    wrench = np.r_[dynamics.mass[:3, :3] @ R.T @ pushed, moment]
    memory.program.nominal[:] = thrusters.allocator @ wrench
    lower, upper = thrusters.lower * thrusters.effectiveness, thrusters.upper * thrusters.effectiveness
    turned = np.kron(np.diag([1, 0]), R) + np.kron(np.diag([0, 1]), np.eye(3))
    motion = barrier.Motion(
        position, ahead.velocity, free, turned @ dynamics.inverse_mass @ thrusters.matrix,
        np.trace(dynamics.mass[:3, :3]) / 3.0, np.trace(dynamics.mass[3:, 3:]) / 3.0,
        GAINS.braking_share * model.available_braking(dynamics, thrusters),
        0.5 * GAINS.acceleration * (0.02**2 + seen.state[LAG] ** 2), variance, state.deviation[6:9].max(),
    )  # fmt: skip
    rates = 0.02 / (0.02 + np.where(regions.hard, GAINS.price_smoothing, 0.0))
    stages = memory.weights[0] + rates * (weights - memory.weights[0])
    smoothed = memory.weights[1] + rates * (stages - memory.weights[1])
    fraction = 0.02 / (0.02 + GAINS.smoothing) if memory.report.constraint_slack > clearance_bound.KEPT else 1.0
    rows = barrier.write_rows(
        memory.program, memory.observation, regions, smoothed, motion, lower, upper, fraction, GAINS
    )
    forces, program = np.empty(8), copy.deepcopy(memory.program)
    solve(memory.program, rows, thrusters.inverse, lower, upper, forces)
    return pushed, rows, program, np.clip(forces / thrusters.effectiveness, thrusters.lower, thrusters.upper)


@pytest.mark.medium
def test_step_is_the_sequence_of_its_stages():
    own, sea, weights = law_for(ALL), Sea(noise=(0.02, 0.01)), np.array([1.0, 0.3, 0.7, 0.5])
    fly(own, sea, regions=ALL, steps=4)
    sea.quaternion[:] = np.array([0.95, 0.1, -0.2, 0.15]) / np.linalg.norm([0.95, 0.1, -0.2, 0.15])
    state = own.memory.state_estimate.state
    state[CURRENT : CURRENT + 2], state[MOMENTS : MOMENTS + 3], state[LAG] = (0.2, -0.1), (3.0, -2.0, 1.0), 0.05
    # three steps of drag beside the ball, which then has a row
    state[:3] = sea.position = np.array([3.1, 0.2, 2.4])
    state[VELOCITY : VELOCITY + 3] = sea.velocity = np.array([0.5, 0.1, -0.05])
    publish(own.memory.state_estimate)
    goal, regions, forces, most = pack([GOAL]), pack(ALL), np.empty(8), 0
    goal.velocities[0], regions.velocities[:3] = (
        (0.1, -0.2, 0.05),
        [[-0.9, 0.2, 0.1], [0.3, 0.0, -0.2], [0.1, 0.1, 0.1]],
    )
    deviation = np.array([0.02, 0.01, 0.03, 0.004, 0.003, 0.005, 0.01, 0.02, 0.015, 0.001, 0.002, 0.001])
    for _ in range(4):
        state, memory = sea.measured()._replace(deviation=deviation), copy.deepcopy(own.memory)
        own.step(state, goal, regions, weights, forces)
        pushed, rows, program, wanted_forces = expected(memory, state, goal, regions, weights)
        most = max(most, rows)
        seen, R = memory.state_estimate, rotation_matrix(memory.quaternion)
        later = np.r_[seen.position + 0.02 * seen.velocity, R.T @ seen.velocity]
        assert own.expected == pytest.approx(later, rel=1e-12, abs=1e-15)
        for ours, theirs in zip(own.memory.plan.new_cost, memory.plan.new_cost, strict=True):
            assert ours == pytest.approx(theirs, rel=1e-9, abs=1e-12)
        assert own.memory.filtered_acceleration == pytest.approx(pushed, rel=1e-10, abs=1e-12)
        for part in ("rows", "rhs", "price"):
            ours, theirs = getattr(own.memory.program, part), getattr(program, part)
            np.testing.assert_allclose(ours[:rows], theirs[:rows], rtol=1e-8, atol=1e-14)
        assert own.memory.program.nominal == pytest.approx(program.nominal, rel=1e-8, abs=1e-9)
        assert forces == pytest.approx(wanted_forces, abs=1e-6)
        assert np.array_equal(own.memory.thrusters.forces, forces)
        assert own.estimate.tolist() == [own.memory.state_estimate.net_weight, *own.memory.state_estimate.moments]
    assert most >= 2


def test_soft_region_pushes_back_by_the_depth_in_the_goal_relative_to_the_end_of_the_path():
    """What its weight adds to the nominal forces, half as deep in the goal as the path's end."""
    soft = Region("soft", Sphere((8.2, 0.5, 2.5), 1.0), "out", hard=False)
    own, sea, goal, regions, forces = law_for([soft]), Sea(), pack([GOAL]), pack([soft]), np.empty(8)
    fly(own, sea, regions=[soft], steps=4)
    own.memory.state_estimate.state[:3] = sea.position = np.array([7.65, 0.5, 2.5])
    publish(own.memory.state_estimate)
    memory, nominal = copy.deepcopy(own.memory), []
    for weight in (1.0, 0.0):
        own.memory = copy.deepcopy(memory)
        own.step(sea.measured(), goal, regions, np.array([weight]), forces)
        nominal.append(own.memory.program.nominal.copy())
    plan, ahead = own.memory.plan, own.memory.predicted
    wanted = desired_velocity(plan, ahead.position, goal.velocities[0], GAINS)
    end = plan.path[plan.points - 1]
    entered = clearance_at(goal, 0, ahead.position) / min(clearance_at(goal, 0, end), GAINS.depth)
    R = rotation_matrix(ahead.quaternion)
    force = deployable_law._soft_forces(own.memory.observation, regions, np.ones(1), wanted, entered, memory.dynamics)
    wrench = np.r_[R.T @ force, 0.0, 0.0, 0.0]
    assert 0.3 < entered < 0.7 and np.linalg.norm(wanted) < 0.3 and np.abs(wrench).max() > 0.1
    assert nominal[0] - nominal[1] == pytest.approx(memory.thrusters.allocator @ wrench, rel=1e-9, abs=1e-9)


def test_bound_is_less_by_the_spread_beyond_the_margins_and_by_errors_and_slack():
    """Between two walls that contradict each other; three deviations up to 0.6 m are in the margins."""
    walls = [Region(f"wall {sign}", HalfSpace((sign * 0.5, 0.0, 0.0), (-sign, 0.0, 0.0)), "in") for sign in (1.0, -1.0)]
    own, sea, forces = law_for(walls), Sea(), np.empty(8)
    deviation = np.r_[0.25, np.zeros(11)]
    for _ in range(3):
        own.step(sea.measured()._replace(deviation=deviation), pack([GOAL]), pack(walls), np.ones(2), forces)
    memory = own.memory
    spread = 3.0 * np.sqrt(memory.state_estimate.covariance[0, 0] + 0.25**2)
    slack, error = memory.report.constraint_slack / 4.0, memory.report.acceleration_error / 4.0
    unsure = 3.0 * np.sqrt(np.diag(memory.state_estimate.covariance)[3:6].max())
    lost = ((2.0 + 4.0 * memory.state_estimate.state[LAG]) * error + unsure + slack) / 1.5 - 0.03
    assert spread > 0.65 and slack > 0.05 and error > 0.05
    # the estimate is 0.5 m from both walls at most, less what the margins have of the spread
    assert own.report[16] == pytest.approx(memory.bound.last - (spread - 0.6) - lost, rel=1e-12)
    assert memory.bound.last <= 0.5 - 0.6


def test_unequal_effectiveness_causes_no_opposing_forces_at_a_barrier():
    """What is given at a wall is the least that keeps it: no part of it without a wrench."""
    wall = Region("wall", HalfSpace((1.0, 0.0, 0.0), (1.0, 0.0, 0.0)), "in")
    for uneven in (0.0, 0.15):
        own, sea, forces = law_for([wall]), Sea(noise=(0.02, 0.01)), np.empty(8)
        fly(own, sea, regions=[wall], steps=4)
        state, thrusters = own.memory.state_estimate.state, own.memory.thrusters
        state[EFFECTIVENESS : EFFECTIVENESS + 8] = 0.9 + uneven * np.array([1, -1, 1, 1, -1, 1, -1, -1])
        state[:3] = sea.position = np.array([0.85, 0.0, 2.5])
        state[VELOCITY : VELOCITY + 3] = sea.velocity = np.array([0.05, 0.0, 0.0])
        publish(own.memory.state_estimate)
        own.step(sea.measured(), pack([GOAL]), pack([wall]), np.ones(1), forces)
        given = forces * thrusters.effectiveness
        idle = given - np.linalg.pinv(ODIN.thruster_matrix) @ ODIN.thruster_matrix @ given
        assert own.report[11] == 1.0 and np.abs(given).max() > 3.0
        assert np.linalg.norm(idle) < 0.02 * np.linalg.norm(given)


def test_without_measurements_speed_is_limited_to_a_timely_stop():
    """Within 0.15 s it goes on; then at most at what `acceleration` stops within `coast`; then it rests."""
    own, sea = law_for([]), Sea()
    fly(own, sea, regions=[], steps=100)
    lost = sea.measured()._replace(position=np.full(3, np.nan), velocity_body=np.full(6, np.nan))
    goal, nothing, forces, wanted = pack([GOAL]), pack([]), np.empty(8), []
    for _ in range(105):
        own.step(lost, goal, nothing, np.empty(0), forces)
        wanted.append((own.report[15], own.report[8], forces.any()))
    for since, speed, pushes in wanted:
        if since < 0.15:
            assert speed == pytest.approx(GAINS.speed)
        elif since < GAINS.coast - 1e-9:
            assert speed == pytest.approx(min(GAINS.speed, GAINS.acceleration * (GAINS.coast - since)), abs=1e-9)
        assert pushes == (since <= GAINS.coast)
    assert deployable_law.DIAGNOSTICS[8].name == "desired_speed"


@pytest.mark.parametrize("rise", [0.0, 5.0])
def test_weight_is_held_at_any_attitude_without_a_moment(rise):
    memory, forces = law_for([]).memory, np.empty(8)
    memory.state_estimate.time_since_measurement = memory.attitude.started = 1.0
    memory.state_estimate.net_weight = 9.0
    R = rotation_matrix(np.array([0.8, 0.4, -0.4, 0.2]))
    deployable_law._hold_weight(memory, R, GAINS._replace(rise=rise), forces)
    held = np.r_[R.T @ [0.0, 0.0, -9.0 - rise], np.zeros(3)]
    assert ODIN.thruster_matrix @ forces == pytest.approx(held, rel=5e-3, abs=0.05)  # allocated at a small cost


def test_position_uncertainty_reduces_speed():
    speeds = []
    for spread in (0.01, 0.09, 0.15, 0.25):
        own = law_for([])
        desired, seen = np.array([GAINS.speed, 0.0, 0.0]), own.memory.state_estimate
        seen.time_since_measurement = 0.0
        deployable_law._limit_speed(seen, 3.0 * spread, np.ones(6), np.array([0.0, 0.0, 1.0]), GAINS, desired)
        speeds.append(desired[0])
    assert speeds == pytest.approx([GAINS.speed, GAINS.speed, 0.5 * GAINS.speed, 0.0])


@pytest.mark.parametrize(
    ("tilt", "fraction"), [(0.1, 0.2533), (0.35, 1.0), (1.6, 1.0), (3.0, 1.0), (np.pi, 1.0), (3.2, 1.0)]
)
def test_tilt_of_an_undriven_axis_reduces_speed(tilt, fraction):
    seen, desired = law_for([]).memory.state_estimate, np.array([GAINS.speed, 0.0, 0.0])
    seen.time_since_measurement = 0.0
    metric, down = np.array([1.0, 1.0, 1.0, 1.0, 0.0, 1.0]), np.array([np.sin(0.0873), 0.0, np.cos(0.0873)])
    deployable_law._limit_speed(seen, 0.0, metric, down, GAINS._replace(tilt=tilt), desired)
    assert desired[0] == pytest.approx(fraction * GAINS.speed, rel=0.01)
