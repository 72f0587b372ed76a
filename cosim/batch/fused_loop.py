"""The fused loop: a whole flight in C, which steps the FMU through its functions."""

# The stages are those of `cosim.simulation.master`, with the same functions: measure, regions, arbiter, law,
# allocation, FMU. The metrics of the flight are computed from the true motion at every plant step.

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from controller import CompiledLaw, VehicleState
from controller.allocation import allocate
from controller.compiling.function import BoundCall
from controller.law import NOTHING_EXPECTED
from controller.navigation.navigator import navigate
from controller.regions import Sphere
from controller.regions.kinds import FIRST_OF_ATTITUDE
from controller.regions.region_set import PackedRegions, clearance_of_pose, clearance_of_sphere
from controller.translator.foreign import POINTER, call_c
from cosim.batch.c_calls import fmi_do_step, fmi_get, fmi_set, seconds
from cosim.batch.flight_config import (
    Allocator,
    BoundArbiter,
    BoundLaw,
    FlightConfig,
    FlightMetrics,
    FlightOutputs,
    Workspace,
)
from cosim.simulation.arbiter_inputs import compute_inputs, write_arbiter_state
from cosim.simulation.compiled_rules import BoundRules
from fuzzy_arbiter import System
from plant_fmu.running.native import Native

Array = NDArray[np.float64]

_SPHERE, _ATTITUDE = Sphere.kind, FIRST_OF_ATTITUDE
_WORDS = (POINTER,)  # argument of the C functions of law and arbiter


def fly(  # noqa: C901 - one loop, as a whole
    setup: FlightConfig,
    native: Native,
    effectiveness: Native,
    losses: Native,
    allocator: Allocator,
    law: BoundLaw,
    arbiter: BoundArbiter,
    workspace: Workspace,
    out: FlightOutputs,
) -> None:
    """Fly from start to end."""
    m, n, inputs = setup.thrusters, setup.regions.kinds.size, native.inputs
    state, weights, by_criterion = workspace.state, workspace.weights, workspace.by_criterion
    clearances, goal_clearance = workspace.clearances, workspace.goal_clearance
    arbiter_state = workspace.arbiter_state
    position, quaternion = native.outputs[:3], native.outputs[3:7]
    first_inside, last_entered, inside = -1, -1, False
    goal_index, stayed = 0, 0
    min_clearance, min_angle, max_goal_clearance = np.inf, np.inf, -np.inf
    effort, thrust_effort, variation, violation = 0.0, 0.0, 0.0, 0.0
    max_force, max_speed, worst, refused = 0.0, 0.0, 0.0, -1
    failures, known_failures, outages = 0, 0, 0
    bound, excess = np.nan, -np.inf
    timed = setup.clock.size > 0
    if not fmi_get(native):
        refused = 0

    for k in range(setup.steps + 1):
        if refused >= 0:
            break
        now = k * setup.step
        # failures and outages
        while failures < setup.failed.size and k == setup.failure_steps[failures]:
            j, remaining = setup.failed[failures], setup.remaining[failures]
            if remaining >= 0.0:
                effectiveness.inputs[j] = remaining
            else:
                workspace.stuck[j] = inputs[j]
            if setup.report_failures and not remaining > 0.0:
                state.thruster_health[j] = 0.0
                known_failures = min(known_failures + 1, allocator.lower.shape[0] - 1)
            failures += 1
            if not fmi_set(effectiveness):
                refused = k
        while outages < setup.outage_steps.size and k == setup.outage_steps[outages]:
            losses.inputs[setup.outage_sensors[outages]] = setup.outage_losses[outages]
            outages += 1
            if not fmi_set(losses):
                refused = k
        # metrics
        if setup.moving or k == 0:
            _move(setup, now)
        if goal_index > 0:
            for axis in range(3):
                setup.goal.shifts[0, axis] += setup.goal_places[goal_index - 1, axis]
        _clearances(setup.regions, position, quaternion, clearances, workspace.scratch)
        _clearances(setup.goal, position, quaternion, goal_clearance, workspace.scratch)
        for i in range(n):
            if setup.regions.hard[i]:
                if setup.regions.kinds[i] < _ATTITUDE:
                    min_clearance = _least(clearances[i], min_clearance)
                    if not np.isnan(bound):
                        excess = max(excess, bound - clearances[i])
                else:
                    min_angle = _least(clearances[i], min_angle)
            if k < setup.steps and not clearances[i] >= 0.0:
                violation -= setup.priorities[i] * clearances[i] * setup.step
        shown_index = goal_index  # a goal that is reached moves from the next step on
        if goal_index == setup.goal_places.shape[0]:
            max_goal_clearance = max(max_goal_clearance, goal_clearance[0])
            if goal_clearance[0] >= 0.0 and not inside:
                last_entered = k
                if first_inside < 0:
                    first_inside = k
            inside = goal_clearance[0] >= 0.0
        else:
            stayed = stayed + 1 if goal_clearance[0] >= 0.0 else 0
            if stayed > setup.goal_stay:
                goal_index, stayed = goal_index + 1, 0
        u, v, w = native.outputs[7], native.outputs[8], native.outputs[9]
        max_speed = max(max_speed, math.sqrt(u * u + v * v + w * w))
        controls = k % setup.control_every == 0
        if controls:
            for i in range(4):
                out.estimate[i] = law.estimate[i]
        if k == setup.steps or refused >= 0:
            break
        # measure
        arbitrates = k % setup.arbiter_every == 0
        if setup.through_sensors:
            _navigate(setup, now, native.outputs[16 + m :], workspace)
        elif not setup.exact or controls or arbitrates:
            _measure(setup, k, now, native.outputs, state)
        # regions and arbiter: while the position is lost, the last weights hold
        if arbitrates and _is_finite(state.position):
            arbiter_clearances = clearances
            write_arbiter_state(state, law.expected, arbiter_state)
            if not setup.exact:
                arbiter_clearances = workspace.arbiter_clearances
                _clearances(
                    setup.regions, arbiter_state.position, arbiter_state.quaternion,
                    arbiter_clearances, workspace.scratch,
                )  # fmt: skip
            workspace.now[0] = now
            compute_inputs(
                setup.inputs,
                setup.goal,
                setup.regions,
                arbiter_state,
                workspace.now,
                arbiter_clearances,
                workspace.signals,
            )
            call_c(arbiter.address, _WORDS, arbiter.words)
            for i in range(n):
                weights[i] = by_criterion[setup.criteria[i]]
        # law and allocation
        if controls:
            started = seconds(setup.clock, workspace.ticks) if timed else 0.0
            steers = not setup.through_sensors or workspace.navigation.started[0] > 0.0  # there is a state estimate
            if steers:
                call_c(law.address, _WORDS, law.words)
                bound = law.report[setup.bound] if setup.bound >= 0 else np.nan
            else:
                inputs[:] = 0.0
            if steers and m > 0 and law.is_wrench:
                lower, upper = allocator.lower[known_failures], allocator.upper[known_failures]
                allocate(allocator.inverse[known_failures], lower, upper, allocator.direction, workspace.wrench, inputs)
            if timed:
                worst = max(worst, seconds(setup.clock, workspace.ticks) - started)
            if out.reasons.shape[0]:
                _give_reasons(out.reasons[k // setup.control_every], out.estimate, shown_index, workspace)
            if out.trace.shape[0]:
                _trace(out.trace[k // setup.control_every], now, native, state.position, by_criterion, law.report)
            for j in range(inputs.size):
                variation += abs(inputs[j] - workspace.before[j])
                workspace.before[j] = inputs[j]
                if math.isfinite(workspace.stuck[j]):
                    inputs[j] = workspace.stuck[j]
            if not fmi_set(native):
                refused = k
                break
        # plant
        if not (fmi_do_step(native, now, setup.step) and fmi_get(native)):
            refused = k
            break
        if controls and out.reasons.shape[0]:
            given = native.outputs[13 : 16 + m]
            for j in range(given.size):
                out.reasons[k // setup.control_every, out.reasons.shape[1] - given.size + j] = given[j]
        for j in range(m):
            thrust_effort += abs(native.outputs[13 + j]) * setup.step
        x, y, z = native.outputs[13 + m], native.outputs[14 + m], native.outputs[15 + m]
        force = math.sqrt(x * x + y * y + z * z)
        effort += force * setup.step
        max_force = max(max_force, force)
    metrics = out.metrics
    metrics[0], metrics[1], metrics[2] = first_inside, last_entered, inside
    metrics[3], metrics[4], metrics[5] = min_clearance, min_angle, max_goal_clearance
    metrics[6], metrics[7], metrics[8] = effort, thrust_effort, variation
    metrics[9], metrics[10], metrics[11], metrics[12] = max_force, max_speed, worst, refused
    metrics[13], metrics[14] = excess, violation


def _measure(setup: FlightConfig, k: int, now: float, true_state: Array, state: VehicleState) -> None:
    """Write the measured state at plant step `k` as `simulation.sensor.Sensor` does."""
    for i in range(4):
        state.quaternion[i] = true_state[3 + i]
    for i in range(3):
        state.velocity_body[3 + i] = true_state[10 + i]
    lost = setup.dead_from <= now < setup.dead_until
    if lost and setup.frozen and now > 0.0:
        return
    control = k // setup.control_every
    for i in range(3):
        state.position[i], state.velocity_body[i] = true_state[i], true_state[7 + i]
        if lost and not setup.frozen:
            state.position[i] = state.velocity_body[i] = np.nan
        elif not (lost or setup.exact):
            state.position[i] += setup.noise[control, i]
            state.velocity_body[i] += setup.noise[control, 3 + i]


def _navigate(setup: FlightConfig, now: float, sensed: Array, workspace: Workspace) -> None:
    """Write the estimated state at a time [s] as `SensorNavigation` does; `sensed` are `SENSOR_OUTPUTS`."""
    samples = workspace.measurements
    for i in range(samples.values.size):
        samples.values[i] = sensed[i]
    for i in range(samples.times.size):
        samples.times[i] = sensed[samples.values.size + i]
    workspace.now[0] = now
    navigate(samples, workspace.now, setup.sensors, workspace.navigation, workspace.state)


def _is_finite(position: Array) -> bool:
    return math.isfinite(position[0]) and math.isfinite(position[1]) and math.isfinite(position[2])


def _move(setup: FlightConfig, now: float) -> None:
    """Move all regions to their positions at a time [s]."""
    for regions in (setup.goal, setup.regions):
        for i in range(regions.kinds.size):
            for axis in range(3):
                regions.shifts[i, axis] = regions.velocities[i, axis] * now


def _clearances(
    regions: PackedRegions, position: Array, quaternion: Array, clearances: Array, workspace: Array
) -> None:
    """Write the clearance of each region, [m] or [rad], at a pose into `clearances`."""
    for i in range(regions.kinds.size):
        if regions.kinds[i] == _SPHERE:
            clearances[i] = clearance_of_sphere(regions, i, position)
        else:
            clearances[i] = clearance_of_pose(regions, i, position, quaternion, workspace)


def _least(clearance: float, least: float) -> float:
    """Return the lesser of two numbers, NaN if one of them is."""
    return clearance if clearance < least or np.isnan(clearance) else least


def _trace(row: Array, now: float, native: Native, position: Array, weights: Array, report: Array) -> None:
    m = native.inputs.size
    row[0] = now
    row[1:14] = native.outputs[:13]
    row[14:17] = position
    c = weights.size
    row[17 : 17 + c] = weights
    row[17 + c : 17 + c + m] = native.inputs
    row[17 + c + m :] = report


def _give_reasons(row: Array, estimate: Array, place: int, workspace: Workspace) -> None:
    n, c, m = workspace.clearances.size, workspace.signals.memberships.size, workspace.signals.inputs.size
    row[0] = workspace.goal_clearance[0]
    row[1 : 1 + n] = workspace.clearances
    row[1 + n : 1 + n + c] = workspace.signals.memberships
    row[1 + n + c : 1 + n + c + m] = workspace.signals.inputs
    row[1 + n + c + m : 5 + n + c + m] = estimate
    row[5 + n + c + m : 11 + n + c + m] = workspace.wrench
    row[11 + n + c + m] = place


def fly_law(
    setup: FlightConfig,
    native: Native,
    effectiveness: Native,
    losses: Native,
    allocator: Allocator,
    law: CompiledLaw,
    rules: System,
    workspace: Workspace,
    trace: Array,
) -> tuple[FlightMetrics, Array]:
    """Compile `fly`, and fly with a law; returns (4,) [N, N m]."""
    is_wrench = law.output == "wrench"
    forces = workspace.wrench if setup.thrusters and is_wrench else native.inputs
    decide = law.bound(workspace.state, setup.goal, setup.regions, workspace.weights, forces)
    expected = NOTHING_EXPECTED if setup.exact else law.expected
    bound = BoundLaw(decide.address, decide.words, is_wrench, law.estimate, expected, law.report)
    weigh = BoundRules(rules, workspace.signals.inputs, workspace.by_criterion)
    arbiter = BoundArbiter(weigh.address, weigh.words)
    out = FlightOutputs(np.zeros(len(FlightMetrics._fields)), np.zeros(4), trace, np.zeros((0, 0)))
    BoundCall(fly, (setup, native, effectiveness, losses, allocator, bound, arbiter, workspace, out)).call()
    decide.raise_error()
    weigh.raise_error()
    metrics = FlightMetrics(*out.metrics.tolist())
    return metrics._replace(inside=bool(metrics.inside)), out.estimate
