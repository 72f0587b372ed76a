"""The deployable law: one step from measurement to thruster forces, in named stages."""

# estimate -> fault detection -> prediction -> path planner -> bounded attraction -> barriers -> quadratic program.

from __future__ import annotations

from typing import Any, ClassVar

import numpy as np

from controller import quadratic_program
from controller.arithmetic import QUARTER_TURN, sine, square
from controller.law import (
    Array,
    CompiledLaw,
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
)
from controller.laws.deployable.actuator_lag import predict_state
from controller.laws.deployable.attitude import empty_attitude
from controller.laws.deployable.attraction import desired_acceleration, desired_velocity, integrate_error
from controller.laws.deployable.barrier import (
    Motion,
    RegionObservation,
    observe_regions,
    predict_shifts,
    write_rows,
    write_tilt_rows,
)
from controller.laws.deployable.braking import max_upright_speed, min_forces
from controller.laws.deployable.clearance_bound import (
    KEPT,
    error_loss,
    max_slack,
    measure_error,
    predict_point,
    update_bound,
    vehicle_bound,
    withdraw_bound,
)
from controller.laws.deployable.diagnostics import (
    DIAGNOSTICS,
    NO_BOUND,
    Report,
    clear_report,
    write_program_report,
    write_report,
)
from controller.laws.deployable.estimate import LAG, Estimate, make_estimate
from controller.laws.deployable.faces import FACES
from controller.laws.deployable.fault_detection import FaultState
from controller.laws.deployable.gains import SPREADS, DeployableGains, check_gains
from controller.laws.deployable.memory import DeployableMemory
from controller.laws.deployable.model import Dynamics, Loads, make_dynamics, make_thrusters
from controller.laws.deployable.path_planning.cost import TOTAL
from controller.laws.deployable.path_planning.planner import empty_plan, go_straight, improve_path
from controller.laws.deployable.path_planning.search import PathLimits
from controller.linear_algebra import norm
from controller.quadratic_program import empty_workspace
from controller.quaternion import rotation_matrix
from controller.regions.kinds import FIRST_OF_ATTITUDE
from controller.regions.region_set import PackedRegions, clearance_at
from controller.stack_array import Matrix3, Vector3, Vector6, array, zeros

_STALE = 0.15  # s without a measurement after which the speed is reduced
_TRUSTED_SPREAD = 0.3  # m, `SPREADS` deviations of the position above which the speed is reduced; it is 0 at twice that
_SEED = 1  # seed of the path planner's random numbers
_ON_THE_WAY = 0.3  # m/s, desired speed from which soft regions do not push the vehicle back at all
_SHALLOWEST = 1e-3  # m, lower bound of the depth in the goal region at which they push back in full again
_LEAST_EFFECTIVENESS = 0.5  # effectiveness below which the desired force of a thruster is reduced in proportion
_MIN_FRACTION = 0.4  # minimum fraction of the desired force, so that a thruster is not kept within its dead band
_ATTITUDE = FIRST_OF_ATTITUDE  # first kind of region that depends on attitude


def step(
    state: VehicleState,
    goal: PackedRegions,
    regions: PackedRegions,
    weights: Array,
    gains: DeployableGains,
    memory: DeployableMemory,
    forces: Array,
) -> None:
    """Run a step of the deployable law, as specified by `CompiledLaw.step`; `forces` are those of the thrusters [N]."""
    estimate, thrusters, dynamics, period = memory.state_estimate, memory.thrusters, memory.dynamics, memory.period
    speed = min(gains.speed, dynamics.max_speed)
    gains = gains._replace(speed=min(speed, memory.speed_limit))
    input_validation.smooth_weights(weights, memory.weights, regions.hard, period / (period + gains.price_smoothing))
    # estimate
    input_validation.process_measurement(memory, state, gains)
    memory.report.rejected = memory.rejected_samples / max(memory.samples, 1.0)
    R = rotation_matrix(memory.quaternion)
    # there is no estimate, or it is too old
    if estimate.time_since_measurement < 0.0 or estimate.time_since_measurement > gains.coast:
        _hold_weight(memory, R, gains, forces)
        thrusters.forces = forces
        memory.report.time_since_measurement = estimate.time_since_measurement
        clear_report(memory.report)
        withdraw_bound(memory.bound)
        memory.expected[:] = np.nan
        return

    memory.expected[:3] = estimate.position + period * estimate.velocity
    memory.expected[3:] = R.T @ estimate.velocity

    # fault detection
    changed = fault_detection.detect_fault(memory.fault_state, estimate, thrusters, gains)
    if changed >= 0:
        memory.report.failed_thruster = changed + 1
    else:
        quiet = memory.report.barriers == 0.0
        changed = fault_detection.try_again(memory.fault_state, estimate, thrusters, memory.reported, quiet, period)
    if changed >= 0 or input_validation.reports_change(state.thruster_health, memory.reported, thrusters.health):
        input_validation.update_thrusters(memory, state.thruster_health)

    # prediction
    lag, ahead = estimate.state[LAG], memory.predicted
    loads = Loads(estimate.water_velocity, estimate.net_weight, estimate.moments, estimate.yaw_moment, estimate.drag)
    acceleration = zeros(6)
    if lag > 0.0:
        acceleration = model.thrust_acceleration(dynamics, thrusters, R, thrusters.acting_now)
        acceleration += model.free_acceleration(dynamics, R, estimate.velocity, memory.omega, loads)
    predict_state(ahead, estimate.position, estimate.velocity, memory.quaternion, memory.omega, acceleration, lag)
    R_ahead, velocity, omega = rotation_matrix(ahead.quaternion), ahead.velocity[:3], ahead.velocity[3:]
    against = model.free_wrench(dynamics, R_ahead, velocity, omega, loads)
    free = model.to_acceleration(dynamics, R_ahead, velocity, omega, loads, against)
    # where goal and regions will be at the time of that state
    predict_shifts(goal, lag, memory.goal_shifts)
    predict_shifts(regions, lag, memory.region_shifts)
    goal_ahead = goal._replace(shifts=memory.goal_shifts)
    regions_ahead = regions._replace(shifts=memory.region_shifts)

    # path planner, bounded attraction
    P = estimate.covariance
    variance = array(P[0, 0], P[1, 1], P[2, 2]) + memory.deviation[:3] ** 2
    spread = SPREADS * np.sqrt(np.max(variance))
    memory.position_variance = np.minimum(variance, square(2.0 * _TRUSTED_SPREAD / SPREADS))
    wider = min(spread, _TRUSTED_SPREAD)
    limits = PathLimits(gains.clearance + wider, gains.margin + wider, gains.speed, gains.depth)
    if gains.path_planning > 0.0:
        improve_path(memory.plan, ahead.position, goal_ahead, regions_ahead, limits, period)
    else:
        go_straight(memory.plan, ahead.position, goal_ahead, limits)
    desired = desired_velocity(memory.plan, ahead.position, goal.velocities[0], gains)
    _limit_speed(estimate, spread, thrusters.metric, R[2], gains, desired)

    # desired wrench
    observe_regions(memory.observation, regions_ahead, ahead.position, ahead.quaternion, ahead.velocity)
    fraction = period / (period + gains.smoothing)
    integrate_error(memory.integral, desired, velocity, gains, period)
    by_thrust = desired_acceleration(desired, velocity, gains) + memory.integral - free[:3]
    memory.filtered_acceleration += fraction * (by_thrust - memory.filtered_acceleration)
    force = dynamics.mass[:3, :3] @ (R_ahead.T @ memory.filtered_acceleration)
    deep = min(clearance_at(goal_ahead, 0, memory.plan.path[memory.plan.points - 1]), gains.depth)
    entered = min(max(clearance_at(goal_ahead, 0, ahead.position) / max(deep, _SHALLOWEST), 0.0), 1.0)
    pushed = _soft_forces(memory.observation, regions, memory.weights[1], desired, entered, dynamics)
    attitude_loop.update_desired(memory.attitude, regions_ahead, ahead.position, thrusters.metric, gains, period)
    moment = attitude_loop.compute_moment(memory.attitude, dynamics, ahead.quaternion, omega, against, gains)
    wrench = np.concatenate((force + R_ahead.T @ pushed, moment))
    work = memory.program
    work.nominal = thrusters.allocator @ wrench
    work.nominal *= np.clip(thrusters.effectiveness / _LEAST_EFFECTIVENESS, _MIN_FRACTION, 1.0)
    lower, upper = memory.given_limits[0], memory.given_limits[1]
    model.write_force_limits(thrusters, memory.given_limits)

    # barriers
    model.write_thruster_acceleration(
        dynamics, thrusters, R, R_ahead, memory.thruster_acceleration, memory.acceleration_ahead
    )
    motion = Motion(
        ahead.position,
        ahead.velocity,
        free,
        memory.acceleration_ahead,
        dynamics.translational_mass,
        (dynamics.mass[3, 3] + dynamics.mass[4, 4] + dynamics.mass[5, 5]) / 3.0,
        gains.braking_share * model.available_braking(dynamics, thrusters),
        0.5 * gains.acceleration * (square(period) + square(lag)),
        memory.position_variance,
        np.max(memory.deviation[6:9]),
    )
    raised = measure_error(memory.bound, motion, gains, period)
    rows, bound, yields = 0, NO_BOUND, memory.report.constraint_slack > KEPT
    if gains.barriers > 0.0:
        rows = write_rows(  # yielding barriers amplify noise
            work, memory.observation, regions_ahead, memory.weights[1], motion, lower, upper,
            fraction if yields else 1.0, gains,
        )  # fmt: skip
        bound = min(memory.observation.bound, vehicle_bound(regions, estimate.position, motion, gains))
    constraints = write_tilt_rows(work, rows, thrusters.metric, R_ahead[2], motion, lower, upper, gains)

    # quadratic program
    steps = quadratic_program.solve(work, constraints, thrusters.inverse, lower, upper, forces)
    slack = max_slack(work, rows, forces)
    predict_point(memory.bound, motion, forces, period)
    model.command_forces(thrusters, forces)
    thrusters.forces = forces
    memory.estimate[0] = estimate.net_weight
    memory.estimate[1:] = estimate.moments
    write_report(memory.report, estimate, memory.plan.cost[TOTAL], memory.plan.points, thrusters.health, desired)
    write_program_report(memory.report, work.multipliers, slack, rows, steps)
    memory.report.acceleration_error = gains.barrier_rate * memory.bound.error
    beyond = max(spread - 2.0 * _TRUSTED_SPREAD, 0.0)  # spread that the margins do not cover
    loss = beyond + error_loss(memory.bound, estimate, slack, lag, gains)
    update_bound(memory.bound, bound, loss, raised or yields or slack > KEPT)
    memory.report.bound = memory.bound.bound


def _hold_weight(memory: DeployableMemory, R: Matrix3, gains: DeployableGains, forces: Array) -> None:
    """Write the forces that compensate W - B, plus `rise`; zeros before the first estimate, or without an attitude."""
    thrusters, wrench = memory.thrusters, zeros(6)
    if memory.state_estimate.time_since_measurement > 0.0 and memory.attitude.started > 0.0:
        wrench[:3] = -R[2] * (memory.state_estimate.net_weight + gains.rise)
    forces[:] = np.clip(thrusters.allocator @ wrench, thrusters.lower, thrusters.upper)


def _limit_speed(
    estimate: Estimate, spread: float, metric: Vector6, down: Vector3, gains: DeployableGains, desired: Vector3
) -> None:
    """Limit the desired velocity so that the vehicle can stop before `coast` ends or the position is too uncertain."""
    # `spread` is the uncertainty of the position [m]. The speed also falls beyond half the greatest tilt about an axis
    # that is left to the righting moment; `down` is the vertical in body axes.
    gap = max(estimate.time_since_measurement, estimate.longest_gap)
    max_speed = gains.speed
    if gap > _STALE:
        max_speed = min(max_speed, gains.acceleration * max(gains.coast - gap, 0.0))
    if spread > _TRUSTED_SPREAD:
        max_speed = min(max_speed, gains.speed * max(2.0 - spread / _TRUSTED_SPREAD, 0.0))
    for axis in range(3, 5):
        if metric[axis] == 0.0:
            tilt = abs(down[4 - axis]) / sine(min(gains.tilt, QUARTER_TURN))
            max_speed = min(max_speed, gains.speed * max(2.0 - 2.0 * tilt, 0.0))
    speed = norm(desired)
    if speed > max_speed:
        desired *= max_speed / speed


def _soft_forces(
    observation: RegionObservation,
    regions: PackedRegions,
    weights: Array,
    desired: Vector3,
    entered: float,
    dynamics: Dynamics,
) -> Vector3:
    """Return the repulsive force of violated soft regions of position (22), -alpha_i g_i grad g_i / |grad g_i|, NED."""
    # Each is at most the force that the thrusters give in every direction. The path decides what is crossed: on the
    # way, which is as fast as `desired` [m/s, NED], a region pushes aside, but not back. Nor does it outside the goal
    # region, however slow the approach is: `entered` is 0 there, and 1 where the vehicle is as deep in it as the path's
    # end.
    speed, total = norm(desired), zeros(3)
    most = dynamics.translational_mass * np.min(dynamics.braking)
    for i in range(regions.kinds.size):
        if regions.hard[i] or not observation.values[i] > 0.0 or regions.kinds[i] >= _ATTITUDE:
            continue
        size = norm(observation.gradients[i])
        if not size > 0.0:
            continue
        push = min(regions.gains[i] * weights[i] * observation.values[i], most)
        force = -push * observation.gradients[i] / size
        along = force @ desired
        if along < 0.0:
            spared = max(min(speed / _ON_THE_WAY, 1.0), 1.0 - entered)  # fraction of the push back
            force -= spared * along * desired / square(speed)
        total += force
    return total


class DeployableLaw(CompiledLaw):
    """Reach the goal region and keep every hard region, within the limits of the thrusters; period [s]."""

    output: ClassVar[Output] = "thrusters"
    function = staticmethod(step)
    gains_type = DeployableGains
    takes_speed = True
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
        self.memory = memory = DeployableMemory(
            n=n_regions,
            m=m,
            period=validate_period(period),
            report=Report.over(np.zeros(len(DIAGNOSTICS))),
            dynamics=make_dynamics(vehicle, min_forces(vehicle, gains.tilt), max_upright_speed(vehicle, gains.tilt)),
            thrusters=make_thrusters(vehicle),
            state_estimate=make_estimate(vehicle),
            attitude=empty_attitude(desired),
            fault_state=FaultState(m=m, h=2 * m),
            plan=empty_plan(n_regions, _SEED),
            program=empty_workspace((1 + FACES) * n_regions + 2, m),
        )
        memory.quaternion, memory.predicted.quaternion[0] = desired, 1.0
        memory.expected[:] = memory.weights[:] = np.nan
        memory.reported[:] = 1.0
        clear_report(memory.report)

    @classmethod
    def validate(cls, gains: Any) -> Any:
        """Validate the gains, and return them."""
        return check_gains(gains)

    @property
    def report(self) -> Array:
        """Diagnostics of the last step, shape (len(diagnostics),)."""
        report: Array = self.memory.report.block
        return report

    @property
    def expected(self) -> Array:
        """Position [m, NED] and velocity over ground [m/s, body] at the next step, shape (6,); NaN: not estimated."""
        expected: Array = self.memory.expected
        return expected

    @property
    def desired_quaternion(self) -> Array:
        """Preferred attitude, a unit quaternion from body to world, shape (4,)."""
        preferred: Array = self.memory.attitude.preferred
        return preferred

    @property
    def attitude_target(self) -> Array:
        """Preferred attitude that the law follows at once, shape (4,); NaN: none."""
        target: Array = self.memory.attitude.target
        return target
