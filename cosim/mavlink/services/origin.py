"""The global origin, and home."""

from __future__ import annotations

import math
from typing import Any

from cosim.mavlink.messages import pose
from cosim.mavlink.services.service import CommandRequest, Service, to_local_position
from cosim.mavlink.vehicle.geodesy import LocalFrame
from cosim.mavlink.vehicle.vehicle_context import Sender, VehicleContext

_E7 = 1e-7
_MM = 1e-3
_MAX_HOME_DISTANCE = 1e5  # m


class Origin(Service):
    """SET_GPS_GLOBAL_ORIGIN, and the commands about home. Neither moves the vehicle."""

    def __init__(self, context: VehicleContext) -> None:
        super().__init__(context)
        m = context.mavlink
        self.messages = {"SET_GPS_GLOBAL_ORIGIN": self._set_origin}
        self.commands = {m.MAV_CMD_GET_HOME_POSITION: self._get_home, m.MAV_CMD_DO_SET_HOME: self._set_home}

    def _set_origin(self, sender: Sender, message: Any) -> None:
        context = self.context
        latitude, longitude = message.latitude * _E7, message.longitude * _E7
        if not context.accepts_commands:
            context.submit()
        elif abs(latitude) > 90.0 or abs(longitude) > 180.0:
            context.reject(f"origin at {latitude:g}, {longitude:g} deg", "origin")
        else:
            context.frame = LocalFrame(latitude, longitude, message.altitude * _MM)
            context.active_gcs.record_command(sender.system)
        for reply in (*pose.gps_global_origin(context), *pose.home_position(context)):
            context.send(reply)

    def _get_home(self, request: CommandRequest) -> int:
        for message in pose.home_position(self.context):
            request.sender.link.send(message)
        return int(self.context.mavlink.MAV_RESULT_ACCEPTED)

    def _set_home(self, request: CommandRequest) -> int:
        """DO_SET_HOME: move home to another position at the surface."""
        m, context = self.context.mavlink, self.context
        if not context.accepts_commands:
            return context.submit()
        position = (
            context.view.position_ned
            if request[1] == 1.0
            else to_local_position(context, request.frame, request[5], request[6], 0.0)
        )
        if position is None or not math.hypot(position[0], position[1]) <= _MAX_HOME_DISTANCE:
            return int(m.MAV_RESULT_DENIED)
        context.home = position[0], position[1]
        context.active_gcs.record_command(request.sender.system)
        for message in pose.home_position(context):
            context.send(message)
        return int(m.MAV_RESULT_ACCEPTED)
