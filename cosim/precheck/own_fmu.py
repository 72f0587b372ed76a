"""Checks of FMUs of the user's without running them: their maps, units and directions, and their steps."""

from __future__ import annotations

from collections.abc import Collection, Iterator

from cosim.errors import ScenarioError
from cosim.precheck.finding import Finding, Topic, status
from cosim.scenario.fmu_tables import UserFmu
from cosim.scenario.scenario import Scenario
from cosim.simulation.columns import columns_without_plant
from cosim.simulation.component_map import connect_components
from cosim.simulation.fmu_map import connect, law_signals, law_targets, read_fmu_of
from cosim.simulation.plant_map import plant_start, plant_targets
from plant_fmu.checking.fmu_file import FmuFile

_ROUNDING = 1e-6  # tolerance of a period, as a fraction of a step


def law_fmu_findings(scenario: Scenario, fmu: UserFmu) -> Iterator[Finding]:
    """Yield the findings on the FMU that is the law."""
    try:
        file = read_fmu_of(fmu)
        targets, output = law_targets(fmu, file, scenario)
        connected = connect(fmu, file, law_signals(scenario, columns_without_plant(scenario)))
    except ScenarioError as error:
        yield _failure("law", "FMU", error)
        return
    text = f"{file.path.name} sets the {output} by {len(targets)} of its outputs, from {len(connected)} of its inputs"
    yield Finding("law", "FMU", "holds", f"{text}; units and directions fit.")
    yield from _free_inputs("law", "inputs", file, connected)
    yield _step_finding("law", "step", file, "time.control", scenario.time.control)


def component_findings(scenario: Scenario) -> Iterator[Finding]:
    """Yield the findings on FMUs beside the plant, and on one that is the plant."""
    if not (scenario.components or scenario.plant_fmu):
        return
    try:
        maps = connect_components(scenario, columns_without_plant(scenario))
        if scenario.plant_fmu:
            file = maps[-1].file
            targets = plant_targets(scenario.plant_fmu, file, scenario.vehicle)
            start = plant_start(scenario.plant_fmu, file, scenario, targets)
    except ScenarioError as error:
        yield _failure("components", "FMU", error)
        return
    for one in maps:
        name, text = one.fmu.name, f"{one.file.path.name} has {len(one.inputs)} of its inputs connected"
        if one.fmu is scenario.plant_fmu:
            text += f", gives {len(targets)} of the vehicle's outputs, and gets {len(start)} of its start values"
        else:
            text += f", sets {len(one.sent)} of the plant's inputs and {len(one.received - {*one.sent})} of others'"
        yield Finding("components", name, "holds", f"{text}; units and directions fit.")
        yield from _free_inputs("components", f"{name} inputs", one.file, one.inputs)
        yield _step_finding("components", f"{name} step", one.file, "time.step", scenario.time.step)


def _failure(topic: Topic, name: str, error: ScenarioError) -> Finding:
    return Finding(topic, name, "fails", str(error), "correct the map, or the FMU")


def _free_inputs(topic: Topic, name: str, file: FmuFile, connected: Collection[str]) -> Iterator[Finding]:
    free = [v.name for v in file.model.values() if v.causality == "input" and v.name not in connected]
    if free:
        yield Finding(topic, name, "note", f"{', '.join(free)}: not connected, and keep their start values.")


def _step_finding(topic: Topic, name: str, file: FmuFile, period_key: str, period: float) -> Finding:
    """Compare the period of an FMU's steps [s] with those that it declares."""
    attributes, varies = file.interfaces["CS"], file.offers("CS", "canHandleVariableCommunicationStepSize")
    key = "fixedInternalStepSize" if attributes.get("fixedInternalStepSize") else "DefaultExperiment.stepSize"
    step = float(attributes.get("fixedInternalStepSize", 0.0)) or (0.0 if varies else file.default_step)
    how = "varying" if varies else "equal"
    if not step:
        text = f"{period_key} is {period:g} s; the FMU takes {how} steps of any length."
        return Finding(topic, name, "holds", text)
    fits = period > 0.5 * step and abs(period - round(period / step) * step) <= _ROUNDING * step
    text = f"{period_key} is {period:g} s, {key} of the FMU {step:g} s, and its steps are {how}."
    advice = "" if fits else f"set {period_key} to a multiple of {step:g} s"
    return Finding(topic, name, status(fits), text, advice)
