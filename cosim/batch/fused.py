"""Flights by the fused loop: the vehicle's FMU, stepped in C with the functions of the master."""

from __future__ import annotations

import contextlib
import math
from typing import Any

import numpy as np
from numpy.typing import NDArray

from controller import Law, LawError
from controller.compiling.function import BoundCall
from cosim.batch.outcome import OUTCOME, BatchResult, arrivals_of, empty_outcomes
from cosim.batch.variation import Variation
from cosim.errors import RunError, ScenarioError
from cosim.results.record import Rows
from cosim.results.spans import SETTLED_FOR
from cosim.scenario.law_factory import OwnLaw, law_of, require_builtin_law
from cosim.scenario.scenario import Scenario
from cosim.scenario.true_vehicle import start_values
from cosim.simulation.bindings import BoundLaw, bind_rules
from cosim.simulation.columns import channels_of_run, columns_of_channels
from cosim.simulation.component_map import fmus_beside
from cosim.simulation.components import Components
from cosim.simulation.fmu_law import FmuLaw
from cosim.simulation.fmu_plant import FmuPlant
from cosim.simulation.make_step import NO_CLOCK, exchanged_variables, make_data, make_model, make_noise, step_signals
from cosim.simulation.signals import Signals
from cosim.simulation.step_functions import load_plant
from cosim.simulation.stepped_plant import BoundPlant, plant_calls
from cosim.step.score import FlightMetrics, fly
from cosim.step.step_model import Array, Integers, StepData, StepModel
from fuzzy_arbiter import Arbiter
from plant_fmu import PlantError


class FusedFlyer:
    """Flies variations of a scenario one after the other, with one plant that is reset before each."""

    def __init__(self, variation: Variation, own: OwnLaw | None = None) -> None:
        self.variation, self._own = variation, own
        base = variation.base
        require_fused(base)
        for key, (_, expected) in _fixed_keys(base).items():
            if key in variation.keys:
                raise RunError(f"{key} varies, expected {expected!r} for flights without a record")
        if own is not None:
            own.make(base)
        elif base.law.fmu is None:
            require_builtin_law(base)
        self._open = contextlib.ExitStack()
        self._vehicle = self._open.enter_context(FlownVehicle(base))

    def fly(self, values: Array, seeds: NDArray[np.int64]) -> BatchResult:
        """Fly a batch; values (rows, keys), seeds (rows,)."""
        outcomes, refused, arrivals = empty_outcomes(len(seeds)), {}, {}
        for row, (row_values, seed) in enumerate(zip(values, seeds, strict=True)):
            try:
                scenario = self.variation.scenario(row_values.tolist(), int(seed))
                metrics, model, data, _ = self._fly(scenario)
                outcomes[row], arrivals[row] = _outcome(metrics, model, data), arrivals_of(data.arrivals)
            except (ScenarioError, PlantError, LawError) as error:
                refused[row] = str(error)
        return BatchResult(outcomes, refused, arrivals)

    def fly_one(self, scenario: Scenario, trace: bool = False) -> tuple[NDArray[np.void], Rows]:
        """Fly one scenario of the variation; return its outcome, shape (), and its signals at each control step."""
        metrics, model, data, signals = self._fly(scenario, trace)
        return _outcome(metrics, model, data), signals

    def _fly(self, scenario: Scenario, trace: bool = False) -> tuple[FlightMetrics, StepModel, StepData, Rows]:
        return self._vehicle.fly(scenario, trace, own=self._own.make(scenario) if self._own else None)

    def close(self) -> None:
        """Free plant and law. May be called twice."""
        self._open.close()

    def __enter__(self) -> FusedFlyer:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()


def require_fused(scenario: Scenario, what: str = "flights without a record") -> None:
    """Raise `RunError` for the first key of a scenario that the fused loop does not support; `what` needs the loop."""
    for key, (received, expected) in _fixed_keys(scenario).items():
        if received != expected:
            way = f", such as by --set {key}={expected}" if isinstance(expected, str) else ""
            raise RunError(f"{key} is {received!r}, expected {expected!r} for {what}{way}")


def _fixed_keys(scenario: Scenario) -> dict[str, tuple[Any, Any]]:
    """Return the present and the required value of each key that has to have a fixed value."""
    return {
        "arbiter.engine": (scenario.arbiter.engine, Arbiter(scenario.rules.system).engine),
        "master.order": (scenario.master.order, "gauss-seidel"),
        "plant.fmi": (scenario.plant.fmi, 3),
        "commands.enabled": (scenario.commands.enabled, False),
    }


class FlownVehicle:
    """Plant, FMUs beside it, and the law's FMU, which fly one scenario of the same FMUs after another."""

    def __init__(self, scenario: Scenario) -> None:
        self._open = contextlib.ExitStack()
        try:
            self._plant = load_plant(scenario)
            self._open.callback(self._plant.close)
            self._components = Components(scenario, self._plant)
            self._open.callback(self._components.close)
            self._law = FmuLaw(scenario) if scenario.law.fmu else None
            if self._law:
                self._open.callback(self._law.close)
        except BaseException:
            self.close()
            raise

    def fly(
        self, scenario: Scenario, trace: bool = False, clock: Integers = NO_CLOCK, own: Law | None = None
    ) -> tuple[FlightMetrics, StepModel, StepData, Rows]:
        """Reset all of them, and fly a scenario with its law, or one's own; return its signals if a trace is wanted."""
        if self._law is not None:
            self._law.restart(scenario)
        law, plant = own or self._law or law_of(scenario), self._plant
        if isinstance(plant, FmuPlant):
            plant.restart(scenario)
        else:
            plant.reset()
            plant.set(start_values(scenario))
            plant.initialize()
        # an FMU may ask for any signal of a record
        for_record = self._law is not None or bool(fmus_beside(scenario))
        channels = channels_of_run(scenario)
        inputs, outputs = exchanged_variables(scenario)
        if for_record:
            inputs, outputs = (tuple(c.name for c in kind) for kind in (channels.inputs, channels.outputs))
        model = make_model(scenario, law, clock, for_record)
        signals = step_signals(scenario, law, inputs, outputs)
        if for_record:
            signals = Signals(columns_of_channels(scenario, *channels, law.diagnostics))
        flags = tuple(c.name for c in channels.flags) if isinstance(plant, FmuPlant) else ()
        data = make_data(scenario, model, law, signals, inputs, outputs, make_noise(scenario), flags)
        if isinstance(plant, FmuPlant):
            calls = BoundPlant(scenario, plant, data, native=False, inputs=inputs).calls
        else:
            calls = plant_calls(scenario.vehicle, plant.native(inputs, outputs), plant.native)
        if fmus_beside(scenario):
            self._components.bind(scenario, model, data, signals, list(inputs), calls.native.inputs)
        bound_law, rules = BoundLaw(law, model, data, signals), bind_rules(scenario.rules.system, data)
        decisions = -(-scenario.steps // scenario.control_every)
        rows = np.zeros((decisions if trace else 0, signals.row.size))
        metrics = FlightMetrics()
        BoundCall(fly, (model, data, calls, metrics, np.zeros(len(inputs)), rows)).call()
        _raise_error(bound_law, float(data.now))
        for part in (rules, self._components):
            part.raise_error()
        columns = signals.columns
        flown = Rows(columns, {column.name: values for column, values in zip(columns, rows.T, strict=True)})
        return metrics, model, data, flown

    def close(self) -> None:
        """Free all of them. May be called twice."""
        self._open.close()

    def __enter__(self) -> FlownVehicle:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()


def _raise_error(law: BoundLaw, now: float) -> None:
    """Raise the error of the law's last step; that of a user's Python code as a `LawError`."""
    try:
        law.raise_error()
    except PlantError:
        raise
    except Exception as error:
        text = str(error) if isinstance(error, LawError) else f"{type(error).__name__}: {error}"
        raise LawError(f"t = {now:.6g} s: {' '.join(text.split())}") from error


def _outcome(metrics: FlightMetrics, model: StepModel, data: StepData) -> NDArray[np.void]:
    def when(step: float) -> float:
        return step * model.step if step >= 0 else math.nan

    stopped = metrics.failed_step >= 0
    last = metrics.failed_step if stopped else model.steps
    stayed = (last - metrics.last_entered) * model.step if metrics.inside else 0.0
    fields = {
        "reached": metrics.first_inside >= 0,
        "reach_time": when(metrics.first_inside),
        "settled": metrics.inside and stayed >= SETTLED_FOR,
        "settle_time": when(metrics.last_entered),
        "violated": metrics.min_clearance < 0.0 or metrics.min_angle < 0.0,
        "min_clearance": metrics.min_clearance,
        "weighted_violation": metrics.weighted_violation,
        "closest_to_goal": -metrics.goal_clearance if metrics.goal_clearance > -math.inf else math.nan,
        "effort": metrics.effort,
        "max_force": metrics.max_force,
        "max_speed": metrics.max_speed,
        **{f"final_{axis}": data.outputs[i] for i, axis in enumerate("xyz")},
        **{f"phi{i + 1}": data.estimate[i] for i in range(4)},
        "stopped_at": when(metrics.failed_step),
    }
    return np.array(tuple(fields[name] for name in OUTCOME.names or ()), OUTCOME)
