"""The map between FMUs beside the plant, the plant's inputs and the signals of a run."""

from __future__ import annotations

import graphlib
from collections.abc import Sequence
from typing import NamedTuple

from cosim.errors import ScenarioError
from cosim.scenario.fmu_tables import UserFmu
from cosim.scenario.scenario import Scenario
from cosim.simulation.fmu_map import (
    Signal,
    assign,
    component_signals,
    connect,
    find_variable,
    read_fmu_of,
)
from cosim.simulation.plant_map import MOTION_FORMS, check_plant_inputs, plant_targets
from cosim.simulation.signals import Column
from plant_fmu.checking.fmu_file import FmuFile
from plant_fmu.errors import printable
from plant_fmu.running.channels import Channel
from plant_fmu.toml_tables import hint
from plant_fmu.variables.coupling import coupling_inputs

_MAX_TEXT = 200  # maximum number of characters of a description


class ComponentMap(NamedTuple):
    """One FMU, and what its variables are connected to."""

    fmu: UserFmu
    file: FmuFile
    inputs: dict[str, str]  # signal of each connected input
    sources: tuple[int, ...]  # index of each of these signals of `cosim.step.fmu_call.signal`
    sent: dict[str, str]  # input of the plant that an output sets, by output
    outputs: tuple[str, ...]  # all outputs, which are columns of the record
    first: int  # index of the first of them in `StepData.component_results`
    received: frozenset[str]  # outputs that something receives


def fmus_beside(scenario: Scenario) -> tuple[UserFmu, ...]:
    """Return the FMUs whose outputs are columns of the record: those beside the plant, and an own plant."""
    return (*scenario.components, *([scenario.plant_fmu] if scenario.plant_fmu else []))


def component_columns(scenario: Scenario) -> list[Column]:
    """Return the columns of the outputs of components."""
    return [
        Column(f"{fmu.name}.{v.name}", printable(v.unit), printable(v.description or v.name)[:_MAX_TEXT])
        for fmu in fmus_beside(scenario)
        for v in read_fmu_of(fmu).with_causality("output")
    ]


def component_channels(scenario: Scenario) -> tuple[Channel, ...]:
    """Return the inputs of a coupled plant that components set, in the plant's order."""
    sent = {target for one in component_outputs(scenario) for target in one.values()}
    rows = coupling_inputs(scenario.vehicle) if sent else ()
    return tuple(Channel(v.name, v.quantity.unit, v.description) for v in rows if v.name in sent)


def component_outputs(scenario: Scenario) -> list[dict[str, str]]:
    """Return the plant's input that each connected output of a component sets, for each component."""
    known, sent = _plant_inputs(scenario), list[dict[str, str]]()
    for fmu in scenario.components:
        taken = [target for other in sent for target in other.values()]
        direct = {name: target for name, target in fmu.outputs.items() if not _to_component(scenario, target)}
        what = "is no input of the plant or of a component"
        targets = assign(fmu._replace(outputs=direct), read_fmu_of(fmu), known, what, taken)
        others = fmu.outputs.keys() - direct.keys()
        sent.append({name: target for name, target in targets.items() if name not in others})
    return sent


def _plant_inputs(scenario: Scenario) -> dict[str, Signal]:
    """Return the inputs of the plant that components can set: none of an FMU of the user's, which names signals."""
    if scenario.plant_fmu:
        return {}
    return {v.name: Signal(-1, v.quantity.unit) for v in coupling_inputs(scenario.vehicle)}


def _to_component(scenario: Scenario, target: str) -> tuple[str, str] | None:
    """Return component and input of a target such as ``winch.load``."""
    name, dot, variable = target.partition(".")
    return (name, variable) if dot and name in {fmu.name for fmu in fmus_beside(scenario)} else None


def connect_components(scenario: Scenario, columns: Sequence[Column]) -> list[ComponentMap]:
    """Return the maps of all components in the order of their steps, that of an own plant last."""
    beside, signals = fmus_beside(scenario), component_signals(scenario, columns)
    files = {fmu.name: read_fmu_of(fmu) for fmu in beside}
    base, firsts, n = 1 + max(signal.index for signal in signals.values()), dict[str, int](), 0
    for fmu in beside:
        file, firsts[fmu.name] = files[fmu.name], n
        for v in file.with_causality("output"):
            definition = file.units.get(v.unit, {}) if v.unit else {}
            signals[f"{fmu.name}.{v.name}"] = Signal(base + n, v.unit, definition)
            n += 1
    pushed = _pushed_inputs(scenario, files, signals)
    inputs = {fmu.name: connect(fmu._replace(inputs=fmu.inputs | pushed[fmu.name]), files[fmu.name], signals)
              for fmu in beside}  # fmt: skip
    received = {signal for one in inputs.values() for signal in one.values()}
    sent = component_outputs(scenario)
    maps = []
    for i, fmu in enumerate(beside):
        outputs = tuple(v.name for v in files[fmu.name].with_causality("output"))
        own = sent[i] if i < len(sent) else {}
        if fmu is scenario.plant_fmu:
            own_motion = plant_targets(fmu, files[fmu.name], scenario.vehicle)
            received |= {f"{fmu.name}.{name}" for name, target in own_motion.items() if target in MOTION_FORMS}
        used = frozenset(name for name in outputs if name in own or f"{fmu.name}.{name}" in received)
        sources = tuple(signals[signal].index for signal in inputs[fmu.name].values())
        maps.append(ComponentMap(fmu, files[fmu.name], inputs[fmu.name], sources, own, outputs, firsts[fmu.name], used))
    if scenario.plant_fmu:
        check_plant_inputs(scenario.plant_fmu, scenario.actuation.through, maps[-1].inputs.values())
    return _in_order(scenario, maps)


def _pushed_inputs(
    scenario: Scenario, files: dict[str, FmuFile], signals: dict[str, Signal]
) -> dict[str, dict[str, str]]:
    """Return the signal of each input that an output of another component names."""
    pushed: dict[str, dict[str, str]] = {name: {} for name in files}
    given = {fmu.name: fmu.inputs for fmu in fmus_beside(scenario)}
    for fmu in scenario.components:
        for output, target in fmu.outputs.items():
            if to := _to_component(scenario, target):
                key, (name, variable) = f"{fmu.key}.outputs.{output}", to
                find_variable(files[fmu.name], key, output, "output")
                known = [v.name for v in files[name].with_causality("input")]
                if variable not in known:
                    raise ScenarioError(f"{key} is {target!r}, but {name} has no such input; {hint(variable, known)}")
                if variable in pushed[name] or variable in given[name]:
                    raise ScenarioError(f"{key} is {target!r}, which is connected already")
                signal = f"{fmu.name}.{output}"
                signals[signal].require(key, files[name], files[name].model[variable])
                pushed[name][variable] = signal
    return pushed


def _in_order(scenario: Scenario, maps: list[ComponentMap]) -> list[ComponentMap]:
    """Return the maps in an order in which each component comes behind those whose outputs it receives."""
    if scenario.master.order == "jacobi":
        return maps
    by_name = {one.fmu.name: one for one in maps if one.fmu is not scenario.plant_fmu}
    graph = graphlib.TopologicalSorter(
        {
            name: [
                other.fmu.name
                for other in by_name.values()
                if {f"{other.fmu.name}.{output}" for output in other.outputs} & set(one.inputs.values())
            ]
            for name, one in by_name.items()
        }
    )
    try:
        order = [by_name[name] for name in graph.static_order()]
    except graphlib.CycleError as error:
        cycle = " -> ".join(error.args[1])
        raise ScenarioError(
            f"components: {cycle} is a cycle of connections, expected none with master.order = 'gauss-seidel', such as "
            "by --set master.order=jacobi"
        ) from error
    return [*order, *(one for one in maps if one.fmu is scenario.plant_fmu)]
