"""Conversion of a vehicle's MAVLink messages to samples of a log."""

from __future__ import annotations

import math
from typing import Any

from cosim.logs.frames import ReadComponents, attitude_of_angles, attitude_of_quaternion, scale_fields
from cosim.logs.spool import LogContents, handled_names
from cosim.mavlink.vehicle.profile import find_profile
from cosim.mavlink.wire.dialect import dialect
from cosim.mavlink.wire.manual_control import decode_sticks

AUTOPILOT = 1  # component id of an autopilot
NO_AUTOPILOT = 8  # MAV_AUTOPILOT_INVALID, of ground stations and other components
DOWNWARD = 25  # MAV_SENSOR_ROTATION_PITCH_270
_LOCAL_NED, _BODY_FRD = 1, 12  # MAV_FRAME
_MARINE_TYPES = (0, 11, 12)  # MAV_TYPE of generic, surface boat and submarine
_FROM_OTHERS = ("MANUAL_CONTROL", "VISION_POSITION_DELTA")  # messages of the pilot's station and of a DVL's driver
_ARDUPILOT, _PX4 = 3, 12  # MAV_AUTOPILOT
_FRAME = "Frame: "  # prefix of ArduSub's text with its arrangement of thrusters
_RATES = ("rates", scale_fields("rollspeed pitchspeed yawspeed"))
_IMU = (
    ("acceleration", scale_fields("xacc yacc zacc", 1e-3 * 9.80665)),
    ("gyro", scale_fields("xgyro ygyro zgyro", 1e-3)),
)
_SAMPLES: dict[str, tuple[tuple[str, ReadComponents], ...]] = {  # message: quantities in SI units, by its fields
    "ATTITUDE": (("attitude", attitude_of_angles("roll pitch yaw")), _RATES),
    "ATTITUDE_QUATERNION": (("attitude", attitude_of_quaternion("q1 q2 q3 q4")), _RATES),
    "LOCAL_POSITION_NED": (("position", scale_fields("x y z")), ("velocity_world", scale_fields("vx vy vz"))),
    "ODOMETRY": (
        ("attitude", attitude_of_quaternion("q")), ("position", scale_fields("x y z")),
        ("velocity", scale_fields("vx vy vz")), _RATES,
    ),
    "SCALED_PRESSURE2": (("pressure", scale_fields("press_abs", 100.0)),),
    "SCALED_IMU2": _IMU,
    "RAW_IMU": _IMU,
    "DISTANCE_SENSOR": (("altitude", scale_fields("current_distance", 0.01)),),
    "SERVO_OUTPUT_RAW": (("pulses", scale_fields(" ".join(f"servo{i}_raw" for i in range(1, 17)))),),
}  # fmt: skip
_IN_MICROSECONDS = ("ODOMETRY", "RAW_IMU")  # messages of _SAMPLES with time_usec; others have time_boot_ms
_WRAP, _NEAR = 2**32 * 1e-6, 10.0  # s: period of a 32-bit clock of microseconds; distance of stamps of one clock
_PREFERENCES = {
    "attitude": ("ODOMETRY", "ATTITUDE_QUATERNION", "ATTITUDE"),
    "rates": ("ODOMETRY", "ATTITUDE_QUATERNION", "ATTITUDE"),
    "position": ("ODOMETRY", "LOCAL_POSITION_NED"),
    "gyro": ("RAW_IMU", "SCALED_IMU2"),
    "acceleration": ("RAW_IMU", "SCALED_IMU2"),
}


class VehicleMessages:
    """Add messages of a vehicle and its pilot to the contents of a log; ``_read_x`` converts messages X by hand."""

    def __init__(self, contents: LogContents, system: int, autopilot: int, kind: int) -> None:
        self._contents = contents
        self._system, self._autopilot = system, autopilot
        self._booted = math.nan  # s, last stamp since the vehicle's start
        contents.kind = vehicle_kind(kind)
        contents.autopilot = {_ARDUPILOT: "ardupilot", _PX4: "px4"}.get(autopilot, "")
        contents.preferences |= _PREFERENCES

    def add(self, system: int, component: int, message: Any, written: float) -> None:
        """Add one of `MESSAGES` from a system and component, written at a time [s]."""
        name, contents = message.get_type(), self._contents
        if reason := self._rejection(name, system, component, message):
            contents.unread[f"{name}{reason}"] += 1
            return
        stamp = getattr(message, "time_boot_ms", math.nan) * 1e-3
        self._booted = self._booted if math.isnan(stamp) else stamp
        if name in _IN_MICROSECONDS:
            stamp = message.time_usec * 1e-6
        elif name == "SERVO_OUTPUT_RAW":
            stamp = self._unwrapped(message.time_usec * 1e-6)
        for quantity, components in _SAMPLES.get(name, ()):
            contents.put(quantity, name, stamp, written, components(message.__getattribute__))
        if (read := getattr(self, f"_read_{name.lower()}", None)) is not None:
            read(message, written)

    def _unwrapped(self, stamp: float) -> float:
        """Return a stamp [s] of a 32-bit clock, which wraps after 71 minutes; NaN if it is not near the last stamp."""
        if math.isnan(self._booted):
            return math.nan
        stamp += _WRAP * round((self._booted - stamp) / _WRAP)
        return stamp if abs(stamp - self._booted) < _NEAR else math.nan

    def _read_manual_control(self, m: Any, written: float) -> None:
        profile = find_profile(self._autopilot)
        sticks = decode_sticks(m, profile.centered_stick, profile.full_tilt_stick)
        self._contents.put("sticks", "MANUAL_CONTROL", math.nan, written, sticks)

    def _read_sys_status(self, m: Any, written: float) -> None:
        if 0 < m.voltage_battery < 0xFFFF:
            self._contents.put("voltage", "SYS_STATUS", math.nan, written, (m.voltage_battery * 1e-3,))

    def _read_vision_position_delta(self, m: Any, written: float) -> None:
        if m.time_delta_usec > 0:  # the mean over the time before the reception
            seconds = m.time_delta_usec * 1e-6
            velocity = [distance / seconds for distance in m.position_delta]
            self._contents.put("dvl", "VISION_POSITION_DELTA", math.nan, written - 0.5 * seconds, velocity)

    def _read_param_value(self, m: Any, written: float) -> None:
        self._contents.put_parameter(_text(m.param_id).rstrip("\0")[:16], float(m.param_value))

    def _read_statustext(self, m: Any, written: float) -> None:
        if (text := _text(m.text)).startswith(_FRAME):
            self._contents.frame = text.removeprefix(_FRAME).split("\0")[0].strip()

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


MESSAGES = _SAMPLES.keys() | handled_names(VehicleMessages)  # that are read


def _text(text: str | bytes) -> str:
    return text if isinstance(text, str) else text.decode("ascii", "replace")


def vehicle_kind(number: int) -> str:
    """Return the kind of vehicle of a MAV_TYPE in words; empty for a boat, a submarine, or generic."""
    entry = dialect().enums["MAV_TYPE"].get(number)
    if number in _MARINE_TYPES or entry is None:
        return ""
    return str(entry.name).removeprefix("MAV_TYPE_").replace("_", " ").lower()
