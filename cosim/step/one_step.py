"""The order of one step of the co-simulation."""

from __future__ import annotations

import numpy as np

from cosim.step.arbiter_inputs import write_arbiter_state
from cosim.step.decision import arbitrate, control, update_delayed_weights
from cosim.step.mission_legs import advance_mission
from cosim.step.plant_calls import PlantCalls, fmi_do_step, fmi_get, fmi_get_flags, fmi_set
from cosim.step.region_positions import evaluate, move_regions
from cosim.step.sensing import fail_thrusters, measure, read_outputs
from cosim.step.step_model import (
    LOCATED,
    MEASURED,
    PLANT_STEP,
    Array,
    Integers,
    StepData,
    StepModel,
    call_all,
    call_back,
)


def step(model: StepModel, data: StepData, plant: PlantCalls, k: int) -> None:
    """Do step `k`; the last one does not advance the plant."""
    data.k = k
    data.now = k * model.step
    fail_thrusters(model, data, plant)
    if model.jacobi and k > 0:
        update_delayed_weights(model, data)
    measure(model, data, plant)
    call_all(data, data.exchanges)
    decide(model, data, k % model.arbiter_every == 0, k % model.control_every == 0)
    if k < model.steps and data.failed_step < 0:
        step_plant(model, data, plant)


def decide(model: StepModel, data: StepData, arbitrates: bool, controls: bool) -> None:
    """Evaluate the regions, and decide by the measured state."""
    call_back(data, MEASURED)
    if data.calls[MEASURED] != 0 and data.failed_step >= 0:
        return
    locate(model, data)
    call_back(data, LOCATED)
    if data.failed_step >= 0:
        return
    if arbitrates and not model.jacobi:
        arbitrate(model, data)
    if controls:
        control(model, data)


def advance(model: StepModel, data: StepData, plant: PlantCalls, span: Integers, rows: Array) -> None:
    """Do span[1] steps from step span[0] on, and copy their rows; span[2] counts those that succeeded."""
    span[2] = 0
    for i in range(span[1]):
        step(model, data, plant, span[0] + i)
        if data.failed_step >= 0:
            break
        span[2] = i + 1
        if rows.shape[0] > 0:
            rows[i] = data.row


def show_start(model: StepModel, data: StepData, plant: PlantCalls) -> None:
    """Measure the initial state without noise, and evaluate the regions, as a run does that waits for its start."""
    data.k = 0
    data.now = 0.0
    read_outputs(data, plant)
    data.state.position[:] = data.true_state.position
    data.state.quaternion[:] = data.true_state.quaternion
    data.state.velocity_body[:] = data.true_state.velocity_body
    locate(model, data)


def locate(model: StepModel, data: StepData) -> None:
    """Move the regions, evaluate them at the arbiter's pose and at the true one, and advance the mission."""
    if model.moving:
        move_regions(model, data)
    if model.for_record or data.k % model.arbiter_every == 0:
        write_arbiter_state(data.state, data.expected, data.arbiter_state)
        if not model.exact:
            evaluate(model, data, data.arbiter_state, data.arbiter_evaluation)
    evaluate(model, data, data.true_state, data.true_evaluation)
    advance_mission(model, data)


def step_plant(model: StepModel, data: StepData, plant: PlantCalls) -> None:
    """Send the inputs after their delay, those of stuck thrusters as they are, and advance the plant."""
    native, own, delay = plant.native, data.stuck.size, data.delayed.shape[0]
    for i in range(own):
        sent = data.inputs[i]
        if delay > 0:
            sent = data.delayed[data.k % delay, i]
            data.delayed[data.k % delay, i] = data.inputs[i]
        native.inputs[i] = sent if np.isnan(data.stuck[i]) else data.stuck[i]
    call_all(data, data.components)
    data.inputs[own:] = native.inputs[own:]  # of a coupled plant: its caller sets them, or components
    if data.failed_step >= 0:
        return
    if fmi_set(native) and fmi_do_step(native, data.now, model.step) and fmi_get(native) and fmi_get_flags(native):
        call_back(data, PLANT_STEP)
    else:
        data.failed_step = data.k
    if data.failed_step < 0:
        first = data.first_applied
        data.outputs[first:] = native.outputs[first:]
        data.flags[:] = native.flags
