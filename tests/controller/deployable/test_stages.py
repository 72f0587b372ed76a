"""What stands between estimate and barriers, and what is believed of what comes in, against plain matrices."""

import copy

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from controller import VehicleState
from controller.laws.deployable import actuator_lag, deployable_law, diagnostics, input_validation, observer
from controller.laws.deployable.attraction import desired_velocity
from controller.laws.deployable.barrier import RegionObservation, observe_regions
from controller.laws.deployable.estimate import POSITION, VELOCITY, initialize, make_estimate
from controller.laws.deployable.gains import DeployableGains
from controller.laws.deployable.model import (
    Loads,
    available_braking,
    free_acceleration,
    make_thrusters,
    reallocate,
    write_force_limits,
    write_thruster_acceleration,
)
from controller.laws.deployable.path_planning.planner import CORNERS, empty_plan
from controller.regions import HalfSpace, Orientation, Region, Sphere, pack
from tests.controller.deployable.scenery import LEVEL, ODIN, askew, law_for

GAINS = DeployableGains()


TURNED = Rotation.from_euler("zyx", [0.7, -0.3, 0.2]).as_matrix()
ATTITUDE = Rotation.from_matrix(TURNED).as_quat()[[3, 0, 1, 2]]


def approach(distance, a, slope):
    return np.sqrt(2.0 * a * distance + (a / slope) ** 2) - a / slope if distance > 0.0 else slope * distance


def test_desired_velocity_slows_at_corners_and_at_the_end():
    rng, plan, slowed = np.random.default_rng(1), empty_plan(0, 1), 0
    for _ in range(200):
        count, at, drift = int(rng.integers(1, 5)), rng.normal(size=3), rng.normal(size=3) * 0.1
        plan.points, plan.path[:] = count, rng.normal(size=(CORNERS + 1, 3)) * rng.choice([0.15, 1.5])
        points = np.vstack([at + 0.3 * rng.normal(size=3) if rng.uniform() < 0.3 else at, plan.path[:count]])
        points[0] = at
        legs = np.diff(points, axis=0)
        lengths = np.linalg.norm(legs, axis=1)
        units, ends = legs / lengths[:, None], np.cumsum(lengths)
        speed = GAINS.speed
        for i in range(1, count):
            corner = GAINS.speed * max(0.25, 0.5 * (1.0 + units[i - 1] @ units[i]))
            speed = min(speed, np.sqrt(corner**2 + 2.0 * GAINS.acceleration * ends[i - 1]))
        slowed += speed < GAINS.speed
        speed = min(speed, approach(ends[-1], GAINS.acceleration, GAINS.position_bandwidth))
        along, left = np.zeros(3), 0.4  # m ahead on the way
        for unit, length in zip(units, lengths, strict=True):
            along += unit * np.clip(left, 0.0, length)
            left -= length
        out = desired_velocity(plan, at, drift, GAINS)
        assert out == pytest.approx(drift + speed * along / np.linalg.norm(along), rel=1e-9, abs=1e-12)
    assert slowed > 50


def test_thruster_influence_matrix_matches_the_inverse_mass():
    dynamics, thrusters = askew(np.random.default_rng(3)), make_thrusters(ODIN)
    body = dynamics.inverse_mass @ thrusters.matrix
    expected, ahead = np.vstack([TURNED @ body[:3], body[3:]]), TURNED @ TURNED
    push, later = np.zeros((6, thrusters.health.size)), np.zeros((6, thrusters.health.size))
    limits = np.zeros((2, thrusters.health.size))
    thrusters.effectiveness[:], thrusters.stuck[5] = np.linspace(0.2, 0.9, 8), 4.0
    write_thruster_acceleration(dynamics, thrusters, TURNED, ahead, push, later)
    assert push == pytest.approx(expected, rel=1e-12, abs=1e-15)
    assert later == pytest.approx(np.vstack([ahead @ body[:3], body[3:]]), rel=1e-12, abs=1e-15)
    lower, upper = ODIN.thrust_min * thrusters.effectiveness, ODIN.thrust_max * thrusters.effectiveness
    lower[5] = upper[5] = 4.0 * thrusters.effectiveness[5]  # it gives what it is stuck at, whatever is commanded
    write_force_limits(thrusters, limits)
    assert limits == pytest.approx(np.array([lower, upper]), rel=1e-12)


def test_violated_soft_regions_repel():
    rng, position = np.random.default_rng(4), np.array([0.3, -0.1, 0.2])
    dynamics = askew(rng)
    regions = [
        Region("soft", Sphere((0.0, 0.0, 0.0), 2.0), "out", gain=3.0, hard=False),
        Region("soft wall", HalfSpace((0.0, 0.0, 0.0), (-1.0, -2.0, -3.0)), "out", gain=400.0, hard=False),
        Region("kept", Sphere((9.0, 0.0, 0.0), 0.1), "out", gain=3.0, hard=False),
        Region("hard", Sphere((0.0, 0.0, 0.0), 1.0), "out", gain=3.0),
        Region("face", Orientation((0.0, 1.0, 0.0, 0.0), 0.1), "in", gain=3.0, hard=False),
    ]
    weights, sight = rng.uniform(0.3, 1.0, 5), RegionObservation(n=5)
    observe_regions(sight, pack(regions), position, ATTITUDE, np.zeros(6))
    most = dynamics.translational_mass * dynamics.braking.min()
    expected, count = np.zeros(3), 0
    for i in (0, 1):
        out = -sight.gradients[i] / np.linalg.norm(sight.gradients[i])
        push = min(regions[i].gain * weights[i] * sight.values[i], most)
        count += push < most
        expected += out * push
    force = deployable_law._soft_forces(sight, pack(regions), weights, np.zeros(3), 0.0, dynamics)
    assert force == pytest.approx(expected, rel=1e-12)
    assert count == 1


@pytest.mark.parametrize("entered", [0.0, 0.4, 1.0])
def test_moving_vehicle_is_repelled_sideways_but_not_backwards(entered):
    """At rest in full; else without the part against the desired velocity, of which the goal region gives some back.

    Where the vehicle is as deep in it as the path ends, all of it at rest, none from 0.3 m/s on.
    """
    dynamics, region = (
        askew(np.random.default_rng(4)),
        Region("wall", HalfSpace((0.5, 0.0, 0.0), (1.0, 1.0, 0.0)), "out", gain=10.0, hard=False),
    )
    sight = RegionObservation(n=1)
    observe_regions(sight, pack([region]), np.zeros(3), ATTITUDE, np.zeros(6))
    push = 10.0 * sight.values[0]
    along = np.array([1.0, 1.0, 0.0]) / np.sqrt(2.0) * push  # out of it, along its normal
    for desired in (
        [0.0, 0.0, 0.0],
        [-1e-4, 0.0, 0.0],
        [-0.1, 0.0, 0.0],
        [-0.3, 0.0, 0.0],
        [-2.0, 0.0, 0.0],
        [2.0, 0.0, 0.0],
        [0.0, 0.0, -1.0],
    ):
        expected, desired = along.copy(), np.array(desired)
        if desired[0] < 0.0:  # against the push in x
            expected[0] *= min(1.0 - min(-desired[0] / 0.3, 1.0), entered)
        force = deployable_law._soft_forces(sight, pack([region]), np.ones(1), desired, entered, dynamics)
        assert force == pytest.approx(expected, rel=1e-12, abs=1e-12)


@pytest.mark.parametrize("lost", [[], [3], [3, 5], [1, 4, 6]])
def test_available_braking_accounts_for_lost_thrusters(lost):
    dynamics, thrusters = askew(np.random.default_rng(5)), make_thrusters(ODIN)
    thrusters.health[lost] = 0.0
    reallocate(thrusters)
    expected = dynamics.braking.min() if not lost else dynamics.braking[lost[0]]
    for j in lost[1:]:
        expected = 0.5 * min(expected, dynamics.braking[j])
    assert available_braking(dynamics, thrusters) == pytest.approx(expected)


def test_report_holds_the_diagnostics():
    seen, report = make_estimate(ODIN), diagnostics.Report()
    names = [name.partition(".")[0] for name in (diagnostic.name for diagnostic in deployable_law.DIAGNOSTICS)]
    assert names == [field for field in report._fields for _ in range(report.storage(field).size)]
    seen.position[:], seen.velocity[:], seen.water_velocity[:2] = (1.0, 2.0, 3.0), (4.0, 5.0, 6.0), (7.0, 8.0)
    wanted, report.failed_thruster = np.array([2.0, -3.0, 6.0]), 1.0
    for second in (0.0, 1.0):  # the first one was isolated last
        diagnostics.write_report(report, seen, 9.5, 4, np.array([0.0, second, 0.0, 1.0]), wanted)
        assert report.failed_thruster == 1.0
    health = np.array([1.0, 1.0, 0.0, 1.0])
    diagnostics.write_report(report, seen, 9.5, 4, health, wanted)
    assert np.concatenate(report[:3]).tolist() == [1.0, 2.0, 3.0, 4.0, 5.0, 6.0, 7.0, 8.0]
    assert (report.desired_speed, report.path_cost, report.path_corners) == (7.0, 9.5, 3.0)
    assert (report.failed_thruster, report.time_since_measurement) == (3.0, -1.0)
    program = np.array([0.0, 2.0, 3.0, 9.0]), 1.5, 3, -6
    diagnostics.write_program_report(report, *program)
    assert (report.barriers, report.constraint_slack, report.qp_steps) == (2.0, 1.5, -6.0)


# ---- what is believed ----


def begun():
    memory = law_for([]).memory
    thrust = np.random.default_rng(6).uniform(-15.0, 15.0, 8)
    memory.thrusters.forces[:] = memory.thrusters.acting[:] = thrust
    initialize(memory.state_estimate, np.array([1.0, 2.0, 3.0]), np.array([0.4, -0.3, 0.2]), GAINS)
    memory.quaternion[:], memory.omega[:] = ATTITUDE, (0.3, -0.2, 0.1)
    return memory


def test_missing_attitude_and_rates_are_propagated_by_the_model():
    memory = begun()
    seen = memory.state_estimate
    loads = Loads(seen.water_velocity, seen.net_weight, seen.moments, seen.yaw_moment, seen.drag)
    free = free_acceleration(memory.dynamics, TURNED, seen.velocity, memory.omega, loads)
    wrench = memory.thrusters.matrix @ memory.thrusters.forces
    omega = memory.omega + 0.02 * (free[3:] + (memory.dynamics.inverse_mass @ wrench)[3:])
    turned = Rotation.from_matrix(TURNED) * Rotation.from_rotvec(0.02 * omega)
    input_validation._propagate_attitude(memory)
    assert memory.omega == pytest.approx(omega, rel=1e-12)
    assert memory.quaternion == pytest.approx(turned.as_quat()[[3, 0, 1, 2]], abs=1e-6)


@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_propagated_rates_stay_bounded(sign):
    """The drag of one period at such a rate would throw it back far beyond."""
    memory = begun()
    memory.omega[:] = 1e3 * sign
    input_validation._propagate_attitude(memory)
    assert memory.omega.tolist() == [-100.0 * sign] * 3


def state_of(memory, **change):
    seen = memory.state_estimate
    body = np.r_[TURNED.T @ seen.velocity, memory.omega]
    return VehicleState(seen.position.copy(), ATTITUDE.copy(), body, np.ones(8))._replace(**change)


@pytest.mark.parametrize("axis", [None, 0, 1, 2])
def test_measurements_in_the_world_frame_count_by_their_greatest_deviation(axis):
    """Half a position's; a velocity's squared over 0.01 m/s, and less evidence of a failure by the square of both."""
    memory, theirs = begun(), begun()
    body = np.r_[TURNED.T @ [0.41, -0.31, 0.21], 0.1, 0.2, -0.3]
    deviation, noise, weight = np.zeros(12), (0.02, 0.01), 1.0
    if axis is not None:
        deviation[axis], deviation[3 + axis], noise, weight = 0.3, 0.05, (0.15, 0.25), (0.01 / 0.05) ** 2
    state = state_of(memory, position=np.array([1.01, 2.0, 3.0]), velocity_body=body, deviation=deviation)
    state = state._replace(quaternion=1.001 * ATTITUDE)
    assert input_validation.process_measurement(memory, state, GAINS)
    assert memory.quaternion == pytest.approx(ATTITUDE, abs=1e-12) and np.array_equal(memory.omega, body[3:])
    actuator_lag.update_forces(theirs.state_estimate, theirs.thrusters, 0.02)
    given = theirs.dynamics, theirs.thrusters, theirs.thruster_acceleration
    observer.predict(theirs.state_estimate, *given, TURNED, body[3:], GAINS, 0.02)
    assert observer.correct(theirs.state_estimate, POSITION, state.position, noise[0], GAINS)
    assert observer.correct(theirs.state_estimate, VELOCITY, np.array([0.41, -0.31, 0.21]), noise[1], GAINS)
    assert memory.state_estimate.state == pytest.approx(theirs.state_estimate.state, rel=1e-9, abs=1e-12)
    assert memory.state_estimate.covariance == pytest.approx(theirs.state_estimate.covariance, rel=1e-9, abs=1e-15)
    assert memory.state_estimate.weight == pytest.approx(weight)


@pytest.mark.parametrize("axis", range(3))
@pytest.mark.parametrize(("speed", "push", "new"), [(0.019, 0.049, True), (0.021, 0.0, False), (0.0, 0.051, False)])
def test_repeated_measurement_is_new_only_at_rest_and_without_a_push(axis, speed, push, new):
    for sign in (1.0, -1.0):
        seen = begun().state_estimate
        seen.velocity[:], seen.acceleration[:] = sign * speed * np.eye(3)[axis], -sign * push * np.eye(3)[axis]
        assert input_validation._is_new(seen, 0, True, GAINS) == new


def test_identical_measurements_while_moving_are_rejected():
    for moving in ((-0.05, 0.0, 0.0), (0.0, -0.05, 0.0), (0.0, 0.0, -0.05), (0.0, 0.0, 0.0)):
        memory = begun()
        memory.thrusters.forces[:] = 0.0
        memory.state_estimate.velocity[:] = memory.state_estimate.state[VELOCITY : VELOCITY + 3] = moving
        state = state_of(memory)
        assert input_validation.process_measurement(memory, state, GAINS)
        assert input_validation.process_measurement(memory, state, GAINS) == (not any(moving))
        for which in (0, 1, 2):  # one number that differs in its last bit is enough
            position, body = state.position.copy(), state.velocity_body.copy()
            position[which] = np.nextafter(position[which], np.inf)
            other = copy.deepcopy(memory)
            assert input_validation.process_measurement(other, state._replace(position=position), GAINS)
            body[which] = np.nextafter(body[which], np.inf)
            other = copy.deepcopy(memory)
            assert input_validation.process_measurement(other, state._replace(velocity_body=body), GAINS)


@pytest.mark.parametrize(
    ("change", "accepted"),
    [
        ({"quaternion": 1.006 * ATTITUDE}, {"position"}), ({"quaternion": 0.994 * ATTITUDE}, {"position"}),
        ({"position": np.array([1e7, 2.0, 3.0])}, {"position", "velocity"}),  # of the position the other two
        ({"position": np.full(3, np.nan)}, {"velocity"}),
        ({"velocity_body": np.array([0.0, -200.0, 0.0, 0.0, 0.0, 0.0])}, {"position"}),
        ({"velocity_body": np.array([0.0, 0.0, 0.0, 60.0, -60.0, 0.0])}, {"position"}),
        ({"velocity_body": np.array([0.0, 0.0, 0.0, -200.0, 0.0, 0.0])}, {"position"}),
        ({"position": np.full(3, np.nan), "velocity_body": np.full(6, np.nan)}, set()),
    ],
)  # fmt: skip
def test_impossible_measurements_are_rejected_and_others_accepted(change, accepted):
    fresh, memory = law_for([]).memory, begun()
    seen = memory.state_estimate
    assert input_validation.process_measurement(memory, state_of(memory, **change), GAINS) == bool(accepted)
    assert (seen.time_since_valid == 0.0).tolist() == ["position" in accepted, "velocity" in accepted]
    assert (seen.time_since_measurement == 0.0) == bool(accepted)
    rates = state_of(memory, **change).velocity_body[3:]  # it starts with attitude, rates and place
    starts = "quaternion" not in change and "position" not in change and np.abs(rates).sum() < 100.0
    assert input_validation.process_measurement(fresh, state_of(memory, **change), GAINS) == starts
    assert (fresh.state_estimate.time_since_measurement < 0.0) != starts
    assert starts or input_validation.process_measurement(fresh, state_of(memory, quaternion=0.999 * ATTITUDE), GAINS)


def test_longest_measurement_gap_decays_over_a_second():
    memory = begun()
    nothing = state_of(memory, position=np.full(3, np.nan), velocity_body=np.full(6, np.nan))
    for _ in range(24):
        assert not input_validation.process_measurement(memory, nothing, GAINS)
    seen = memory.state_estimate
    assert seen.time_since_measurement == pytest.approx(0.48)
    depth = np.array([np.nan, np.nan, seen.position[2]])
    assert input_validation.process_measurement(memory, nothing._replace(position=depth), GAINS)
    assert seen.longest_gap == pytest.approx(0.5) and seen.time_since_valid.tolist() == pytest.approx([0.0, 0.5])
    given = memory.dynamics, memory.thrusters, memory.thruster_acceleration
    observer.predict(seen, *given, TURNED, memory.omega, GAINS, 0.02)
    assert seen.longest_gap == pytest.approx(0.5 * 0.98)


def test_diverged_estimate_is_reset():
    memory = begun()
    memory.state_estimate.state[1], memory.fault_state.ratio[2] = 2e6, 5.0
    bad = state_of(memory, position=np.full(3, np.nan))
    assert not input_validation.process_measurement(memory, bad, GAINS)
    assert memory.state_estimate.time_since_measurement == -1.0
    assert not memory.state_estimate.position.any() and not memory.fault_state.ratio.any()
    assert input_validation.process_measurement(memory, state_of(memory), GAINS)


def test_persistent_measurements_are_eventually_accepted():
    memory = begun()
    elsewhere = state_of(memory, position=np.array([30.0, 2.0, 3.0]))
    for silence, begins in ((1.0, False), (GAINS.coast + 0.1, True)):
        memory.state_estimate.time_since_valid[0] = silence
        assert input_validation.process_measurement(memory, elsewhere, GAINS)  # its velocity
        assert (memory.state_estimate.position[0] == 30.0) == begins
        elsewhere.velocity_body[0] += 1e-6
        elsewhere.position[2] += 1e-6


def test_weights_and_health_are_sanitized():
    believed, hard = np.full((2, 4), np.nan), np.array([True, False, True, False])
    input_validation.smooth_weights(np.array([-1.0, 0.3, 2.0, np.nan]), believed, hard, 0.1)
    assert believed.tolist() == [[0.0, 0.3, 1.0, 1.0]] * 2  # the first as they are
    input_validation.smooth_weights(np.array([1.0, 0.7, np.nan, -2.0]), believed, hard, 0.1)
    assert believed[0] == pytest.approx([0.1, 0.7, 1.0, 0.0], rel=1e-12)
    assert believed[1] == pytest.approx([0.01, 0.7, 1.0, 0.0], rel=1e-12)
    memory = law_for([]).memory
    memory.thrusters.health[2] = 0.0  # isolated
    input_validation.update_thrusters(memory, np.ones(8))
    assert np.flatnonzero(memory.thrusters.health == 0.0).tolist() == [2]
    told = np.array([1.0, -1.0, 1.0, np.nan, 1.0, 1.0, 1.0, 0.5])
    assert input_validation.reports_change(told, memory.reported, memory.thrusters.health)
    input_validation.update_thrusters(memory, told)
    assert np.flatnonzero(memory.thrusters.health == 0.0).tolist() == [1, 2]
    assert not input_validation.reports_change(told, memory.reported, memory.thrusters.health)
    assert np.array_equal(memory.quaternion, LEVEL)
