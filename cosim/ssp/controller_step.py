"""One step of the controller FMU: the co-simulation's step without plant and arbiter."""

# It is of Jacobi type: weights and motion are those at the beginning of the step, and outputs act from its end on.

from __future__ import annotations

import math
from typing import NamedTuple

from cosim.step.decision import update_inputs, weigh
from cosim.step.one_step import decide
from cosim.step.region_positions import completed_steps
from cosim.step.sensing import estimate_state, position_is_known, report_failures
from cosim.step.step_model import Array, Integers, StepData, StepModel


class ControllerInputs(NamedTuple):
    """Inputs and initial motion that the importer sets; the weights are in `StepData`."""

    motion: Array  # (13,) position, quaternion and velocity of the vehicle
    start: Array  # (13,) the same at the start, for masters that begin with zeros
    samples: Array  # (15,) of the sensors; (0,) without sensors
    sample_times: Array  # (5,) s
    end: Array  # (1,) s, end of the step
    controls: Integers  # (1,) 1 if the law runs in the step


class ControllerOutputs(NamedTuple):
    """Outputs of the FMU that `StepData` lacks, and counters of the failures and outages sent to the plant."""

    thrusts: Array  # (m,) N; (0,) without thrusters
    lost: Array  # (m,) lost fraction of each thruster's force
    outages: Array  # (5,) probability that a sensor loses a sample by an outage
    values: Array  # (n + 1,) g of goal and regions at the last known position
    clearances: Array  # (n + 1,) m or rad
    failures: Integers  # (1,) number of failures sent to the plant
    changes: Integers  # (1,) number of sensor changes (outages and their ends) sent to the plant


def step_controller(model: StepModel, data: StepData, inputs: ControllerInputs, out: ControllerOutputs) -> None:
    """Run one step: read the inputs, estimate, compute forces, and write the outputs at the end of the step."""
    read_inputs(data, inputs)
    report_failures(model, data)
    weigh(model, data)
    estimate_state(model, data)
    decide(model, data, True, inputs.controls[0] > 0)
    data.now[0] = inputs.end[0]
    if position_is_known(model, data):
        update_inputs(model, data)
        out.values[:] = data.true_evaluation.values if model.exact else data.arbiter_evaluation.values
        out.clearances[:] = data.true_evaluation.clearances if model.exact else data.arbiter_evaluation.clearances
    schedule_failures(model, data, out)
    for j in range(out.thrusts.size):
        out.thrusts[j] = data.stuck[j] if math.isfinite(data.stuck[j]) else data.thrusts[j]


def read_inputs(data: StepData, inputs: ControllerInputs) -> None:
    """Write the vehicle's motion and the sensor samples."""
    # Inputs are all zero until the plant has given its first outputs.
    motion, state = inputs.start if is_zero(inputs.motion) else inputs.motion, data.true_state
    state.position[:], state.quaternion[:], state.velocity_body[:] = motion[:3], motion[3:7], motion[7:]
    if is_zero(state.quaternion):
        state.quaternion[0] = 1.0
    if not is_zero(inputs.samples):
        data.measurements.values[:] = inputs.samples
        data.measurements.times[:] = inputs.sample_times


def is_zero(values: Array) -> bool:
    """Return True if all numbers are 0."""
    zero = True
    for i in range(values.size):
        zero = zero and values[i] == 0.0
    return zero


def schedule_failures(model: StepModel, data: StepData, out: ControllerOutputs) -> None:
    """Send the plant the thruster failures and sensor outages that are due by the end of the step."""
    i, k = out.failures[0], completed_steps(model, data.now[0])
    while i < model.failed.size and model.failure_steps[i] <= k:
        thruster, remaining = model.failed[i], model.remaining[i]
        if remaining >= 0.0:
            out.lost[thruster] = 1.0 - remaining
        else:
            data.stuck[thruster] = out.thrusts[thruster]
        i += 1
    out.failures[0] = i
    i = out.changes[0]
    while i < model.outage_steps.size and model.outage_steps[i] <= k:
        out.outages[model.outage_sensors[i]] = float(model.outage_losses[i] == 1.0)
        i += 1
    out.changes[0] = i
