"""The origin on the globe, and home."""

from __future__ import annotations

import math
from typing import Any

from cosim.mavlink.messages import pose
from cosim.mavlink.services.service import Call, Service, place_of
from cosim.mavlink.vehicle.geodesy import LocalFrame
from cosim.mavlink.vehicle.vehicle_context import Sender, Vessel

_E7 = 1e-7
_MM = 1e-3
_FARTHEST_HOME = 1e5  # m


class Origin(Service):
    """SET_GPS_GLOBAL_ORIGIN, and the commands about home. Neither moves the vehicle."""

    def __init__(self, vessel: Vessel) -> None:
        super().__init__(vessel)
        m = vessel.mavlink
        self.messages = {"SET_GPS_GLOBAL_ORIGIN": self._set_origin}
        self.commands = {m.MAV_CMD_GET_HOME_POSITION: self._get_home, m.MAV_CMD_DO_SET_HOME: self._set_home}

    def _set_origin(self, sender: Sender, message: Any) -> None:
        vessel = self.vessel
        latitude, longitude = message.latitude * _E7, message.longitude * _E7
        if not vessel.heeds:
            vessel.give()
        elif abs(latitude) > 90.0 or abs(longitude) > 180.0:
            vessel.deny(f"origin at {latitude:g}, {longitude:g} deg", "origin")
        else:
            vessel.frame = LocalFrame(latitude, longitude, message.altitude * _MM)
            vessel.operator.commanded(sender.system)
        for reply in (*pose.gps_global_origin(vessel), *pose.home_position(vessel)):
            vessel.send(reply)

    def _get_home(self, call: Call) -> int:
        for message in pose.home_position(self.vessel):
            call.sender.link.send(message)
        return int(self.vessel.mavlink.MAV_RESULT_ACCEPTED)

    def _set_home(self, call: Call) -> int:
        """DO_SET_HOME: home goes to another place at the surface."""
        m, vessel = self.vessel.mavlink, self.vessel
        if not vessel.heeds:
            return vessel.give()
        place = vessel.view.position_ned if call[1] == 1.0 else place_of(vessel, call.frame, call[5], call[6], 0.0)
        if place is None or not math.hypot(place[0], place[1]) <= _FARTHEST_HOME:
            return int(m.MAV_RESULT_DENIED)
        vessel.home = place[0], place[1]
        vessel.operator.commanded(call.sender.system)
        for message in pose.home_position(vessel):
            vessel.send(message)
        return int(m.MAV_RESULT_ACCEPTED)
