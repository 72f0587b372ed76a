"""Log files: the vehicle has none, and answers with an empty list. The record is in the run folder."""

from __future__ import annotations

from typing import Any

from cosim.mavlink.services.service import Service
from cosim.mavlink.vehicle.vehicle_context import Sender, VehicleContext


class LogProtocol(Service):
    """LOG_REQUEST_LIST, LOG_REQUEST_DATA and LOG_ERASE: an empty list, without which MAVSDK waits for 7.5 s."""

    def __init__(self, context: VehicleContext) -> None:
        super().__init__(context)
        self.messages = {
            "LOG_REQUEST_LIST": self._list,
            "LOG_REQUEST_DATA": self._data,
            "LOG_ERASE": lambda sender, message: context.reject("there are no logs to erase", "logs"),
        }

    def _list(self, sender: Sender, message: Any) -> None:
        sender.link.send(self.context.make("LOG_ENTRY", 0, 0, 0, 0, 0))

    def _data(self, sender: Sender, message: Any) -> None:
        sender.link.send(self.context.make("LOG_DATA", message.id, message.ofs, 0, bytes(90)))
        self.context.reject(f"there is no log {message.id}: the record is in the run's folder", "logs")
