"""The deployable law: one step from measurement to thruster forces, in named stages.

estimate -> failed thrusters -> way round -> bounded attraction -> barriers -> quadratic program.
"""

from __future__ import annotations

from functools import cached_property
from typing import Any, ClassVar

import numpy as np

from controller.jit.function_pointer import call, pointer_to
from controller.jit.jit import jit_noalloc, part
from controller.jit.stack_array import zeros
from controller.law import (
    Array,
    CompiledLaw,
    Diagnostic,
    Output,
    VehicleModel,
    VehicleState,
    checked_period,
    validate_quaternion,
)
from controller.laws.deployable import attitude as attitude_loop
from controller.laws.deployable import (
    fault_detection,
    input_validation,
    model,
    observer,
    path_planner,
    quadratic_program,
)
from controller.laws.deployable.attitude import attitude_of
from controller.laws.deployable.attraction import wanted_acceleration, wanted_velocity
from controller.laws.deployable.barrier import Motion, Sight, look, sight_of, write_rows
from controller.laws.deployable.braking import least_forces
from controller.laws.deployable.faces import FACES
from controller.laws.deployable.fault_detection import suspicion_of
from controller.laws.deployable.gains import DeployableGains, check_gains
from controller.laws.deployable.linear_algebra import copy
from controller.laws.deployable.memory import DeployableMemory, Stages
from controller.laws.deployable.model import Dynamics, Thrusters, dynamics_of, thrusters_of
from controller.laws.deployable.observer import Estimate, estimate_of_nothing
from controller.laws.deployable.path_planner import guide_of_nothing
from controller.laws.deployable.quadratic_program import workspace
from controller.quaternion import write_rotation
from controller.regions import pack
from controller.regions.kinds import FIRST_OF_ATTITUDE
from controller.regions.region_set import PackedRegions

_SPREADS = 3.0  # standard deviations of the position that the margin adds
_STALE = 0.15  # s without a valid measurement, after which the vehicle is brought to a stop
_SEED = 1
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
    Diagnostic("wanted_speed", "m/s", "Speed that the attraction wants"),
    Diagnostic("way_cost", "m", "Length of the way into the goal region, and what it costs to pass close"),
    Diagnostic("way_corners", "", "Corners of the way"),
    Diagnostic("barriers", "", "Barriers that hold the thrusters back"),
    Diagnostic("yielding", "m/s2", "By how much the barrier that yields most yields"),
    Diagnostic("program_steps", "", "Steps of the quadratic program, negative if it was cut short"),
    Diagnostic("failed_thruster", "", "Thruster that is given up, from 1; 0 for none"),
    Diagnostic("silence", "s", "Time since the last measurement that was believed"),
)


@jit_noalloc
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
    seen, thrusters, dynamics, period = memory.observed, memory.thrusters, memory.dynamics, memory.period[0]
    input_validation.sanitize_weights(weights, memory.weights)
    R, wanted, acceleration = zeros(3, 3), zeros(3), zeros(3)
    free, wrench, velocity = zeros(6), zeros(6), zeros(6)

    # estimate
    measured = call(memory.stages.take_in, input_validation.take_in_measurement, (memory, state, gains))
    write_rotation(memory.quaternion, R)
    if seen.silence[0] < 0.0 or seen.silence[0] > gains.coast:  # nothing is known any more: drift
        forces[:] = 0.0
        thrusters.forces[:] = 0.0
        memory.report[15] = seen.silence[0]
        return

    # failed thrusters
    failed = call(
        memory.stages.detect_fault,
        fault_detection.detect_fault,
        (memory.suspicion, seen, memory.attitude.residual, dynamics, thrusters, R, gains, period, measured),
    )
    if failed >= 0 or input_validation.says_more(state.thruster_health, memory.reported, thrusters.health):
        input_validation.take_in_thrusters(memory, state.thruster_health, failed)
        observer.inflate_covariance(seen, 0.01)

    # way round, bounded attraction
    call(memory.stages.improve, path_planner.improve, (memory.guide, seen.position, goal, regions, gains, period))
    if seen.silence[0] <= _STALE:
        wanted_velocity(memory.guide, seen.position, goal.velocities[0], gains, wanted)
    wanted_acceleration(wanted, seen.velocity, gains, acceleration)

    # wanted wrench
    model.free_acceleration(dynamics, R, seen.velocity, memory.omega, seen.water, seen.restoring[0], free)
    attitude_loop.propagate(memory.attitude, dynamics, R, seen.velocity, seen.water)
    attitude_loop.free_turning(memory.attitude, dynamics, memory.quaternion, memory.omega, free[3:])
    copy(seen.velocity, velocity[:3])
    copy(memory.omega, velocity[3:])
    look(memory.sight, regions, seen.position, memory.quaternion, velocity)
    share = period / (period + gains.smoothing)
    for axis in range(3):
        memory.pushed[axis] += share * (acceleration[axis] - free[axis] - memory.pushed[axis])
    _force_of(dynamics, R, memory.pushed, wrench)
    _soft_forces(memory.sight, regions, memory.weights, R, dynamics, wrench)
    call(memory.stages.aim, attitude_loop.aim, (memory.attitude, regions, seen.position, gains, period))
    attitude_loop.moment(memory.attitude, dynamics, memory.quaternion, memory.omega, gains, wrench[3:])
    work = memory.program
    for j in range(forces.size):
        work.wanted[j] = 0.0
        for k in range(6):
            work.wanted[j] += thrusters.allocator[j, k] * wrench[k]

    # barriers
    _write_push(dynamics, thrusters, R, memory.push)
    motion = Motion(
        seen.position,
        velocity,
        free,
        memory.push,
        dynamics.translational_mass[0],
        (dynamics.mass[3, 3] + dynamics.mass[4, 4] + dynamics.mass[5, 5]) / 3.0,
        gains.braking_share * _braking(dynamics, thrusters),
        _SPREADS * observer.position_spread(seen) + 0.5 * gains.acceleration * period**2,
    )
    rows = call(
        memory.stages.write_rows,
        write_rows,
        (work, memory.sight, regions, memory.weights, motion, thrusters.lower, thrusters.upper, gains),
    )

    # quadratic program
    steps = call(
        memory.stages.solve,
        quadratic_program.solve,
        (work, rows, thrusters.inverse, thrusters.lower, thrusters.upper, forces),
    )
    copy(forces, thrusters.forces)
    memory.estimate[0] = seen.restoring[0]
    copy(memory.attitude.moments, memory.estimate[1:])
    _report(memory.report, seen, memory.guide.cost[0], memory.guide.points[0], thrusters.health, wanted)
    _report_program(memory.report, work.multipliers, work.price, rows, steps)


@part
def _force_of(dynamics: Dynamics, R: Array, acceleration: Array, out: Array) -> None:
    """Write the body force [N] that gives an acceleration, world frame, into out[:3]."""
    for i in range(3):
        out[i] = 0.0
        for k in range(3):
            along = 0.0
            for axis in range(3):
                along += R[axis, k] * acceleration[axis]
            out[i] += dynamics.mass[i, k] * along


@part
def _soft_forces(
    sight: Sight, regions: PackedRegions, weights: Array, R: Array, dynamics: Dynamics, wrench: Array
) -> None:
    """Add the push of violated soft regions of place (22), -alpha_i g_i grad g_i / |grad g_i|.

    Each at most what the thrusters can always give.
    """
    most = dynamics.translational_mass[0] * _least(dynamics.braking)
    for i in range(regions.kinds.size):
        if regions.hard[i] or not sight.values[i] > 0.0 or regions.kinds[i] >= _ATTITUDE:
            continue
        size = np.sqrt(sight.gradients[i, 0] ** 2 + sight.gradients[i, 1] ** 2 + sight.gradients[i, 2] ** 2)
        if not size > 0.0:
            continue
        push = min(regions.gains[i] * weights[i] * sight.values[i], most)
        for k in range(3):
            for axis in range(3):
                wrench[k] -= push * R[axis, k] * sight.gradients[i, axis] / size


@part
def _write_push(dynamics: Dynamics, thrusters: Thrusters, R: Array, push: Array) -> None:
    """Write the acceleration of one newton of each thruster, shape (6, m), as `barrier.Motion` has it."""
    push[:, :] = 0.0
    for j in range(thrusters.health.size):
        for i in range(6):
            body = 0.0
            for k in range(6):
                body += dynamics.inverse_mass[i, k] * thrusters.matrix[k, j]
            if i >= 3:
                push[i, j] = body
            else:
                for axis in range(3):
                    push[axis, j] += R[axis, i] * body


@part
def _least(values: Array) -> float:
    least: float = values[0]
    for i in range(values.size):
        least = min(least, values[i])
    return least


@part
def _braking(dynamics: Dynamics, thrusters: Thrusters) -> float:
    """Return the deceleration [m/s2] of the worst direction with one thruster lost: the one that is, or any.

    With more lost, half of that for each; a rule of thumb.
    """
    worst, lost = _least(dynamics.braking), 0
    for j in range(thrusters.health.size):
        if thrusters.health[j] == 0.0:
            worst = dynamics.braking[j] if lost == 0 else 0.5 * min(worst, dynamics.braking[j])
            lost += 1
    return worst


@part
def _report(report: Array, seen: Estimate, cost: float, points: int, health: Array, wanted: Array) -> None:
    """Write what `DIAGNOSTICS` says of estimate, way and thrusters."""
    copy(seen.position, report[:3])
    copy(seen.velocity, report[3:6])
    copy(seen.water, report[6:8])
    report[8] = np.sqrt(wanted[0] ** 2 + wanted[1] ** 2 + wanted[2] ** 2)
    report[9] = cost
    report[10] = points - 1
    report[14] = 0.0
    for j in range(health.size):
        if health[j] == 0.0:
            report[14] = j + 1
    report[15] = seen.silence[0]


@part
def _report_program(report: Array, multipliers: Array, price: Array, rows: int, steps: int) -> None:
    """Write what `DIAGNOSTICS` says of barriers and quadratic program."""
    active, yielding = 0, 0.0
    for i in range(rows):
        if multipliers[i] > 0.0:
            active += 1
            yielding = max(yielding, multipliers[i] * price[i])
    report[11], report[12], report[13] = active, yielding, steps


def _stages(memory: DeployableMemory, gains: DeployableGains) -> Stages:
    """Return the addresses of the stages, for arguments such as a step gives them."""
    m, n = memory.reported.size, memory.weights.size
    three, forces, R, regions = np.zeros(3), np.zeros(m), np.zeros((3, 3)), pack([])
    state, thrusters, seen = VehicleState(three, np.zeros(4), np.zeros(6), forces), memory.thrusters, memory.observed
    motion, bounds = Motion(three, np.zeros(6), np.zeros(6), memory.push, 0.0, 0.0, 0.0, 0.0), (forces, forces)
    reason = (memory.suspicion, seen, three, memory.dynamics, thrusters, R, gains, 0.0, False)
    return Stages(
        take_in=pointer_to(input_validation.take_in_measurement, (memory, state, gains)),
        detect_fault=pointer_to(fault_detection.detect_fault, reason),
        improve=pointer_to(path_planner.improve, (memory.guide, three, regions, regions, gains, 0.0)),
        aim=pointer_to(attitude_loop.aim, (memory.attitude, regions, three, gains, 0.0)),
        write_rows=pointer_to(write_rows, (memory.program, memory.sight, regions, np.zeros(n), motion, *bounds, gains)),
        solve=pointer_to(quadratic_program.solve, (memory.program, 0, R, *bounds, forces)),
    )


class DeployableLaw(CompiledLaw):
    """Regions kept, goal reached, within real thrusters.

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
        How many secondary regions it will be given.

    Raises
    ------
    LawError
        If gains, attitude or period cannot be.
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
        self.gains = self.checked(gains)
        desired = validate_quaternion(desired_quaternion)
        m = vehicle.thruster_matrix.shape[1]
        self._memory = DeployableMemory(
            period=np.array([checked_period(period)]),
            estimate=np.zeros(4),
            report=np.zeros(len(DIAGNOSTICS)),
            dynamics=dynamics_of(vehicle, least_forces(vehicle)),
            thrusters=thrusters_of(vehicle),
            observed=estimate_of_nothing(),
            attitude=attitude_of(desired),
            suspicion=suspicion_of(m),
            guide=guide_of_nothing(n_regions, _SEED),
            sight=sight_of(n_regions),
            program=workspace((1 + FACES) * n_regions, m),
            quaternion=desired.copy(),
            omega=np.zeros(3),
            weights=np.ones(n_regions),
            reported=np.ones(m),
            pushed=np.zeros(3),
            push=np.zeros((6, m)),
            stages=Stages(),
        )

    @cached_property
    def memory(self) -> DeployableMemory:
        """What it carries on, with the addresses of the stages: they are compiled when it is first asked for."""
        return self._memory._replace(stages=_stages(self._memory, self.gains))

    def __getstate__(self) -> dict[str, Any]:
        """Return what is pickled: not the addresses, which are this process's."""
        return {name: value for name, value in vars(self).items() if name != "memory"}

    @classmethod
    def for_vehicle(
        cls, vehicle: VehicleModel, gains: Any, desired_quaternion: Array, period: float, n_regions: int
    ) -> DeployableLaw:
        """Return the law for a vehicle, as `CompiledLaw.for_vehicle`."""
        return cls(vehicle, gains, desired_quaternion, period, n_regions)

    @classmethod
    def checked(cls, gains: Any) -> Any:
        """Return gains if the law can work with them."""
        return check_gains(gains)

    def set_attitude(self, quaternion: Array) -> None:
        """Keep another attitude, a unit `quaternion`, where no region asks for one, from the next step on."""
        self.memory.attitude.preferred[:] = validate_quaternion(quaternion)
