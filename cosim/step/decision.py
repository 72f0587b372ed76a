"""The decision of a step: weights of the criteria, and forces."""

from __future__ import annotations

import numpy as np

from controller.allocation import allocate, invert_curve
from cosim.step.arbiter_inputs import compute_inputs
from cosim.step.mission_legs import aim
from cosim.step.plant_calls import seconds
from cosim.step.sensing import position_is_known
from cosim.step.step_model import ARBITER, LAW, Array, StepData, StepModel, call_back

MAX_WRENCH = 1e5  # N, N m: bound of the wrench in runs with commands, as some laws ask for any force to a far target


def arbitrate(model: StepModel, data: StepData) -> None:
    """Compute the criteria's weights; while the position is lost, the last ones hold."""
    if position_is_known(model, data):
        update_inputs(model, data)
        weigh(model, data)


def update_inputs(model: StepModel, data: StepData) -> None:
    """Compute the memberships and the inputs of the arbiter's rules."""
    clearances = data.true_evaluation.clearances if model.exact else data.arbiter_evaluation.clearances
    compute_inputs(model.inputs, data.goal, data.regions, data.arbiter_state, data.now, clearances[1:], data.signals)
    data.shown_inputs = data.signals.memberships[: data.shown_inputs.size]


def weigh(model: StepModel, data: StepData) -> None:
    """Compute the weights from the inputs of the rules."""
    call_back(data, ARBITER)
    for i in range(data.weights.size):
        data.weights[i] = data.by_criterion[model.criteria[i]]


def update_delayed_weights(model: StepModel, data: StepData) -> None:
    """Take over the weights and the arbiter's inputs that follow from the step before (Jacobi)."""
    if (data.k - 1) % model.arbiter_every == 0:
        weigh(model, data)
    if position_is_known(model, data):
        update_inputs(model, data)


def control(model: StepModel, data: StepData) -> None:
    """Compute the forces of the coming control period, and allocate them; 0 before there is a state estimate."""
    started = seconds(model.clock, data.ticks) if model.clock.size > 0 else 0.0
    data.expected[:] = np.nan
    if controls(model, data):
        aim(model, data)
        data.estimate = data.law.estimate
        call_back(data, LAW)
        data.report = data.law.report
        if not model.exact:
            data.expected = data.law.expected
        if not model.law_gives_wrench and model.for_record:
            data.command = model.thruster_matrix @ data.thrusts
    elif data.manual == 0:
        data.command[:] = 0.0
    by_wrench = model.law_gives_wrench or not controls(model, data)
    if model.through_thrusters:
        stage, allocator = data.stage, data.allocator
        lower, upper, direction = allocator.lower[stage], allocator.upper[stage], allocator.direction
        if by_wrench:
            data.saturated = allocate(allocator.inverse[stage], lower, upper, direction, data.command, data.thrusts)
        invert_curve(data.thrusts, lower, upper, model.dead_band, model.curve)
    elif by_wrench:
        data.wrench = data.command
        if model.commands:
            data.saturated = bound_wrench(data.wrench)
    if model.clock.size > 0:
        data.max_duration = max(data.max_duration, seconds(model.clock, data.ticks) - started)


def controls(model: StepModel, data: StepData) -> bool:
    """Return True if the law computes the forces: the command is not given, and there is a state."""
    return data.manual == 0 and (not model.through_sensors or data.navigation.started > 0.0)


def bound_wrench(wrench: Array) -> bool:
    """Scale force and moment of a wrench [N, N m] to at most `MAX_WRENCH`, or to 0 if they are not finite."""
    changed = False
    for i in range(0, 6, 3):
        axes = wrench[i : i + 3]
        finite, largest = np.all(np.isfinite(axes)), np.max(np.abs(axes))
        if not (finite and largest <= MAX_WRENCH):
            changed = True
            axes[:] = np.where(finite, axes * (MAX_WRENCH / largest), 0.0)
    return changed
