"""Conversion of a vehicle's MAVLink messages to samples of a log."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from typing import Any

from cosim.logs.frames import quaternion_of_angles
from cosim.logs.spool import LogContents
from cosim.mavlink.wire.dialect import dialect

AUTOPILOT = 1  # component id of an autopilot
NO_AUTOPILOT = 8  # MAV_AUTOPILOT_INVALID, of ground stations and other components
NO_STAMP = math.nan
_LOCAL_NED, _BODY_FRD, _DOWNWARDS = 1, 12, 25  # MAV_FRAME, twice; MAV_SENSOR_ROTATION_PITCH_270
_INVALID_STICK = 0x7FFF  # value of an unused stick
_SWIM = (0, 11, 12)  # MAV_TYPE of generic, surface boat and submarine
_OF_OTHERS = ("MANUAL_CONTROL", "VISION_POSITION_DELTA")  # messages of the pilot's station and of a DVL's driver
_ARDUPILOT, _PX4 = 3, 12  # MAV_AUTOPILOT
_RESTS_IN_THE_MIDDLE = (_ARDUPILOT, _PX4)  # autopilots whose vertical stick rests at 500
_G = 9.80665  # m/s2
_FRAME = "Frame: "  # prefix of ArduSub's text with its arrangement of thrusters
_PREFERENCES = {
    "attitude": ("ODOMETRY", "ATTITUDE_QUATERNION", "ATTITUDE"),
    "rates": ("ODOMETRY", "ATTITUDE_QUATERNION", "ATTITUDE"),
    "position": ("ODOMETRY", "LOCAL_POSITION_NED"),
    "gyro": ("RAW_IMU", "SCALED_IMU2"),
    "acceleration": ("RAW_IMU", "SCALED_IMU2"),
}


class VehicleMessages:
    """Add messages of a vehicle and its pilot to the contents of a log."""

    def __init__(self, contents: LogContents, system: int, autopilot: int, kind: int) -> None:
        self._contents = contents
        self._put = contents.put
        self._system, self._autopilot = system, autopilot
        contents.kind = kind_of(kind)
        contents.autopilot = {_ARDUPILOT: "ardupilot", _PX4: "px4"}.get(autopilot, "")
        contents.preferences |= _PREFERENCES
        self._handlers: dict[str, Callable[[Any, float], None]] = {
            name.removeprefix("_on_").upper(): getattr(self, name) for name in dir(self) if name.startswith("_on_")
        }
        self.wanted = frozenset(self._handlers)

    def take(self, system: int, component: int, message: Any, written: float) -> None:
        """Add a message of `wanted` from a system and component, written at a time [s]."""
        name = message.get_type()
        if name in _OF_OTHERS or (system, component) == (self._system, AUTOPILOT):
            self._handlers[name](message, written)
        elif system != self._system:
            self._contents.unread[f"{name} of system {system}"] += 1
        else:
            self._contents.unread[f"{name} of component {component}"] += 1

    # ---- handlers, one for each message, named after it ----

    def _on_attitude(self, m: Any, at: float) -> None:
        stamp = m.time_boot_ms * 1e-3
        self._put("attitude", "ATTITUDE", stamp, at, quaternion_of_angles(m.roll, m.pitch, m.yaw))
        self._put("rates", "ATTITUDE", stamp, at, (m.rollspeed, m.pitchspeed, m.yawspeed))

    def _on_attitude_quaternion(self, m: Any, at: float) -> None:
        stamp = m.time_boot_ms * 1e-3
        self._quaternion("ATTITUDE_QUATERNION", stamp, at, (m.q1, m.q2, m.q3, m.q4))
        self._put("rates", "ATTITUDE_QUATERNION", stamp, at, (m.rollspeed, m.pitchspeed, m.yawspeed))

    def _quaternion(self, name: str, stamp: float, at: float, q: Sequence[float]) -> None:
        length = math.hypot(*q)
        self._put("attitude", name, stamp, at, [part / length if length > 0.0 else math.nan for part in q])

    def _on_local_position_ned(self, m: Any, at: float) -> None:
        stamp = m.time_boot_ms * 1e-3
        self._put("position", "LOCAL_POSITION_NED", stamp, at, (m.x, m.y, m.z))
        self._put("velocity_world", "LOCAL_POSITION_NED", stamp, at, (m.vx, m.vy, m.vz))

    def _on_odometry(self, m: Any, at: float) -> None:
        if (m.frame_id, m.child_frame_id) != (_LOCAL_NED, _BODY_FRD):
            self._contents.unread[f"ODOMETRY in frames {m.frame_id} and {m.child_frame_id}"] += 1
            return
        stamp = m.time_usec * 1e-6
        self._quaternion("ODOMETRY", stamp, at, m.q)
        self._put("position", "ODOMETRY", stamp, at, (m.x, m.y, m.z))
        self._put("velocity", "ODOMETRY", stamp, at, (m.vx, m.vy, m.vz))
        self._put("rates", "ODOMETRY", stamp, at, (m.rollspeed, m.pitchspeed, m.yawspeed))

    def _on_servo_output_raw(self, m: Any, at: float) -> None:
        if m.port:
            self._contents.unread[f"SERVO_OUTPUT_RAW of port {m.port}"] += 1
            return
        # its 32-bit clock wraps after 71 minutes, so the time of reception is used
        pulses = [float(getattr(m, f"servo{i}_raw")) for i in range(1, 17)]
        self._put("pulses", "SERVO_OUTPUT_RAW", NO_STAMP, at, pulses)

    def _on_manual_control(self, m: Any, at: float) -> None:
        center = 500.0 if self._autopilot in _RESTS_IN_THE_MIDDLE else 0.0
        up = 0.0 if m.z == _INVALID_STICK else (m.z - center) / (1000.0 - center)
        roll = _axis(m.t) if m.enabled_extensions & 2 else 0.0
        pitch = _axis(m.s) if m.enabled_extensions & 1 else 0.0
        sticks = (_axis(m.x), _axis(m.y), -_part(up) + 0.0, roll, pitch, _axis(m.r))
        self._put("sticks", "MANUAL_CONTROL", NO_STAMP, at, sticks)

    def _on_sys_status(self, m: Any, at: float) -> None:
        if 0 < m.voltage_battery < 0xFFFF:
            self._put("voltage", "SYS_STATUS", NO_STAMP, at, (m.voltage_battery * 1e-3,))

    def _on_scaled_pressure2(self, m: Any, at: float) -> None:
        self._put("pressure", "SCALED_PRESSURE2", m.time_boot_ms * 1e-3, at, (m.press_abs * 100.0,))

    def _on_scaled_imu2(self, m: Any, at: float) -> None:
        self._imu("SCALED_IMU2", m.time_boot_ms * 1e-3, at, m)

    def _on_raw_imu(self, m: Any, at: float) -> None:
        if self._autopilot == _ARDUPILOT:  # ArduPilot's are scaled to mG and mrad/s; others are in units of the chip
            self._imu("RAW_IMU", m.time_usec * 1e-6, at, m)
        else:
            self._contents.unread["RAW_IMU"] += 1

    def _imu(self, name: str, stamp: float, at: float, m: Any) -> None:
        self._put("acceleration", name, stamp, at, [1e-3 * _G * a for a in (m.xacc, m.yacc, m.zacc)])
        self._put("gyro", name, stamp, at, [1e-3 * w for w in (m.xgyro, m.ygyro, m.zgyro)])

    def _on_distance_sensor(self, m: Any, at: float) -> None:
        if m.orientation == _DOWNWARDS:
            self._put("altitude", "DISTANCE_SENSOR", m.time_boot_ms * 1e-3, at, (m.current_distance * 0.01,))
        else:
            self._contents.unread[f"DISTANCE_SENSOR of orientation {m.orientation}"] += 1

    def _on_vision_position_delta(self, m: Any, at: float) -> None:
        if m.time_delta_usec > 0:  # mean over the time before the reception
            seconds = m.time_delta_usec * 1e-6
            values = [d / seconds for d in m.position_delta]
            self._put("dvl", "VISION_POSITION_DELTA", NO_STAMP, at - 0.5 * seconds, values)

    def _on_param_value(self, m: Any, at: float) -> None:
        name = m.param_id if isinstance(m.param_id, str) else m.param_id.decode("ascii", "replace")
        self._contents.parameters[name.rstrip("\0")[:16]] = float(m.param_value)

    def _on_statustext(self, m: Any, at: float) -> None:
        text = m.text if isinstance(m.text, str) else m.text.decode("ascii", "replace")
        if text.startswith(_FRAME):
            self._contents.frame = text.removeprefix(_FRAME).split("\0")[0].strip()


def _axis(value: int) -> float:
    return 0.0 if value == _INVALID_STICK else _part(value / 1000.0)


def _part(value: float) -> float:
    return max(-1.0, min(1.0, value))


def kind_of(number: int) -> str:
    """Return the kind of vehicle of a MAV_TYPE in words; empty for a boat, a submarine, or generic."""
    entry = dialect().enums["MAV_TYPE"].get(number)
    if number in _SWIM or entry is None:
        return ""
    return str(entry.name).removeprefix("MAV_TYPE_").replace("_", " ").lower()
