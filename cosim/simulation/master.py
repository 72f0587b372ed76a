"""The co-simulation master: steps plant, arbiter and controller, and publishes their signals."""

# A step is `cosim.step.one_step.step`, plain functions that run as C. `Master.run` does blocks of steps, and passes
# their rows to the observers; one step at a time where commands, observers or the caller may change it between steps.

from __future__ import annotations

import contextlib
import time
from collections.abc import Sequence
from types import TracebackType
from typing import Protocol, runtime_checkable

import numpy as np

from controller import CompiledLaw, Law
from controller.compiling.function import BoundCall, load_functions
from controller.quaternion import from_axis_angle
from cosim.scenario.law_factory import with_custom_law
from cosim.scenario.scenario import Scenario
from cosim.scenario.true_vehicle import start_values
from cosim.simulation.actuation_limits import ActuationLimits
from cosim.simulation.bindings import BoundLaw, bind_arbiter
from cosim.simulation.columns import channels_of_run, columns_of_channels
from cosim.simulation.commands.command_handler import CommandHandler
from cosim.simulation.commands.commands import Command
from cosim.simulation.commands.sources import CommandSource
from cosim.simulation.components import Components
from cosim.simulation.environment import RegionEnvironment
from cosim.simulation.fmu_law import FmuLaw, make_law
from cosim.simulation.lyapunov_signals import LyapunovSignals
from cosim.simulation.make_step import NoiseSource, make_data, make_model
from cosim.simulation.pace import Pace
from cosim.simulation.signals import Array, Signals
from cosim.simulation.step_functions import make_plant, step_functions
from cosim.simulation.stepped_plant import BoundPlant, SteppedPlant, validate_plant
from cosim.step.one_step import advance, locate, show_start
from cosim.step.step_model import LOCATED, MEASURED, set_call
from fuzzy_arbiter import Arbiter

_ARMING_PERIOD = 0.005  # s of the wall clock, between polls of the commands while the run waits for arming
_BLOCK = 256  # maximum number of steps of a block
_BLOCK_TIME = 0.002  # s of the wall clock that a block takes: Ctrl-C and other threads wait for its end
_DOWN: Array = np.array([0.0, 0.0, 1.0])


class Observer(Protocol):
    """Receives the row of signals after each step."""

    def observe(self, k: int, row: Array) -> None:
        """Take the row of step `k`, shape (n,). The next step overwrites it: copy what you keep."""
        ...


@runtime_checkable
class BlockObserver(Observer, Protocol):
    """Receives the rows of several steps at once; it must not change the run."""

    def observe_block(self, first: int, rows: Array) -> None:
        """Take the rows of the steps from `first` on, shape (steps, n). The next block overwrites them."""
        ...


class _Raising(Protocol):
    def raise_error(self) -> None:
        """Raise the error of the last call, if it raised one."""
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
        The plant's state, and the measured one that law and arbiter receive.
    model, data : StepModel, StepData
        Constants, and state and signals, of a step.

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
        self._arbiter = Arbiter(scenario.rules.system, engine=scenario.arbiter.engine)
        self._boundary = 0.0  # s, beginning of the next step

        self._open = contextlib.ExitStack()
        try:
            self._law: Law = make_law(scenario) if law is None else law
            if isinstance(self._law, FmuLaw):
                self._open.callback(self._law.close)
            if plant is not None:
                self._open.callback(plant.close)
                load_functions(*step_functions(scenario, self._law))
            self.plant: SteppedPlant = make_plant(scenario, self._law) if plant is None else plant
            self._open.callback(self.plant.close)
            self.plant.set(start_values(scenario))
            self.plant.initialize()
            self._channels = channels_of_run(scenario, plant)
            self.signals = Signals(columns_of_channels(scenario, *self._channels, self.law.diagnostics))
            self._components = Components(scenario, self.plant)
            self._open.callback(self._components.close)
            self._bind(own_plant=plant is None)
        except BaseException:
            self.close()
            raise

    def _bind(self, own_plant: bool) -> None:
        """Bind plant, law, arbiter and commands to the arrays of a step."""
        s, scenario = self.signals, self.scenario
        outputs, flags, inputs = ([channel.name for channel in channels] for channels in self._channels)
        self._noise = NoiseSource(scenario, 2 + _BLOCK // scenario.control_every)
        self.model = make_model(scenario, self.law, for_record=True)
        self.data = make_data(scenario, self.model, self.law, s, inputs, outputs, self._noise.values, flags)
        self._plant = BoundPlant(scenario, self.plant, self.data, own_plant, inputs)
        self._components.bind(scenario, self.model, self.data, s, inputs, self._plant.calls.native.inputs)
        self.true_state, self.state = self.data.true_state, self.data.state
        self.environment = RegionEnvironment(scenario, self.data)
        self._span = np.zeros(3, np.int64)
        self._rows: Array = np.zeros((_BLOCK, s.row.size))
        arguments = self.model, self.data, self._plant.calls
        block = *arguments, self._span, self._rows
        self._bound_law = BoundLaw(self.law, self.model, self.data, s)
        arbiter = bind_arbiter(self.arbiter, self.data)
        self._parts: list[_Raising] = [self._bound_law, arbiter, self._plant, self._components]
        self._advance_one = BoundCall(advance, (*arguments, self._span, self._rows[:0]))
        self._advance_block = BoundCall(advance, block)
        self._show_start = BoundCall(show_start, arguments)
        self._lyapunov: LyapunovSignals | None = None
        if scenario.record.lyapunov:
            self._lyapunov = LyapunovSignals(scenario, self.data, s.view("lyapunov.printed", 4))
        self.command_handler: CommandHandler | None = None
        self._commands: CommandSource | None = None  # of the present step
        if scenario.commands.enabled:
            limits = ActuationLimits(scenario, self.plant, self.model, self.data)
            self.command_handler = CommandHandler(
                scenario, self.environment, limits, self.data.state, s.view("commands.armed", 7)
            )
            self._locate = BoundCall(locate, (self.model, self.data))
            for when, function in ((MEASURED, self._take_commands), (LOCATED, self._continue_mission)):
                hook = BoundCall(function, ())
                set_call(self.data, when, hook)
                self._parts.append(hook)
        # the caller of a plant of its own, and commands, change it between steps
        self._in_blocks = own_plant and self._lyapunov is None and self.command_handler is None

    @property
    def law(self) -> Law:
        """The law, which its run cannot exchange."""
        return self._law

    @property
    def arbiter(self) -> Arbiter:
        """The arbiter, which its run cannot exchange."""
        return self._arbiter

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
            Observers, called in this order after each step, or after each block of steps.
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
        LawError, CommandError
            If a law in Python returns no forces; other errors of a law, an arbiter or a source of commands pass on.
        """
        if self._in_blocks and rate is None and all(isinstance(observer, BlockObserver) for observer in observers):
            self._run_blocks([observer for observer in observers if isinstance(observer, BlockObserver)])
        else:
            self._run_steps(observers, rate, commands, awaiting)

    def _run_blocks(self, observers: Sequence[BlockObserver]) -> None:
        """Do all steps in blocks, each of about the same wall-clock time."""
        k, size = 0, 1
        while k <= self.scenario.steps:
            started = time.perf_counter()
            n, self._span[2] = min(size, self.scenario.steps + 1 - k), 0
            try:
                self._advance(self._advance_block, k, n)
            finally:
                done = int(self._span[2])
                for observer in observers if done else ():
                    observer.observe_block(k, self._rows[:done])
            k += n
            size = max(1, min(_BLOCK, 4 * size, int(n * _BLOCK_TIME / (time.perf_counter() - started))))

    def _run_steps(
        self,
        observers: Sequence[Observer],
        rate: float | None,
        commands: CommandSource | None,
        awaiting: Observer | None,
    ) -> None:
        """Do all steps one by one."""
        row = self.row
        waited = self._await_arming(commands, awaiting)
        pace = None if rate is None else Pace(self.scenario.time.step / rate)
        for k in range(self.scenario.steps + 1):
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
        self._commands = commands
        self._advance(self._advance_one, k, 1)
        if self._lyapunov is not None:
            self._lyapunov.write()

    def _advance(self, call: BoundCall, k: int, n: int) -> None:
        """Do `n` steps from step `k` on; raise the error of plant, law, arbiter or command that ends one early."""
        step, span = self.scenario.time.step, self._span
        span[0], span[1], span[2] = k, n, 0
        self.data.failed_step = -1
        self._noise.draw(1 + (k + n - 1) // self.scenario.control_every)
        self._bound_law.refresh()
        self._plant.prepare_steps()
        try:
            call.call()
        finally:
            done = int(span[2])
            self._plant.count_steps(min(k + done, self.scenario.steps) - min(k, self.scenario.steps))
            self._boundary = (k + done) * step
        for part in self._parts:
            part.raise_error()
        if self.data.failed_step >= 0:
            self._plant.raise_failure()

    def measure_initial_state(self) -> None:
        """Fill the row with the initial state, which law and arbiter receive without noise; do not step the plant."""
        self._show_start.call()
        if self.command_handler is not None:
            self.command_handler.update(0.0, self._goal_clearance)

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

    # ---- called by a step of a run with commands ----

    def _take_commands(self) -> None:
        """Apply the commands of this step, after it has measured."""
        if self.command_handler is not None and self._commands is not None:
            self._apply_commands(self.command_handler, self._commands.take(int(self.data.k)))

    def _continue_mission(self) -> None:
        """Begin the next mission item if it is time, and compute a manual command, once the regions are evaluated."""
        handler, data = self.command_handler, self.data
        assert handler is not None
        if handler.update(float(data.now), self._goal_clearance):
            self._apply_commands(handler, ())  # changes by the next mission item
            self._locate.call()
        if data.k % self.model.control_every == 0:
            data.manual = not handler.automatic_control
            if data.manual:
                data.command[:] = handler.wrench()

    @property
    def _goal_clearance(self) -> float:
        """Clearance of the goal at the pose that the arbiter uses [m]."""
        evaluation = self.data.true_evaluation if self.model.exact else self.data.arbiter_evaluation
        return float(evaluation.clearances[0])

    def _apply_commands(self, command_handler: CommandHandler, commands: Sequence[Command]) -> None:
        """Apply the commands of this step, and pass changed settings to law and arbiter."""
        for command in commands:
            command_handler.apply(command, float(self.data.now))
        if command_handler.control_regained:
            self._bound_law.reset(self.scenario)
        if isinstance(self.law, CompiledLaw) and (
            command_handler.control_regained or command_handler.changed or command_handler.turned
        ):
            self.law.gains = command_handler.settings.gains
            self._bound_law.refresh()
            if command_handler.heading is not None:
                self.law.set_attitude(from_axis_angle(_DOWN, command_handler.heading))
        if command_handler.changed:
            memberships = self.model.inputs.memberships
            memberships.ramps[memberships.follows] = command_handler.settings["arbiter.ramp"]
        command_handler.mark_applied()

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
        """Free the FMUs. May be called twice."""
        self._open.close()

    def __enter__(self) -> Master:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.close()
