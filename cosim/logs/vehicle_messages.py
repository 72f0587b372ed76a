"""Conversion of a vehicle's MAVLink messages to samples of a log."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any

from cosim.logs.frames import quaternion_of_angles, unit_quaternion
from cosim.logs.spool import LogContents
from cosim.mavlink.wire.dialect import dialect

AUTOPILOT = 1  # component id of an autopilot
NO_AUTOPILOT = 8  # MAV_AUTOPILOT_INVALID, of ground stations and other components
DOWNWARD = 25  # MAV_SENSOR_ROTATION_PITCH_270
_LOCAL_NED, _BODY_FRD = 1, 12  # MAV_FRAME
_INVALID_STICK = 0x7FFF  # value of an unused stick
_MARINE_TYPES = (0, 11, 12)  # MAV_TYPE of generic, surface boat and submarine
_FROM_OTHERS = ("MANUAL_CONTROL", "VISION_POSITION_DELTA")  # messages of the pilot's station and of a DVL's driver
_ARDUPILOT, _PX4 = 3, 12  # MAV_AUTOPILOT
_RESTS_IN_THE_MIDDLE = (_ARDUPILOT, _PX4)  # autopilots whose vertical stick rests at 500
_FRAME = "Frame: "  # prefix of ArduSub's text with its arrangement of thrusters
_RATES = ("rates", "rollspeed pitchspeed yawspeed", 1.0)
_IMU = (("acceleration", "xacc yacc zacc", 1e-3 * 9.80665), ("gyro", "xgyro ygyro zgyro", 1e-3))
_SAMPLES = {  # message: the quantities that it holds, with their fields and the factor to SI units
    "ATTITUDE": (_RATES,),
    "ATTITUDE_QUATERNION": (_RATES,),
    "LOCAL_POSITION_NED": (("position", "x y z", 1.0), ("velocity_world", "vx vy vz", 1.0)),
    "ODOMETRY": (("position", "x y z", 1.0), ("velocity", "vx vy vz", 1.0), _RATES),
    "SCALED_PRESSURE2": (("pressure", "press_abs", 100.0),),
    "SCALED_IMU2": _IMU,
    "RAW_IMU": _IMU,
    "DISTANCE_SENSOR": (("altitude", "current_distance", 0.01),),
}
_IN_MICROSECONDS = ("ODOMETRY", "RAW_IMU")  # messages of _SAMPLES with time_usec; others have time_boot_ms
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
        self._system, self._autopilot = system, autopilot
        contents.kind = vehicle_kind(kind)
        contents.autopilot = {_ARDUPILOT: "ardupilot", _PX4: "px4"}.get(autopilot, "")
        contents.preferences |= _PREFERENCES
        self._handlers: dict[str, Callable[[Any, float, float], None]] = {
            "ATTITUDE": self._put_angles, "ATTITUDE_QUATERNION": self._put_quaternion, "ODOMETRY": self._put_quaternion,
            "SERVO_OUTPUT_RAW": self._put_pulses, "MANUAL_CONTROL": self._put_sticks, "SYS_STATUS": self._put_voltage,
            "VISION_POSITION_DELTA": self._put_dvl, "PARAM_VALUE": self._store_parameter,
            "STATUSTEXT": self._store_frame,
        }  # fmt: skip
        self.message_names = frozenset(self._handlers) | _SAMPLES.keys()

    def add(self, system: int, component: int, message: Any, written: float) -> None:
        """Add a message of `message_names` from a system and component, written at a time [s]."""
        name = message.get_type()
        if reason := self._rejection(name, system, component, message):
            self._contents.unread[f"{name}{reason}"] += 1
            return
        stamp = getattr(message, "time_boot_ms", math.nan) * 1e-3
        if name in _IN_MICROSECONDS:
            stamp = message.time_usec * 1e-6
        for quantity, fields, factor in _SAMPLES.get(name, ()):
            values = [factor * getattr(message, field) for field in fields.split()]
            self._contents.put(quantity, name, stamp, written, values)
        if name in self._handlers:
            self._handlers[name](message, stamp, written)

    def _rejection(self, name: str, system: int, component: int, m: Any) -> str:
        """Return what distinguishes a message that is not read; empty for one that is."""
        if name not in _FROM_OTHERS and (system, component) != (self._system, AUTOPILOT):
            return f" of system {system}" if system != self._system else f" of component {component}"
        if name == "ODOMETRY" and (m.frame_id, m.child_frame_id) != (_LOCAL_NED, _BODY_FRD):
            return f" in frames {m.frame_id} and {m.child_frame_id}"
        if name == "SERVO_OUTPUT_RAW" and m.port:
            return f" of port {m.port}"
        if name == "DISTANCE_SENSOR" and m.orientation != DOWNWARD:
            return f" of orientation {m.orientation}"
        # ArduPilot's are scaled to mG and mrad/s; others are in units of the chip
        return " in units of the chip" if name == "RAW_IMU" and self._autopilot != _ARDUPILOT else ""

    # ---- messages that are no plain samples ----

    def _put_angles(self, m: Any, stamp: float, written: float) -> None:
        self._contents.put("attitude", "ATTITUDE", stamp, written, quaternion_of_angles(m.roll, m.pitch, m.yaw))

    def _put_quaternion(self, m: Any, stamp: float, written: float) -> None:
        q = m.q if m.get_type() == "ODOMETRY" else (m.q1, m.q2, m.q3, m.q4)
        self._contents.put("attitude", m.get_type(), stamp, written, unit_quaternion(q))

    def _put_pulses(self, m: Any, stamp: float, written: float) -> None:
        # its 32-bit clock wraps after 71 minutes, so the time of reception is used
        pulses = [float(getattr(m, f"servo{i}_raw")) for i in range(1, 17)]
        self._contents.put("pulses", "SERVO_OUTPUT_RAW", math.nan, written, pulses)

    def _put_sticks(self, m: Any, stamp: float, written: float) -> None:
        center = 500.0 if self._autopilot in _RESTS_IN_THE_MIDDLE else 0.0
        up = 0.0 if m.z == _INVALID_STICK else (m.z - center) / (1000.0 - center)
        roll = _stick(m.t) if m.enabled_extensions & 2 else 0.0
        pitch = _stick(m.s) if m.enabled_extensions & 1 else 0.0
        sticks = (_stick(m.x), _stick(m.y), -_limit(up) + 0.0, roll, pitch, _stick(m.r))
        self._contents.put("sticks", "MANUAL_CONTROL", math.nan, written, sticks)

    def _put_voltage(self, m: Any, stamp: float, written: float) -> None:
        if 0 < m.voltage_battery < 0xFFFF:
            self._contents.put("voltage", "SYS_STATUS", math.nan, written, (m.voltage_battery * 1e-3,))

    def _put_dvl(self, m: Any, stamp: float, written: float) -> None:
        if m.time_delta_usec > 0:  # mean over the time before the reception
            seconds = m.time_delta_usec * 1e-6
            values = [d / seconds for d in m.position_delta]
            self._contents.put("dvl", "VISION_POSITION_DELTA", math.nan, written - 0.5 * seconds, values)

    def _store_parameter(self, m: Any, stamp: float, written: float) -> None:
        self._contents.put_parameter(_text(m.param_id).rstrip("\0")[:16], float(m.param_value))

    def _store_frame(self, m: Any, stamp: float, written: float) -> None:
        text = _text(m.text)
        if text.startswith(_FRAME):
            self._contents.frame = text.removeprefix(_FRAME).split("\0")[0].strip()


def _text(text: str | bytes) -> str:
    return text if isinstance(text, str) else text.decode("ascii", "replace")


def _stick(value: int) -> float:
    return 0.0 if value == _INVALID_STICK else _limit(value / 1000.0)


def _limit(value: float) -> float:
    return max(-1.0, min(1.0, value))


def vehicle_kind(number: int) -> str:
    """Return the kind of vehicle of a MAV_TYPE in words; empty for a boat, a submarine, or generic."""
    entry = dialect().enums["MAV_TYPE"].get(number)
    if number in _MARINE_TYPES or entry is None:
        return ""
    return str(entry.name).removeprefix("MAV_TYPE_").replace("_", " ").lower()
