"""The global origin, and home."""

from __future__ import annotations

import math
from typing import Any

from cosim.mavlink.messages.message_table import build_messages
from cosim.mavlink.services.service import CommandRequest, Service, to_local_position
from cosim.mavlink.vehicle.geodesy import LocalFrame
from cosim.mavlink.vehicle.vehicle_context import Result, Sender
from cosim.scenario.region_tables import Vector3

_E7 = 1e-7
_MM = 1e-3
_MAX_HOME_DISTANCE = 1e5  # m


class Origin(Service):
    """SET_GPS_GLOBAL_ORIGIN, and the commands about home. Neither moves the vehicle."""

    def _receive_set_gps_global_origin(self, sender: Sender, message: Any) -> None:
        context = self.context
        latitude, longitude = message.latitude * _E7, message.longitude * _E7
        if self.rejects_commands():
            pass
        elif abs(latitude) > 90.0 or abs(longitude) > 180.0:
            context.reject(f"origin at {latitude:g}, {longitude:g} deg", "origin")
        else:
            context.frame = LocalFrame(latitude, longitude, message.altitude * _MM)
            context.active_gcs.record_command(sender.system)
        for reply in build_messages(context, "GPS_GLOBAL_ORIGIN", "HOME_POSITION"):
            context.send(reply)

    def _execute_get_home_position(self, request: CommandRequest) -> Result:
        return self.reply(request.sender, build_messages(self.context, "HOME_POSITION"))

    def _execute_do_set_home(self, request: CommandRequest) -> Result:
        """Move home to another position at the surface."""
        context = self.context
        if not context.accepts_commands:
            return context.submit()
        position: Vector3 | None = context.view.position_ned
        if request[1] != 1.0:
            position = to_local_position(context, request.frame, request[5], request[6], 0.0)
        if position is None or not math.hypot(position[0], position[1]) <= _MAX_HOME_DISTANCE:
            return Result.DENIED
        context.home = position[0], position[1]
        context.active_gcs.record_command(request.sender.system)
        for message in build_messages(context, "HOME_POSITION"):
            context.send(message)
        return Result.ACCEPTED
