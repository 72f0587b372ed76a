"""From the commanded wrench to the inputs of the plant: thruster allocation, limits, and thruster failures."""

from __future__ import annotations

import numpy as np

from controller.allocation import Allocation
from controller.linear_algebra import product
from cosim.scenario.scenario import Scenario
from cosim.scenario.tables import Failure
from cosim.simulation.signals import Array, Signals
from cosim.simulation.stepped_plant import SteppedPlant

# N, N m: bound of the wrench in runs with commands, where a far target makes some laws ask for any force
MAX_WRENCH = 1e5


class Actuators:
    """Writes a wrench, or thruster forces, to the plant's inputs."""

    def __init__(self, scenario: Scenario, plant: SteppedPlant, signals: Signals) -> None:
        self._scenario, self._plant = scenario, plant
        vehicle = scenario.vehicle
        self._bounded = scenario.commands.enabled
        self.command = signals.view("command.X", 6)  # commanded wrench [N, N m], body frame
        self._saturated = signals.view("allocation_saturated", 1)
        inputs, n = signals.view("thrust[1]", len(plant.inputs)), vehicle.n_thrusters + 6
        # thrusts: commanded thruster forces [N]
        self.thrusts, self._wrench = inputs[: vehicle.n_thrusters], inputs[vehicle.n_thrusters : n]
        # memoryviews: copying one takes a third of the time of copying an array
        self._asked, self._given = self.command.data, self._wrench.data
        self._decided, self._sent = inputs[:n].data, plant.inputs.values[:n].data
        # further inputs, such as those of a coupled plant, are the caller's, and recorded as they are
        self._further, self._further_sent = inputs[n:].data, plant.inputs.values[n:].data
        self._delayed = np.zeros(n).data if scenario.master.order == "jacobi" else None
        self._stuck: dict[int, float] = {}  # force [N] of each stuck thruster, from 0
        self.health: Array = np.ones(vehicle.n_thrusters)
        self._limits = {"thrust_min": vehicle.thrust_min.copy(), "thrust_max": vehicle.thrust_max.copy()}
        self._allocate_to_the_healthy()

    def fail(self, failure: Failure) -> None:
        """Fail a thruster now; if the scenario reports failures and it is a total one, set its health to 0."""
        if failure.stuck:
            self._stuck[failure.thruster - 1] = float(self._plant.inputs.values[failure.thruster - 1])
        else:
            self._plant.set({f"thrust_effectiveness[{failure.thruster}]": failure.effectiveness})
        if self._scenario.report_failures and failure.is_total:
            self.health[failure.thruster - 1] = 0.0
            self._allocate_to_the_healthy()

    def limit(self, parameter: str, value: float) -> None:
        """Set a limit of the plant, such as ``thrust_max[1]``, and allocate within it; the law does not receive it."""
        self._plant.set({parameter: value})
        kind, _, rest = parameter.partition("[")
        if kind in self._limits:
            self._limits[kind][int(rest[:-1]) - 1] = value
            self._allocate_to_the_healthy()

    def allocate(self) -> None:
        """Allocate the wrench `command` to the plant's inputs."""
        if self.allocation is None:
            self._given[:] = self._asked
            if self._bounded:
                self._saturated[0] = saturate(self._wrench)
        else:
            self._saturated[0] = self.allocation(self.command, self.thrusts)

    def apply_thrusts(self) -> None:
        """Apply the forces `thrusts` as the plant's inputs, and write their wrench into `command`."""
        product(self._scenario.vehicle.thruster_matrix, self.thrusts, self.command)

    def write_inputs(self) -> None:
        """Write the inputs of a step to the plant: those of this step, or under Jacobi those of the step before."""
        if self._delayed is None:
            self._sent[:] = self._decided
        else:
            self._sent[:] = self._delayed
            self._delayed[:] = self._decided
        for j, force in self._stuck.items():
            self._plant.inputs.values[j] = force
        if self._further:
            self._further[:] = self._further_sent

    def _allocate_to_the_healthy(self) -> None:
        actuation = self._scenario.actuation
        self.allocation: Allocation | None = None
        if actuation.through == "thrusters":
            self.allocation = Allocation(
                self._scenario.vehicle.thruster_matrix,
                self._limits["thrust_min"] * self.health,
                self._limits["thrust_max"] * self.health,
                actuation.limits,
            )


def saturate(wrench: Array) -> bool:
    """Scale force and moment of a wrench in place to at most `MAX_WRENCH`; set them to 0 if they are not finite."""
    # with wrench [N, N m]
    changed = False
    for part in (wrench[:3], wrench[3:]):
        maximum = float(np.max(np.abs(part)))
        if not maximum <= MAX_WRENCH:
            part[:] = part * (MAX_WRENCH / maximum) if maximum < np.inf else 0.0
            changed = True
    return changed
