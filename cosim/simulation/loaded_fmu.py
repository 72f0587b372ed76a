"""An FMU of the user's, loaded: restarted, watched while it runs, and called by its C functions."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from typing import Any

from cosim.errors import ScenarioError
from cosim.scenario.fmu_tables import UserFmu
from cosim.simulation.watchdog import Watchdog
from cosim.step.fmu_call import BUSY, FAILED, NOW, STEPS
from plant_fmu import Plant, PlantError
from plant_fmu.errors import StepError
from plant_fmu.running.native import Native


class LoadedFmu:
    """One instance of a co-simulation FMU, with steps of one length [s], which a key of the scenario gives."""

    def __init__(self, fmu: UserFmu, period: float, period_key: str) -> None:
        self.fmu, self.period, self._period_key = fmu, period, period_key
        self._watchdog = Watchdog(fmu.label, fmu.timeout)
        self.progress = self._watchdog.progress
        try:
            self.plant = self._load()
        except BaseException:
            self._watchdog.close()
            raise

    def _load(self) -> Plant:
        plant: Plant = self._watched(lambda: Plant(self.fmu.file))
        return plant

    def restart(self, fmu: UserFmu, start: Mapping[str, float] | None = None) -> None:
        """Begin again at time 0, with parameters and start values; in a new instance if it cannot be reset."""
        self.enter_initialization(fmu, start)
        self.exit_initialization()

    def enter_initialization(self, fmu: UserFmu, start: Mapping[str, float] | None = None) -> None:
        """Begin again at time 0, and stay in initialization mode."""
        if self.plant.initialized:
            try:
                self._watched(self.plant.reset)
            except PlantError:
                self.plant.close()
                self.plant = self._load()
        try:
            self.plant.set(fmu.parameters)
        except PlantError as error:
            raise ScenarioError(f"{fmu.key}.parameters: {error}") from error
        self._watched(lambda: self.plant.set(start or {}))
        self._watched(self.plant.enter_initialization)

    def exit_initialization(self) -> None:
        """End the initialization mode, and prepare steps."""
        self._watched(self.plant.exit_initialization)
        try:
            self.plant.prepare_steps(self.period)
        except PlantError as error:
            raise ScenarioError(f"{self._period_key}: {self.fmu.label}: {error}") from error
        self.progress[:] = 0.0

    def _watched(self, act: Callable[[], Any]) -> Any:
        """Call a function of the FMU within its time limit."""
        self.progress[STEPS] -= 1.0  # tells this call from the one before
        self.progress[BUSY] = 1.0
        try:
            return act()
        except PlantError as error:
            text = str(error)
            raise PlantError(text if self.fmu.label in text else f"{self.fmu.label}: {text}") from error
        finally:
            self.progress[BUSY] = 0.0

    def set(self, name: str, value: float) -> None:
        """Set an input."""
        self._watched(lambda: self.plant.__setitem__(name, value))

    def set_at_once(self, name: str, value: float) -> None:
        """Set an input of an FMU in initialization mode."""
        self._watched(lambda: self.plant.set({name: value}))

    def get(self, name: str) -> float:
        """Return the present value of a variable."""
        value: float = self._watched(lambda: self.plant[name])
        return value

    def step(self, now: float) -> None:
        """Send the inputs, make a step from `now` [s], and get the outputs, from Python."""
        self.progress[NOW] = now
        self._watched(lambda: self.plant.step(self.period))

    def native(self, inputs: Sequence[str], outputs: Sequence[str]) -> Native:
        """Return the C functions, with buffers of some variables; the inputs have their present values."""
        self._native, self._outputs = self.plant.native(tuple(inputs), tuple(outputs)), tuple(outputs)
        self._native.inputs[:] = self.values(inputs)
        return self._native

    def values(self, names: Sequence[str]) -> list[float]:
        """Return the present values of real variables."""
        return [float(self.plant[name]) for name in names]

    def raise_error(self, expected: str = "a finite number") -> None:
        """Raise the error of the last step, if it failed."""
        failed, now, label = int(self.progress[FAILED]), float(self.progress[NOW]), self.fmu.label
        if failed > 0:
            value, name = self._native.outputs[failed - 1], self._outputs[failed - 1]
            raise PlantError(f"{label}: t = {now:.6g} s: {name} is {value}, expected {expected}")
        if failed < 0:
            self.plant.count_steps(int(self.progress[STEPS]) - 1)
            begin = self.plant.time  # the FMU's own, which begins again where a law regains control
            try:
                self.plant.raise_failure(self._native)
            except StepError as error:
                raise PlantError(f"{label}: t = {now + error.time - begin:.6g} s: {error.reason}") from error

    def close(self) -> None:
        """Free the FMU. May be called twice."""
        self.plant.close()
        self._watchdog.close()
