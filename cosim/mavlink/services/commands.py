"""Commands: each gets one ack, to its sender."""

from __future__ import annotations

import math
from collections.abc import Iterable
from typing import Any

from cosim.mavlink.services.service import Call, Command, Service, unscaled
from cosim.mavlink.vehicle.vehicle_context import Sender, VehicleContext

_NOWHERE = 0x7FFFFFFF  # x or y of a COMMAND_INT without a position


class Commands(Service):
    """COMMAND_LONG and COMMAND_INT.

    Parameters
    ----------
    context : VehicleContext
        The vehicle.
    services : iterable of Service
        Services with the handlers of commands.
    """

    def __init__(self, context: VehicleContext, services: Iterable[Service]) -> None:
        super().__init__(context)
        self.messages = {"COMMAND_LONG": self._long, "COMMAND_INT": self._int}
        self._known: dict[int, Command] = {}
        for service in services:
            self._known.update(service.commands)

    def _long(self, sender: Sender, message: Any) -> None:
        numbers = tuple(float(getattr(message, f"param{i}")) for i in range(1, 8))
        self._answer(Call(sender, message.command, numbers, self.context.mavlink.MAV_FRAME_GLOBAL))

    def _int(self, sender: Sender, message: Any) -> None:
        first = tuple(float(getattr(message, f"param{i}")) for i in range(1, 5))
        x, y = unscaled(message.frame, message.x, message.y)
        nowhere = message.x == _NOWHERE, message.y == _NOWHERE
        x, y = (math.nan if none else v for v, none in zip((x, y), nowhere, strict=True))
        self._answer(Call(sender, message.command, (*first, x, y, float(message.z)), message.frame))

    def _answer(self, call: Call) -> None:
        context = self.context
        command = self._known.get(call.number)
        result = context.mavlink.MAV_RESULT_UNSUPPORTED if command is None else command(call)
        to = call.sender
        to.link.send(context.make("COMMAND_ACK", call.number, result, 0, 0, to.system, to.component))
