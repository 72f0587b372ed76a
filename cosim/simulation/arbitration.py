"""The arbiter within a run: clearances and the state in, memberships and weights out, into the row of the step."""

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
    """Decides by the regions and the state; arrays are read and written in place.

    Parameters
    ----------
    scenario : Scenario
        Its criteria, and what its rules get.
    arbiter : Arbiter
        Of these rules.
    measured : VehicleState
        As the law is given it.
    now : ndarray, shape (1,)
        Time [s].
    clearances : ndarray, shape (n,)
        Of each region at the pose of `state` [m], or [rad] of attitude.
    memberships, weights : ndarray, shape (criteria,)
        Receive those of each criterion.
    inputs : ndarray, shape (m,), optional
        Receives those of the rules.

    Attributes
    ----------
    state : VehicleState
        What it decides by.
    region_weights : ndarray, shape (n,)
        Weight of the criterion of each region.
    """

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
        self._weighed: list[float] | None = None  # inputs that the weights are of

    def set_ramp(self, width: float) -> None:
        """Let memberships that have no reason of their own reach 0 at another clearance [m or rad]."""
        memberships = self._packed.memberships
        memberships.ramps[memberships.follows] = width

    def observe(self, expected: Array) -> None:
        """Write the state that is decided by: what the law expected, shape (6,), or what is measured."""
        self._write_state(self._measured, expected, self.state)

    def decide(self, goal: PackedRegions, regions: PackedRegions) -> None:
        """Write the memberships and the weights, by goal and regions where they are now."""
        inputs = self._update(goal, regions)
        # the same inputs have the same weights, which stand in the row still
        if inputs != self._weighed:
            self._weighed = inputs
            self._weigh(inputs)

    def weigh(self) -> None:
        """Write the weights of what was worked out last."""
        self._weigh(self._signals.inputs.tolist())

    def update(self, goal: PackedRegions, regions: PackedRegions) -> None:
        """Write the memberships, by goal and regions where they are now, and leave the weights as they are."""
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
