"""What the vehicle is, and how it is. Each function returns the messages of one kind."""

from __future__ import annotations

import hashlib
from importlib import metadata
from typing import Any

from packaging.version import Version

from cosim.mavlink.messages.sensors import has_bottom
from cosim.mavlink.vehicle.profile import MODE_NAMES, STANDARD_MODES, SUBMARINE
from cosim.mavlink.vehicle.vehicle_context import Vessel
from cosim.mavlink.wire.encode import wrapped
from cosim.simulation.commands.commands import MODES

_PROTOCOL = 3  # of HEARTBEAT.mavlink_version, for MAVLink 2 as for 1
_OFFICIAL, _DEVELOPMENT = 255, 0  # FIRMWARE_VERSION_TYPE


def heartbeat(vessel: Vessel) -> list[Any]:
    """HEARTBEAT."""
    m = vessel.mavlink
    state = m.MAV_STATE_ACTIVE if vessel.armed else m.MAV_STATE_STANDBY
    return [beat(vessel, m.MAV_STATE_CRITICAL if vessel.failsafe else state)]


def beat(vessel: Vessel, state: int) -> Any:
    """Return a HEARTBEAT with a MAV_STATE."""
    profile, mode = vessel.profile, vessel.mode
    base = profile.base_mode(mode, vessel.armed)
    return vessel.make("HEARTBEAT", SUBMARINE, profile.autopilot, base, profile.numbers[mode], state, _PROTOCOL)


def sys_status(vessel: Vessel) -> list[Any]:
    """SYS_STATUS: no fence can be broken, and whatever is there is healthy; the battery is not known."""
    m = vessel.mavlink
    present = (
        m.MAV_SYS_STATUS_SENSOR_3D_GYRO
        | m.MAV_SYS_STATUS_SENSOR_3D_ACCEL
        | m.MAV_SYS_STATUS_SENSOR_3D_MAG
        | m.MAV_SYS_STATUS_SENSOR_ABSOLUTE_PRESSURE
        | m.MAV_SYS_STATUS_SENSOR_GPS
        | m.MAV_SYS_STATUS_SENSOR_ATTITUDE_STABILIZATION
        | m.MAV_SYS_STATUS_SENSOR_YAW_POSITION
        | m.MAV_SYS_STATUS_SENSOR_Z_ALTITUDE_CONTROL
        | m.MAV_SYS_STATUS_SENSOR_XY_POSITION_CONTROL
        | m.MAV_SYS_STATUS_AHRS
        | m.MAV_SYS_STATUS_PREARM_CHECK
    )
    if has_bottom(vessel):
        present |= m.MAV_SYS_STATUS_SENSOR_LASER_POSITION
    motors = m.MAV_SYS_STATUS_SENSOR_MOTOR_OUTPUTS
    enabled = present | (motors if vessel.armed else 0)
    healthy = present | motors | m.MAV_SYS_STATUS_GEOFENCE
    return [vessel.make("SYS_STATUS", present | motors, enabled, healthy, 0, 0xFFFF, -1, -1, 0, 0, 0, 0, 0, 0)]


def system_time(vessel: Vessel) -> list[Any]:
    """SYSTEM_TIME: the date goes on from that of the beginning, by simulated time."""
    boot = vessel.view.boot_us
    return [vessel.make("SYSTEM_TIME", vessel.unix_start_us + boot, wrapped(boot))]


def extended_sys_state(vessel: Vessel) -> list[Any]:
    """EXTENDED_SYS_STATE: under way while armed, else as if on the ground.

    QGroundControl offers by it what can be done: while flying neither disarming nor a mission's start, else neither a
    pause nor a place to go to. The bottom is no ground to it: the heartbeat of an armed vehicle says that it flies.
    """
    m = vessel.mavlink
    landed = m.MAV_LANDED_STATE_IN_AIR if vessel.armed else m.MAV_LANDED_STATE_ON_GROUND
    return [vessel.make("EXTENDED_SYS_STATE", 0, landed)]


def current_mode(vessel: Vessel) -> list[Any]:
    """CURRENT_MODE, and the one that is commanded."""
    numbers, mode = vessel.profile.numbers, vessel.mode
    return [vessel.make("CURRENT_MODE", STANDARD_MODES[mode], numbers[mode], numbers[vessel.mode_ahead])]


def available_modes(vessel: Vessel, index: int = 0) -> list[Any]:
    """AVAILABLE_MODES: one of them, from 1, or all for index 0; none for an index that is not there."""
    chosen = range(1, len(MODES) + 1) if index == 0 else [index] if 1 <= index <= len(MODES) else []
    messages = []
    for i in chosen:
        mode = MODES[i - 1]
        values = STANDARD_MODES[mode], vessel.profile.numbers[mode], 0, MODE_NAMES[mode]
        messages.append(vessel.make("AVAILABLE_MODES", len(MODES), i, *values))
    return messages


def available_modes_monitor(vessel: Vessel) -> list[Any]:
    """AVAILABLE_MODES_MONITOR: they never change."""
    return [vessel.make("AVAILABLE_MODES_MONITOR", 0)]


def capabilities(vessel: Vessel) -> int:
    """Return MAV_PROTOCOL_CAPABILITY: what it really understands."""
    m = vessel.mavlink
    return int(
        m.MAV_PROTOCOL_CAPABILITY_MISSION_FLOAT
        | m.MAV_PROTOCOL_CAPABILITY_PARAM_FLOAT
        | m.MAV_PROTOCOL_CAPABILITY_MISSION_INT
        | m.MAV_PROTOCOL_CAPABILITY_COMMAND_INT
        | m.MAV_PROTOCOL_CAPABILITY_FTP
        | m.MAV_PROTOCOL_CAPABILITY_SET_POSITION_TARGET_LOCAL_NED
        | m.MAV_PROTOCOL_CAPABILITY_SET_POSITION_TARGET_GLOBAL_INT
        | m.MAV_PROTOCOL_CAPABILITY_MAVLINK2
    )


def autopilot_version(vessel: Vessel) -> list[Any]:
    """AUTOPILOT_VERSION: this package's version as middleware; the unique id follows from vehicle and system id.

    The flight software's is the same, but where the profile stands for another autopilot: that one's then, as a
    development version. By its number QGroundControl chooses what it shows and what it warns of, and only one that
    calls itself official is compared with the newest. The custom version is the name, or for PX4, where it is shown as
    numbers, the package's version again.
    """
    version, profile = Version(metadata.version("subreach")), vessel.profile
    own = version.major, version.minor, version.micro
    kind = _DEVELOPMENT if profile.stands_for or version.is_prerelease else _OFFICIAL
    flight = _version_number(profile.stands_for or own, kind)
    middleware = _version_number(own, _DEVELOPMENT if version.is_prerelease else _OFFICIAL)
    custom = [*reversed(own), *[0] * 5] if profile.name == "px4" else list(b"subreach")
    identity = f"subreach {vessel.scenario.vehicle.name} {vessel.options.system_id}".encode()
    digest = hashlib.sha256(identity).digest()
    none = (0,) * 8
    uid = int.from_bytes(digest[:8], "little")
    versions = flight, middleware, 0, 0, custom, none, none
    return [vessel.make("AUTOPILOT_VERSION", capabilities(vessel), *versions, 0, 0, uid, list(digest[:18]))]


def _version_number(version: tuple[int, int, int], kind: int) -> int:
    major, minor, micro = version
    return major << 24 | minor << 16 | micro << 8 | kind


def mission_current(vessel: Vessel) -> list[Any]:
    """MISSION_CURRENT."""
    m, view, total = vessel.mavlink, vessel.view, len(vessel.plan)
    first = int(vessel.profile.home_is_first)
    if not total:
        state = m.MISSION_STATE_NO_MISSION
    elif view.item < 0:
        state = m.MISSION_STATE_NOT_STARTED
    elif view.mode != "mission":
        state = m.MISSION_STATE_PAUSED
    else:
        last_reached = view.item == total - 1 and view.clearances[0] >= 0.0
        state = m.MISSION_STATE_COMPLETE if last_reached else m.MISSION_STATE_ACTIVE
    under_way = 1 if view.mode == "mission" else 2
    return [vessel.make("MISSION_CURRENT", max(view.item + first, 0), total, state, under_way)]
