"""The arbiter in a run: from clearances and state to memberships and weights in the row of the step."""

from __future__ import annotations

import numpy as np

from controller import VehicleState
from controller.compiling.function import CompiledFunction
from controller.regions.region_set import PackedRegions
from cosim.scenario.scenario import Scenario
from cosim.simulation.arbiter_inputs import (
    ArbiterSignals,
    compute_inputs,
    empty_signals,
    empty_state,
    pack_inputs,
    write_arbiter_state,
)
from cosim.simulation.signals import Array
from fuzzy_arbiter import Arbiter


class Arbitration:
    """Computes memberships and weights from regions and state; reads and writes its arrays in place; now [s]."""

    def __init__(
        self,
        scenario: Scenario,
        arbiter: Arbiter,
        measured: VehicleState,
        now: Array,
        clearances: Array,
        memberships: Array,
        weights: Array,
        inputs: Array | None = None,
    ) -> None:
        self.region_weights: Array = np.zeros(len(scenario.regions))
        self._of_region = np.array(scenario.criterion_places, dtype=np.int64)
        self._arbiter, self._measured, self._now, self._clearances = arbiter, measured, now, clearances
        self.state = empty_state()
        self._memberships, self._weights, self._inputs = memberships, weights, inputs
        packed = pack_inputs(scenario.regions, scenario.criteria, scenario.rules, scenario.arbiter.ramp)
        self._packed = packed
        self._signals: ArbiterSignals = empty_signals(packed, len(scenario.regions), memberships.size)
        self._compute, self._write_state = CompiledFunction(compute_inputs), CompiledFunction(write_arbiter_state)
        self._weighed: list[float] | None = None  # inputs from which the present weights were computed

    def set_ramp(self, width: float) -> None:
        """Set the ramp [m or rad] of the memberships whose criterion has none of its own."""
        memberships = self._packed.memberships
        memberships.ramps[memberships.follows] = width

    def observe(self, expected: Array) -> None:
        """Write `state`: from the law's prediction `expected`, shape (6,), or the measurement where that is NaN."""
        self._write_state(self._measured, expected, self.state)

    def decide(self, goal: PackedRegions, regions: PackedRegions) -> None:
        """Compute memberships and weights from goal and regions at their present positions."""
        inputs = self._update(goal, regions)
        # the same inputs give the same weights, which are still in the row
        if inputs != self._weighed:
            self._weighed = inputs
            self._weigh(inputs)

    def weigh(self) -> None:
        """Compute the weights from the last inputs."""
        self._weigh(self._signals.inputs.tolist())

    def update(self, goal: PackedRegions, regions: PackedRegions) -> None:
        """Compute the memberships from goal and regions at their present positions; do not change the weights."""
        self._update(goal, regions)

    def _update(self, goal: PackedRegions, regions: PackedRegions) -> list[float]:
        signals = self._signals
        self._compute(self._packed, goal, regions, self.state, self._now, self._clearances, signals)
        self._memberships[:] = signals.memberships
        if self._inputs is not None:
            self._inputs[:] = signals.inputs
        inputs: list[float] = signals.inputs.tolist()
        return inputs

    def _weigh(self, inputs: list[float]) -> None:
        self._weights[:] = self._arbiter(inputs)
        self.region_weights[:] = self._weights[self._of_region]
