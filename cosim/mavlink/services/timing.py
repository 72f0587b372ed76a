"""Clocks: TIMESYNC and PING."""

from __future__ import annotations

from typing import Any

from cosim.mavlink.services.service import Service
from cosim.mavlink.vehicle.vehicle_context import Sender, VehicleContext

_NANO = 1000  # ns in a µs


class Timing(Service):
    """Answer TIMESYNC with the time since boot, and PING."""

    def __init__(self, context: VehicleContext) -> None:
        super().__init__(context)
        self.messages = {"TIMESYNC": self._synchronize, "PING": self._ping}

    def _synchronize(self, sender: Sender, message: Any) -> None:
        if message.tc1 == 0:
            boot = max(1, self.context.view.boot_us * _NANO)  # 0 would be a request
            sender.link.send(self.context.make("TIMESYNC", boot, message.ts1))

    def _ping(self, sender: Sender, message: Any) -> None:
        if message.target_system == 0 and message.target_component == 0:  # a request, not an answer
            to = sender.system, sender.component
            sender.link.send(self.context.make("PING", message.time_usec, message.seq, *to))
