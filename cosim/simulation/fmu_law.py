"""An FMU of the user's as the law, by the map of its scenario."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, NoReturn

import numpy as np

from controller import Law
from controller.compiling.function import BoundCall
from controller.law import Array, Diagnostic
from cosim.errors import ScenarioError
from cosim.scenario.law_factory import law_of
from cosim.scenario.scenario import Scenario
from cosim.simulation.fmu_map import connect, law_targets, read_fmu_of, signal_units
from cosim.simulation.signals import Signals
from cosim.simulation.watchdog import Watchdog
from cosim.step.fmu_call import BUSY, FAILED, NOW, STEPS, FmuCalls, call_law
from cosim.step.step_model import StepData, StepModel
from plant_fmu import Plant, PlantError
from plant_fmu.errors import StepError


def make_law(scenario: Scenario) -> Law:
    """Make a scenario's law: an FMU, or one of `controller.LAWS`."""
    return FmuLaw(scenario) if scenario.law.fmu else law_of(scenario)


class FmuLaw:
    """A co-simulation FMU that computes the forces; it fulfills the protocol `Law`, and C calls it."""

    diagnostics: tuple[Diagnostic, ...] = ()

    def __init__(self, scenario: Scenario) -> None:
        assert scenario.law.fmu is not None
        self._scenario, self.fmu = scenario, scenario.law.fmu
        self.name, self._period = scenario.law.name, scenario.time.control
        self._watchdog = Watchdog(self.name, self.fmu.timeout)
        self._progress = self._watchdog.progress
        try:
            self._file = read_fmu_of(self.fmu)
            names, self.output = law_targets(self.fmu, self._file, scenario)
            self._plant = self._load()
            self._outputs, self._targets = tuple(names), np.array([*names.values()], np.int64)
            self.estimate, self.report = np.zeros(4), np.zeros(0)
            self.restart(scenario)
        except BaseException:
            self.close()
            raise

    def _load(self) -> Plant:
        plant: Plant = self._watched(lambda: Plant(self.fmu.file))
        return plant

    def restart(self, scenario: Scenario) -> None:
        """Begin again at time 0, with the parameters of a scenario; in a new instance if the FMU cannot be reset."""
        self._scenario, parameters = scenario, scenario.law.fmu.parameters if scenario.law.fmu else {}
        if self._plant.initialized:
            try:
                self._watched(self._plant.reset)
            except PlantError:
                self._plant.close()
                self._plant = self._load()
        try:
            self._plant.set(parameters)
        except PlantError as error:
            raise ScenarioError(f"{self.fmu.key}.parameters: {error}") from error
        self._watched(self._plant.initialize)
        try:
            self._plant.prepare_steps(self._period)
        except PlantError as error:
            raise ScenarioError(f"time.control: {self.name}: {error}") from error
        self._progress[:] = 0.0
        self.estimate[:] = 0.0

    def _watched(self, act: Callable[[], Any]) -> Any:
        """Call a function of the FMU within its time limit."""
        self._progress[STEPS] -= 1.0  # tells this call from the one before
        self._progress[BUSY] = 1.0
        try:
            return act()
        except PlantError as error:
            text = str(error)
            raise PlantError(text if self.name in text else f"{self.name}: {text}") from error
        finally:
            self._progress[BUSY] = 0.0

    def bind(self, model: StepModel, data: StepData, signals: Signals, forces: Array) -> BoundCall:
        """Return the call of the FMU with the arrays of a step, as C makes it; it writes `forces` [N]."""
        units = signal_units(self._scenario, signals)
        inputs = connect(self.fmu, self._file, units)
        places = {name: i for i, name in enumerate(units)}
        self._native = self._plant.native(tuple(inputs), self._outputs)
        sources = np.array([places[signal] for signal in inputs.values()], np.int64)
        numbers = np.zeros(len(units))
        calls = FmuCalls(self._native, self._period, sources, self._targets, numbers, self._progress)
        return BoundCall(call_law, (calls, model, data, forces))

    def raise_error(self) -> None:
        """Raise the error of the last step, if it failed."""
        failed, now = int(self._progress[FAILED]), float(self._progress[NOW])
        if failed > 0:
            value, name = self._native.outputs[failed - 1], self._outputs[failed - 1]
            raise PlantError(f"{self.name}: t = {now:.6g} s: {name} is {value}, expected a finite force")
        if failed < 0:
            self._raise_failure(now)

    def _raise_failure(self, now: float) -> NoReturn:
        self._plant.count_steps(int(self._progress[STEPS]) - 1)
        begin = self._plant.time  # the FMU's own, which begins again where the law regains control
        try:
            self._plant.raise_failure(self._native)
        except StepError as error:
            raise PlantError(f"{self.name}: t = {now + error.time - begin:.6g} s: {error.reason}") from error

    def step(self, *arguments: Any) -> None:
        """Raise an error, as a step needs all signals of a run: C calls the FMU."""
        raise PlantError(f"{self.name}: an FMU has no step in Python, expected a run of its scenario")

    def close(self) -> None:
        """Free the FMU. May be called twice."""
        if hasattr(self, "_plant"):
            self._plant.close()
        self._watchdog.close()
