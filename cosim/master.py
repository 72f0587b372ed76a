"""The co-simulation master: one step of plant, arbiter and controller, from measuring to publishing.

Read `Master.run` from top to bottom: each stage is one call. Observers see the row of signals when a step is done; they
copy what they keep, and cannot change it.
"""

from __future__ import annotations

import time
from collections.abc import Sequence
from types import TracebackType
from typing import Protocol

import numpy as np

from controller import Allocation, Law, PrintedLaw, VehicleState
from controller.regions import Region, pack
from cosim.lyapunov import LyapunovSignals, lyapunov_columns
from cosim.scenario import CRITERIA, Scenario
from cosim.signals import Array, Column, Signals
from fuzzy_arbiter import Arbiter, ramp
from plant_fmu import Channels, Plant

_LONGEST_SLEEP = 3600.0  # s
_FIRST_APPLIED = "thruster_force[1]"  # outputs before it are read at the beginning of a step, from it on at the end


class Observer(Protocol):
    """Listens to a run."""

    def observe(self, k: int, row: Array) -> None:
        """Take the row of step `k`, shape (n,); it is overwritten in the next step, so copy what is kept."""
        ...


class Master:
    """Everything that a run needs, made once; `run` then steps it.

    Parameters
    ----------
    scenario : Scenario
        What to run.

    Attributes
    ----------
    signals : Signals
        The row that each step fills.

    Raises
    ------
    PlantError
        If the FMU refuses the scenario's numbers.
    BuildError
        If there is no FMU and none can be built.
    LawError, DefinitionError
        If law or arbiter cannot be set up.
    """

    def __init__(self, scenario: Scenario) -> None:
        self.scenario = scenario
        self.arbiter = Arbiter(engine=scenario.arbiter.engine, points=scenario.arbiter.points)
        self.law: Law = PrintedLaw(
            scenario.law.gains,
            np.array(scenario.law.desired_quaternion),
            scenario.time.control,
            len(scenario.regions),
        )
        vehicle = scenario.vehicle
        self.allocation: Allocation | None = None
        if scenario.actuation.through == "thrusters":
            self.allocation = Allocation(
                vehicle.thruster_matrix, vehicle.thrust_min, vehicle.thrust_max, scenario.actuation.limits
            )
        self.goal = pack([Region("goal", scenario.goal, "in")])
        self.regions = pack([secondary.region for secondary in scenario.regions])
        self._criterion_of = [CRITERIA.index(secondary.criterion) for secondary in scenario.regions]

        self.plant = Plant(vehicle, scenario.plant.fmi)
        try:
            self.plant.set(_start_values(scenario))
            self.plant.initialise()
            self.signals = Signals(_columns(scenario, self.plant))
            self._bind()
        except BaseException:
            self.plant.close()
            raise

    def _bind(self) -> None:
        """Name the parts of the row, and the buffers beside it."""
        s, n, n_thrusters = self.signals, len(self.scenario.regions), self.scenario.vehicle.n_thrusters
        plant, n_outputs = self.plant, len(self.plant.outputs)
        outputs = s.view("position.x", n_outputs + len(plant.flags))
        n_measured = plant.outputs.names.index(_FIRST_APPLIED)
        self._measured, self._applied, self._flags = np.split(outputs, [n_measured, n_outputs])
        self._plant_measured, self._plant_applied = np.split(plant.outputs.values, [n_measured])

        self.state = VehicleState(
            position=s.view("position.x", 3),
            quaternion=s.view("quaternion.e0", 4),
            velocity_body=s.view("velocity.u", 6),
            thruster_health=np.ones(n_thrusters),
        )
        self._values, self._clearances = s.view("goal.value", n + 1), s.view("goal.clearance", n + 1)
        self._gradients: Array = np.zeros((n + 1, 3))
        self._memberships = s.view(f"membership.{CRITERIA[0]}", len(CRITERIA))
        self._weights = s.view(f"weight.{CRITERIA[0]}", len(CRITERIA))
        self._weights_of_regions: Array = np.zeros(n)
        self._estimate = s.view("estimate.phi1", 4)
        self._command = s.view("command.X", 6)
        self._allocation_cut = s.view("allocation_saturated", 1)
        inputs = s.view("thrust[1]", len(self.plant.inputs))
        self._thrusts, self._wrench = inputs[:n_thrusters], inputs[n_thrusters:]
        self._inputs = inputs
        self._lyapunov: LyapunovSignals | None = None
        if self.scenario.record.lyapunov:
            out = s.view("lyapunov.printed", 4)
            self._lyapunov = LyapunovSignals(
                self.scenario, self.state, self.goal, self.regions, self._weights_of_regions, self._estimate, out
            )

    def run(self, observers: Sequence[Observer] = (), rate: float | None = None) -> None:
        """Step from time 0 to the end, once, telling the observers of each step.

        The row of step k holds what was measured and decided at its beginning, and the forces that acted at its end.

        Parameters
        ----------
        observers : sequence of Observer
            Told in this order.
        rate : float, optional
            Simulated seconds a wall-clock second at the most; default: as fast as it goes.

        Raises
        ------
        PlantError
            If the FMU fails in a step.
        """
        scenario, row = self.scenario, self.signals.row
        seen = row.view()
        seen.flags.writeable = False
        step, last = scenario.time.step, scenario.steps
        started = time.perf_counter()
        for k in range(last + 1):
            row[0] = k * step
            self._measure()
            self._evaluate_regions()
            if k % scenario.arbiter_every == 0:
                self._arbitrate()
            if k % scenario.control_every == 0:
                self._control()
                self._actuate()
            if self._lyapunov is not None:
                self._lyapunov.write()
            if k < last:
                self._advance(step)
            for observer in observers:
                observer.observe(k, seen)
            if rate is not None:
                time.sleep(min(max(0.0, started + (k + 1) * step / rate - time.perf_counter()), _LONGEST_SLEEP))

    # ---- the stages of a step ----

    def _measure(self) -> None:
        self._measured[:] = self._plant_measured

    def _evaluate_regions(self) -> None:
        position = self.state.position
        self.goal.move_to(self.signals.row[0])
        self.regions.move_to(self.signals.row[0])
        self.goal.evaluate(position, self._values[:1], self._gradients[:1], self._clearances[:1])
        self.regions.evaluate(position, self._values[1:], self._gradients[1:], self._clearances[1:])

    def _arbitrate(self) -> None:
        """Turn clearances into memberships, of the most pressing region of each criterion, and these into weights."""
        width = self.scenario.arbiter.ramp
        memberships = [0.0] * len(CRITERIA)
        for criterion, clearance in zip(self._criterion_of, self._clearances[1:].tolist(), strict=True):
            memberships[criterion] = max(memberships[criterion], ramp(clearance, width))
        weights = self.arbiter(memberships)
        self._memberships[:] = memberships
        self._weights[:] = weights
        for i, criterion in enumerate(self._criterion_of):
            self._weights_of_regions[i] = weights[criterion]

    def _control(self) -> None:
        self._estimate[:] = self.law.estimate
        self.law.step(self.state, self.goal, self.regions, self._weights_of_regions, self._command)

    def _actuate(self) -> None:
        if self.allocation is None:
            self._wrench[:] = self._command
        else:
            self._allocation_cut[0] = self.allocation(self._command, self._thrusts)

    def _advance(self, step: float) -> None:
        self.plant.inputs.values[:] = self._inputs
        self.plant.step(step)
        self._applied[:] = self._plant_applied
        self._flags[:] = self.plant.read_flags()

    # ---- the end ----

    def close(self) -> None:
        """Free the FMU. May be called twice."""
        self.plant.close()

    def __enter__(self) -> Master:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.close()


def _start_values(scenario: Scenario) -> dict[str, float]:
    """Return what the FMU is told before initialisation."""
    initial, plant, limit = scenario.initial, scenario.plant, scenario.limit
    values = {"substep": plant.substep, "wrench_time_constant": limit.time_constant}
    if limit.force < np.inf:
        values["wrench_force_limit"] = limit.force
    for prefix, names, numbers in (
        ("current", "xyz", plant.current),
        ("position", "xyz", initial.position),
        ("quaternion", ("e0", "e1", "e2", "e3"), initial.quaternion),
        ("velocity", "uvwpqr", initial.velocity),
    ):
        values |= {f"{prefix}.{name}": number for name, number in zip(names, numbers, strict=True)}
    return values | plant.parameters


def _columns(scenario: Scenario, plant: Plant) -> list[Column]:
    """Return the columns of a row, in its order."""
    regions = [("goal", scenario.goal), *((r.region.name, r.region.shape) for r in scenario.regions)]
    force_units = ("N",) * 3 + ("N.m",) * 3
    return [
        Column("time", "s", "Simulated time at the beginning of the step"),
        *_of(plant.outputs),
        *_of(plant.flags),
        *(Column(f"{name}.value", shape.unit, f"g of {name}, above 0 where violated") for name, shape in regions),
        *(
            Column(f"{name}.clearance", "m", f"Distance to the surface of {name}, below 0 where violated")
            for name, _ in regions
        ),
        *(
            Column(f"membership.{name}", "", f"Degree to which criterion {name} asks for attention")
            for name in CRITERIA
        ),
        *(Column(f"weight.{name}", "", f"Weight of the criterion {name} from the arbiter") for name in CRITERIA),
        *(Column(f"estimate.phi{i + 1}", "N.m" if i else "N", f"Estimate of phi {i + 1} in (12)") for i in range(4)),
        *(
            Column(f"command.{name}", unit, "Wrench that the law asks for, body frame")
            for name, unit in zip("XYZKMN", force_units, strict=True)
        ),
        Column("allocation_saturated", "", "The thrusters' limits cut the wrench that the law asks for"),
        *_of(plant.inputs),
        *lyapunov_columns(scenario),
    ]


def _of(channels: Channels) -> list[Column]:
    return [Column(channel.name, channel.unit, channel.description) for channel in channels.channels]
