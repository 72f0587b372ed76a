"""A scenario's flight with all arrays of its step, before a plant exists."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from controller.law import Diagnostic
from controller.translator.static_data import Expression
from cosim.batch.fused import require_fused
from cosim.replay.view_columns import added_columns, is_drawn
from cosim.scenario.law_factory import law_of, require_no_fmus
from cosim.scenario.scenario import Scenario
from cosim.scenario.true_vehicle import start_values
from cosim.simulation.columns import columns_of_channels
from cosim.simulation.make_step import SENSED, exchanged_variables, make_data, make_model
from cosim.simulation.signals import Column, Signals
from cosim.simulation.stepped_plant import plant_calls, vehicle_channels
from cosim.step.score import FlightMetrics
from plant_fmu.running.channels import Channel
from plant_fmu.running.native import Native
from plant_fmu.variables import variables

NEVER = 2**62  # step of an unused failure


class Flight:
    """The arguments of `cosim.step.score.fly` and of the law for a scenario, with one more thruster failure."""

    def __init__(self, scenario: Scenario) -> None:
        require_fused(scenario, "an interactive replay")
        require_no_fmus(scenario, "an interactive replay")
        self.scenario, self.law, self.start = scenario, law_of(scenario), start_values(scenario)
        self.variables = {v.name: v for v in variables(scenario.vehicle)}
        self._references = {name: i for i, name in enumerate(self.variables)}
        through_state = scenario.sensing.through == "state"
        channels, sensed = vehicle_channels(scenario.vehicle), () if through_state else SENSED
        inputs, _ = exchanged_variables(scenario)
        outputs = [channel.name for channel in channels.outputs if is_drawn(channel.name) or channel.name in sensed]
        flags = [channel.name for channel in channels.flags if is_drawn(channel.name)]
        signals = Signals(_columns(scenario, outputs, flags, self.law.diagnostics))
        self.columns = {column.name: i for i, column in enumerate(signals.columns)}
        model = make_model(scenario, self.law, for_record=True)
        self.model = model._replace(
            # the page can add noise to an exact state
            exact=Expression("m->exact") if through_state and not scenario.sensing.dead_for > 0.0 else model.exact,  # type: ignore[arg-type]
            failed=np.append(model.failed, 0),
            failure_steps=np.append(model.failure_steps, NEVER),
            remaining=np.append(model.remaining, 0.0),
        )
        periods = scenario.steps // scenario.control_every
        self.noise = np.zeros((1 + periods if through_state else 0, 6))
        self.data = make_data(scenario, self.model, self.law, signals, inputs, outputs, self.noise, flags)
        self.plant = plant_calls(scenario.vehicle, self._native(inputs, outputs, flags), self._native)
        self.metrics = FlightMetrics()
        self.rows = np.zeros((-(-scenario.steps // scenario.control_every), len(self.columns)))
        self.fly = self.model, self.data, self.plant, self.metrics, np.zeros(len(inputs)), self.rows
        data, forces = self.data, self.data.command if model.law_gives_wrench else self.data.thrusts
        self.control = data.state, data.goal, data.regions, data.weights, self.law.gains, self.law.memory, forces

    def reference(self, name: str) -> int:
        """Return the value reference of a variable of the plant."""
        return self._references[name]

    def _native(self, inputs: Sequence[str], outputs: Sequence[str], flags: Sequence[str] = ()) -> Native:
        """Return the plant's C functions with buffers for some variables, at their start values."""

        def references(names: Sequence[str]) -> NDArray[np.uint32]:
            return np.array([self.reference(name) for name in names], np.uint32)

        return Native(
            instance=Expression("(intptr_t)PLANT"),
            set_values=Expression("(intptr_t)fmi3SetFloat64"),
            get_values=Expression("(intptr_t)fmi3GetFloat64"),
            do_step=Expression("(intptr_t)fmi3DoStep"),
            input_references=references(inputs),
            inputs=np.array([self.start.get(name, self.variables[name].start) for name in inputs], float),
            output_references=references(outputs),
            outputs=np.zeros(len(outputs)),
            results=np.zeros(5, np.int64),
            reached=np.zeros(1),
            get_flags=Expression("(intptr_t)fmi3GetBoolean"),
            flag_references=references(flags),
            flags=np.zeros(len(flags), np.bool_),
        )


def _columns(
    scenario: Scenario, outputs: Sequence[str], flags: Sequence[str], diagnostics: Sequence[Diagnostic]
) -> list[Column]:
    """Return the columns of a flight's row: those of a record that a page draws, and those that a page adds."""
    of_outputs, of_flags = ([Channel(name, "", "") for name in names] for names in (outputs, flags))
    recorded = columns_of_channels(scenario, of_outputs, of_flags, (), diagnostics)
    kept = (column for column in recorded if is_drawn(column.name) or column.name in outputs)
    return [*kept, *added_columns(scenario.rules.system)]
