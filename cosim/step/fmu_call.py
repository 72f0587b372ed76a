"""The step of an FMU of the user's, as the law, beside the plant or as the plant: signals in, `doStep`, outputs out."""

from __future__ import annotations

import math
from typing import NamedTuple

from cosim.step.plant_calls import fmi_do_step, fmi_get, fmi_set
from cosim.step.region_positions import RegionEvaluation
from cosim.step.step_model import Array, Integers, StepData, StepModel
from plant_fmu.running.native import Native

STEPS, BUSY, NOW, FAILED = range(4)  # indices in `FmuCalls.progress`


class FmuCalls(NamedTuple):
    """An FMU of the user's, and the map between its variables and the arrays of a step."""

    native: Native  # inputs and outputs that are connected
    period: float  # s, length of its steps
    sources: Integers  # (i,) index of each input's signal, as `signal` numbers them
    targets: Integers  # (o,) index among forces and estimate of each output
    progress: Array  # (4,) steps done; 1 during a step; time of the run at its begin [s]; -1: it failed; n: output
    # n - 1 is not finite


class ComponentCalls(NamedTuple):
    """An FMU of the user's beside the plant, and what it exchanges."""

    fmu: FmuCalls  # all its outputs; targets (o,): 1 for each that is connected, which has to be finite
    first: int  # index of its first output in `StepData.component_results`
    senders: Integers  # (c,) index among its outputs of each that an input of the plant receives
    receivers: Integers  # (c,) index of that input
    plant_inputs: Array  # (p,) inputs of the plant


def call_law(fmu: FmuCalls, model: StepModel, data: StepData, forces: Array) -> None:
    """Let an FMU compute the forces [N] of the coming control period."""
    receive(fmu, model, data)
    if not advance_fmu(fmu, data):
        return
    native, progress, n = fmu.native, fmu.progress, forces.size
    forces[:] = 0.0  # those that no output sets, as a pilot may have set them
    for i in range(fmu.targets.size):
        target, value = fmu.targets[i], native.outputs[i]
        if target >= n:
            data.law.estimate[target - n] = value
            data.estimate[target - n] = value  # the FMU gives that with which it made the forces
        elif math.isfinite(value):
            forces[target] = value
        elif progress[FAILED] == 0.0:
            progress[FAILED] = 1.0 + i
            data.failed_step = data.k


def exchange_component(component: ComponentCalls, model: StepModel, data: StepData) -> None:
    """Let a component receive signals of the beginning of a step, and the plant its outputs (Jacobi)."""
    receive(component.fmu, model, data)
    send(component, data)


def step_component(component: ComponentCalls, model: StepModel, data: StepData) -> None:
    """Step a component; in Gauss-Seidel's order it receives the latest signals, and the plant its new outputs."""
    fmu = component.fmu
    if not model.jacobi:
        receive(fmu, model, data)
    if not advance_fmu(fmu, data):
        return
    for i in range(fmu.targets.size):
        value = fmu.native.outputs[i]
        data.component_results[component.first + i] = value
        if fmu.targets[i] > 0 and not math.isfinite(value) and fmu.progress[FAILED] == 0.0:
            fmu.progress[FAILED] = 1.0 + i
            data.failed_step = data.k
    if not model.jacobi:
        send(component, data)


def send(component: ComponentCalls, data: StepData) -> None:
    """Set the inputs of the plant to the latest outputs of a component."""
    for i in range(component.senders.size):
        value = data.component_results[component.first + component.senders[i]]
        component.plant_inputs[component.receivers[i]] = value


def receive(fmu: FmuCalls, model: StepModel, data: StepData) -> None:
    """Set the inputs of an FMU to their signals."""
    for i in range(fmu.sources.size):
        fmu.native.inputs[i] = signal(model, data, fmu.sources[i])


def advance_fmu(fmu: FmuCalls, data: StepData) -> bool:
    """Send the inputs of an FMU, step it and get its outputs; return True unless it fails."""
    native, progress = fmu.native, fmu.progress
    progress[NOW] = data.now
    progress[BUSY] = 1.0
    ok = False
    if fmi_set(native) and fmi_do_step(native, progress[STEPS] * fmu.period, fmu.period) and fmi_get(native):
        ok = True
    progress[BUSY] = 0.0
    progress[STEPS] += 1.0
    if not ok:
        progress[FAILED] = -1.0
        data.failed_step = data.k
    return ok


def signal(model: StepModel, data: StepData, i: int) -> float:
    """Return signal `i` of: measured motion (13), weights (n), regions (5 n + 5), row, latest outputs of components."""
    n, row = data.weights.size, data.row.size
    first = 18 + 6 * n
    if i >= first + row:
        return float(data.component_results[i - first - row])
    if i >= first:
        return float(data.row[i - first])
    if i >= 13 + n:
        return region_signal(data.true_evaluation if model.exact else data.arbiter_evaluation, i - 13 - n)
    if i >= 13:
        return float(data.weights[i - 13])
    if i >= 7:
        return float(data.state.velocity_body[i - 7])
    return float(data.state.quaternion[i - 3] if i >= 3 else data.state.position[i])


def region_signal(evaluation: RegionEvaluation, i: int) -> float:
    """Return number `i` of values (m), clearances (m) and gradients (3 m) of goal and regions."""
    m = evaluation.values.size
    if i < m:
        return float(evaluation.values[i])
    if i < 2 * m:
        return float(evaluation.clearances[i - m])
    return float(evaluation.gradients[(i - 2 * m) // 3, (i - 2 * m) % 3])
