"""Messages about position, attitude and motion. Each function yields the fields of each message of one kind."""

from __future__ import annotations

import math
from collections.abc import Iterator

from cosim.mavlink.vehicle.vehicle_context import VehicleContext
from cosim.mavlink.wire.encode import Fields
from cosim.scenario.region_tables import Vector3

_E7 = 1e7  # in a degree
_MM = 1e3
_CM = 1e2
_COVARIANCE_UNKNOWN = (math.nan,) + (0.0,) * 20


def to_lat_lon_alt(context: VehicleContext, position: Vector3) -> Vector3:
    """Return latitude and longitude [1e-7 deg] and altitude [mm]."""
    latitude, longitude, altitude = context.frame.to_global(position)
    return latitude * _E7, longitude * _E7, altitude * _MM


def degrees(angle: float) -> float:
    """Return an angle in degrees."""
    return angle * 180.0 / math.pi


def attitude(context: VehicleContext) -> Iterator[Fields]:
    """ATTITUDE."""
    view = context.view
    yield view.boot_ms, *view.euler, *view.rates


def attitude_quaternion(context: VehicleContext) -> Iterator[Fields]:
    """ATTITUDE_QUATERNION: from body, forward right down, to north east down."""
    view = context.view
    yield view.boot_ms, *view.quaternion, *view.rates


def local_position_ned(context: VehicleContext) -> Iterator[Fields]:
    """LOCAL_POSITION_NED."""
    view = context.view
    yield view.boot_ms, *view.position_ned, *view.velocity_ned


def global_position_int(context: VehicleContext) -> Iterator[Fields]:
    """GLOBAL_POSITION_INT: its relative altitude is the negative depth."""
    view = context.view
    latitude, longitude, altitude = to_lat_lon_alt(context, view.position_ned)
    speeds = [v * _CM for v in view.velocity_ned]
    heading = round(degrees(view.heading) * _CM) % 36000 if math.isfinite(view.heading) else math.nan
    yield view.boot_ms, latitude, longitude, altitude, -view.position_ned[2] * _MM, *speeds, heading


def vfr_hud(context: VehicleContext) -> Iterator[Fields]:
    """VFR_HUD: throttle is the maximum ratio of a thruster's force to its limit."""
    view = context.view
    north, east, down = view.velocity_ned
    speed = math.hypot(*view.velocity_body)
    heading = round(degrees(view.heading)) % 360 if math.isfinite(view.heading) else math.nan
    throttle = max(map(abs, context.thrust_fractions()), default=0.0)
    yield speed, math.hypot(north, east), heading, 100.0 * throttle, -view.position_ned[2], -down


def gps_raw_int(context: VehicleContext) -> Iterator[Fields]:
    """GPS_RAW_INT: the position as a fix, for stations that read no other message; accuracy unknown."""
    view = context.view
    latitude, longitude, altitude = to_lat_lon_alt(context, view.position_ned)
    north, east, _ = view.velocity_ned
    course = degrees(math.atan2(east, north)) % 360.0
    fix = context.mavlink.GPS_FIX_TYPE_3D_FIX if all(map(math.isfinite, view.position_ned)) else 1
    speed, unknown, satellites = math.hypot(north, east) * _CM, 0xFFFF, 10
    yield view.boot_us, fix, latitude, longitude, altitude, unknown, unknown, speed, course * _CM, satellites


def home_position(context: VehicleContext) -> Iterator[Fields]:
    """HOME_POSITION: at the surface."""
    home = context.home_ned()
    yield *to_lat_lon_alt(context, home), *home, (1.0, 0.0, 0.0, 0.0), 0.0, 0.0, -1.0, context.view.boot_us


def gps_global_origin(context: VehicleContext) -> Iterator[Fields]:
    """GPS_GLOBAL_ORIGIN: global position of the local origin."""
    yield *to_lat_lon_alt(context, (0.0, 0.0, 0.0)), context.view.boot_us


def odometry(context: VehicleContext) -> Iterator[Fields]:
    """ODOMETRY: pose and twist; covariances unknown."""
    m, view = context.mavlink, context.view
    frames = m.MAV_FRAME_LOCAL_NED, m.MAV_FRAME_BODY_FRD
    covariances = _COVARIANCE_UNKNOWN, _COVARIANCE_UNKNOWN
    pose = *view.position_ned, view.quaternion
    twist = *view.velocity_body, *view.rates
    yield view.boot_us, *frames, *pose, *twist, *covariances, 0, m.MAV_ESTIMATOR_TYPE_AUTOPILOT


def altitude(context: VehicleContext) -> Iterator[Fields]:
    """ALTITUDE: above the surface, and above the bottom if there is one."""
    view = context.view
    up = -view.position_ned[2]
    above_bottom = view.altitude if view.altitude < 1e5 else math.nan
    amsl = context.frame.altitude + up
    yield view.boot_us, up, amsl, up, up, math.nan, above_bottom


def ahrs2(context: VehicleContext) -> Iterator[Fields]:
    """AHRS2: Cockpit reads the altitude from it."""
    view = context.view
    latitude, longitude, altitude_mm = to_lat_lon_alt(context, view.position_ned)
    yield *view.euler, altitude_mm / _MM, latitude, longitude
