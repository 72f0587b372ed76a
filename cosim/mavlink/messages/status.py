"""Messages about identity and status. Each function yields the fields of each message of one kind."""

from __future__ import annotations

import hashlib
from collections.abc import Iterator
from importlib import metadata

from packaging.version import Version

from cosim.mavlink.messages.sensors import has_bottom
from cosim.mavlink.vehicle.profile import MODE_TABLE, SUBMARINE
from cosim.mavlink.vehicle.vehicle_context import VehicleContext
from cosim.mavlink.wire.encode import Fields, combine_flags
from cosim.simulation.commands.commands import MODES

_PROTOCOL = 3  # value of HEARTBEAT.mavlink_version, for MAVLink 2 as for 1
_OFFICIAL, _DEVELOPMENT = 255, 0  # FIRMWARE_VERSION_TYPE


def heartbeat(context: VehicleContext) -> Iterator[Fields]:
    """HEARTBEAT."""
    m, profile, mode = context.mavlink, context.profile, context.mode
    state = m.MAV_STATE_ACTIVE if context.armed and not context.has_ended else m.MAV_STATE_STANDBY
    state = m.MAV_STATE_CRITICAL if context.failsafe and not context.has_ended else state
    base = profile.base_mode(mode, context.armed)
    yield SUBMARINE, profile.autopilot, base, profile.custom_modes[mode], state, _PROTOCOL


def sys_status(context: VehicleContext) -> Iterator[Fields]:
    """SYS_STATUS: the fence and all present sensors are healthy; the battery is unknown."""
    m = context.mavlink
    sensors = "3D_GYRO 3D_ACCEL 3D_MAG ABSOLUTE_PRESSURE GPS ATTITUDE_STABILIZATION YAW_POSITION Z_ALTITUDE_CONTROL"
    present = combine_flags(m, "MAV_SYS_STATUS_SENSOR_", f"{sensors} XY_POSITION_CONTROL")
    present |= m.MAV_SYS_STATUS_AHRS | m.MAV_SYS_STATUS_PREARM_CHECK
    if has_bottom(context):
        present |= m.MAV_SYS_STATUS_SENSOR_LASER_POSITION
    motors = m.MAV_SYS_STATUS_SENSOR_MOTOR_OUTPUTS
    enabled = present | (motors if context.armed else 0)
    healthy = present | motors | m.MAV_SYS_STATUS_GEOFENCE
    yield present | motors, enabled, healthy, 0, 0xFFFF, -1, -1, 0, 0, 0, 0, 0, 0


def system_time(context: VehicleContext) -> Iterator[Fields]:
    """SYSTEM_TIME: the date at the start plus simulated time."""
    boot = context.view.boot_us
    yield context.unix_start_us + boot, context.view.boot_ms


def extended_sys_state(context: VehicleContext) -> Iterator[Fields]:
    """EXTENDED_SYS_STATE: in the air while armed, else on the ground."""
    # QGroundControl selects its actions by it: in the air it offers neither disarming nor the start of a mission, on
    # the ground neither pause nor go-to. Contact with the bottom does not count as on the ground.
    m = context.mavlink
    landed = m.MAV_LANDED_STATE_IN_AIR if context.armed else m.MAV_LANDED_STATE_ON_GROUND
    yield 0, landed


def current_mode(context: VehicleContext) -> Iterator[Fields]:
    """CURRENT_MODE: the current mode and the commanded one."""
    numbers, mode = context.profile.custom_modes, context.mode
    yield MODE_TABLE[mode].standard, numbers[mode], numbers[context.mode_ahead]


def available_modes(context: VehicleContext, index: int = 0) -> Iterator[Fields]:
    """AVAILABLE_MODES: the mode of an index from 1, or all for index 0; none for an unknown index."""
    chosen = range(1, len(MODES) + 1) if index == 0 else [index] if 1 <= index <= len(MODES) else []
    for i in chosen:
        mode = MODES[i - 1]
        yield len(MODES), i, MODE_TABLE[mode].standard, context.profile.custom_modes[mode], 0, MODE_TABLE[mode].name


def available_modes_monitor(context: VehicleContext) -> Iterator[Fields]:
    """AVAILABLE_MODES_MONITOR: constant, since the modes never change."""
    yield (0,)


def capabilities(context: VehicleContext) -> int:
    """Return the MAV_PROTOCOL_CAPABILITY bits of the implemented protocols."""
    names = "MISSION_FLOAT PARAM_FLOAT MISSION_INT COMMAND_INT FTP SET_POSITION_TARGET_LOCAL_NED"
    names += " SET_POSITION_TARGET_GLOBAL_INT MAVLINK2"
    return combine_flags(context.mavlink, "MAV_PROTOCOL_CAPABILITY_", names)


def autopilot_version(context: VehicleContext) -> Iterator[Fields]:
    """AUTOPILOT_VERSION: this package's version as middleware; the unique id follows from vehicle and system id."""
    # The flight software's version is the same, or, if the profile imitates an autopilot, a development version of that
    # autopilot. QGroundControl selects views and warnings by it, and compares only official versions with the newest.
    # The custom version is the name, or for PX4, where it is shown as numbers, the package's version again.
    version, profile = Version(metadata.version("subreach")), context.profile
    own = version.major, version.minor, version.micro
    kind = _DEVELOPMENT if profile.imitated_release or version.is_prerelease else _OFFICIAL
    flight = _version_number(profile.imitated_release or own, kind)
    middleware = _version_number(own, _DEVELOPMENT if version.is_prerelease else _OFFICIAL)
    custom = [*reversed(own), *[0] * 5] if profile.name == "px4" else list(b"subreach")
    identity = f"subreach {context.scenario.vehicle.name} {context.options.system_id}".encode()
    digest = hashlib.sha256(identity).digest()
    none = (0,) * 8
    uid = int.from_bytes(digest[:8], "little")
    versions = flight, middleware, 0, 0, custom, none, none
    yield capabilities(context), *versions, 0, 0, uid, list(digest[:18])


def _version_number(version: tuple[int, int, int], kind: int) -> int:
    major, minor, micro = version
    return major << 24 | minor << 16 | micro << 8 | kind


def mission_current(context: VehicleContext) -> Iterator[Fields]:
    """MISSION_CURRENT."""
    m, view, total = context.mavlink, context.view, len(context.plan)
    first = int(context.profile.has_home_item)
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
    yield max(view.item + first, 0), total, state, under_way
