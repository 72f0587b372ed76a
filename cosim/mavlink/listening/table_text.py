"""The table of messages and its header, as lines of text."""

from __future__ import annotations

import math
import time
from collections.abc import Mapping
from typing import Any

from cosim.mavlink.listening.fields import format_values
from cosim.mavlink.listening.telemetry_table import TelemetryTable, printable
from cosim.mavlink.wire.dialect import dialect
from cosim.mavlink.wire.ground_end import GroundLink

_DEG = 180.0 / math.pi
_LOST_TIME = 3.5  # s without a heartbeat, after which QGroundControl reports a lost vehicle
_MIN_WIDTH = 40
_ARDUPILOT, _PX4, _SUBMARINE = 3, 12, 12  # MAV_AUTOPILOT, MAV_AUTOPILOT, MAV_TYPE
_MAIN, _SUB = 16, 24  # bits by which PX4's main mode and sub-mode are shifted

_PX4_MAIN = {
    1: "MANUAL", 2: "ALTCTL", 3: "POSCTL", 4: "AUTO", 5: "ACRO", 6: "OFFBOARD", 7: "STABILIZED",
}  # fmt: skip
_PX4_AUTO = {1: "READY", 2: "TAKEOFF", 3: "LOITER", 4: "MISSION", 5: "RTL", 6: "LAND", 8: "FOLLOW", 9: "PRECLAND"}


def format_table(
    link: GroundLink, table: TelemetryTable, now: float, width: int = 120, height: int | None = None
) -> list[str]:
    """Format the received messages as lines of text; now [s]."""
    width = max(width, _MIN_WIDTH)
    lines = [_link_line(link, table, now), *_vehicle_lines(table, now), *_text_lines(table, now)]
    rows = [f"{'message':<34} {'from':>7} {'Hz':>7} {'count':>8}  last values"]
    for key, row in sorted(table.rows.items()):
        sender = f"{key.system}:{key.component}"
        rows.append(
            f"{key.label:<34.34} {sender:>7} {row.rate(now):>7.1f} {row.count:>8}  {format_values(row.message)}"
        )
    if table.omitted:
        rows.append(f"{table.omitted} messages of further kinds")
    lines += ["", *rows]
    if height is not None and len(lines) > height:
        hidden = len(lines) - height + 1
        lines = [*lines[: max(0, height - 1)], f"{hidden} more rows"]
    return [line[:width] for line in lines]


def _link_line(link: GroundLink, table: TelemetryTable, now: float) -> str:
    rate = sum(row.rate(now) for row in table.rows.values())
    return ", ".join([f"{link.name}: {table.total} messages", f"{rate:.1f} a second", *link.loss_reports()])


def _vehicle_lines(table: TelemetryTable, now: float) -> list[str]:
    heartbeat, silence = table.last("HEARTBEAT"), table.silence(now)
    if table.vehicle is None or heartbeat is None or silence is None:
        return ["no vehicle found"]
    m = dialect()
    armed = "ARMED" if heartbeat.base_mode & m.MAV_MODE_FLAG_SAFETY_ARMED else "disarmed"
    kind = f"{_enum('MAV_AUTOPILOT', heartbeat.autopilot)} {_enum('MAV_TYPE', heartbeat.type)}"
    state = _enum("MAV_STATE", heartbeat.system_status)
    vehicle = f"vehicle {table.vehicle[0]}:{table.vehicle[1]} {kind}"
    lines = [f"{vehicle}, mode {mode_name(heartbeat, table.modes)}, {armed}, {state}"]
    if silence > _LOST_TIME:
        lines[0] += f", SILENT for {silence:.0f} s"
    pose = [part for part in (_position(table), _attitude(table), _depth(table)) if part]
    return [*lines, ", ".join(pose)] if pose else lines


def mode_name(heartbeat: Any, names: Mapping[int, str]) -> str:
    """Return the name of a vehicle's mode, by the heartbeat of any autopilot."""
    number = heartbeat.custom_mode
    if names.get(number):
        return names[number]
    if heartbeat.autopilot == _PX4:
        main, sub = number >> _MAIN & 0xFF, number >> _SUB & 0xFF
        name = _PX4_MAIN.get(main, str(main))
        return f"{name}.{_PX4_AUTO.get(sub, sub)}" if sub else name
    if heartbeat.autopilot == _ARDUPILOT and heartbeat.type == _SUBMARINE:
        return _enum("SUB_MODE", number)
    return str(number)


def _position(table: TelemetryTable) -> str:
    local, world = table.last("LOCAL_POSITION_NED"), table.last("GLOBAL_POSITION_INT")
    if local is not None:
        return f"north {local.x:z.2f} east {local.y:z.2f} down {local.z:z.2f} m"
    return f"latitude {world.lat * 1e-7:z.6f} longitude {world.lon * 1e-7:z.6f} deg" if world is not None else ""


def _attitude(table: TelemetryTable) -> str:
    a = table.last("ATTITUDE")
    return f"roll {a.roll * _DEG:z.1f} pitch {a.pitch * _DEG:z.1f} yaw {a.yaw * _DEG:z.1f} deg" if a is not None else ""


def _depth(table: TelemetryTable) -> str:
    world = table.last("GLOBAL_POSITION_INT")
    return f"depth {-1e-3 * world.relative_alt:z.2f} m" if world is not None else ""


def _text_lines(table: TelemetryTable, now: float) -> list[str]:
    return [
        f"{time.strftime('%H:%M:%S', time.localtime(time.time() - (now - then)))} "
        f"{_enum('MAV_SEVERITY', text.severity)}: {printable(text.text)}"
        for then, text in table.texts
    ]


def _enum(name: str, value: int) -> str:
    """Return the name of a value of an enumeration without its prefix; the number if unknown."""
    entry = dialect().enums[name].get(value)
    label = "ENUM_END" if entry is None else entry.name.removeprefix(f"{name}_")
    return str(value) if label == "ENUM_END" else label
