"""One step of the controller FMU: the co-simulation's step without plant and arbiter."""

# It is of Jacobi type: weights and motion are those at the beginning of the step, and outputs act from its end on.

from __future__ import annotations

from typing import Annotated

import numpy as np

from controller.navigation.measurements import N_SENSORS
from controller.stack_array import Shape, VectorM, VectorN
from controller.state import State
from cosim.step.decision import update_inputs, weigh
from cosim.step.mission_legs import completed_steps
from cosim.step.one_step import decide
from cosim.step.sensing import estimate_state, position_is_known, report_failures
from cosim.step.step_model import Array, StepData, StepModel

Motion13 = Annotated[Array, Shape(13)]
PerSensor = Annotated[Array, Shape(N_SENSORS)]


class ControllerInputs(State):
    """Inputs and initial motion that the importer sets; the weights are in `StepData`."""

    motion: Motion13  # position, quaternion and velocity of the vehicle
    start: Motion13  # the same at the start, for masters that begin with zeros
    samples: Array  # (15,) of the sensors; (0,) without sensors
    sample_times: Array  # (5,) s
    end: float  # s, end of the step
    controls: int  # 1 if the law runs in the step


class ControllerOutputs(State):
    """Outputs of the FMU that `StepData` lacks, and counters of the failures and outages sent to the plant."""

    thrusts: VectorM  # N; (0,) without thrusters
    lost: VectorM  # lost fraction of each thruster's force
    outages: PerSensor  # probability that a sensor loses a sample by an outage
    values: VectorN  # g of goal and regions at the last known position
    clearances: VectorN  # m or rad
    failures: int  # number of failures sent to the plant
    changes: int  # number of sensor changes (outages and their ends) sent to the plant


def step_controller(model: StepModel, data: StepData, inputs: ControllerInputs, out: ControllerOutputs) -> None:
    """Run one step: read the inputs, estimate, compute forces, and write the outputs at the end of the step."""
    read_inputs(data, inputs)
    report_failures(model, data)
    weigh(model, data)
    estimate_state(model, data)
    decide(model, data, True, inputs.controls > 0)
    data.now = inputs.end
    if position_is_known(model, data):
        update_inputs(model, data)
        out.values = data.true_evaluation.values if model.exact else data.arbiter_evaluation.values
        out.clearances = data.true_evaluation.clearances if model.exact else data.arbiter_evaluation.clearances
    schedule_failures(model, data, out)
    stuck = data.stuck[: out.thrusts.size]
    out.thrusts[:] = np.where(np.isfinite(stuck), stuck, data.thrusts)


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
    return bool(np.all(values == 0.0))


def schedule_failures(model: StepModel, data: StepData, out: ControllerOutputs) -> None:
    """Send the plant the thruster failures and sensor outages that are due by the end of the step."""
    i, k = out.failures, completed_steps(model, data.now)
    while i < model.failed.size and model.failure_steps[i] <= k:
        thruster, remaining = model.failed[i], model.remaining[i]
        if remaining >= 0.0:
            out.lost[thruster] = 1.0 - remaining
        else:
            data.stuck[thruster] = out.thrusts[thruster]
        i += 1
    out.failures = i
    i = out.changes
    while i < model.outage_steps.size and model.outage_steps[i] <= k:
        out.outages[model.outage_sensors[i]] = float(model.outage_losses[i] == 1.0)
        i += 1
    out.changes = i
