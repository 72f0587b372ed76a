"""Commands: each gets one ack, to its sender."""

from __future__ import annotations

import math
from collections.abc import Iterable
from typing import Any

from cosim.mavlink.services.service import CommandHandler, CommandRequest, Service, unscale_position
from cosim.mavlink.vehicle.vehicle_context import Result, Sender, VehicleContext

_NO_POSITION = 0x7FFFFFFF  # x or y of a COMMAND_INT without a position


class CommandProtocol(Service):
    """COMMAND_LONG and COMMAND_INT."""

    def __init__(self, context: VehicleContext, services: Iterable[Service]) -> None:
        super().__init__(context)
        self._handlers: dict[int, CommandHandler] = {}
        for service in services:
            self._handlers.update(service.commands)

    def _receive_command_long(self, sender: Sender, message: Any) -> None:
        params = tuple(float(getattr(message, f"param{i}")) for i in range(1, 8))
        self._answer(CommandRequest(sender, message.command, params, self.context.mavlink.MAV_FRAME_GLOBAL))

    def _receive_command_int(self, sender: Sender, message: Any) -> None:
        params = tuple(float(getattr(message, f"param{i}")) for i in range(1, 5))
        x, y = unscale_position(message.frame, message.x, message.y)
        x = math.nan if message.x == _NO_POSITION else x
        y = math.nan if message.y == _NO_POSITION else y
        self._answer(CommandRequest(sender, message.command, (*params, x, y, float(message.z)), message.frame))

    def _answer(self, request: CommandRequest) -> None:
        handler, sender = self._handlers.get(request.command), request.sender
        result = Result.UNSUPPORTED if handler is None else handler(request)
        sender.link.send(self.context.make("COMMAND_ACK", request.command, result, 0, 0, *sender.address))
