"""State shared by all micro-services: the latest snapshot, the links, submission of commands, and status texts."""

from __future__ import annotations

import time
from collections.abc import Sequence
from dataclasses import dataclass
from enum import IntEnum
from typing import Any

from cosim.errors import CommandError
from cosim.mavlink.vehicle.active_gcs import ActiveGcs
from cosim.mavlink.vehicle.geodesy import LocalFrame
from cosim.mavlink.vehicle.profile import PROFILES
from cosim.mavlink.vehicle.proximity import Proximity
from cosim.mavlink.vehicle.row_layout import RowLayout
from cosim.mavlink.vehicle.status_texts import StatusTexts
from cosim.mavlink.vehicle.view import View
from cosim.mavlink.wire.dialect import dialect
from cosim.mavlink.wire.encode import Encoder
from cosim.mavlink.wire.link import Link
from cosim.mavlink.wire.options import MavlinkOptions
from cosim.scenario.region_tables import Vector3, Vector6
from cosim.scenario.scenario import Scenario
from cosim.simulation.commands.commands import Arm, Command, MissionItem, Mode, SetMode, SetTarget
from cosim.simulation.commands.settings import LiveSettings
from cosim.simulation.commands.sources import CommandQueue
from cosim.simulation.signals import Array, Column
from plant_fmu.autopilot import Autopilot, pulse_of_effort

_PREDICTION_TIME = 0.5  # s, within which a snapshot shows the effect of a command


class Result(IntEnum):
    """Result of a command: MAV_RESULT."""

    ACCEPTED = 0
    TEMPORARILY_REJECTED = 1
    DENIED = 2
    UNSUPPORTED = 3
    FAILED = 4


@dataclass(frozen=True)
class Sender:
    """Link, system and component of the sender of a message."""

    link: Link
    system: int
    component: int

    @property
    def address(self) -> tuple[int, int]:
        """Target system and component of a reply."""
        return self.system, self.component


@dataclass(frozen=True)
class ReceivedMissionItem:
    """The fields of MISSION_ITEM_INT; a station reads back what it wrote."""

    frame: int
    command: int
    autocontinue: int
    param1: float
    param2: float
    param3: float
    param4: float
    x: int  # 1e-7 deg, or 1e-4 m
    y: int
    z: float  # m


class VehicleContext:
    """State of the vehicle for the micro-services."""

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
        self.layout = RowLayout(scenario, columns)
        self.active_gcs = ActiveGcs()
        self.links: list[Link] = []
        self.now = 0.0  # wall clock at the last call of the autopilot [s]
        self.failsafe = self.has_ended = False
        # silence of the commanding station [s] after which the action is taken, and the action
        self.loss_timeout, self.loss_action = options.loss_timeout, options.loss_action
        self.proximity = Proximity(scenario)
        self.frame = LocalFrame(*options.origin)
        self.unix_start_us = time.time_ns() // 1000  # when simulated time was 0
        vehicle = scenario.vehicle
        self._limits = tuple(zip((-vehicle.thrust_min).tolist(), vehicle.thrust_max.tolist(), strict=True))
        table = vehicle.autopilot if options.profile != "px4" else None
        table = table or Autopilot("", tuple(range(1, vehicle.n_thrusters + 1)), curve="linear")
        self._outputs = table.channels
        self._curves = [pulse_of_effort(table, sign) for sign in table.sign_of_each(vehicle.n_thrusters)]
        self._commands = commands if options.commands and live and scenario.commands.enabled else None
        self.status_texts = StatusTexts(self.mavlink, self.make, self.links, lambda: self.now)
        self.send_text, self.reject = self.status_texts.send_text, self.status_texts.reject
        self.make_text = self.status_texts.make_text
        self.restart()

    def restart(self) -> None:
        """Reset the state that belongs to a run."""
        self.waited_us = 0
        self.view = View(self.layout, self.layout.make_first_row(self.scenario))
        self.has_view = False
        self.settings = LiveSettings(self.scenario)
        self.home = (0.0, 0.0)
        self.plan: tuple[ReceivedMissionItem, ...] = ()
        self.mission_items: tuple[MissionItem, ...] = ()
        self.sticks: Vector6 = (0.0,) * 6
        self._run = 0 if self._commands is None else self._commands.run
        self._predicted: tuple[float, Mode] | None = None
        self._armed_before = self.view.armed
        self._mode_before: Mode = self.view.mode

    # ---- state ----

    @property
    def accepts_commands(self) -> bool:
        """True if the vehicle accepts commands."""
        return self._commands is not None

    @property
    def run_has_ended(self) -> bool:
        """True if the run has ended and no snapshot of the next one was received; commands are rejected until then."""
        return self._commands is not None and self._commands.run != self._run

    @property
    def armed(self) -> bool:
        """Armed state of the snapshot; before the first, as commanded."""
        return self.view.armed if self.has_view else self._armed_before

    @property
    def mode(self) -> Mode:
        """Mode of the snapshot; before the first, as commanded."""
        return self.view.mode if self.has_view else self._mode_before

    @property
    def mode_ahead(self) -> Mode:
        """Mode after the submitted commands are applied."""
        if self._predicted is not None and self.now - self._predicted[0] <= _PREDICTION_TIME:
            return self._predicted[1]
        return self.mode

    def update(self, row: Array) -> None:
        """Update from the next snapshot."""
        self.view, self.has_view = View(self.layout, row, self.waited_us), True
        if self._predicted is not None and self._predicted[1] == self.view.mode:
            self._predicted = None

    def home_ned(self) -> Vector3:
        """Return the position of home [m, NED]."""
        return self.home[0], self.home[1], 0.0

    def thrust_fractions(self) -> list[float]:
        """Return the force of each thruster as a fraction [-] of its limit in that direction, from -1 to 1."""
        return self._thrust_fractions(self.view.thruster_forces)

    def servo_pulses(self) -> list[float]:
        """Return the pulse of each servo output [us], by the vehicle's table ``autopilot``; 0 for unused outputs."""
        # Without that table, and as PX4, a thruster's output has its number, and pulses are linear in the force.
        pulses = [0.0] * max(self._outputs, default=0)
        for fraction, output, pulse in zip(
            self._thrust_fractions(self.view.thruster_commands), self._outputs, self._curves, strict=True
        ):
            if output:
                pulses[output - 1] = pulse(fraction)
        return pulses

    def _thrust_fractions(self, forces: Sequence[float]) -> list[float]:
        fractions = []
        for force, (backwards, forwards) in zip(forces, self._limits, strict=True):
            limit = forwards if force > 0.0 else backwards
            fractions.append(max(-1.0, min(1.0, force / limit)) if limit > 0.0 else 0.0)
        return fractions

    # ---- commands ----

    def submit(self, *commands: Command) -> Result:
        """Submit commands, which are applied at the next step."""
        if self._commands is None:
            self.reject("commands are off: start with --commands" if self.live else "this is a recorded run", "off")
            return Result.DENIED
        for command in commands:
            try:
                if not self._commands.submit(command, self._run):
                    self.reject(self._commands.refusal(command, self._run) or "too many commands at once", "full")
                    return Result.TEMPORARILY_REJECTED
            except CommandError as error:
                self.reject(str(error), "command")
                return Result.DENIED
            self._predict(command)
        return Result.ACCEPTED

    def _predict(self, command: Command) -> None:
        match command:
            case Arm():
                self._armed_before = command.armed
            case SetMode():
                self._predict_mode(command.mode)
            case SetTarget():
                self._predict_mode("reach")

    def _predict_mode(self, mode: Mode) -> None:
        self._predicted = None if mode == self.mode else (self.now, mode)
        self._mode_before = mode

    def send(self, message: Any) -> None:
        """Send a message on every link."""
        for link in self.links:
            link.send(message)
