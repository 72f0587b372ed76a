"""Flights by the fused loop: the vehicle's FMU, stepped in C with the functions of the master."""

from __future__ import annotations

import contextlib
import math
from typing import Any

import numpy as np
from numpy.typing import NDArray

from controller.compiling.function import BoundCall
from cosim.batch.outcome import OUTCOME, BatchResult, arrivals_of, empty_outcomes
from cosim.batch.variation import Variation
from cosim.errors import RunError, ScenarioError
from cosim.results.record import Rows
from cosim.results.spans import SETTLED_FOR
from cosim.scenario.law_factory import law_of, require_builtin_law
from cosim.scenario.scenario import Scenario
from cosim.scenario.true_vehicle import start_values
from cosim.simulation.bindings import BoundLaw, bind_rules
from cosim.simulation.columns import columns_of
from cosim.simulation.fmu_law import FmuLaw
from cosim.simulation.make_step import NO_CLOCK, exchanged_variables, make_data, make_model, make_noise, step_signals
from cosim.simulation.signals import Signals
from cosim.simulation.stepped_plant import plant_calls
from cosim.step.score import FlightMetrics, fly
from cosim.step.step_model import Array, Integers, StepData, StepModel
from fuzzy_arbiter import Arbiter
from plant_fmu import Plant, PlantError


class FusedFlyer:
    """Flies variations of a scenario one after the other, with one plant that is reset before each."""

    def __init__(self, variation: Variation) -> None:
        self.variation = variation
        base = variation.base
        require_fused(base)
        for key, (_, expected) in _fixed_keys(base).items():
            if key in variation.keys:
                raise RunError(f"{key} varies, expected {expected!r} for flights without a record")
        if base.law.fmu is None:
            require_builtin_law(base)
        self._open = contextlib.ExitStack()
        self._plant = self._open.enter_context(Plant(base.vehicle))
        self._law: FmuLaw | None = None
        if base.law.fmu:
            self._law = FmuLaw(base)
            self._open.callback(self._law.close)

    def fly(self, values: Array, seeds: NDArray[np.int64]) -> BatchResult:
        """Fly a batch; values (rows, keys), seeds (rows,)."""
        outcomes, refused, arrivals = empty_outcomes(len(seeds)), {}, {}
        for row, (row_values, seed) in enumerate(zip(values, seeds, strict=True)):
            try:
                scenario = self.variation.scenario(row_values.tolist(), int(seed))
                metrics, model, data, _ = fly_scenario(self._plant, scenario, law=self._law)
                outcomes[row], arrivals[row] = _outcome(metrics, model, data), arrivals_of(data.arrivals)
            except (ScenarioError, PlantError) as error:
                refused[row] = str(error)
        return BatchResult(outcomes, refused, arrivals)

    def fly_one(self, scenario: Scenario, trace: bool = False) -> tuple[NDArray[np.void], Rows]:
        """Fly one scenario of the variation; return its outcome, shape (), and its signals at each control step."""
        metrics, model, data, signals = fly_scenario(self._plant, scenario, trace, law=self._law)
        return _outcome(metrics, model, data), signals

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


def fly_scenario(
    plant: Plant, scenario: Scenario, trace: bool = False, clock: Integers = NO_CLOCK, law: FmuLaw | None = None
) -> tuple[FlightMetrics, StepModel, StepData, Rows]:
    """Reset plant and FMU of the law, and fly a scenario; return the signals at control steps if a trace is wanted."""
    if law is not None:
        law.restart(scenario)
    made = law or law_of(scenario)
    plant.reset()
    plant.set(start_values(scenario))
    plant.initialize()
    # an FMU may ask for any signal of a record
    inputs, outputs = (plant.inputs.names, plant.outputs.names) if law else exchanged_variables(scenario)
    calls = plant_calls(scenario.vehicle, plant.native(inputs, outputs), plant.native)
    model = make_model(scenario, made, clock, for_record=law is not None)
    signals = Signals(columns_of(scenario, plant, law)) if law else step_signals(scenario, made, inputs, outputs)
    data = make_data(scenario, model, made, signals, inputs, outputs, make_noise(scenario))
    bound_law, rules = BoundLaw(made, model, data, signals), bind_rules(scenario.rules.system, data)
    decisions = -(-scenario.steps // scenario.control_every)
    rows = np.zeros((decisions if trace else 0, signals.row.size))
    metrics = FlightMetrics()
    BoundCall(fly, (model, data, calls, metrics, np.zeros(len(inputs)), rows)).call()
    bound_law.raise_error()
    rules.raise_error()
    columns = signals.columns
    flown = Rows(columns, {column.name: values for column, values in zip(columns, rows.T, strict=True)})
    return metrics, model, data, flown


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
