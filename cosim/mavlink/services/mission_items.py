"""What an item of a mission means here: a region to be reached, and for how long to stay."""

from __future__ import annotations

import math

from cosim.helm.orders import Item
from cosim.mavlink.mission_item import MissionItem
from cosim.mavlink.services.service import place_of, unscaled
from cosim.mavlink.vessel import Vessel
from cosim.scenario_tables import Vector3

_LONGEST_STAY = 1e9  # s
_LARGEST = 1e5  # m


class ItemError(Exception):
    """An item that cannot be flown; its number is MAV_MISSION_RESULT."""

    def __init__(self, result: int, reason: str) -> None:
        super().__init__(reason)
        self.result = result


def meant(vessel: Vessel, item: MissionItem, before: Vector3) -> Item:
    """Return what an item asks for.

    NAV_WAYPOINT is a sphere about its place, of its acceptance radius (parameter 2), or for 0 the scenario's goal
    region moved there; parameter 1 says for how long to stay. NAV_LOITER_TIME and NAV_LOITER_UNLIM are that region, for
    a time and for good. NAV_LAND is a sphere at the depth of surfacing above its place, or for 0, 0 above the place
    before; NAV_RETURN_TO_LAUNCH is the same at home. Both are for good.

    Parameters
    ----------
    vessel : Vessel
        Where the globe's frame and home are.
    item : MissionItem
        As it came.
    before : tuple of float
        Where the item before it is [m, NED].

    Raises
    ------
    ItemError
        If there is no such item here, or a number of it cannot be.
    """
    m = vessel.mavlink
    settings = vessel.settings
    radius, surface = settings["commands.hold_radius"], settings["commands.surface_depth"]
    match item.command:
        case m.MAV_CMD_NAV_WAYPOINT:
            return Item(_place(vessel, item), _acceptance(vessel, item), _stay(vessel, item))
        case m.MAV_CMD_NAV_LOITER_TIME:
            return Item(_place(vessel, item), None, _stay(vessel, item))
        case m.MAV_CMD_NAV_LOITER_UNLIM:
            return Item(_place(vessel, item), None, None)
        case m.MAV_CMD_NAV_LAND:
            north, east, _ = before if item.x == item.y == 0 else _place(vessel, item)
            return Item((north, east, surface), radius, None)
        case m.MAV_CMD_NAV_RETURN_TO_LAUNCH:
            north, east, _ = vessel.home_ned()
            return Item((north, east, surface), radius, None)
    raise ItemError(m.MAV_MISSION_UNSUPPORTED, f"command {item.command} is not known in a mission")


def _place(vessel: Vessel, item: MissionItem) -> Vector3:
    m = vessel.mavlink
    x, y = unscaled(item.frame, item.x, item.y)
    place = place_of(vessel, item.frame, x, y, item.z)
    if place is None:
        raise ItemError(m.MAV_MISSION_UNSUPPORTED_FRAME, f"frame {item.frame}; it may be 0, 1, 3, 5 or 6")
    results = m.MAV_MISSION_INVALID_PARAM5_X, m.MAV_MISSION_INVALID_PARAM6_Y, m.MAV_MISSION_INVALID_PARAM7
    for value, result in zip(place, results, strict=True):
        if not abs(value) <= _LARGEST:
            raise ItemError(result, f"it is {value:.4g} m from the origin, at most {_LARGEST:g} m can be")
    return place


def _stay(vessel: Vessel, item: MissionItem) -> float:
    if math.isnan(item.param1):
        return 0.0
    if not 0.0 <= item.param1 <= _LONGEST_STAY:
        raise ItemError(vessel.mavlink.MAV_MISSION_INVALID_PARAM1, f"a stay of {item.param1:g} s")
    return item.param1


def _acceptance(vessel: Vessel, item: MissionItem) -> float | None:
    if math.isnan(item.param2) or item.param2 == 0.0:
        return None
    if not 0.0 < item.param2 <= _LARGEST:
        raise ItemError(vessel.mavlink.MAV_MISSION_INVALID_PARAM2, f"an acceptance radius of {item.param2:g} m")
    return item.param2


def home_item(vessel: Vessel) -> MissionItem:
    """Return home as ArduPilot has it, the first item of every mission."""
    latitude, longitude, altitude = vessel.frame.to_global(vessel.home_ned())
    m = vessel.mavlink
    x, y = round(latitude * 1e7), round(longitude * 1e7)
    return MissionItem(m.MAV_FRAME_GLOBAL, m.MAV_CMD_NAV_WAYPOINT, 1, 0.0, 0.0, 0.0, 0.0, x, y, altitude)
