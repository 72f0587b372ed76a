"""A scenario's flight with all arrays of the fused loop, before a plant exists."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import numpy as np

from controller.translator.static_data import Expression
from cosim.batch.flight_config import (
    LOSSES,
    Allocator,
    BoundArbiter,
    BoundLaw,
    FlightMetrics,
    FlightOutputs,
    make_workspace,
)
from cosim.batch.fused import configure_flight, exchanged_variables, failure_stages, require_fused
from cosim.scenario.law_factory import law_of
from cosim.scenario.scenario import Scenario
from cosim.scenario.start_values import start_values
from cosim.simulation.signals import Array
from cosim.ssp.memory import arrays_of
from plant_fmu.running.native import Native
from plant_fmu.variables import variables

NEVER = -1  # step of an unused failure


class Flight:
    """The arguments of `cosim.batch.fused_loop.fly` for a scenario, with a slot for one more thruster failure."""

    def __init__(self, scenario: Scenario) -> None:
        require_fused(scenario, "a page that flies")
        self.scenario, self.law = scenario, law_of(scenario)
        self.start = start_values(scenario)
        through, m = scenario.actuation.through == "thrusters", scenario.vehicle.n_thrusters
        self.setup = configure_flight(scenario, m if through else 0)
        decisions = -(-scenario.steps // scenario.control_every)
        self.noisy = scenario.sensing.through == "state"
        self.exact = self.noisy and not scenario.sensing.dead_for > 0.0
        self.noise = np.zeros((decisions if self.noisy else 0, 6))
        stages = failure_stages(scenario, self.setup) if through else _empty_allocator()
        self.setup = self.setup._replace(
            noise=self.noise,
            exact=Expression("m->exact") if self.exact else self.setup.exact,  # type: ignore[arg-type]
            failed=np.append(self.setup.failed, 0),
            failure_steps=np.append(self.setup.failure_steps, NEVER),
            remaining=np.append(self.setup.remaining, 1.0),
        )
        if self.setup.report_failures:
            inverse, lower, upper = (np.concatenate([rows, rows[-1:]]) for rows in stages[:3])
            stages = Allocator(inverse, lower, upper, stages.direction)
        self.allocator = stages
        inputs, outputs = exchanged_variables(scenario)
        self.native = self._plant(inputs, outputs)
        self.effectiveness = self._plant(tuple(f"thrust_effectiveness[{i + 1}]" for i in range(m)), ())
        self.losses = self._plant(LOSSES, ())
        criteria, n = len(scenario.criteria), len(scenario.regions)
        self.workspace = make_workspace(self.setup, criteria, len(inputs), m)
        rule_inputs, forces = self.workspace.signals.inputs.size, (m if through else 0) + 3
        self.trace = np.zeros((decisions, 17 + criteria + len(inputs) + self.law.report.size))
        self.reasons = np.zeros((decisions, 12 + n + criteria + rule_inputs + forces))
        self.metrics, self.estimate = np.zeros(len(FlightMetrics._fields)), np.zeros(4)
        self.expected = np.zeros(6)  # placeholder for the law's expected state, or for NaN where sensing is exact

    @property
    def decide(self) -> tuple[Any, ...]:
        """Arguments of the law."""
        through, wrench = self.setup.thrusters > 0, self.law.output == "wrench"
        setup, w = self.setup, self.workspace
        forces = w.wrench if through and wrench else self.native.inputs
        return w.state, setup.goal, setup.regions, w.weights, self.law.gains, self.law.memory, forces

    @property
    def fly(self) -> tuple[Any, ...]:
        """Arguments of the loop."""
        law = BoundLaw(
            Expression("(intptr_t)call_law"), Expression("(intptr_t)m"), self.law.output == "wrench", self.law.estimate,
            self.expected if self.exact else self.law.expected, self.law.report,
        )  # fmt: skip
        arbiter = BoundArbiter(Expression("(intptr_t)call_rules"), Expression("(intptr_t)m"))
        out = FlightOutputs(self.metrics, self.estimate, self.trace, self.reasons)
        plants = self.native, self.effectiveness, self.losses
        return self.setup, *plants, self.allocator, law, arbiter, self.workspace, out

    def arrays(self) -> Iterator[Array]:
        """Yield every array of loop and law, in an order that is the same for scenarios of one kind."""
        yield from arrays_of((self.fly, self.decide))

    def _plant(self, inputs: tuple[str, ...], outputs: tuple[str, ...]) -> Native:
        """Return the plant's C functions with buffers for some variables, at their start values."""
        table = {v.name: (i, v) for i, v in enumerate(variables(self.scenario.vehicle))}
        starts = [self.start.get(name, table[name][1].start) for name in inputs]
        return Native(
            instance=Expression("(intptr_t)PLANT"),
            set_values=Expression("(intptr_t)fmi3SetFloat64"),
            get_values=Expression("(intptr_t)fmi3GetFloat64"),
            do_step=Expression("(intptr_t)fmi3DoStep"),
            input_references=np.array([table[name][0] for name in inputs], np.uint32),
            inputs=np.array(starts, float),
            output_references=np.array([table[name][0] for name in outputs], np.uint32),
            outputs=np.zeros(len(outputs)),
            results=np.zeros(4, np.int64),
        )


def _empty_allocator() -> Allocator:
    return Allocator(np.zeros((1, 0, 6)), np.zeros((1, 0)), np.zeros((1, 0)), False)
