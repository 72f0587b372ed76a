"""Messages of sensors, of ideal proximity sensors too. Each function yields the fields of each message of one kind."""

from __future__ import annotations

import math
from collections.abc import Iterator

from cosim.mavlink.messages.pose import to_lat_lon_alt
from cosim.mavlink.vehicle.proximity import MAX_RANGE, SECTORS
from cosim.mavlink.vehicle.vehicle_context import VehicleContext
from cosim.mavlink.wire.encode import Fields, combine_flags
from cosim.scenario.region_tables import Vector3

SURFACE_PRESSURE = 1013.25  # hPa
WATER_DENSITY = 1000.0  # kg/m3, fresh water, ArduSub's default
GRAVITY = 9.80665  # m/s2
_PASCAL = 100.0  # Pa in a hPa
_DEEPEST_BOTTOM = 655.0  # m below the vehicle; the range of DISTANCE_SENSOR
_CENTI = 100.0  # cm in a m
_HIGHRES_FIELDS = 0b111111 | 1 << 9 | 1 << 11  # accelerations, rates, pressure, pressure altitude
_MAX_OBSTACLES = 8  # maximum number of nearest obstacles, each in a message
_MAX_DISTANCE = 1000.0  # m
_INCREMENT = 360 // SECTORS  # degrees


def pressure_at(depth: float) -> float:
    """Return the absolute pressure [hPa] at a depth [m]."""
    return SURFACE_PRESSURE + WATER_DENSITY * GRAVITY * depth / _PASCAL


def scaled_pressure(context: VehicleContext) -> Iterator[Fields]:
    """SCALED_PRESSURE: inside the hull, equal to that of the surface."""
    yield context.view.boot_ms, SURFACE_PRESSURE, 0.0, 0


def scaled_pressure2(context: VehicleContext) -> Iterator[Fields]:
    """SCALED_PRESSURE2: of the water, from the depth sensor, as in ArduSub."""
    view = context.view
    pressure = pressure_at(view.depth)
    yield view.boot_ms, pressure, pressure - SURFACE_PRESSURE, 0


def scaled_imu2(context: VehicleContext) -> Iterator[Fields]:
    """SCALED_IMU2: specific force [mG] and rates [mrad/s]; there is no magnetometer."""
    view = context.view
    force = [a / GRAVITY * 1e3 for a in view.acceleration]
    rates = [w * 1e3 for w in view.measured_rates]
    yield view.boot_ms, *force, *rates, 0, 0, 0


def highres_imu(context: VehicleContext) -> Iterator[Fields]:
    """HIGHRES_IMU, without a magnetometer."""
    view = context.view
    pressure = pressure_at(view.depth)
    none = math.nan, math.nan, math.nan
    values = *view.acceleration, *view.measured_rates, *none, pressure, 0.0, -view.depth, math.nan, _HIGHRES_FIELDS
    yield view.boot_us, *values


def has_bottom(context: VehicleContext) -> bool:
    """Return True if the bottom is within 655 m below the vehicle."""
    return context.view.altitude <= _DEEPEST_BOTTOM


def distance_sensor(context: VehicleContext) -> Iterator[Fields]:
    """DISTANCE_SENSOR: down to the bottom, if it is within range."""
    if not has_bottom(context):
        return
    m, view = context.mavlink, context.view
    kind = m.MAV_DISTANCE_SENSOR_ULTRASOUND, 0, m.MAV_SENSOR_ROTATION_PITCH_270, 0xFF
    reach = 5, _DEEPEST_BOTTOM * _CENTI
    yield view.boot_ms, *reach, view.altitude * _CENTI, *kind


def rangefinder(context: VehicleContext) -> Iterator[Fields]:
    """RANGEFINDER: the same, for stations that read no other message."""
    if has_bottom(context):
        yield context.view.altitude, 0.0


def water_depth(context: VehicleContext) -> Iterator[Fields]:
    """WATER_DEPTH: the height above the bottom, if it is within range."""
    if not has_bottom(context):
        return
    view = context.view
    latitude, longitude, altitude_mm = to_lat_lon_alt(context, view.position_ned)
    yield view.boot_ms, 0, 1, latitude, longitude, altitude_mm / 1e3, *view.euler, view.altitude, 0.0


def battery_status(context: VehicleContext) -> Iterator[Fields]:
    """BATTERY_STATUS: all unknown, since the plant has no battery."""
    m = context.mavlink
    kind = 0, m.MAV_BATTERY_FUNCTION_ALL, m.MAV_BATTERY_TYPE_UNKNOWN, 0x7FFF
    yield *kind, [0xFFFF] * 10, -1, -1, -1, -1


def _known_states(context: VehicleContext, prefix: str) -> int:
    """Return the flags of attitude and velocity, and those of the position if it is finite."""
    has_position = all(map(math.isfinite, context.view.position_ned))
    names = "ATTITUDE VELOCITY_HORIZ VELOCITY_VERT" + has_position * " POS_HORIZ_REL POS_HORIZ_ABS POS_VERT_ABS"
    return combine_flags(context.mavlink, prefix, names)


def estimator_status(context: VehicleContext) -> Iterator[Fields]:
    """ESTIMATOR_STATUS: flags of the known states; innovations are unknown."""
    yield context.view.boot_us, _known_states(context, "ESTIMATOR_"), *[0.0] * 6, math.nan, math.nan


def ekf_status_report(context: VehicleContext) -> Iterator[Fields]:
    """EKF_STATUS_REPORT: the same flags for ArduPilot's stations."""
    yield _known_states(context, "EKF_"), *[0.0] * 5


def obstacle_distance(context: VehicleContext) -> Iterator[Fields]:
    """OBSTACLE_DISTANCE: a level scan, sector by sector clockwise from the vehicle's heading."""
    # A sector's angle is that of its center. In cm: `max_distance` plus one without an obstacle, 65535 if position,
    # heading or an obstacle's position is NaN.
    m, view, proximity = context.mavlink, context.view, context.proximity
    proximity.update(view, context.settings)
    max_range = MAX_RANGE * _CENTI
    no_obstacle = max_range + 1.0
    distances = [no_obstacle if d == math.inf else d * _CENTI for d in proximity.scan(view.position_ned, view.heading)]
    geometry = _INCREMENT, 0, max_range, float(_INCREMENT), 0.0, m.MAV_FRAME_BODY_FRD
    yield view.boot_us, m.MAV_DISTANCE_SENSOR_UNKNOWN, distances, *geometry


def obstacle_distance_3d(context: VehicleContext) -> Iterator[Fields]:
    """OBSTACLE_DISTANCE_3D: the nearest point, in the body frame, of each region that is an obstacle."""
    # `obstacle_id` is the region's number in the scenario, from 1. No message before the first snapshot.
    m, view, proximity = context.mavlink, context.view, context.proximity
    if not context.has_view:
        return
    proximity.update(view, context.settings)
    inwards = dict(zip(proximity.ids, proximity.inward_directions(view.position_ned), strict=True))
    near = sorted((clearance, i) for i in inwards if abs(clearance := view.clearances[i]) <= _MAX_DISTANCE)
    for clearance, i in near[:_MAX_OBSTACLES]:
        away = _nearest_point(clearance, inwards[i])
        if away is not None and all(map(math.isfinite, away)):
            kind = m.MAV_DISTANCE_SENSOR_UNKNOWN, m.MAV_FRAME_BODY_FRD, i
            yield view.boot_ms, *kind, *view.to_body(away), 0.0, _MAX_DISTANCE


def _nearest_point(clearance: float, inwards: list[float]) -> Vector3 | None:
    """Return the vector to the nearest point of a surface [m, NED], or None if its direction is undefined."""
    length = math.hypot(*inwards)
    if not 0.0 < length < math.inf:
        return None
    north, east, down = (clearance * x / length for x in inwards)
    return north, east, down
