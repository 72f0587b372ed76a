"""An FMU of the user's as the law, by the map of its scenario."""

from __future__ import annotations

from typing import Any

import numpy as np

from controller import Law
from controller.compiling.function import BoundCall
from controller.law import Array, Diagnostic
from cosim.scenario.law_factory import law_of
from cosim.scenario.scenario import Scenario
from cosim.simulation.fmu_map import connect, law_signals, law_targets, read_fmu_of
from cosim.simulation.loaded_fmu import LoadedFmu
from cosim.simulation.signals import Signals
from cosim.step.fmu_call import FmuCalls, call_law
from cosim.step.step_model import StepData, StepModel
from plant_fmu import PlantError


def make_law(scenario: Scenario) -> Law:
    """Make a scenario's law: an FMU, or one of `controller.LAWS`."""
    return FmuLaw(scenario) if scenario.law.fmu else law_of(scenario)


class FmuLaw:
    """A co-simulation FMU that computes the forces; it fulfills the protocol `Law`, and C calls it."""

    diagnostics: tuple[Diagnostic, ...] = ()

    def __init__(self, scenario: Scenario) -> None:
        assert scenario.law.fmu is not None
        self.fmu, self.name = scenario.law.fmu, scenario.law.name
        self._file = read_fmu_of(self.fmu)
        names, self.output = law_targets(self.fmu, self._file, scenario)
        self._outputs, self._targets = tuple(names), np.array([*names.values()], np.int64)
        self.estimate, self.report = np.zeros(4), np.zeros(0)
        self._loaded = LoadedFmu(self.fmu, scenario.time.control, "time.control")
        try:
            self.restart(scenario)
        except BaseException:
            self.close()
            raise

    def restart(self, scenario: Scenario) -> None:
        """Begin again at time 0, with the parameters of a scenario; in a new instance if the FMU cannot be reset."""
        self._scenario = scenario
        self._loaded.restart(scenario.law.fmu or self.fmu)
        self.estimate[:] = 0.0

    def bind(self, model: StepModel, data: StepData, signals: Signals, forces: Array) -> BoundCall:
        """Return the call of the FMU with the arrays of a step, as C makes it; it writes `forces` [N]."""
        known, loaded = law_signals(self._scenario, signals.columns), self._loaded
        inputs = connect(self.fmu, self._file, known)
        native = loaded.native(tuple(inputs), self._outputs)
        sources = np.array([known[signal].index for signal in inputs.values()], np.int64)
        calls = FmuCalls(native, loaded.period, sources, self._targets, loaded.progress)
        return BoundCall(call_law, (calls, model, data, forces))

    def raise_error(self) -> None:
        """Raise the error of the last step, if it failed."""
        self._loaded.raise_error("a finite force")

    def step(self, *arguments: Any) -> None:
        """Raise an error, as a step needs all signals of a run: C calls the FMU."""
        raise PlantError(f"{self.name}: an FMU has no step in Python, expected a run of its scenario")

    def close(self) -> None:
        """Free the FMU. May be called twice."""
        self._loaded.close()
