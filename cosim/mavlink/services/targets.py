"""Set-points: where the target region goes."""

from __future__ import annotations

import math
from typing import Any

from cosim.mavlink.services.mission_items import SPEED
from cosim.mavlink.services.parameters import Parameters, shortest
from cosim.mavlink.services.service import Call, Service, place_of, unscaled
from cosim.mavlink.vehicle.profile import MODE_NAMES
from cosim.mavlink.vehicle.vehicle_context import Sender, VehicleContext
from cosim.scenario.tables import Vector3
from cosim.simulation.commands.commands import Command, SetHeading, SetMode, SetTarget

_X_Y, _Z = 0b011, 0b100  # type_mask: what is ignored
_VELOCITY, _ACCELERATION, _FORCE, _YAW = 0b111000, 0b111 << 6, 1 << 9, 1 << 10
_LOCAL, _OFFSET, _BODY, _BODY_OFFSET, _BODY_FRD = 1, 7, 8, 9, 12
_FROM_HERE = (_OFFSET, _BODY, _BODY_OFFSET, _BODY_FRD)
_ANEW = 1.0  # s of silence, after which the same way from here is another one


class Targets(Service):
    """SET_POSITION_TARGET_*, and the commands that move, turn and pace the vehicle.

    Set-points are heeded while the region is to be reached, as ArduSub heeds them in GUIDED alone. One that says what
    the last one said makes no command, unless it is a way from here and none came for a second: QGroundControl's change
    of depth, made twice.

    Parameters
    ----------
    context : VehicleContext
        Whom it serves.
    parameters : Parameters
        Through which the speed is set.
    """

    def __init__(self, context: VehicleContext, parameters: Parameters) -> None:
        super().__init__(context)
        self._parameters = parameters
        m = context.mavlink
        self._last: tuple[object, ...] = ()
        self._last_at = -math.inf
        self.messages = {
            "SET_POSITION_TARGET_LOCAL_NED": self._local,
            "SET_POSITION_TARGET_GLOBAL_INT": self._global,
        }
        self.commands = {
            m.MAV_CMD_DO_REPOSITION: self._reposition,
            m.MAV_CMD_CONDITION_YAW: self._turn,
            m.MAV_CMD_DO_CHANGE_SPEED: self._speed,
        }

    def on_snapshot(self) -> None:
        """Forget the last set-point once another mode is on."""
        if self.context.mode_ahead != "reach":
            self._last = ()

    def restart(self) -> None:
        """Forget the last set-point."""
        self._last = ()

    # ---- set-points ----

    def _local(self, sender: Sender, message: Any) -> None:
        frame = message.coordinate_frame
        if frame not in (_LOCAL, *_FROM_HERE):
            self.context.reject(f"set-point in frame {frame}; it may be 1, 7, 8, 9 or 12", "frame")
            return
        raw = message.x, message.y, message.z
        self._set_point(sender, message, frame, self._from_local(frame, raw), raw)

    def _global(self, sender: Sender, message: Any) -> None:
        frame = message.coordinate_frame
        place = None
        if frame != _LOCAL:
            latitude, longitude = unscaled(frame, message.lat_int, message.lon_int)
            place = place_of(self.context, frame, latitude, longitude, message.alt)
        if place is None:
            self.context.reject(f"set-point in frame {frame}; it may be 0, 3, 5 or 6", "frame")
            return
        self._set_point(sender, message, frame, place, (message.lat_int, message.lon_int, message.alt))

    def _from_local(self, frame: int, raw: Vector3) -> Vector3:
        """Return a position [m, NED]; the body's frames lie level, and are turned by yaw alone, as ArduPilot's."""
        if frame == _LOCAL:
            return raw
        north, east, down = self._levelled(frame, raw)
        x, y, z = self.context.view.position_ned
        return x + north, y + east, z + down

    def _levelled(self, frame: int, vector: Vector3) -> Vector3:
        if frame not in (_BODY, _BODY_OFFSET, _BODY_FRD):
            return vector
        yaw = self.context.view.heading
        if math.isnan(yaw):
            return math.nan, math.nan, vector[2]
        ahead, right, down = vector
        sine, cosine = math.sin(yaw), math.cos(yaw)
        return ahead * cosine - right * sine, ahead * sine + right * cosine, down

    def _set_point(self, sender: Sender, message: Any, frame: int, place: Vector3, raw: Vector3) -> None:
        context, mask = self.context, message.type_mask
        if not self._may(sender):
            return
        forced = mask & _FORCE and mask & _ACCELERATION != _ACCELERATION  # QGroundControl sets all bits but those
        if mask & _Z or mask & _X_Y not in (0, _X_Y) or forced:
            context.reject(f"set-point with mask {mask}: a position is needed", "mask")
            return
        if context.mode_ahead != "reach":
            name = MODE_NAMES[context.mode_ahead].lower()
            context.reject(f"set-point while the mode is {name}", "mode of set-point")
            return
        going = (0.0, 0.0, 0.0) if mask & _VELOCITY else (message.vx, message.vy, message.vz)
        yaw = None if mask & _YAW or not math.isfinite(message.yaw) else message.yaw
        said = (frame, mask, raw, going, yaw)
        since, self._last_at = context.now - self._last_at, context.now
        if said == self._last and (frame not in _FROM_HERE or since < _ANEW):
            return
        position = (*context.view.target[:2], place[2]) if mask & _X_Y else place
        commands: list[Command] = [SetTarget(position, None, self._levelled(frame, going))]
        if yaw is not None and self._last[-1:] != (yaw,):
            turned = frame in (_BODY, _BODY_OFFSET, _BODY_FRD)
            commands.append(SetHeading(yaw + (context.view.euler[2] if turned else 0.0)))
        if context.submit(*commands) == context.mavlink.MAV_RESULT_ACCEPTED:
            self._last = said

    def _may(self, sender: Sender) -> bool:
        context = self.context
        if not context.accepts_commands:
            context.submit()
            return False
        if not context.operator.may_steer(sender.system, context.now):
            context.reject("another station has the vehicle in hand", "active gcs")
            return False
        return True

    # ---- commands ----

    def _reposition(self, call: Call) -> int:
        m, context = self.context.mavlink, self.context
        place = place_of(context, call.frame, call[5], call[6], call[7])
        if place is None:
            context.reject(f"frame {call.frame} of a position", "frame")
            return int(m.MAV_RESULT_UNSUPPORTED)
        return self.go(call.sender, place, call[4])

    def go(self, sender: Sender, place: Vector3, yaw: float = math.nan) -> int:
        """Move the target region, and reach it; without any place, hold this one: so QGroundControl pauses PX4.

        Parameters
        ----------
        sender : Sender
            Who wants it.
        place : tuple of float
            Its middle [m, NED]; what is not finite stays as it is.
        yaw : float
            Heading [rad]; NaN for none.

        Returns
        -------
        int
            MAV_RESULT.
        """
        context = self.context
        if not self._may(sender):
            return int(context.mavlink.MAV_RESULT_DENIED)
        x, y, z = (a if math.isfinite(a) else b for a, b in zip(place, context.view.position_ned, strict=True))
        commands: list[Command] = [SetTarget((x, y, z)) if any(map(math.isfinite, place)) else SetMode("hold")]
        if math.isfinite(yaw):
            commands.append(SetHeading(yaw))
        self._last = ()
        return context.submit(*commands)

    def _turn(self, call: Call) -> int:
        context = self.context
        angle = math.radians(call[1])
        if not math.isfinite(angle) or not math.isfinite(call[4]):
            return int(context.mavlink.MAV_RESULT_DENIED)
        if call[4] == 1.0:
            angle = context.view.euler[2] + math.copysign(1.0, -1.0 if call[3] < 0.0 else 1.0) * angle
        if not self._may(call.sender):
            return int(context.mavlink.MAV_RESULT_DENIED)
        return context.submit(SetHeading(angle))

    def _speed(self, call: Call) -> int:
        m, speed = self.context.mavlink, call[2]
        if not self._parameters.has(SPEED):
            return int(m.MAV_RESULT_UNSUPPORTED)
        if speed < 0.0:  # as it is
            return int(m.MAV_RESULT_ACCEPTED)
        if not math.isfinite(speed):
            return int(m.MAV_RESULT_DENIED)
        if not self._may(call.sender):
            return int(m.MAV_RESULT_DENIED)
        return self._parameters.change(SPEED, shortest(speed))
