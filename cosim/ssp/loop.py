"""A scenario's controller in its FMU: model and data of its step, and the layout of their arrays in its memory."""

from __future__ import annotations

import numpy as np

from controller import CompiledLaw, LawError
from controller.navigation.measurements import N_SENSORS, N_VALUES
from cosim.scenario.law_factory import law_of
from cosim.scenario.scenario import Scenario
from cosim.simulation.make_step import exchanged_variables, make_data, make_model
from cosim.simulation.signals import Array, Column, Signals
from cosim.ssp.controller_step import ControllerInputs, ControllerOutputs
from cosim.ssp.memory import Memory, arrays_of
from cosim.step.step_model import Integers, StepData, StepModel


class Loop:
    """The arguments of `step_controller` for a scenario, in the memory of an FMU."""

    def __init__(self, scenario: Scenario) -> None:
        self.law: CompiledLaw = law_of(scenario)
        no_regions: Integers = np.empty(0, np.int64)
        self.model: StepModel = make_model(scenario, self.law)._replace(
            for_record=True, jacobi=True, moving=True, moving_regions=no_regions, control_every=1, arbiter_every=1
        )  # the importer sets velocities, and the C code counts the law's period
        inputs, outputs = exchanged_variables(scenario)
        signals, noise = Signals([Column("time", "s", "Simulated time")]), np.zeros((1, 6))
        self.data: StepData = make_data(scenario, self.model, self.law, signals, inputs, outputs, noise)
        self.data.measurements.times[:] = -np.inf
        n_values, n_sensors = (N_VALUES, N_SENSORS) if self.model.through_sensors else (0, 0)
        self.inputs = ControllerInputs(samples=np.zeros(n_values), sample_times=np.zeros(n_sensors))
        self.out = ControllerOutputs(m=self.data.thrusts.size, n=1 + len(scenario.regions))
        self.desired_quaternion = _attitude_of(self.law)
        self.period = _period_of(self.law, scenario.time.control)
        self.ramp = np.array([scenario.arbiter.ramp])
        self.memory = Memory()
        self.constants = self._allocate_arrays()

    def is_of_mission(self, array: Array) -> bool:
        """Return True if the mission writes an array, which then is no parameter of the FMU."""
        mission, data = self.model.mission, self.data
        return (
            (array is data.goal.numbers and bool(np.isfinite(mission.radii).any()))
            or (array is data.goal.velocities and bool((mission.paces > 0.0).any()))
            or (array is data.regions.velocities and mission.views.size > 0)
            or (array is self.desired_quaternion and mission.turns)
        )

    def member(self, array: Array, i: int = 0) -> str:
        """Return the member of the FMU's model that holds an item of an array."""
        return f"numbers[{self.memory.keep(array) + i}]"

    def _allocate_arrays(self) -> dict[str, int]:
        """Allocate what the importer sets, then outputs, then other variables; return the constants of the C header."""
        memory, model, data, inputs, out = self.memory, self.model, self.data, self.inputs, self.out
        for array in (
            data.goal.numbers, data.goal.velocities, data.regions.numbers, data.regions.gains, data.regions.velocities,
            self.desired_quaternion, self.period, self.ramp,
            inputs.start, inputs.motion, inputs.samples, inputs.sample_times, data.by_criterion,
        ):  # fmt: skip
            if not self.is_of_mission(array):
                memory.keep(array)
        n_settable = memory.size
        for array in (
            data.command, out.thrusts, out.lost, out.outages, data.signals.memberships, data.signals.inputs,
            data.estimate, out.values, out.clearances,
        ):  # fmt: skip
            memory.keep(array)
        n_outputs = memory.size - n_settable
        memory.keep(model.inputs.memberships.ramps)
        of_mission = data.goal.numbers, data.goal.velocities, data.regions.velocities
        for array in (data.goal.shifts, data.regions.shifts, *of_mission, *arrays_of(self.law.memory)):
            memory.keep(array)
        memory.fix(model, data.goal, data.regions, data.allocator, *map(data.storage, ("k", "manual", "failed_step")))
        if not model.through_sensors:
            memory.fix(data.navigation, data.measurements)
        return {
            "N_SETTABLE": n_settable,
            "N_OUTPUTS": n_outputs,
            "PERIOD_INDEX": memory.keep(self.period),
            "RAMP_INDEX": memory.keep(self.ramp),
            "NOW_INDEX": memory.keep(data.storage("now")),
            "END_INDEX": memory.keep(inputs.storage("end")),
            "CONTROLS_INDEX": memory.keep(inputs.storage("controls")),
            "NOISE_INDEX": memory.keep(data.noise),
            "N_GAINS": max(len(self.law.gains), 1),
        }

    def counters(self) -> dict[int, int]:
        """Return the largest valid number of each counter, by its index in the model's integers."""
        model, data, out = self.model, self.data, self.out
        counters = (
            (data.storage("stage"), len(data.allocator.lower) - 1),
            (data.storage("leg"), len(model.mission.stops) - 1),
            (data.storage("failures"), model.failed.size),
            (out.storage("failures"), model.failed.size),
            (out.storage("changes"), model.outage_steps.size),
        )
        return {self.memory.keep(counter): maximum for counter, maximum in counters}


def _period_of(law: CompiledLaw, period: float) -> Array:
    """Return the array of the period [s] in a law's memory, or an own one if it has none."""
    fields = law.memory._fields
    array: Array = law.memory[fields.index("period")] if "period" in fields else np.array([period])
    return array


def _attitude_of(law: CompiledLaw) -> Array:
    """Return the array in a law's memory that `set_attitude` writes."""
    attitude = law.desired_quaternion
    if not any(array is attitude for array in arrays_of(law.memory)):
        raise LawError(f"law {law.name}: desired_quaternion is not in its memory, expected an array that C can read")
    return attitude
