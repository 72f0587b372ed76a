"""What all micro-services share: the latest snapshot, the links, the way to give commands, and the status texts."""

from __future__ import annotations

import time
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

from cosim.errors import CommandError
from cosim.mavlink.vehicle.active_gcs import ActiveGcs
from cosim.mavlink.vehicle.geodesy import LocalFrame
from cosim.mavlink.vehicle.layout import Layout
from cosim.mavlink.vehicle.mission_item import ReceivedMissionItem
from cosim.mavlink.vehicle.profile import PROFILES
from cosim.mavlink.vehicle.proximity import Proximity
from cosim.mavlink.vehicle.status_texts import StatusTexts
from cosim.mavlink.vehicle.view import View
from cosim.mavlink.wire.dialect import dialect
from cosim.mavlink.wire.encode import Encoder
from cosim.mavlink.wire.message_sink import MessageSink
from cosim.mavlink.wire.options import MavlinkOptions
from cosim.scenario.scenario import Scenario
from cosim.scenario.tables import Vector3, Vector6
from cosim.simulation.commands.commands import Arm, Command, MissionItem, Mode, SetMode, SetTarget
from cosim.simulation.commands.settings import LiveSettings
from cosim.simulation.commands.sources import CommandQueue
from cosim.simulation.signals import Array, Column
from plant_fmu.autopilot import Autopilot, pulse_of_effort

COMPONENT_ID = 1  # MAV_COMP_ID_AUTOPILOT1: ground stations listen to no other

_WISH_LASTS = 0.5  # s, that a command may take until a snapshot shows it


@dataclass(frozen=True)
class Sender:
    """Who sent a message, and on which link."""

    link: MessageSink
    system: int
    component: int


class VehicleContext:
    """The vehicle as the micro-services see it.

    Parameters
    ----------
    scenario : Scenario
        What is run.
    columns : sequence of Column
        Of the rows.
    options : MavlinkOptions
        As whom it shows itself, and whom it heeds.
    commands : CommandQueue or None
        Where commands go; None for a vehicle that takes none.
    live : bool
        False for a recorded run.

    Attributes
    ----------
    mavlink : module
        The dialect.
    make : Encoder
        Makes messages.
    view : View
        The latest snapshot.
    waited_us : int
        For how long arming is awaited [µs], which counts as time since boot.
    has_view : bool
        Whether a snapshot came at all.
    links : list of MessageSink
        That are attached.
    settings : LiveSettings
        The numbers as they are once all commands are followed.
    proximity : Proximity
        What a scan of the water about it shows.
    frame : LocalFrame
        Where on the globe position 0 is.
    home : tuple of float
        North and east of home [m], which is at the surface.
    status_texts : StatusTexts
        Sends texts; `say`, `reject` and `text` are its own.
    now : float
        The wall clock, as it was told last [s].
    failsafe : bool
        Whether the ground station that commands is lost.
    loss_timeout, loss_action : float, str
        For how long it may be silent [s], and what is done then.
    plan : tuple of ReceivedMissionItem
        The mission, without home.
    course : tuple of MissionItem
        What its items ask for.
    sticks : tuple of float
        As commanded last, X Y Z K M N, from -1 to 1.
    """

    def __init__(
        self,
        scenario: Scenario,
        columns: Sequence[Column],
        options: MavlinkOptions,
        commands: CommandQueue | None,
        live: bool = True,
    ) -> None:
        self.scenario, self.options, self.live = scenario, options, live
        self.mavlink: Any = dialect()
        self.make = Encoder(self.mavlink)
        self.profile = PROFILES[options.profile]
        self.layout = Layout(scenario, columns)
        self.operator = ActiveGcs()
        self.links: list[MessageSink] = []
        self.now = 0.0
        self.failsafe = False
        self.loss_timeout, self.loss_action = options.loss_timeout, options.loss_action
        self.proximity = Proximity(scenario)
        self.frame = LocalFrame(*options.origin)
        self.unix_start_us = time.time_ns() // 1000  # when simulated time was 0
        vehicle = scenario.vehicle
        self._limits = tuple(zip((-vehicle.thrust_min).tolist(), vehicle.thrust_max.tolist(), strict=True))
        table = vehicle.autopilot if options.profile != "px4" else None
        table = table or Autopilot("", tuple(range(1, vehicle.n_thrusters + 1)), curve="linear")
        signs = table.signs if isinstance(table.signs, tuple) else (table.signs,) * vehicle.n_thrusters
        self._outputs, self._curves = table.channels, [pulse_of_effort(table, sign) for sign in signs]
        self._commands = commands if options.commands and live and scenario.commands.enabled else None
        self.status_texts = StatusTexts(self.mavlink, self.make, self.links, lambda: self.now)
        self.say, self.reject, self.text = self.status_texts.say, self.status_texts.reject, self.status_texts.text
        self.restart()

    def restart(self) -> None:
        """Forget what belongs to a run, as at its beginning."""
        self.waited_us = 0
        self.view = View(self.layout, self.layout.first_row(self.scenario))
        self.has_view = False
        self.settings = LiveSettings(self.scenario)
        self.home = (0.0, 0.0)
        self.plan: tuple[ReceivedMissionItem, ...] = ()
        self.course: tuple[MissionItem, ...] = ()
        self.sticks: Vector6 = (0.0,) * 6
        self._run = 0 if self._commands is None else self._commands.run
        self._wished: tuple[float, Mode] | None = None
        self._armed_before = self.view.armed
        self._mode_before: Mode = self.view.mode

    # ---- how things stand ----

    @property
    def accepts_commands(self) -> bool:
        """Whether it takes commands at all."""
        return self._commands is not None

    @property
    def outlived(self) -> bool:
        """Whether the run is over that it knows: it gives commands again once it has seen the next one."""
        return self._commands is not None and self._commands.run != self._run

    @property
    def armed(self) -> bool:
        """As the snapshot has it; before there is one, as commanded."""
        return self.view.armed if self.has_view else self._armed_before

    @property
    def mode(self) -> Mode:
        """As the snapshot has it; before there is one, as commanded."""
        return self.view.mode if self.has_view else self._mode_before

    @property
    def mode_ahead(self) -> Mode:
        """The mode once the commands on their way are followed."""
        if self._wished is not None and self.now - self._wished[0] <= _WISH_LASTS:
            return self._wished[1]
        return self.mode

    def look(self, row: Array) -> None:
        """Take the next snapshot."""
        self.view, self.has_view = View(self.layout, row, self.waited_us), True
        if self._wished is not None and self._wished[1] == self.view.mode:
            self._wished = None

    def home_ned(self) -> Vector3:
        """Return where home is [m, NED]."""
        return self.home[0], self.home[1], 0.0

    def thrust_parts(self) -> list[float]:
        """Return what each thruster gives, as a part of the vehicle's limit on that side, from -1 to 1."""
        return self._parts(self.view.thruster_forces)

    def servo_pulses(self) -> list[float]:
        """Return what each servo output says [us], by the vehicle's table ``autopilot``; 0 for an output of none.

        Without that table, and as PX4, a thruster's output has its number, and pulses go straight with the force.
        """
        pulses = [0.0] * max(self._outputs, default=0)
        for part, output, pulse in zip(
            self._parts(self.view.thruster_commands), self._outputs, self._curves, strict=True
        ):
            if output:
                pulses[output - 1] = pulse(part)
        return pulses

    def _parts(self, forces: Sequence[float]) -> list[float]:
        parts = []
        for force, (backwards, forwards) in zip(forces, self._limits, strict=True):
            limit = forwards if force > 0.0 else backwards
            parts.append(max(-1.0, min(1.0, force / limit)) if limit > 0.0 else 0.0)
        return parts

    # ---- commands ----

    def submit(self, *commands: Command) -> int:
        """Give commands, which are followed at the next step.

        Parameters
        ----------
        *commands : Command
            In this order.

        Returns
        -------
        int
            MAV_RESULT: accepted, denied where no commands can be given or the numbers cannot be, or temporarily
            rejected where the queue is full or the run is over.
        """
        m = self.mavlink
        if self._commands is None:
            self.reject("commands are off: start with --commands" if self.live else "this is a recorded run", "off")
            return int(m.MAV_RESULT_DENIED)
        for command in commands:
            try:
                if not self._commands.submit(command, self._run):
                    self.reject("the run is over" if self.outlived else "too many commands at once", "full")
                    return int(m.MAV_RESULT_TEMPORARILY_REJECTED)
            except CommandError as error:
                self.reject(str(error), "order")
                return int(m.MAV_RESULT_DENIED)
            self._foresee(command)
        return int(m.MAV_RESULT_ACCEPTED)

    def _foresee(self, command: Command) -> None:
        match command:
            case Arm():
                self._armed_before = command.armed
            case SetMode():
                self._foresee_mode(command.mode)
            case SetTarget():
                self._foresee_mode("reach")

    def _foresee_mode(self, mode: Mode) -> None:
        self._wished = None if mode == self.mode else (self.now, mode)
        self._mode_before = mode

    def send(self, message: Any) -> None:
        """Send a message on every link."""
        for link in self.links:
            link.send(message)
