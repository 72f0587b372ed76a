"""The beginning of a step: failures of thrusters, outages of sensors, and the measured state."""

from __future__ import annotations

import numpy as np

from controller.navigation.navigator import navigate
from cosim.step.mission_legs import completed_steps
from cosim.step.plant_calls import PlantCalls, fmi_get, fmi_set_one
from cosim.step.step_model import PLANT_SET, StepData, StepModel, call_back


def fail_thrusters(model: StepModel, data: StepData, plant: PlantCalls) -> None:
    """Fail the thrusters that are scheduled for this step, and report total failures."""
    first = data.failures
    report_failures(model, data)
    for i in range(first, data.failures):
        thruster, remaining = model.failed[i], model.remaining[i]
        if remaining >= 0.0:
            plant.effectiveness.inputs[thruster] = remaining
            call_back(data, PLANT_SET)
            if not (fmi_set_one(plant.effectiveness, thruster) and fmi_get(plant.native)):
                data.failed_step = data.k
        else:
            data.stuck[thruster] = plant.native.inputs[thruster]


def report_failures(model: StepModel, data: StepData) -> None:
    """Report total failures of thrusters that are due to law and allocation."""
    i, k = data.failures, completed_steps(model, data.now)
    while i < model.failed.size and model.failure_steps[i] <= k:
        if model.report_failures and not model.remaining[i] > 0.0:
            data.state.thruster_health[model.failed[i]] = 0.0
            data.stage = min(data.stage + 1, data.allocator.lower.shape[0] - 1)
        i += 1
    data.failures = i


def measure(model: StepModel, data: StepData, plant: PlantCalls) -> None:
    """Copy the plant's outputs, and write the state that law and arbiter receive."""
    read_outputs(data, plant)
    if model.through_sensors:
        apply_outages(model, data, plant)
    estimate_state(model, data)


def read_outputs(data: StepData, plant: PlantCalls) -> None:
    """Copy the outputs of the beginning of a step: of the plant, and of FMUs beside it."""
    data.outputs[: data.first_applied] = plant.native.outputs[: data.first_applied]
    data.component_outputs[:] = data.component_results


def estimate_state(model: StepModel, data: StepData) -> None:
    """Write the state that law and arbiter receive."""
    if model.through_sensors:
        data.navigation.now = data.now
        navigate(data.measurements, model.sensors, data.navigation, data.state)
    else:
        sense(model, data)


def apply_outages(model: StepModel, data: StepData, plant: PlantCalls) -> None:
    """Change the sensors' loss probabilities where an outage begins or ends with this step."""
    i = data.outages
    while i < model.outage_steps.size and data.k == model.outage_steps[i]:
        sensor = model.outage_sensors[i]
        plant.losses.inputs[sensor] = model.outage_losses[i]
        call_back(data, PLANT_SET)
        if not fmi_set_one(plant.losses, sensor):
            data.failed_step = data.k
        i += 1
    data.outages = i


def sense(model: StepModel, data: StepData) -> None:
    """Write the measured state: with noise, held, or lost."""
    true_state, state, now = data.true_state, data.state, data.now
    state.quaternion[:] = true_state.quaternion
    state.velocity_body[3:] = true_state.velocity_body[3:]
    lost = model.dead_from <= now < model.dead_until
    if lost and model.frozen and now > 0.0:
        return
    state.position[:] = true_state.position
    state.velocity_body[:3] = true_state.velocity_body[:3]
    if lost and not model.frozen:
        state.position[:] = np.nan
        state.velocity_body[:3] = np.nan
    elif not (lost or model.exact):
        noise = data.noise[data.k // model.control_every % data.noise.shape[0]]
        state.position[:] += noise[:3]
        state.velocity_body[:3] += noise[3:]


def position_is_known(model: StepModel, data: StepData) -> bool:
    """Return True if the measured position is finite."""
    return bool(model.exact) or bool(np.all(np.isfinite(data.state.position)))
