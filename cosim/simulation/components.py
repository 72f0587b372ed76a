"""FMUs beside the plant, loaded and bound to the arrays of a step."""

from __future__ import annotations

import contextlib
from collections.abc import Iterable, Sequence

import numpy as np

from controller.compiling.function import BoundCall
from cosim.errors import ScenarioError
from cosim.scenario.scenario import Scenario
from cosim.simulation.component_map import ComponentMap, connect_components
from cosim.simulation.fmu_plant import FmuPlant
from cosim.simulation.loaded_fmu import LoadedFmu
from cosim.simulation.signals import Signals
from cosim.simulation.stepped_plant import SteppedPlant
from cosim.step.fmu_call import ComponentCalls, FmuCalls, exchange_component, step_component
from cosim.step.plant_fmu_call import step_plant_fmu, write_outputs
from cosim.step.step_model import PLANT_STEP, Array, Integers, StepData, StepModel, register_call, set_call


class Components:
    """The FMUs beside a plant, and the plant itself where it is one of the user's."""

    def __init__(self, scenario: Scenario, plant: SteppedPlant) -> None:
        self._plant = plant
        self._open = contextlib.ExitStack()
        self._loaded: dict[str, LoadedFmu] = {}
        self._calls: list[BoundCall] = []
        try:
            for fmu in scenario.components:
                self._loaded[fmu.name] = loaded = LoadedFmu(fmu, scenario.time.step, "time.step")
                self._open.callback(loaded.close)
        except BaseException:
            self.close()
            raise
        if isinstance(plant, FmuPlant):
            self._loaded[plant.loaded.fmu.name] = plant.loaded

    def _restart(self, scenario: Scenario, signals: Signals) -> None:
        """Initialize them, after the plant, with the outputs of the plant and of those before as inputs."""
        self._maps = connect_components(scenario, signals.columns)
        fmus = {fmu.name: fmu for fmu in scenario.components}
        known = dict(zip(self._plant.outputs.names, self._plant.outputs.values.tolist(), strict=True))
        if isinstance(self._plant, FmuPlant):
            outputs = next(one.outputs for one in self._maps if one.fmu is scenario.plant_fmu)
            known |= _named(self._plant.loaded, outputs)
        for one in self._maps:
            loaded = self._loaded[one.fmu.name]
            if one.fmu.name in fmus:
                start = {name: known[signal] for name, signal in one.inputs.items() if signal in known}
                loaded.restart(fmus[one.fmu.name], start)
                known |= _named(loaded, one.outputs)

    def bind(
        self, scenario: Scenario, model: StepModel, data: StepData, row: Signals, names: list[str], inputs: Array
    ) -> None:
        """Initialize them, and let a step call them; `inputs` (n,) are the plant's, with their names."""
        self._restart(scenario, row)
        self._calls = []
        for i, one in enumerate(self._maps):
            calls = self._component_calls(one, names, inputs, data)
            data.component_results[one.first : one.first + len(one.outputs)] = calls.fmu.native.outputs
            if isinstance(self._plant, FmuPlant) and one.fmu.name == self._plant.loaded.fmu.name:
                vehicle = self._plant.vehicle_map(one.outputs)
                BoundCall(write_outputs, (vehicle, data.component_results[one.first :])).call()
                step = BoundCall(step_plant_fmu, (calls, vehicle, model, data))
                set_call(data, PLANT_STEP, step)
            else:
                step = BoundCall(step_component, (calls, model, data))
                register_call(data, data.components, 2 * i, step)
            self._calls.append(step)
            if model.jacobi:
                exchange = BoundCall(exchange_component, (calls, model, data))
                register_call(data, data.exchanges, 2 * i, exchange)
                self._calls.append(exchange)

    def _component_calls(self, one: ComponentMap, names: list[str], inputs: Array, data: StepData) -> ComponentCalls:
        loaded = self._loaded[one.fmu.name]
        native = loaded.native(tuple(one.inputs), one.outputs)
        native.outputs[:] = loaded.values(one.outputs)
        for output, target in one.sent.items():
            if target not in names:
                raise ScenarioError(f"{one.fmu.key}.outputs.{output} is {target!r}, which the plant has not")
        calls = FmuCalls(
            native, loaded.period, _integers(one.sources),
            _integers(name in one.received for name in one.outputs), loaded.progress,
        )  # fmt: skip
        return ComponentCalls(
            calls, one.first, _integers(one.outputs.index(output) for output in one.sent),
            _integers(names.index(target) for target in one.sent.values()), inputs,
        )  # fmt: skip

    def raise_error(self) -> None:
        """Raise the error of the last step, if one of them failed."""
        for call in self._calls:
            call.raise_error()
        for loaded in self._loaded.values():
            loaded.raise_error()

    def close(self) -> None:
        """Free them, not the plant. May be called twice."""
        self._open.close()


def _named(loaded: LoadedFmu, names: Sequence[str]) -> dict[str, float]:
    return {f"{loaded.fmu.name}.{name}": value for name, value in zip(names, loaded.values(names), strict=True)}


def _integers(numbers: Iterable[int]) -> Integers:
    return np.array([*numbers], np.int64)
