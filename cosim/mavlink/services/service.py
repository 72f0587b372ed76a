"""The base of a micro-service: handlers of messages and commands, and periodic work."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable
from dataclasses import dataclass
from typing import Any

from cosim.mavlink.vehicle.vehicle_context import Result, Sender, VehicleContext
from cosim.mavlink.wire.encode import round_finite
from cosim.scenario.region_tables import Vector3
from cosim.simulation.commands.commands import Command

Handler = Callable[[Sender, Any], None]

_E7, _E4 = 1e-7, 1e-4
_GLOBAL_FRAMES = (0, 5)  # MAV_FRAME_GLOBAL, GLOBAL_INT
_RELATIVE_FRAMES = (3, 6)  # MAV_FRAME_GLOBAL_RELATIVE_ALT, and its INT
_LOCAL_NED = 1


@dataclass(frozen=True)
class CommandRequest:
    """A command of a COMMAND_LONG or COMMAND_INT."""

    sender: Sender
    command: int
    params: tuple[float, ...]  # parameters 1 to 7; clients fill unused ones with NaN or 0
    frame: int  # MAV_FRAME of parameters 5 to 7; global for COMMAND_LONG

    def __getitem__(self, i: int) -> float:
        """Return parameter `i`, from 1."""
        return self.params[i - 1]

    def int_param(self, i: int) -> int | None:
        """Return parameter `i`, from 1, as an integer, or None if it is not finite."""
        return round_finite(self.params[i - 1])


CommandHandler = Callable[[CommandRequest], Result]


class Service:
    """A micro-service: ``_receive_x`` handles messages X, ``_execute_x`` executes commands MAV_CMD_X."""

    def __init__(self, context: VehicleContext) -> None:
        self.context = context
        self.messages: dict[str, Handler] = self._methods("_receive_")  # by the name of the message
        commands: dict[str, CommandHandler] = self._methods("_execute_")
        self.commands = {getattr(context.mavlink, f"MAV_CMD_{name}"): method for name, method in commands.items()}

    def _methods(self, prefix: str) -> dict[str, Any]:
        return {name.removeprefix(prefix).upper(): getattr(self, name) for name in dir(self) if name.startswith(prefix)}

    def tick(self) -> None:
        """Run periodic work at wall clock `context.now`."""

    def reply(self, sender: Sender, messages: Iterable[Any]) -> Result:
        """Send messages to one station."""
        for message in messages:
            sender.link.send(message)
        return Result.ACCEPTED

    def submit(self, sender: Sender, *commands: Command) -> Result:
        """Submit commands of a station, which then is the commanding one."""
        result = self.context.submit(*commands)
        if result == Result.ACCEPTED:
            self.context.active_gcs.record_command(sender.system)
        return result

    def rejects_commands(self) -> bool:
        """Return True if commands are off, and report the refusal."""
        if self.context.accepts_commands:
            return False
        self.context.submit()
        return True

    def accept_control(self, sender: Sender) -> bool:
        """Return True if the vehicle accepts set-points and sticks of a sender; report a refusal."""
        context = self.context
        if self.rejects_commands():
            return False
        if not context.active_gcs.request_control(sender.system, context.now):
            context.reject("another station controls the vehicle", "active gcs")
            return False
        return True

    def on_snapshot(self) -> None:
        """Handle a new snapshot."""

    def restart(self) -> None:
        """Reset the state that belongs to a run."""


def to_local_position(context: VehicleContext, frame: int, x: float, y: float, z: float) -> Vector3 | None:
    """Convert a received position to the local frame [m, NED]; NaN where it is not finite; x, y, z [deg]."""
    if frame == _LOCAL_NED:
        position = x, y, z
    elif frame in _GLOBAL_FRAMES:
        position = context.frame.to_local(x, y, z)
    elif frame in _RELATIVE_FRAMES:
        north, east, _ = context.frame.to_local(x, y, 0.0)
        position = north, east, -z  # home is at the surface
    else:
        return None
    north, east, down = (v if math.isfinite(v) else math.nan for v in position)
    return north, east, down


def unscale_position(frame: int, x: int, y: int) -> tuple[float, float]:
    """Convert the integers of a position to degrees, or to meters in a local frame."""
    scale = _E4 if frame == _LOCAL_NED else _E7
    return x * scale, y * scale
