"""The co-simulation master: steps plant, arbiter and controller, and publishes their signals."""

# `Master.run` loops over the steps; `Master.step` does one, with a call for each stage. After each step the observers
# receive the row of signals, which is read-only, and which the next step overwrites.

from __future__ import annotations

import math
import time
from collections.abc import Sequence
from types import TracebackType
from typing import Protocol

import numpy as np

from controller import CompiledLaw, Law, VehicleState
from controller.law import NOTHING_EXPECTED
from controller.quaternion import from_axis_angle
from cosim.scenario.law_factory import law_of, with_custom_law
from cosim.scenario.scenario import Scenario
from cosim.scenario.start_values import start_values
from cosim.simulation.actuators import Actuators
from cosim.simulation.arbitration import Arbitration
from cosim.simulation.columns import columns_of
from cosim.simulation.commands.command_handler import CommandHandler
from cosim.simulation.commands.commands import Command
from cosim.simulation.commands.sources import CommandSource
from cosim.simulation.environment import RegionEnvironment
from cosim.simulation.lyapunov_signals import LyapunovSignals
from cosim.simulation.pace import Pace
from cosim.simulation.sensor_navigation import SensorNavigation, make_sensing
from cosim.simulation.signals import Array, Signals
from cosim.simulation.stepped_plant import SteppedPlant, validate_plant
from fuzzy_arbiter import Arbiter
from plant_fmu import Plant

_ARMING_PERIOD = 0.005  # s of the wall clock, between polls of the commands while the run waits for arming
_ROUNDING = 1e-6  # tolerance of times, as a fraction of a step
_DOWN: Array = np.array([0.0, 0.0, 1.0])
_FIRST_APPLIED = "thruster_force[1]"  # outputs before it are read before doStep, it and the later ones after


class Observer(Protocol):
    """Receives the row of signals after each step."""

    def observe(self, k: int, row: Array) -> None:
        """Take the row of step `k`, shape (n,). The next step overwrites it: copy what you keep."""
        ...


class Master:
    """The co-simulation of one scenario: FMU, law, arbiter and regions, set up once; `run` steps them.

    Parameters
    ----------
    scenario : Scenario
        Scenario of the run.
    law : Law, optional
        Control law; default: the scenario's.
    plant : SteppedPlant, optional
        Plant with the channels of the vehicle's FMU, which the master closes; default: that FMU. The caller sets
        further inputs, such as those of a coupled plant.

    Attributes
    ----------
    signals : Signals
        Row that each step fills.
    true_state, state : VehicleState
        The plant's state, and the measured one that law and arbiter receive; the same object where sensing is exact.
    navigator : Navigator or None
        Filter that estimates the state; None unless sensing is through sensors.

    Raises
    ------
    PlantError, BuildError
        If the FMU refuses the scenario's numbers, or there is none and none can be built.
    LawError, DefinitionError, ScenarioError
        If law or arbiter cannot be set up, or the scenario needs a feature that a custom law lacks.
    RunError
        If the plant lacks a channel of the vehicle's FMU.

    Examples
    --------
    >>> import cosim
    >>> with cosim.Master(cosim.load_scenario("paper")) as master:
    ...     for k in range(3):
    ...         master.step(k)
    ...     print(master.row[0].round(3))
    0.002
    """

    def __init__(self, scenario: Scenario, law: Law | None = None, plant: SteppedPlant | None = None) -> None:
        if law is not None:
            scenario = with_custom_law(law, scenario)  # raises for keys that such a law does not support
        if plant is not None:
            validate_plant(plant, scenario.vehicle)
        self.scenario = scenario
        self.arbiter = Arbiter(system=scenario.rules.system, engine=scenario.arbiter.engine)
        self.law: Law = law_of(scenario) if law is None else law
        self._jacobi = scenario.master.order == "jacobi"
        self._failures = bool(scenario.failures)
        self.environment = RegionEnvironment(scenario)
        self._boundary = 0.0  # s, beginning of the next step

        self.plant: SteppedPlant = Plant(scenario.vehicle, scenario.plant.fmi) if plant is None else plant
        try:
            self.plant.set(start_values(scenario))
            self.plant.initialize()
            self.signals = Signals(columns_of(scenario, self.plant, self.law))
            self._bind()
        except BaseException:
            self.plant.close()
            raise

    def _bind(self) -> None:
        """Bind actuators, sensing, arbiter and commands to their parts of the row."""
        s, n = self.signals, len(self.scenario.regions)
        self.actuators = Actuators(self.scenario, self.plant, s)
        plant, n_outputs = self.plant, len(self.plant.outputs)
        n_measured = plant.outputs.names.index(_FIRST_APPLIED)
        # memoryviews: copying one takes a third of the time of copying an array
        outputs, plant_outputs = s.view("position.x", n_outputs).data, plant.outputs.values.data
        self._measured, self._plant_measured = outputs[:n_measured], plant_outputs[:n_measured]
        self._applied, self._plant_applied = outputs[n_measured:], plant_outputs[n_measured:]
        self._flags = s.view("position.x", n_outputs + len(plant.flags))[n_outputs:]
        self._raised = b""  # the flags as they were last written into the row

        true_state = VehicleState(
            position=s.view("position.x", 3),
            quaternion=s.view("quaternion.e0", 4),
            velocity_body=s.view("velocity.u", 6),
            thruster_health=self.actuators.health,
        )
        self.true_state = true_state
        self.state, self._sensor = make_sensing(self.scenario, self.plant, s, true_state)
        self.navigator = self._sensor.navigator if isinstance(self._sensor, SensorNavigation) else None

        values, clearances = s.view("goal.value", n + 1), s.view("goal.clearance", n + 1)
        # where sensing is exact, the arbiter uses the evaluation that is recorded
        self._true_evaluation = self._given_evaluation = self.environment.empty_evaluation(values, clearances)
        if self._sensor is not None:
            self._given_evaluation = self.environment.empty_evaluation(np.zeros(n + 1), np.zeros(n + 1))
        moving, then = self.scenario.moving, self.scenario.goal_then
        self._goal_place = s.view("goal.place", 1) if then else np.empty(0)
        self._shifts = s.view(f"{moving[0]}.shift.x", 3 * len(moving)).reshape(-1, 3) if moving else np.empty((0, 3))
        names, inputs = self.scenario.criterion_names, self.scenario.rules.inputs
        self._arbitration = Arbitration(
            self.scenario, self.arbiter, self.state, s.row[:1], self._given_evaluation.clearances[1:],
            s.view(f"membership.{names[0]}", len(names)), s.view(f"weight.{names[0]}", len(names)),
            s.view(f"arbiter.{inputs[0].name}", len(inputs)) if self.scenario.arbiter.file else None,
        )  # fmt: skip
        self._expected = NOTHING_EXPECTED  # the law's prediction for the next step; unused where sensing is exact
        self._estimate = s.view("estimate.phi1", 4)
        n_reports = len(self.law.diagnostics)
        self._reports = n_reports > 0
        self._report = s.view(f"law.{self.law.diagnostics[0].name}", n_reports) if n_reports else np.empty(0)
        self._lyapunov: LyapunovSignals | None = None
        self.command_handler: CommandHandler | None = None
        if self.scenario.commands.enabled:
            self.command_handler = CommandHandler(
                self.scenario, self.environment, self.actuators, self.state, s.view("commands.armed", 7)
            )
        if self.scenario.record.lyapunov:
            out, goal, regions = s.view("lyapunov.printed", 4), self.environment.goal, self.environment.regions
            weights = self._arbitration.region_weights
            self._lyapunov = LyapunovSignals(self.scenario, true_state, goal, regions, weights, self._estimate, out)

    @property
    def row(self) -> Array:
        """The row of the present step, shape (n,), read-only."""
        row = self.signals.row.view()
        row.flags.writeable = False
        return row

    def run(
        self,
        observers: Sequence[Observer] = (),
        rate: float | None = None,
        commands: CommandSource | None = None,
        awaiting: Observer | None = None,
    ) -> None:
        """Step from time 0 to the end, once, and pass each row to the observers.

        The row of step k holds measurements and decisions from its beginning, and the applied forces from its end.

        Parameters
        ----------
        observers : sequence of Observer
            Observers, called in this order after each step.
        rate : float, optional
            Greatest number of simulated seconds per wall-clock second; default: no limit.
        commands : CommandSource, optional
            Commands during the run, if the scenario's commands are enabled. With `commands.await_arm` the first step
            waits for the command to arm. A command to reset ends the run.
        awaiting : Observer, optional
            Receives the row of the initial state, as step 0, while the run waits for arming.

        Raises
        ------
        PlantError
            If the FMU fails in a step.
        """
        step, last = self.scenario.time.step, self.scenario.steps
        row = self.row
        waited = self._await_arming(commands, awaiting)
        pace = None if rate is None else Pace(step / rate)
        for k in range(last + 1):
            self.step(k, commands if k or not waited else None)
            for observer in observers:
                observer.observe(k, row)
            if self.command_handler is not None and self.command_handler.reset:
                return
            if pace is not None:
                pace.wait()

    def step(self, k: int, commands: CommandSource | None = None) -> None:
        """Do step `k`; call it once for each step, in order, from 0. The last step does not advance the plant.

        Parameters
        ----------
        k : int
            Number of the step.
        commands : CommandSource, optional
            Commands during the run, as for `run`.

        Raises
        ------
        PlantError
            If the FMU fails.
        """
        scenario, step, jacobi = self.scenario, self.scenario.time.step, self._jacobi
        self.signals.row[0] = k * step
        if self._failures:
            self._fail_scheduled_thrusters(k)
        if jacobi and k:
            self._exchange_delayed(k - 1)
        self._measure(k)
        if self.command_handler is not None and commands is not None:
            self._apply_commands(self.command_handler, commands.take(k))
        self._evaluate_regions()
        if self.command_handler is not None and self.command_handler.update(
            float(self.signals.row[0]), float(self._given_evaluation.clearances[0])
        ):
            self._apply_commands(self.command_handler, ())  # changes by the next mission item
            self._evaluate_regions()
        if not jacobi and k % scenario.arbiter_every == 0:
            self._arbitrate()
        if k % scenario.control_every == 0:
            self._control()
        if self._lyapunov is not None:
            self._lyapunov.write()
        if k < scenario.steps:
            self.actuators.write_inputs()
            self._step_plant(step)
        self._boundary = (k + 1) * step

    # ---- the stages of a step ----

    def _fail_scheduled_thrusters(self, k: int) -> None:
        """Fail the thrusters that are scheduled for step `k`."""
        for failure in self.scenario.failures:
            if k == math.ceil(failure.time / self.scenario.time.step - _ROUNDING):
                self.actuators.fail(failure)

    def _measure(self, k: int) -> None:
        """Copy the plant's outputs into the row, and update the measured state."""
        self._measured[:] = self._plant_measured
        if self._sensor is not None:
            self._sensor.measure(self.signals.row[0], k % self.scenario.control_every == 0)

    def measure_initial_state(self) -> None:
        """Fill the row with the initial state, which law and arbiter receive without noise; do not step the plant."""
        self._measured[:] = self._plant_measured
        for given, true in zip(self.state[:3], self.true_state[:3], strict=True):  # the same where sensing is exact
            given[:] = true
        self._evaluate_regions()
        if self.command_handler is not None:
            self.command_handler.update(0.0, float(self._given_evaluation.clearances[0]))

    def _await_arming(self, commands: CommandSource | None, awaiting: Observer | None) -> bool:
        """Apply commands before step 0 until one arms the vehicle or the source is exhausted; return True if waited."""
        command_handler = self.command_handler
        if command_handler is None or command_handler.armed or commands is None:
            return False
        while not (command_handler.armed or commands.exhausted):
            self.measure_initial_state()
            self._apply_commands(command_handler, commands.take(0))
            command_handler.reset = False  # no step has been done: there is nothing to reset
            if awaiting is not None:
                awaiting.observe(0, self.row)
            time.sleep(_ARMING_PERIOD)
        return True

    def _apply_commands(self, command_handler: CommandHandler, commands: Sequence[Command]) -> None:
        """Apply the commands of this step, and pass changed settings to law and arbiter."""
        for command in commands:
            command_handler.apply(command, float(self.signals.row[0]))
        if command_handler.control_regained:
            self.law = law_of(self.scenario)
        if isinstance(self.law, CompiledLaw) and (
            command_handler.control_regained or command_handler.changed or command_handler.turned
        ):
            self.law.gains = command_handler.settings.gains
            if command_handler.heading is not None:
                self.law.set_attitude(from_axis_angle(_DOWN, command_handler.heading))
        if command_handler.changed:
            self._arbitration.set_ramp(command_handler.settings["arbiter.ramp"])
        command_handler.mark_applied()

    def _evaluate_regions(self) -> None:
        """Move the regions to the present time, and evaluate them at the arbiter's pose and at the true pose."""
        self.environment.update_positions(self.signals.row[0], self._shifts)
        self._arbitration.observe(self._expected)
        if self._sensor is not None:
            self.environment.evaluate(self._arbitration.state, self._given_evaluation)
        self.environment.evaluate(self.true_state, self._true_evaluation)
        self.environment.advance_goal(self._true_evaluation.clearances[0], self._goal_place)

    def _arbitrate(self) -> None:
        """Compute the criteria's weights; while the position is lost, keep the last ones."""
        if self._position_known:
            self._arbitration.decide(self.environment.goal, self.environment.regions)

    def _exchange_delayed(self, before: int) -> None:
        """Pass on the outputs that regions and arbiter computed from the inputs of step `before` (Jacobi)."""
        if before % self.scenario.arbiter_every == 0:
            self._arbitration.weigh()
        if self._position_known:
            self._arbitration.update(self.environment.goal, self.environment.regions)

    @property
    def _position_known(self) -> bool:
        return self._sensor is None or bool(np.isfinite(self.state.position).all())

    def _control(self) -> None:
        """Compute the forces of the coming control period, by law or manual control, and allocate them."""
        actuators = self.actuators
        self._expected = NOTHING_EXPECTED
        if self.command_handler is not None and not self.command_handler.automatic_control:
            actuators.command[:] = self.command_handler.wrench()
            actuators.allocate()
            return
        if self.navigator is not None and not self.navigator.started:  # there is no state estimate yet
            actuators.command[:] = actuators.thrusts[:] = 0.0
            actuators.allocate()
            return
        self._estimate[...] = self.law.estimate
        law, by_wrench = self.law, self.law.output == "wrench"
        forces = actuators.command if by_wrench else actuators.thrusts
        law.step(self.state, self.environment.goal, self.environment.regions, self._arbitration.region_weights, forces)
        if self._reports:
            self._report[...] = law.report
        if self._sensor is not None and isinstance(law, CompiledLaw):
            self._expected = law.expected
        if by_wrench:
            actuators.allocate()
        else:
            actuators.apply_thrusts()

    def _step_plant(self, step: float) -> None:
        self.plant.step(step)
        self._applied[:] = self._plant_applied
        flags = self.plant.read_flags()
        raised = flags.tobytes()
        if raised != self._raised:
            self._flags[...], self._raised = flags, raised

    def move_region(self, name: str, displacement: Array, velocity: Array) -> None:
        """Set position and velocity of a streamed region from the next step on.

        Call it between steps: before `run`, or in an observer.

        Parameters
        ----------
        name : str
            Name of a region with ``streamed = true`` in the scenario, or ``"goal"``.
        displacement : array_like, shape (3,)
            Displacement at the beginning of the next step, from the region's place in the scenario [m, NED].
        velocity : array_like, shape (3,)
            Velocity from the next step on [m/s, NED]; the law receives it too.

        Raises
        ------
        RunError
            If there is no such region, it is not streamed, or a number is not finite.
        """
        self.environment.move(name, displacement, velocity, self._boundary)

    def close(self) -> None:
        """Free the FMU. May be called twice."""
        self.plant.close()

    def __enter__(self) -> Master:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.close()
