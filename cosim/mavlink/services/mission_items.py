"""Decode mission items: a region to reach, a time to stay, or a command executed at once."""

from __future__ import annotations

import math
from collections.abc import Sequence

from cosim.errors import CommandError
from cosim.mavlink.services.parameter_protocol import shorten_float32
from cosim.mavlink.services.service import to_local_position, unscale_position
from cosim.mavlink.vehicle.speed import SPEED, resolve_speed
from cosim.mavlink.vehicle.vehicle_context import ReceivedMissionItem, VehicleContext
from cosim.mavlink.wire.encode import round_finite
from cosim.scenario.region_tables import Vector3
from cosim.simulation.commands.commands import ChangeSetting, MissionItem, SetHeading

_MAX_STAY = 1e9  # s
_MAX_POSITION = 1e5  # m


class ItemError(Exception):
    """Raised for an invalid item; `result` is the name of its MAV_MISSION_RESULT."""

    def __init__(self, result: str, reason: str) -> None:
        super().__init__(reason)
        self.result = result


def decode_mission_item(
    context: VehicleContext, item: ReceivedMissionItem, before: Sequence[MissionItem], count: int
) -> MissionItem:
    """Decode a received mission item."""
    # NAV_WAYPOINT is a sphere about its position, of its acceptance radius (parameter 2), or for 0 the scenario's goal
    # region moved there; parameter 1 is the time to stay. NAV_SPLINE_WAYPOINT is the goal region, without its spline.
    # NAV_LOITER_TIME and NAV_LOITER_UNLIM are that region, for a time and without end. NAV_LAND is a sphere at the
    # surfacing depth above its position, or for 0, 0 above the previous one; NAV_RETURN_TO_LAUNCH is the same at home.
    # Both are without end.
    #
    # NAV_DELAY and CONDITION_DELAY stay at the previous item for parameter 1. DO_CHANGE_SPEED sets the law's speed, if
    # it has one, CONDITION_YAW a heading, and DO_JUMP continues at another item, a given number of times.
    m = context.mavlink
    settings = context.settings
    radius, surface = settings["commands.hold_radius"], settings["commands.surface_depth"]
    match item.command:
        case m.MAV_CMD_NAV_WAYPOINT:
            return MissionItem(_position(context, item), _acceptance(item), _stay(item))
        case m.MAV_CMD_NAV_SPLINE_WAYPOINT | m.MAV_CMD_NAV_LOITER_TIME:
            return MissionItem(_position(context, item), None, _stay(item))
        case m.MAV_CMD_NAV_LOITER_UNLIM:
            return MissionItem(_position(context, item), None, None)
        case m.MAV_CMD_NAV_LAND:
            positions = (other.position for other in reversed(before) if other.position is not None)
            here = item.x == item.y == 0
            north, east, _ = next(positions, context.view.position_ned) if here else _position(context, item)
            return MissionItem((north, east, surface), radius, None)
        case m.MAV_CMD_NAV_RETURN_TO_LAUNCH:
            north, east, _ = context.home_ned()
            return MissionItem((north, east, surface), radius, None)
        case m.MAV_CMD_NAV_DELAY | m.MAV_CMD_CONDITION_DELAY:
            return MissionItem(None, stay=_stay(item))
        case m.MAV_CMD_DO_CHANGE_SPEED:
            return _change_speed(context, item)
        case m.MAV_CMD_CONDITION_YAW:
            return _change_heading(item)
        case m.MAV_CMD_DO_JUMP:
            return _jump(context, item, count)
    entry = m.enums["MAV_CMD"].get(item.command)
    name = f" {entry.name.removeprefix('MAV_CMD_')}" if entry else ""
    raise ItemError("UNSUPPORTED", f"command {item.command}{name} is not known in a mission")


def _change_speed(context: VehicleContext, item: ReceivedMissionItem) -> MissionItem:
    before = getattr(context.settings.gains, "speed", math.nan)
    if math.isnan(before) and item.param2 != -1.0:
        raise ItemError("UNSUPPORTED", f"law {context.scenario.law.name} has no speed")
    try:
        speed = resolve_speed(context, shorten_float32(item.param2))
        if speed is None:
            return MissionItem(None)
        context.settings.change(SPEED, speed)
    except CommandError as error:
        raise ItemError("INVALID_PARAM2", str(error)) from error
    context.settings.change(SPEED, before)
    return MissionItem(None, commands=(ChangeSetting(SPEED, speed),))


def _change_heading(item: ReceivedMissionItem) -> MissionItem:
    if item.param4 != 0.0 and not math.isnan(item.param4):
        raise ItemError("INVALID_PARAM4", "a heading from the present one; parameter 4 may be 0: from north")
    if not math.isfinite(item.param1):
        raise ItemError("INVALID_PARAM1", f"a heading of {item.param1:g} deg")
    return MissionItem(None, commands=(SetHeading(math.radians(item.param1)),))


def _jump(context: VehicleContext, item: ReceivedMissionItem, count: int) -> MissionItem:
    first = int(context.profile.has_home_item)
    to, times = round_finite(item.param1), round_finite(item.param2)
    if to is None or not 0 <= to - first < count:
        raise ItemError("INVALID_PARAM1", f"a jump to item {item.param1:g} of {first} to {count - 1 + first}")
    if times is None:
        raise ItemError("INVALID_PARAM2", f"a jump {item.param2:g} times")
    return MissionItem(None, jump=to - first, times=None if times < 0 else times)


def _position(context: VehicleContext, item: ReceivedMissionItem) -> Vector3:
    x, y = unscale_position(item.frame, item.x, item.y)
    position = to_local_position(context, item.frame, x, y, item.z)
    if position is None:
        raise ItemError("UNSUPPORTED_FRAME", f"frame {item.frame}; it may be 0, 1, 3, 5 or 6")
    results = "INVALID_PARAM5_X", "INVALID_PARAM6_Y", "INVALID_PARAM7"
    for value, result in zip(position, results, strict=True):
        if not abs(value) <= _MAX_POSITION:
            raise ItemError(result, f"it is {value:.4g} m from the origin, expected at most {_MAX_POSITION:g} m")
    return position


def _stay(item: ReceivedMissionItem) -> float:
    if math.isnan(item.param1):
        return 0.0
    if not 0.0 <= item.param1 <= _MAX_STAY:
        raise ItemError("INVALID_PARAM1", f"a stay of {item.param1:g} s")
    return item.param1


def _acceptance(item: ReceivedMissionItem) -> float | None:
    if math.isnan(item.param2) or item.param2 == 0.0:
        return None
    if not 0.0 < item.param2 <= _MAX_POSITION:
        raise ItemError("INVALID_PARAM2", f"an acceptance radius of {item.param2:g} m")
    return item.param2


def home_item(context: VehicleContext) -> ReceivedMissionItem:
    """Return the home item, the first of every mission in ArduPilot's profile."""
    latitude, longitude, altitude = context.frame.to_global(context.home_ned())
    m = context.mavlink
    x, y = round(latitude * 1e7), round(longitude * 1e7)
    return ReceivedMissionItem(m.MAV_FRAME_GLOBAL, m.MAV_CMD_NAV_WAYPOINT, 1, 0.0, 0.0, 0.0, 0.0, x, y, altitude)
