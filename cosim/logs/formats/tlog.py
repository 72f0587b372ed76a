"""Telemetry logs of ground stations: MAVLink frames, each after its time of reception."""

from __future__ import annotations

import math
import struct
from collections.abc import Callable, Iterator, Sequence
from pathlib import Path
from typing import Any

from cosim.errors import ImportLogError
from cosim.logs.clocks import Clock
from cosim.logs.column_map import ColumnMap
from cosim.logs.format import LogFormat, Moved
from cosim.logs.frames import quaternion_of_angles
from cosim.logs.spool import LogContents
from cosim.mavlink.wire.dialect import dialect
from cosim.mavlink.wire.framing import Counts, Gate, Header, header_at

_CHUNK = 1 << 20  # bytes
_STAMP = struct.Struct(">Q")  # us since 1970
_LONGEST_FRAME = 300  # bytes
_EARLIEST, _LATEST = 9e8, 4.1e9  # s since 1970, range of valid stamps
_LOCAL_NED, _BODY_FRD, _DOWNWARDS = 1, 12, 25
_INVALID_STICK = 0x7FFF
_HEARTBEAT, _AUTOPILOT = 0, 1  # ids of the message, and of the vehicle's component
_SWIM = (0, 11, 12)  # MAV_TYPE of generic, surface boat and submarine
_OF_OTHERS = ("MANUAL_CONTROL", "VISION_POSITION_DELTA")  # messages of the pilot's station and of a DVL's driver
_ARDUPILOT, _PX4, _NO_AUTOPILOT = 3, 12, 8
_RESTS_IN_THE_MIDDLE = (_ARDUPILOT, _PX4)
_G = 9.80665
_FRAME = "Frame: "  # prefix of ArduSub's text with its arrangement of thrusters

Put = Callable[[str, str, float, float, Sequence[float]], None]
NO_STAMP = math.nan


class _Vehicle:
    """Add messages of the vehicle and its pilot to the contents of a log."""

    def __init__(self, contents: LogContents, system: int, autopilot: int, kind: int) -> None:
        self._contents = contents
        self._put = contents.put
        self._system, self._autopilot = system, autopilot
        contents.kind = kind_of(kind)
        contents.autopilot = {_ARDUPILOT: "ardupilot", _PX4: "px4"}.get(autopilot, "")
        self._takers: dict[str, Callable[[Any, float], None]] = {
            name.removeprefix("_on_").upper(): getattr(self, name) for name in dir(self) if name.startswith("_on_")
        }
        mavlink = dialect()
        self.wanted = {m.id: m.msgname for m in mavlink.mavlink_map.values() if m.msgname in self._takers}

    def take(self, header: Header, message: Any, written: float) -> None:
        """Add a message."""
        name = message.get_type()
        if name in _OF_OTHERS or (header.system, header.component) == (self._system, _AUTOPILOT):
            self._takers[name](message, written)
        elif header.system != self._system:
            self._contents.unread[f"{name} of system {header.system}"] += 1
        else:
            self._contents.unread[f"{name} of component {header.component}"] += 1

    # ---- message by message: each method is of the message in its name ----

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
        if self._autopilot == _ARDUPILOT:  # its raw numbers are scaled; others are in units of the chip
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
        if m.time_delta_usec > 0:
            seconds = m.time_delta_usec * 1e-6
            self._put("dvl", "VISION_POSITION_DELTA", NO_STAMP, at, [d / seconds for d in m.position_delta])

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


def read(path: Path, columns: ColumnMap | None, contents: LogContents, moved: Moved) -> None:
    """Read a telemetry log, as specified by `LogFormat`; raise ImportLogError if it has no vehicle."""
    counts, clock = Counts(), Clock()
    gate, vehicle, names = Gate(counts), _Vehicle(contents, *_find_vehicle(path)), dialect().mavlink_map
    lost = 0
    for said, frame, header in _frames(path, moved):
        if header is None:
            lost += len(frame)
            continue
        written = clock.time(said)
        name = vehicle.wanted.get(header.message)
        if name is None:
            known = names.get(header.message)
            if header.message != _HEARTBEAT:
                contents.unread[known.msgname if known else f"message {header.message}"] += 1
            continue
        for _, message in gate.frame(frame, header):
            vehicle.take(header, message, written)
    if lost:
        contents.remarks.append(f"{lost} bytes of the log are no MAVLink frames and were passed over.")
    for _, by in clock.jumps:
        contents.remarks.append(f"The clock of the log's writer jumps by {by:+.4g} s: it is taken as a pause of 1 s.")
    contents.preferences |= {
        "attitude": ("ODOMETRY", "ATTITUDE_QUATERNION", "ATTITUDE"),
        "rates": ("ODOMETRY", "ATTITUDE_QUATERNION", "ATTITUDE"),
        "position": ("ODOMETRY", "LOCAL_POSITION_NED"),
        "gyro": ("RAW_IMU", "SCALED_IMU2"),
        "acceleration": ("RAW_IMU", "SCALED_IMU2"),
    }


def kind_of(number: int) -> str:
    """Return the kind of vehicle of a MAV_TYPE in words; empty for a boat, a submarine, or generic."""
    entry = dialect().enums["MAV_TYPE"].get(number)
    if number in _SWIM or entry is None:
        return ""
    return str(entry.name).removeprefix("MAV_TYPE_").replace("_", " ").lower()


def _find_vehicle(path: Path) -> tuple[int, int, int]:
    """Return system id, MAV_AUTOPILOT and MAV_TYPE of the first autopilot's heartbeat."""
    gate = Gate(Counts())
    for _, frame, header in _frames(path, lambda part: None):
        if header is not None and (header.message, header.component) == (_HEARTBEAT, _AUTOPILOT):
            for _, message in gate.frame(frame, header):
                if message.autopilot != _NO_AUTOPILOT:
                    return header.system, message.autopilot, message.type
    raise ImportLogError("holds no heartbeat of an autopilot, expected a telemetry log of a vehicle")


def _frames(path: Path, moved: Moved) -> Iterator[tuple[float, bytes, Header | None]]:
    """Yield reception time [s since 1970], frame and header of each frame; None as header for invalid bytes."""
    gate = Gate(Counts())
    total = max(1, path.stat().st_size)
    with path.open("rb") as file:
        data, at, done, ended = b"", 0, 0, False
        while True:
            if len(data) - at < _LONGEST_FRAME and not ended:
                more = file.read(_CHUNK)
                ended, done = not more, done + len(more)
                data, at = data[at:] + more, 0
                moved(done / total)
            if len(data) - at < _STAMP.size + 8:
                if at < len(data):
                    yield 0.0, data[at:], None
                return
            header = header_at(data, at + _STAMP.size) if data[at + _STAMP.size] in (0xFE, 0xFD) else None
            stamp = _STAMP.unpack_from(data, at)[0] * 1e-6
            end = at + _STAMP.size + (header.size if header else 0)
            if header is None or end > len(data) or not _EARLIEST < stamp < _LATEST:
                yield 0.0, data[at : at + 1], None
                at += 1
                continue
            frame = data[at + _STAMP.size : end]
            if header.message in gate.kinds and not gate.is_intact(frame, header):
                yield 0.0, data[at : at + 1], None
                at += 1
                continue
            yield stamp, frame, header
            at = end


FORMAT = LogFormat((".tlog",), read)
