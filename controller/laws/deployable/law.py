"""The deployable law: one step from measurement to thruster forces, in named stages.

estimate -> fault detection -> path planner -> bounded attraction -> barriers -> quadratic program.
"""

from __future__ import annotations

from typing import Any, ClassVar

import numpy as np

from controller.arithmetic import length3, square
from controller.law import (
    Array,
    CompiledLaw,
    Diagnostic,
    Output,
    VehicleModel,
    VehicleState,
    validate_period,
    validate_quaternion,
)
from controller.laws.deployable import attitude as attitude_loop
from controller.laws.deployable import (
    fault_detection,
    input_validation,
    model,
    path_planner,
    quadratic_program,
)
from controller.laws.deployable.attitude import empty_attitude
from controller.laws.deployable.attraction import desired_acceleration, desired_velocity
from controller.laws.deployable.barrier import Motion, RegionObservation, empty_observation, observe_regions, write_rows
from controller.laws.deployable.braking import least_forces
from controller.laws.deployable.estimate import LAG, Estimate, make_estimate, position_spread
from controller.laws.deployable.faces import FACES
from controller.laws.deployable.fault_detection import empty_fault_state
from controller.laws.deployable.gains import DeployableGains, check_gains
from controller.laws.deployable.linear_algebra import copy
from controller.laws.deployable.memory import DeployableMemory
from controller.laws.deployable.model import Dynamics, Thrusters, make_dynamics, make_thrusters
from controller.laws.deployable.path_planner import empty_plan
from controller.laws.deployable.prediction import empty_prediction, predict_state
from controller.laws.deployable.quadratic_program import empty_workspace
from controller.quaternion import write_rotation
from controller.regions.kinds import FIRST_OF_ATTITUDE
from controller.regions.region_set import PackedRegions
from controller.stack_array import zeros

_SPREADS = 3.0  # standard deviations of the position that the margin adds
_STALE = 0.15  # s without a measurement, after which the vehicle goes slower
_TRUSTED_SPREAD = 0.3  # m, of those deviations, beyond which it does too; at twice as much it stops
_SEED = 1
_LEAST_EFFECTIVENESS = 0.5  # by which more force is commanded
_ATTITUDE = FIRST_OF_ATTITUDE  # shapes from it on depend on attitude

DIAGNOSTICS = (
    Diagnostic("position.x", "m", "Estimated position, north"),
    Diagnostic("position.y", "m", "Estimated position, east"),
    Diagnostic("position.z", "m", "Estimated position, down"),
    Diagnostic("velocity.x", "m/s", "Estimated velocity over ground, north"),
    Diagnostic("velocity.y", "m/s", "Estimated velocity over ground, east"),
    Diagnostic("velocity.z", "m/s", "Estimated velocity over ground, down"),
    Diagnostic("current.x", "m/s", "Estimated current, north"),
    Diagnostic("current.y", "m/s", "Estimated current, east"),
    Diagnostic("desired_speed", "m/s", "Speed that the attraction wants"),
    Diagnostic("path_cost", "m", "Length of the path into the goal region, and what it costs to pass close"),
    Diagnostic("path_corners", "", "Corners of the path"),
    Diagnostic("barriers", "", "Active barriers"),
    Diagnostic("constraint_slack", "m/s2", "Greatest slack of a barrier"),
    Diagnostic("qp_steps", "", "Steps of the quadratic program, negative if it was cut short"),
    Diagnostic("failed_thruster", "", "Isolated thruster, from 1; 0 for none"),
    Diagnostic("time_since_measurement", "s", "Time since the last measurement that was accepted"),
)


def step(
    state: VehicleState,
    goal: PackedRegions,
    regions: PackedRegions,
    weights: Array,
    gains: DeployableGains,
    memory: DeployableMemory,
    forces: Array,
) -> None:
    """Do what `CompiledLaw.step` says, by the deployable law."""
    estimate, thrusters, dynamics, period = memory.state_estimate, memory.thrusters, memory.dynamics, memory.period[0]
    input_validation.sanitize_weights(weights, memory.weights)
    R, desired, acceleration, free, against, wrench = zeros(3, 3), zeros(3), zeros(6), zeros(6), zeros(6), zeros(6)

    # estimate
    input_validation.process_measurement(memory, state, gains)
    write_rotation(memory.quaternion, R)
    if (
        estimate.time_since_measurement[0] < 0.0 or estimate.time_since_measurement[0] > gains.coast
    ):  # the estimate is too old: drift
        forces[:] = 0.0
        thrusters.forces[:] = 0.0
        memory.report[15] = estimate.time_since_measurement[0]
        return

    # fault detection
    failed = fault_detection.detect_fault(memory.fault_state, estimate, thrusters, gains)
    if failed >= 0 or input_validation.reports_change(state.thruster_health, memory.reported, thrusters.health):
        input_validation.update_thrusters(memory, state.thruster_health)

    # prediction
    lag, ahead = estimate.state[LAG], memory.predicted
    _free_acceleration(memory, R, estimate.velocity, memory.omega, free)
    if lag > 0.0:
        model.thrust_acceleration(dynamics, thrusters, R, thrusters.acting_now, acceleration)
        for i in range(6):
            acceleration[i] += free[i]
    predict_state(ahead, estimate.position, estimate.velocity, memory.quaternion, memory.omega, acceleration, lag)
    _free_acceleration(memory, R, ahead.velocity[:3], ahead.velocity[3:], free)

    # path planner, bounded attraction
    path_planner.improve_path(memory.plan, ahead.position, goal, regions, gains, period)
    desired_velocity(memory.plan, ahead.position, goal.velocities[0], gains, desired)
    _limit_speed(estimate, gains, desired)
    desired_acceleration(desired, ahead.velocity[:3], gains, acceleration[:3])

    # desired wrench
    observe_regions(memory.observation, regions, ahead.position, ahead.quaternion, ahead.velocity)
    share = period / (period + gains.smoothing)
    for axis in range(3):
        memory.filtered_acceleration[axis] += share * (
            acceleration[axis] - free[axis] - memory.filtered_acceleration[axis]
        )
    _force_of(dynamics, R, memory.filtered_acceleration, wrench)
    _soft_forces(memory.observation, regions, memory.weights, R, dynamics, wrench)
    attitude_loop.update_desired(memory.attitude, regions, ahead.position, gains, period)
    _free_wrench(memory, R, ahead.velocity, against)
    attitude_loop.compute_moment(
        memory.attitude, dynamics, ahead.quaternion, ahead.velocity[3:], against, gains, wrench[3:]
    )
    work = memory.program
    for j in range(forces.size):
        work.nominal[j] = 0.0
        for k in range(6):
            work.nominal[j] += thrusters.allocator[j, k] * wrench[k]
        work.nominal[j] /= max(thrusters.effectiveness[j], _LEAST_EFFECTIVENESS)
        if not np.isnan(thrusters.stuck[j]):
            thrusters.lower[j] = thrusters.upper[j] = thrusters.stuck[j] * thrusters.effectiveness[j]

    # barriers
    _write_thruster_acceleration(dynamics, thrusters, R, memory.thruster_acceleration)
    for i in range(6):
        for j in range(forces.size):
            follows = np.isnan(thrusters.stuck[j])  # the limits of others are what they give
            memory.effective_acceleration[i, j] = memory.thruster_acceleration[i, j] * (
                thrusters.effectiveness[j] if follows else 1.0
            )
    motion = Motion(
        ahead.position,
        ahead.velocity,
        free,
        memory.effective_acceleration,
        dynamics.translational_mass[0],
        (dynamics.mass[3, 3] + dynamics.mass[4, 4] + dynamics.mass[5, 5]) / 3.0,
        gains.braking_share * _braking(dynamics, thrusters),
        _SPREADS * position_spread(estimate) + 0.5 * gains.acceleration * (square(period) + square(lag)),
    )
    rows = write_rows(
        work, memory.observation, regions, memory.weights, motion, thrusters.lower, thrusters.upper, gains
    )

    # quadratic program
    steps = quadratic_program.solve(work, rows, thrusters.inverse, thrusters.lower, thrusters.upper, forces)
    copy(forces, thrusters.forces)
    memory.estimate[0] = estimate.net_weight[0]
    copy(estimate.moments, memory.estimate[1:])
    _report(memory.report, estimate, memory.plan.cost[0], memory.plan.counts[0], thrusters.health, desired)
    _report_program(memory.report, work.multipliers, work.price, rows, steps)


def _free_wrench(memory: DeployableMemory, R: Array, velocity: Array, out: Array) -> None:
    """Write the wrench [N, N m] without thrust at a velocity, shape (6,) as in `Motion`."""
    estimate = memory.state_estimate
    model.free_wrench(
        memory.dynamics,
        R,
        velocity[:3],
        velocity[3:],
        estimate.water_velocity,
        estimate.net_weight[0],
        estimate.moments,
        out,
    )


def _free_acceleration(memory: DeployableMemory, R: Array, velocity: Array, omega: Array, out: Array) -> None:
    """Write the acceleration [m/s2, rad/s2] without thrust at velocities [m/s, rad/s], shape (3,) each."""
    estimate = memory.state_estimate
    model.free_acceleration(
        memory.dynamics,
        R,
        velocity,
        omega,
        estimate.water_velocity,
        estimate.net_weight[0],
        estimate.moments,
        out,
    )


def _limit_speed(estimate: Estimate, gains: DeployableGains, desired: Array) -> None:
    """Limit the wanted velocity to what `acceleration` stops before the law has coasted too long, or knows no place."""
    gap, spread = max(estimate.time_since_measurement[0], estimate.longest_gap[0]), _SPREADS * position_spread(estimate)
    most = gains.speed
    if gap > _STALE:
        most = min(most, gains.acceleration * max(gains.coast - gap, 0.0))
    if spread > _TRUSTED_SPREAD:
        most = min(most, gains.speed * max(2.0 - spread / _TRUSTED_SPREAD, 0.0))
    speed = length3(desired[0], desired[1], desired[2])
    if speed > most:
        for axis in range(3):
            desired[axis] *= most / speed


def _force_of(dynamics: Dynamics, R: Array, acceleration: Array, out: Array) -> None:
    """Write the body force [N] that gives an acceleration, world frame, into out[:3]."""
    for i in range(3):
        out[i] = 0.0
        for k in range(3):
            along = 0.0
            for axis in range(3):
                along += R[axis, k] * acceleration[axis]
            out[i] += dynamics.mass[i, k] * along


def _soft_forces(
    observation: RegionObservation, regions: PackedRegions, weights: Array, R: Array, dynamics: Dynamics, wrench: Array
) -> None:
    """Add the repulsive force of violated soft regions of position (22), -alpha_i g_i grad g_i / |grad g_i|.

    Each is at most the force that the thrusters give in every direction.
    """
    most = dynamics.translational_mass[0] * _smallest(dynamics.braking)
    for i in range(regions.kinds.size):
        if regions.hard[i] or not observation.values[i] > 0.0 or regions.kinds[i] >= _ATTITUDE:
            continue
        size = length3(observation.gradients[i, 0], observation.gradients[i, 1], observation.gradients[i, 2])
        if not size > 0.0:
            continue
        thruster_acceleration = min(regions.gains[i] * weights[i] * observation.values[i], most)
        for k in range(3):
            for axis in range(3):
                wrench[k] -= thruster_acceleration * R[axis, k] * observation.gradients[i, axis] / size


def _write_thruster_acceleration(
    dynamics: Dynamics, thrusters: Thrusters, R: Array, thruster_acceleration: Array
) -> None:
    """Write the acceleration of one newton of each thruster, shape (6, m), as `barrier.Motion` has it."""
    thruster_acceleration[:, :] = 0.0
    for j in range(thrusters.health.size):
        for i in range(6):
            body = 0.0
            for k in range(6):
                body += dynamics.inverse_mass[i, k] * thrusters.matrix[k, j]
            if i >= 3:
                thruster_acceleration[i, j] = body
            else:
                for axis in range(3):
                    thruster_acceleration[axis, j] += R[axis, i] * body


def _smallest(values: Array) -> float:
    smallest: float = values[0]
    for i in range(values.size):
        smallest = min(smallest, values[i])
    return smallest


def _braking(dynamics: Dynamics, thrusters: Thrusters) -> float:
    """Return the deceleration [m/s2] in the worst direction with one thruster lost: the failed one, or any.

    Each further failure halves it, which is a rule of thumb.
    """
    worst, lost = _smallest(dynamics.braking), 0
    for j in range(thrusters.health.size):
        if thrusters.health[j] == 0.0:
            worst = dynamics.braking[j] if lost == 0 else 0.5 * min(worst, dynamics.braking[j])
            lost += 1
    return worst


def _report(report: Array, estimate: Estimate, cost: float, points: int, health: Array, desired: Array) -> None:
    """Write the `DIAGNOSTICS` of estimate, path and thrusters."""
    copy(estimate.position, report[:3])
    copy(estimate.velocity, report[3:6])
    copy(estimate.water_velocity, report[6:8])
    report[8] = length3(desired[0], desired[1], desired[2])
    report[9] = cost
    report[10] = points - 1
    report[14] = 0.0
    for j in range(health.size):
        if health[j] == 0.0:
            report[14] = j + 1
    report[15] = estimate.time_since_measurement[0]


def _report_program(report: Array, multipliers: Array, price: Array, rows: int, steps: int) -> None:
    """Write the `DIAGNOSTICS` of barriers and quadratic program."""
    active, yielding = 0, 0.0
    for i in range(rows):
        if multipliers[i] > 0.0:
            active += 1
            yielding = max(yielding, multipliers[i] * price[i])
    report[11], report[12], report[13] = active, yielding, steps


class DeployableLaw(CompiledLaw):
    """Reach the goal region and keep every hard region, within the limits of the thrusters.

    Parameters
    ----------
    vehicle : VehicleModel
        Nominal numbers.
    gains : DeployableGains
        Of the law.
    desired_quaternion : array_like, shape (4,)
        Attitude to be kept, from body to world.
    period : float
        Control period [s].
    n_regions : int
        Number of secondary regions.

    Raises
    ------
    LawError
        If gains, attitude or period are invalid.
    """

    output: ClassVar[Output] = "thrusters"
    function = staticmethod(step)
    gains_type = DeployableGains
    diagnostics = DIAGNOSTICS

    def __init__(
        self,
        vehicle: VehicleModel,
        gains: DeployableGains,
        desired_quaternion: Array,
        period: float,
        n_regions: int,
    ) -> None:
        self.gains, self.n_regions = self.validate(gains), n_regions
        desired = validate_quaternion(desired_quaternion)
        self.n_forces = m = vehicle.thruster_matrix.shape[1]
        self.memory = DeployableMemory(
            period=np.array([validate_period(period)]),
            estimate=np.zeros(4),
            report=np.zeros(len(DIAGNOSTICS)),
            dynamics=make_dynamics(vehicle, least_forces(vehicle)),
            thrusters=make_thrusters(vehicle),
            state_estimate=make_estimate(vehicle),
            attitude=empty_attitude(desired),
            fault_state=empty_fault_state(m),
            plan=empty_plan(n_regions, _SEED),
            observation=empty_observation(n_regions),
            program=empty_workspace((1 + FACES) * n_regions, m),
            predicted=empty_prediction(),
            quaternion=desired.copy(),
            omega=np.zeros(3),
            weights=np.ones(n_regions),
            reported=np.ones(m),
            filtered_acceleration=np.zeros(3),
            thruster_acceleration=np.zeros((6, m)),
            effective_acceleration=np.zeros((6, m)),
        )

    @classmethod
    def for_vehicle(
        cls, vehicle: VehicleModel, gains: Any, desired_quaternion: Array, period: float, n_regions: int
    ) -> DeployableLaw:
        """Return the law for a vehicle, as `CompiledLaw.for_vehicle`."""
        return cls(vehicle, gains, desired_quaternion, period, n_regions)

    @classmethod
    def validate(cls, gains: Any) -> Any:
        """Return gains if the law can work with them."""
        return check_gains(gains)

    def set_attitude(self, quaternion: Array) -> None:
        """Keep another attitude, a unit `quaternion`, where no region asks for one, from the next step on."""
        self.memory.attitude.preferred[:] = validate_quaternion(quaternion)
