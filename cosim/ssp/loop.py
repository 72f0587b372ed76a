"""The loop of a scenario in the controller's FMU: its functions in Python, and their arrays."""

# The functions are those of the master and the fused loop; `cosim.ssp.translated` translates them to C.

from __future__ import annotations

from typing import Any

import numpy as np

from controller import CompiledLaw, VehicleState
from controller.allocation import allocate
from controller.law import NOTHING_EXPECTED
from controller.navigation.estimate import empty_memory
from controller.navigation.measurements import empty_measurements
from controller.navigation.navigator import navigate
from controller.regions.region_set import PackedRegions, clearance_of_pose
from controller.stack_array import zeros
from cosim.batch.flight_config import Allocator, FlightConfig
from cosim.batch.fused import configure_flight, failure_stages
from cosim.scenario.law_factory import law_of
from cosim.scenario.scenario import Scenario
from cosim.simulation.arbiter_inputs import (
    ArbiterSignals,
    PackedInputs,
    compute_inputs,
    empty_signals,
    empty_state,
    write_arbiter_state,
)
from cosim.simulation.environment import RegionEvaluation, RegionPlaces, evaluate_places
from cosim.simulation.signals import Array


def decide(
    places: RegionPlaces,
    measured: VehicleState,
    expected: Array,
    state: VehicleState,
    evaluation: RegionEvaluation,
    inputs: PackedInputs,
    now: Array,
    signals: ArbiterSignals,
) -> None:
    """Evaluate the regions at the arbiter's pose, and compute the inputs of its rules; expected (6,), now (1,) [s]."""
    write_arbiter_state(measured, expected, state)
    evaluate_places(places, state, evaluation)
    compute_inputs(inputs, places.goal, places.regions, state, now, evaluation.clearances[1:], signals)


def allocate_wrench(allocator: Allocator, stage: Array, wrench: Array, forces: Array) -> None:
    """Allocate a wrench [N, N m] to thruster forces [N] while `stage` thrusters are reported as failed."""
    k = int(stage[0])
    allocate(allocator.inverse[k], allocator.lower[k], allocator.upper[k], allocator.direction, wrench, forces)


def find_goal(goal: PackedRegions, position: Array, quaternion: Array, clearance: Array) -> None:
    """Write the clearance of the goal at the true pose, shape (1,) [m]."""
    clearance[0] = clearance_of_pose(goal, 0, position, quaternion, zeros(3))


class Loop:
    """A scenario's loop without plant and arbiter."""

    def __init__(self, scenario: Scenario) -> None:
        m, n = scenario.vehicle.n_thrusters, len(scenario.regions)
        self.through_thrusters = scenario.actuation.through == "thrusters"
        self.setup: FlightConfig = configure_flight(scenario, m if self.through_thrusters else 0)
        self.law: CompiledLaw = law_of(scenario)
        self.allocates = self.through_thrusters and self.law.output == "wrench"
        self.state = VehicleState(np.zeros(3), np.array([1.0, 0.0, 0.0, 0.0]), np.zeros(6), np.ones(m), np.zeros(12))
        self.arbiter_state, self.expected = empty_state(), NOTHING_EXPECTED.copy()
        self.evaluation = RegionEvaluation(np.zeros(n + 1), np.zeros((n + 1, 3)), np.zeros((n + 1, 3)), np.zeros(n + 1))
        self.signals = empty_signals(self.setup.inputs, n, len(scenario.criteria))
        self.now, self.stage, self.goal_clearance = np.zeros(1), np.zeros(1), np.zeros(1)
        self.weights, self.wrench, self.thrusts = np.zeros(n), np.zeros(6), np.zeros(m)
        self.true_position, self.true_quaternion = np.zeros(3), np.zeros(4)
        self.measurements, self.navigation = empty_measurements(), empty_memory()
        self.allocator = failure_stages(scenario, self.setup)

    @property
    def functions(self) -> dict[str, tuple[Any, tuple[Any, ...]]]:
        """Functions that a step calls, with their arguments, by name in C."""
        goal, regions = self.setup.goal, self.setup.regions
        forces = self.wrench if self.law.output == "wrench" else self.thrusts
        calls: dict[str, tuple[Any, tuple[Any, ...]]] = {
            "decide": (decide, (
                RegionPlaces(goal, regions), self.state, self.expected, self.arbiter_state, self.evaluation,
                self.setup.inputs, self.now, self.signals,
            )),
            "steer": (type(self.law).function, (
                self.state, goal, regions, self.weights, self.law.gains, self.law.memory, forces,
            )),
        }  # fmt: skip
        if self.setup.through_sensors:
            sensors = self.setup.sensors
            given = (self.measurements, self.now, sensors, self.navigation, self.state)
            calls["navigate"] = navigate, given
        if self.allocates:
            calls["allocate"] = allocate_wrench, (self.allocator, self.stage, self.wrench, self.thrusts)
        if self.setup.goal_places.size:
            calls["find_goal"] = find_goal, (goal, self.true_position, self.true_quaternion, self.goal_clearance)
        return calls
