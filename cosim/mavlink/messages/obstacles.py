"""Obstacles near the vehicle, as a proximity sensor would see them."""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from controller.regions import Region, of_attitude, pack
from cosim.mavlink.encode import wrapped
from cosim.mavlink.vessel import Vessel
from cosim.scenario_tables import FAR_AWAY, SecondaryRegion, Vector3

_MOST = 8  # in a message each, the nearest ones
_FARTHEST = 1000.0  # m


def obstacle_distance_3d(vessel: Vessel) -> list[Any]:
    """OBSTACLE_DISTANCE_3D: the nearest point, in the body's axes, of each region that stands for an obstacle.

    `obstacle_id` is the region's number in the scenario, from 1.
    """
    m, view = vessel.mavlink, vessel.view
    near = []
    for i, (secondary, clearance) in enumerate(zip(vessel.scenario.regions, view.clearances[1:], strict=True), 1):
        if _is_obstacle(secondary) and abs(clearance) <= _FARTHEST:
            near.append((clearance, i, secondary))
    near.sort(key=lambda entry: entry[:2])
    messages = []
    for clearance, i, secondary in near[:_MOST]:
        away = nearest_point(vessel, secondary, clearance)
        if away is not None and all(map(math.isfinite, away)):
            kind = m.MAV_DISTANCE_SENSOR_UNKNOWN, m.MAV_FRAME_BODY_FRD, i
            values = *view.to_body(away), 0.0, _FARTHEST
            messages.append(vessel.make("OBSTACLE_DISTANCE_3D", wrapped(view.boot_us), *kind, *values))
    return messages


def _is_obstacle(secondary: SecondaryRegion) -> bool:
    region = secondary.region
    return region.keep == "out" and secondary.criterion == "obstacle" and not of_attitude(region.shape)


def nearest_point(vessel: Vessel, secondary: SecondaryRegion, clearance: float) -> Vector3 | None:
    """Return the way from the vehicle to the nearest point of a region's surface [m, NED], or None where unknown.

    Parameters
    ----------
    vessel : Vessel
        Where it is.
    secondary : SecondaryRegion
        The region.
    clearance : float
        From its surface [m].
    """
    view, name = vessel.view, secondary.region.name
    here, shift = view.position_ned, view.shift(name)
    if secondary.seen:  # a sphere, whose radius only its clearance tells
        between = [a + b - c for a, b, c in zip(FAR_AWAY, shift, here, strict=True)]
    else:
        between = _inwards(vessel, secondary.region, here, shift)
    length = math.hypot(*between)
    if not 0.0 < length < math.inf:
        return None
    north, east, down = (clearance * x / length for x in between)
    return north, east, down


def _inwards(vessel: Vessel, region: Region, here: Vector3, shift: Vector3) -> list[float]:
    """Return the direction in which the clearance falls, NED, of any length."""
    shape = vessel.settings.shapes.get(region.name, region.shape)
    packed = pack([Region(region.name, shape, "out")])
    packed.shifts[0] = shift
    value, gradient, turning, clearance = np.zeros(1), np.zeros((1, 3)), np.zeros((1, 3)), np.zeros(1)
    packed.evaluate(np.array(here), np.array(vessel.view.quaternion), value, gradient, turning, clearance)
    direction: list[float] = gradient[0].tolist()
    return direction
