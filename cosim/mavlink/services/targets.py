"""Set-points: commands that move the target region."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any

from cosim.errors import CommandError
from cosim.mavlink.services.parameter_protocol import ParameterProtocol, shorten_float32
from cosim.mavlink.services.service import CommandRequest, Service, to_local_position, unscale_position
from cosim.mavlink.vehicle.keep_in_regions import KeepInRegions
from cosim.mavlink.vehicle.profile import MODE_TABLE
from cosim.mavlink.vehicle.speed import SPEED, resolve_speed
from cosim.mavlink.vehicle.vehicle_context import Result, Sender, VehicleContext
from cosim.scenario.region_tables import Vector3
from cosim.simulation.commands.commands import Command, SetDepth, SetHeading, SetMode, SetTarget

_X_Y, _Z = 0b011, 0b100  # type_mask: bits of ignored fields
_VELOCITY, _ACCELERATION, _FORCE, _YAW, _YAW_RATE = 0b111000, 0b111 << 6, 1 << 9, 1 << 10, 1 << 11
_LOCAL, _OFFSET, _BODY, _BODY_OFFSET, _BODY_FRD = 1, 7, 8, 9, 12
_RELATIVE_FRAMES = (_OFFSET, _BODY, _BODY_OFFSET, _BODY_FRD)
_BODY_FRAMES = (_BODY, _BODY_OFFSET, _BODY_FRD)
_REPEAT_TIMEOUT = 1.0  # s without set-points, after which an equal relative set-point is a new one
_EARLY = 1.0  # s, for which a set-point received before its mode is kept
_REPORT_DELAY = 3.0  # s of set-points in another mode, after which a status text is sent
_VELOCITY_TIMEOUT = 3.0  # s without another set-point, after which a velocity ends, as in ArduSub
_SAME_SPEED = 0.01  # m/s
_WARNING_PERIOD = 2.0  # s


class Targets(Service):
    """SET_POSITION_TARGET_*, and commands of position, heading and speed."""

    # Set-points apply only in mode `reach`, as in ArduSub only in GUIDED. A set-point received before that mode, as
    # PX4's stations send it, is kept for 1 s. A repeated set-point makes no command, unless it is relative and follows
    # 1 s of silence: QGroundControl's change of depth, made twice. A velocity without a position moves a sphere about
    # the vehicle; it ends after 3 s without a set-point.

    def __init__(self, context: VehicleContext, parameters: ParameterProtocol) -> None:
        super().__init__(context)
        self._parameters, self._keep_in = parameters, KeepInRegions(context.scenario)
        self._last: tuple[object, ...] = ()
        self._last_at = -math.inf
        self._drift_velocity: Vector3 | None = None  # velocity [m/s, NED] of a set-point without a position
        self._early: tuple[float, float, Callable[[], None]] | None = None  # times of first and last, action

    def on_snapshot(self) -> None:
        """Clear the last set-point in another mode; apply one that was received before its mode."""
        context, early = self.context, self._early
        if context.mode_ahead != "reach":
            self._last, self._drift_velocity = (), None
        elif early is not None:
            self._early = None
            if context.now - early[1] < _EARLY:
                early[2]()

    def tick(self) -> None:
        """End a velocity after 3 s without set-points; report set-points that wait for their mode."""
        context, early = self.context, self._early
        if self._drift_velocity is not None and context.now - self._last_at >= _VELOCITY_TIMEOUT:
            moving, self._drift_velocity, self._last = any(self._drift_velocity), None, ()
            if moving and context.mode_ahead == "reach":
                context.submit(SetTarget(context.view.position_ned, context.settings["commands.hold_radius"]))
                context.send_text(f"No velocity for {_VELOCITY_TIMEOUT:g} s: the vehicle stays", "WARNING")
        if early is not None and context.now - early[0] >= _REPORT_DELAY:
            self._early = None
            now, then = (MODE_TABLE[mode].name.lower() for mode in (context.mode_ahead, "reach"))
            text = f"Set-points wait: the mode is {now}, they apply in {then}"
            context.send_text(text, "NOTICE", "early", 10.0)

    def restart(self) -> None:
        """Clear the last set-point."""
        self._last, self._drift_velocity, self._early = (), None, None

    # ---- set-points ----

    def _receive_set_position_target_local_ned(self, sender: Sender, message: Any) -> None:
        frame = message.coordinate_frame
        if frame not in (_LOCAL, *_RELATIVE_FRAMES):
            self.context.reject(f"set-point in frame {frame}; expected 1, 7, 8, 9 or 12", "frame")
            return
        raw = message.x, message.y, message.z
        self._set_point(sender, message, frame, self._from_local(frame, raw), raw)

    def _receive_set_position_target_global_int(self, sender: Sender, message: Any) -> None:
        context, frame = self.context, message.coordinate_frame
        if context.profile.name == "ardusub" and context.mode_ahead == "depth_hold" and not message.type_mask & _Z:
            if self.accept_control(sender) and math.isfinite(message.alt):  # its frame is ignored there
                context.submit(SetDepth(-message.alt))
            return
        position = None
        if frame != _LOCAL:
            latitude, longitude = unscale_position(frame, message.lat_int, message.lon_int)
            position = to_local_position(context, frame, latitude, longitude, message.alt)
        if position is None:
            context.reject(f"set-point in frame {frame}; expected 0, 3, 5 or 6", "frame")
            return
        self._set_point(sender, message, frame, position, (message.lat_int, message.lon_int, message.alt))

    def _from_local(self, frame: int, raw: Vector3) -> Vector3:
        """Return a position [m, NED]; body frames are level, rotated only by yaw, as in ArduPilot."""
        if frame == _LOCAL:
            return raw
        north, east, down = self._rotate_by_heading(frame, raw)
        x, y, z = self.context.view.position_ned
        return x + north, y + east, z + down

    def _rotate_by_heading(self, frame: int, vector: Vector3) -> Vector3:
        if frame not in _BODY_FRAMES:
            return vector
        yaw = self.context.view.heading
        if math.isnan(yaw):
            return math.nan, math.nan, vector[2]
        ahead, right, down = vector
        sine, cosine = math.sin(yaw), math.cos(yaw)
        return ahead * cosine - right * sine, ahead * sine + right * cosine, down

    def _set_point(self, sender: Sender, message: Any, frame: int, position: Vector3, raw: Vector3) -> None:
        context, mask = self.context, message.type_mask
        if not self.accept_control(sender):
            return
        reason = _unsupported_reason(message)
        if context.profile.name == "ardusub" and not mask & _ACCELERATION:
            reason = "accelerations are not followed"
        if reason:
            context.reject(f"set-point with mask {mask}: {reason}", "mask")
            return
        if context.mode_ahead != "reach":
            first, last, _ = self._early or (context.now, context.now, None)
            first = first if context.now - last < _EARLY else context.now
            self._early = first, context.now, lambda: self._apply(message, frame, position, raw)
            return
        self._apply(message, frame, position, raw)

    def _apply(self, message: Any, frame: int, position: Vector3, raw: Vector3) -> None:
        """Apply a set-point, unless it equals the last one."""
        context, mask = self.context, message.type_mask
        vector = (0.0, 0.0, 0.0) if mask & _VELOCITY else (message.vx, message.vy, message.vz)
        yaw = None if mask & _YAW or not math.isfinite(message.yaw) else message.yaw
        since, self._last_at = context.now - self._last_at, context.now
        velocity = self._rotate_by_heading(frame, vector)
        commands: list[Command] = []
        if mask & _X_Y and mask & _Z:
            set_point: tuple[object, ...] = ("velocity", yaw)
            before = self._drift_velocity
            if before is None or not math.dist(before, velocity) < _SAME_SPEED or set_point != self._last:
                radius = context.settings["commands.hold_radius"]
                commands.append(SetTarget(context.view.position_ned, radius, velocity))
        else:
            set_point = (frame, mask, raw, vector, yaw)
            if set_point != self._last or (frame in _RELATIVE_FRAMES and since >= _REPEAT_TIMEOUT):
                position = (*context.view.target[:2], position[2]) if mask & _X_Y else position
                commands.append(SetTarget(position, None, velocity))
        if not commands:
            return
        if yaw is not None and self._last[-1:] != (yaw,):
            commands.append(SetHeading(yaw + (context.view.euler[2] if frame in _BODY_FRAMES else 0.0)))
        if context.submit(*commands) == Result.ACCEPTED:
            self._last = set_point
            self._drift_velocity = velocity if set_point[0] == "velocity" else None
            if self._drift_velocity is None:
                self.warn_about(position)

    def warn_about(self, position: Vector3, target: str = "target") -> None:
        """Send a warning for each objection to a target, which is accepted nevertheless; position [m, NED]."""
        context = self.context
        for words in self._keep_in.objections(position, context.view, context.settings):
            context.send_text(f"Warning: {target} {words}", "WARNING", f"{target} {words}", _WARNING_PERIOD)

    # ---- commands ----

    def _execute_do_reposition(self, request: CommandRequest) -> Result:
        context = self.context
        position = to_local_position(context, request.frame, request[5], request[6], request[7])
        if position is None:
            context.reject(f"frame {request.frame} of a position", "frame")
            return Result.UNSUPPORTED
        return self.go(request.sender, position, request[4])

    def go(self, sender: Sender, position: Vector3, yaw: float = math.nan) -> Result:
        """Move the target region, and reach it; without a finite coordinate, hold, as QGroundControl pauses PX4."""
        # Units of arguments: position [m, NED]; yaw [rad]
        context = self.context
        if not self.accept_control(sender):
            return Result.DENIED
        x, y, z = (a if math.isfinite(a) else b for a, b in zip(position, context.view.position_ned, strict=True))
        commands: list[Command] = [SetTarget((x, y, z)) if any(map(math.isfinite, position)) else SetMode("hold")]
        if math.isfinite(yaw):
            commands.append(SetHeading(yaw))
        self._last, self._drift_velocity = (), None
        result = context.submit(*commands)
        if result == Result.ACCEPTED and isinstance(commands[0], SetTarget):
            self.warn_about((x, y, z))
        return result

    def _execute_condition_yaw(self, request: CommandRequest) -> Result:
        """Turn to a heading, from north or from the present one."""
        context = self.context
        angle = math.radians(request[1])
        if not math.isfinite(angle) or not math.isfinite(request[4]):
            return Result.DENIED
        if request[4] == 1.0:
            angle = context.view.euler[2] + math.copysign(1.0, -1.0 if request[3] < 0.0 else 1.0) * angle
        if not self.accept_control(request.sender):
            return Result.DENIED
        return context.submit(SetHeading(angle))

    def _execute_do_change_speed(self, request: CommandRequest) -> Result:
        context = self.context
        if SPEED not in self._parameters.setting_values:
            return Result.UNSUPPORTED
        try:
            speed = resolve_speed(context, shorten_float32(request[2]) if math.isfinite(request[2]) else request[2])
        except CommandError as error:
            context.reject(str(error), "speed")
            return Result.DENIED
        if speed is None:
            return Result.ACCEPTED
        if not self.accept_control(request.sender):
            return Result.DENIED
        return self._parameters.change(SPEED, speed)


def _unsupported_reason(message: Any) -> str:
    """Return the reason why a set-point is unsupported, in words; empty if it is supported."""
    mask = message.type_mask
    position, velocity, acceleration = mask & (_X_Y | _Z), mask & _VELOCITY, mask & _ACCELERATION
    if mask & _FORCE and acceleration != _ACCELERATION:  # QGroundControl sets all bits but those
        return "forces are not followed"
    values = (a for i, a in enumerate((message.afx, message.afy, message.afz), 6) if not mask & 1 << i)
    if any(values):
        return "accelerations are not followed"
    if not mask & _YAW_RATE and message.yaw_rate:
        return "yaw rates are not followed; a yaw is"
    if position == _X_Y | _Z and velocity == 0:
        return ""
    if position == _X_Y | _Z:
        return "a position or a velocity is needed"
    if position not in (0, _X_Y) or velocity not in (0, _VELOCITY):
        return "position and velocity need all components, or depth alone"
    return ""
