"""Messages of sensors. Each function returns the messages of one kind."""

from __future__ import annotations

import math
from typing import Any

from cosim.mavlink.messages.pose import to_lat_lon_alt
from cosim.mavlink.vehicle.vehicle_context import VehicleContext
from cosim.mavlink.wire.encode import wrap_time

SURFACE_PRESSURE = 1013.25  # hPa
WATER_DENSITY = 1000.0  # kg/m3, fresh water, ArduSub's default
GRAVITY = 9.80665  # m/s2
_PASCAL = 100.0  # Pa in a hPa
_DEEPEST_BOTTOM = 655.0  # m below the vehicle; the range of DISTANCE_SENSOR
_CENTI = 100  # cm in a m
_HIGHRES_FIELDS = 0b111111 | 1 << 9 | 1 << 11  # accelerations, rates, pressure, pressure altitude


def pressure_at(depth: float) -> float:
    """Return the absolute pressure [hPa] at a depth [m]."""
    return SURFACE_PRESSURE + WATER_DENSITY * GRAVITY * depth / _PASCAL


def scaled_pressure(context: VehicleContext) -> list[Any]:
    """SCALED_PRESSURE: inside the hull, equal to that of the surface."""
    return [context.make("SCALED_PRESSURE", wrap_time(context.view.boot_us), SURFACE_PRESSURE, 0.0, 0)]


def scaled_pressure2(context: VehicleContext) -> list[Any]:
    """SCALED_PRESSURE2: of the water, from the depth sensor, as in ArduSub."""
    view = context.view
    pressure = pressure_at(view.depth)
    return [context.make("SCALED_PRESSURE2", wrap_time(view.boot_us), pressure, pressure - SURFACE_PRESSURE, 0)]


def scaled_imu2(context: VehicleContext) -> list[Any]:
    """SCALED_IMU2: specific force [mG] and rates [mrad/s]; there is no magnetometer."""
    view = context.view
    force = [a / GRAVITY * 1e3 for a in view.acceleration]
    rates = [w * 1e3 for w in view.measured_rates]
    return [context.make("SCALED_IMU2", wrap_time(view.boot_us), *force, *rates, 0, 0, 0)]


def highres_imu(context: VehicleContext) -> list[Any]:
    """HIGHRES_IMU, without a magnetometer."""
    view = context.view
    pressure = pressure_at(view.depth)
    none = math.nan, math.nan, math.nan
    values = *view.acceleration, *view.measured_rates, *none, pressure, 0.0, -view.depth, math.nan, _HIGHRES_FIELDS
    return [context.make("HIGHRES_IMU", view.boot_us, *values)]


def has_bottom(context: VehicleContext) -> bool:
    """Return True if the bottom is within 655 m below the vehicle."""
    return context.view.altitude <= _DEEPEST_BOTTOM


def distance_sensor(context: VehicleContext) -> list[Any]:
    """DISTANCE_SENSOR: down to the bottom, if it is within range."""
    if not has_bottom(context):
        return []
    m, view = context.mavlink, context.view
    kind = m.MAV_DISTANCE_SENSOR_ULTRASOUND, 0, m.MAV_SENSOR_ROTATION_PITCH_270, 0xFF
    reach = 5, _DEEPEST_BOTTOM * _CENTI
    return [context.make("DISTANCE_SENSOR", wrap_time(view.boot_us), *reach, view.altitude * _CENTI, *kind)]


def rangefinder(context: VehicleContext) -> list[Any]:
    """RANGEFINDER: the same, for stations that read no other message."""
    return [context.make("RANGEFINDER", context.view.altitude, 0.0)] if has_bottom(context) else []


def water_depth(context: VehicleContext) -> list[Any]:
    """WATER_DEPTH: the height above the bottom, if it is within range."""
    if not has_bottom(context):
        return []
    view = context.view
    latitude, longitude, altitude_mm = to_lat_lon_alt(context, view.position_ned)
    values = 0, 1, latitude, longitude, altitude_mm / 1e3, *view.euler, view.altitude, 0.0
    return [context.make("WATER_DEPTH", wrap_time(view.boot_us), *values)]


def battery_status(context: VehicleContext) -> list[Any]:
    """BATTERY_STATUS: all unknown, since the plant has no battery."""
    m = context.mavlink
    kind = 0, m.MAV_BATTERY_FUNCTION_ALL, m.MAV_BATTERY_TYPE_UNKNOWN, 0x7FFF
    return [context.make("BATTERY_STATUS", *kind, [0xFFFF] * 10, -1, -1, -1, -1)]


def _position_known(context: VehicleContext) -> bool:
    return all(map(math.isfinite, context.view.position_ned))


def estimator_status(context: VehicleContext) -> list[Any]:
    """ESTIMATOR_STATUS: flags of the known states; innovations are unknown."""
    m = context.mavlink
    flags = m.ESTIMATOR_ATTITUDE | m.ESTIMATOR_VELOCITY_HORIZ | m.ESTIMATOR_VELOCITY_VERT
    if _position_known(context):
        flags |= m.ESTIMATOR_POS_HORIZ_REL | m.ESTIMATOR_POS_HORIZ_ABS | m.ESTIMATOR_POS_VERT_ABS
    return [context.make("ESTIMATOR_STATUS", context.view.boot_us, flags, *[0.0] * 6, math.nan, math.nan)]


def ekf_status_report(context: VehicleContext) -> list[Any]:
    """EKF_STATUS_REPORT: the same flags for ArduPilot's stations."""
    m = context.mavlink
    flags = m.EKF_ATTITUDE | m.EKF_VELOCITY_HORIZ | m.EKF_VELOCITY_VERT
    if _position_known(context):
        flags |= m.EKF_POS_HORIZ_REL | m.EKF_POS_HORIZ_ABS | m.EKF_POS_VERT_ABS
    return [context.make("EKF_STATUS_REPORT", flags, *[0.0] * 5)]
