"""Obstacles near the vehicle, as measured by ideal proximity sensors."""

from __future__ import annotations

import math
from typing import Any

from cosim.mavlink.vehicle.proximity import MAX_RANGE, SECTORS
from cosim.mavlink.vehicle.vehicle_context import VehicleContext
from cosim.mavlink.wire.encode import wrap_time
from cosim.scenario.tables import Vector3

_MAX_OBSTACLES = 8  # greatest number of nearest obstacles, each in a message
_MAX_DISTANCE = 1000.0  # m
_CENTIMETERS = 100.0  # cm in a meter
_INCREMENT = 360 // SECTORS  # degrees


def obstacle_distance(context: VehicleContext) -> list[Any]:
    """OBSTACLE_DISTANCE: a level scan, sector by sector clockwise from the vehicle's heading."""
    # A sector's angle is that of its center. In cm: `max_distance` plus one without an obstacle, 65535 if position,
    # heading or an obstacle's position is NaN.
    m, view, proximity = context.mavlink, context.view, context.proximity
    proximity.update(view, context.settings)
    max_range = MAX_RANGE * _CENTIMETERS
    no_obstacle = max_range + 1.0
    distances = [
        no_obstacle if d == math.inf else d * _CENTIMETERS for d in proximity.scan(view.position_ned, view.heading)
    ]
    geometry = _INCREMENT, 0, max_range, float(_INCREMENT), 0.0, m.MAV_FRAME_BODY_FRD
    return [context.make("OBSTACLE_DISTANCE", view.boot_us, m.MAV_DISTANCE_SENSOR_UNKNOWN, distances, *geometry)]


def obstacle_distance_3d(context: VehicleContext) -> list[Any]:
    """OBSTACLE_DISTANCE_3D: the nearest point, in the body frame, of each region that is an obstacle."""
    # `obstacle_id` is the region's number in the scenario, from 1. No message before the first snapshot.
    m, view, proximity = context.mavlink, context.view, context.proximity
    if not context.has_view:
        return []
    proximity.update(view, context.settings)
    inwards = dict(zip(proximity.ids, proximity.inward_directions(view.position_ned), strict=True))
    near = sorted((clearance, i) for i in inwards if abs(clearance := view.clearances[i]) <= _MAX_DISTANCE)
    messages = []
    for clearance, i in near[:_MAX_OBSTACLES]:
        away = _nearest_point(clearance, inwards[i])
        if away is not None and all(map(math.isfinite, away)):
            kind = m.MAV_DISTANCE_SENSOR_UNKNOWN, m.MAV_FRAME_BODY_FRD, i
            values = *view.to_body(away), 0.0, _MAX_DISTANCE
            messages.append(context.make("OBSTACLE_DISTANCE_3D", wrap_time(view.boot_us), *kind, *values))
    return messages


def _nearest_point(clearance: float, inwards: list[float]) -> Vector3 | None:
    """Return the vector to the nearest point of a surface [m, NED], or None if its direction is undefined."""
    length = math.hypot(*inwards)
    if not 0.0 < length < math.inf:
        return None
    north, east, down = (clearance * x / length for x in inwards)
    return north, east, down
