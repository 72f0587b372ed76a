"""PD control with a disturbance observer for integral action, behind a second-order control-barrier-function filter."""

# The nominal force is that of `pd`, less the disturbance from an observer:
#
#     f = -k_p1 sat(p - p_d) - k_v1 v + push - M d-hat
#
# The observer compares measured velocities with those that the nominal model (11) predicts in still water; for each of
# the six axes, with the acceleration a by model and thrusters over a period T,
#
#     v-hat <- v-hat + T (a + d-hat) + (1 - z^2) e,   d-hat <- d-hat + (1 - z)^2 / T e,   z = 1 / (1 + omega T)
#
# where e is measured less predicted: two poles at z, omega being `observer`. d-hat is the integral of e, so that net
# weight, current and a lost thruster leave no steady error (extended state observer: J. Han, IEEE Trans. Ind. Electron.
# 56(3), 2009). A position is filtered with the same pole.
#
# The filter changes the thruster forces u as little as possible. With h the clearance of a hard region less `margin`, n
# its gradient and v its rate against the region's,
#
#     h'' + (k_1 + k_2) h' + k_1 k_2 h >= 0,   h' = n^T v,   h'' = n^T (A u + a_free + d-hat) + (dn/dt)^T v
#
# keeps h >= 0 if it holds at all times and k_1 h + h' >= 0 at the start: an exponential barrier (Nguyen and Sreenath,
# American Control Conference, 2016), the linear case of high-order barriers (Xiao and Belta, IEEE CDC, 2019). `pull_in`
# and `brake` are k_1 and k_2. Thruster limits are in the quadratic program, and a slack with a price, since limits and
# barriers may contradict each other. Unlike the barriers of the deployable law, these require a deceleration that grows
# with speed, whether the thrusters have it or not.
#
# None of these sources was at hand. Model, gradients and program are those of the deployable law.

from __future__ import annotations

from typing import ClassVar, NamedTuple

import numpy as np

from controller import quadratic_program
from controller.arithmetic import square
from controller.law import (
    Array,
    CompiledLaw,
    LawMemory,
    Output,
    VehicleModel,
    VehicleState,
    validate_period,
    validate_quaternion,
)
from controller.laws.deployable import model
from controller.laws.deployable.barrier import RegionObservation, add_row, observe_gradient, observe_regions
from controller.laws.deployable.model import Dynamics, Thrusters
from controller.potential_field import Field, evaluate_field, max_pull, set_point_error
from controller.quadratic_program import Workspace
from controller.quaternion import error, rotation_matrix
from controller.regions.region_set import PackedRegions
from controller.stack_array import Columns6, Matrix3, Vector3, Vector6, array, zeros

_PRICE = 1e-6  # price of slack: squared force that costs as much as the square of slack times mass


class PidCbfGains(NamedTuple):
    """Defaults: by ``python -m benchmarks baselines --draws 120 --seed 0``, where no other source is given."""

    k_p1: float = 149.4  # N/m, gain of the position error
    k_p2: float = 36.0  # N m, gain of the attitude error, section VII
    k_v1: float = 138.2  # N s/m, damping of translation
    k_v2: float = 40.0  # N m s/rad, damping of rotation, section VII
    limit: float = 180.6  # N, greatest pull to the set point
    inset: float = 0.5  # m, clearance of the set point within the goal region: the center of the scenes' goals
    repulsion: float = 44.62  # N/m, slope of the push of a region of gain 1
    reach: float = 1.277  # m, clearance at which regions begin to push
    observer: float = 1.243  # rad/s, bandwidth of the observer
    pull_in: float = 1.057  # 1/s, k_1 of a barrier
    brake: float = 1.142  # 1/s, k_2 of a barrier
    margin: float = 0.05938  # m, or rad, clearance kept from hard regions


class PidCbfMemory(LawMemory):
    """State between steps, and work arrays; of six numbers three are linear in NED, three angular in body axes."""

    started: float  # 1 after the first measurement
    position: Vector3  # m, NED, estimated
    velocity: Vector6  # m/s, rad/s, over ground, estimated
    disturbance: Vector6  # m/s2, rad/s2: d-hat
    acceleration: Columns6  # acceleration by one newton of each thruster
    field: Field
    observation: RegionObservation
    dynamics: Dynamics
    thrusters: Thrusters
    program: Workspace


def step(
    state: VehicleState,
    goal: PackedRegions,
    regions: PackedRegions,
    weights: Array,
    gains: PidCbfGains,
    memory: PidCbfMemory,
    forces: Array,
) -> None:
    """Write the forces as `CompiledLaw.step`; all regions push in full, and hard ones are barriers."""
    dynamics, thrusters, field, work = memory.dynamics, memory.thrusters, memory.field, memory.program
    mass, velocity, R = dynamics.translational_mass, memory.velocity, rotation_matrix(state.quaternion)
    _update_thrusters(thrusters, state.thruster_health)
    # observer
    observe(memory, state, R, gains)
    # nominal forces
    still = model.Loads(zeros(3), 0.0, zeros(3), 0.0, 1.0)
    free = model.free_acceleration(dynamics, R, velocity[:3], velocity[3:], still) + memory.disturbance
    evaluate_field(state._replace(position=memory.position), goal, regions, gains.repulsion, gains.reach, field)
    set_point_error(field, gains.inset, max_pull(gains, memory.speed_limit) / gains.k_p1)
    e_att = error(memory.desired_quaternion, state.quaternion)[1:]  # (23)
    inertia = array(dynamics.mass[3, 3], dynamics.mass[4, 4], dynamics.mass[5, 5])
    force = -gains.k_p1 * field.error - gains.k_v1 * velocity[:3] + field.push - mass * memory.disturbance[:3]
    moment = -gains.k_p2 * e_att - (gains.k_v2 * velocity[3:] + inertia * memory.disturbance[3:])
    work.nominal = thrusters.allocator @ np.concatenate((R.T @ force, moment))
    # filter
    observe_regions(memory.observation, regions, memory.position, state.quaternion, velocity)
    model.write_thruster_acceleration(dynamics, thrusters, R, R, memory.acceleration, memory.acceleration)
    rows = _write_rows(memory, regions, free, gains)
    quadratic_program.solve(work, rows, thrusters.inverse, thrusters.lower, thrusters.upper, forces)
    thrusters.forces = forces
    memory.estimate[0] = mass * memory.disturbance[2]


def _update_thrusters(thrusters: Thrusters, health: Array) -> None:
    """Update the thrusters by their reported health."""
    changed = False
    for j in range(health.size):
        works = 1.0 if health[j] > 0.0 else 0.0
        changed = changed or works != thrusters.health[j]
        thrusters.health[j] = works
    if changed:
        model.reallocate(thrusters)


def observe(memory: PidCbfMemory, state: VehicleState, R: Matrix3, gains: PidCbfGains) -> None:
    """Propagate the observer over the last period, and correct it by the finite measurements."""
    position, velocity, disturbance, period = memory.position, memory.velocity, memory.disturbance, memory.period
    measured = np.concatenate((R @ state.velocity_body[:3], state.velocity_body[3:]))
    known = np.all(np.isfinite(state.position)) and np.all(np.isfinite(measured))
    if memory.started == 0.0:
        if known:
            memory.position, memory.velocity, memory.started = state.position, measured, 1.0
        return
    still = model.Loads(zeros(3), 0.0, zeros(3), 0.0, 1.0)
    acceleration = model.free_acceleration(memory.dynamics, R, velocity[:3], velocity[3:], still)
    acceleration += model.thrust_acceleration(memory.dynamics, memory.thrusters, R, memory.thrusters.forces)
    position += period * velocity[:3]
    velocity += period * (acceleration + disturbance)
    if known:
        z, error = 1.0 / (1.0 + gains.observer * period), measured - velocity
        position += (1.0 - z) * (state.position - position)
        velocity += (1.0 - square(z)) * error
        disturbance += square(1.0 - z) / period * error


def _write_rows(memory: PidCbfMemory, regions: PackedRegions, free: Vector6, gains: PidCbfGains) -> int:
    """Write the barrier of each hard region that the thrusters could violate; return the number of barriers."""
    # `free` is the acceleration without thrust.
    work, observation, rows = memory.program, memory.observation, 0
    n, relative = zeros(6), zeros(6)
    lower, upper, price = (
        memory.thrusters.lower,
        memory.thrusters.upper,
        _PRICE / square(memory.dynamics.translational_mass),
    )
    for i in range(regions.kinds.size):
        if not regions.hard[i]:
            continue
        exists, turning = observe_gradient(observation, regions, i, memory.velocity, n, relative)
        if not exists:
            continue
        h, rate, drift_term = observation.clearances[i] - gains.margin, float(n @ relative), float(n @ free)
        rhs = -(gains.pull_in + gains.brake) * rate - gains.pull_in * gains.brake * h - drift_term - turning
        rows = add_row(work, rows, n, memory.acceleration, rhs, price, lower, upper)
    return rows


class PidCbfLaw(CompiledLaw):
    """PD control with a disturbance observer, filtered by second-order barriers; period [s]."""

    output: ClassVar[Output] = "thrusters"
    function = staticmethod(step)
    gains_type = PidCbfGains
    gains_for = "odin"
    above_zero = ("k_p1", "observer", "pull_in", "brake")
    takes_speed = True

    def __init__(
        self, vehicle: VehicleModel, gains: PidCbfGains, desired_quaternion: Array, period: float, n_regions: int
    ) -> None:
        self.gains, self.n_regions = self.validate(gains), n_regions
        self.n_forces = m = vehicle.thruster_matrix.shape[1]
        self.memory = PidCbfMemory(
            n=n_regions,
            m=m,
            desired_quaternion=validate_quaternion(desired_quaternion),
            period=validate_period(period),
            dynamics=model.make_dynamics(vehicle, np.zeros(0)),
            thrusters=model.make_thrusters(vehicle),
            program=quadratic_program.empty_workspace(n_regions, m),
        )


LAW = PidCbfLaw
