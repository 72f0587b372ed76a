"""The base of a micro-service: handlers of messages and commands, and periodic work."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any

from cosim.mavlink.vehicle.vehicle_context import Sender, VehicleContext
from cosim.mavlink.wire.encode import round_finite
from cosim.scenario.tables import Vector3

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


CommandHandler = Callable[[CommandRequest], int]  # returns MAV_RESULT


class Service:
    """A micro-service."""

    messages: Mapping[str, Handler]  # handlers by the name of the message
    commands: Mapping[int, CommandHandler]  # handlers by MAV_CMD

    def __init__(self, context: VehicleContext) -> None:
        self.context = context
        self.messages = {}
        self.commands = {}

    def tick(self) -> None:
        """Run periodic work at wall clock `context.now`."""

    def accept_control(self, sender: Sender) -> bool:
        """Return True if the vehicle accepts set-points and sticks of a sender; report a refusal."""
        context = self.context
        if not context.accepts_commands:
            context.submit()
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
