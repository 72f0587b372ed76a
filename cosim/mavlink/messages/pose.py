"""Where the vehicle is and how it moves. Each function returns the messages of one kind."""

from __future__ import annotations

import math
from typing import Any

from cosim.mavlink.vehicle.vehicle_context import Vessel
from cosim.mavlink.wire.encode import wrapped
from cosim.scenario.tables import Vector3

_E7 = 1e7  # in a degree
_MM = 1e3
_CM = 1e2
_COVARIANCE_UNKNOWN = (math.nan,) + (0.0,) * 20


def globe(vessel: Vessel, position: Vector3) -> Vector3:
    """Return latitude and longitude [1e-7 deg] and altitude [mm]."""
    latitude, longitude, altitude = vessel.frame.to_global(position)
    return latitude * _E7, longitude * _E7, altitude * _MM


def degrees(angle: float) -> float:
    """Return an angle in degrees."""
    return angle * 180.0 / math.pi


def attitude(vessel: Vessel) -> list[Any]:
    """ATTITUDE."""
    view = vessel.view
    return [vessel.make("ATTITUDE", wrapped(view.boot_us), *view.euler, *view.rates)]


def attitude_quaternion(vessel: Vessel) -> list[Any]:
    """ATTITUDE_QUATERNION: from body, forward right down, to north east down."""
    view = vessel.view
    return [vessel.make("ATTITUDE_QUATERNION", wrapped(view.boot_us), *view.quaternion, *view.rates)]


def local_position_ned(vessel: Vessel) -> list[Any]:
    """LOCAL_POSITION_NED."""
    view = vessel.view
    return [vessel.make("LOCAL_POSITION_NED", wrapped(view.boot_us), *view.position_ned, *view.velocity_ned)]


def global_position_int(vessel: Vessel) -> list[Any]:
    """GLOBAL_POSITION_INT: its relative altitude is the depth, negative."""
    view = vessel.view
    latitude, longitude, altitude = globe(vessel, view.position_ned)
    speeds = [v * _CM for v in view.velocity_ned]
    heading = round(degrees(view.heading) * _CM) % 36000 if math.isfinite(view.heading) else math.nan
    values = latitude, longitude, altitude, -view.position_ned[2] * _MM, *speeds, heading
    return [vessel.make("GLOBAL_POSITION_INT", wrapped(view.boot_us), *values)]


def vfr_hud(vessel: Vessel) -> list[Any]:
    """VFR_HUD: throttle is the greatest part of its limit that a thruster gives."""
    view = vessel.view
    north, east, down = view.velocity_ned
    speed = math.hypot(*view.velocity_body)
    heading = round(degrees(view.heading)) % 360 if math.isfinite(view.heading) else math.nan
    throttle = max(map(abs, vessel.thrust_parts()), default=0.0)
    values = speed, math.hypot(north, east), heading, 100.0 * throttle, -view.position_ned[2], -down
    return [vessel.make("VFR_HUD", *values)]


def gps_raw_int(vessel: Vessel) -> list[Any]:
    """GPS_RAW_INT: the position as a fix, for stations that know no other; its accuracy is not known."""
    view = vessel.view
    latitude, longitude, altitude = globe(vessel, view.position_ned)
    north, east, _ = view.velocity_ned
    course = degrees(math.atan2(east, north)) % 360.0
    fix = vessel.mavlink.GPS_FIX_TYPE_3D_FIX if all(map(math.isfinite, view.position_ned)) else 1
    unknown = 0xFFFF
    speed, satellites = math.hypot(north, east) * _CM, 10
    values = view.boot_us, fix, latitude, longitude, altitude, unknown, unknown, speed, course * _CM, satellites
    return [vessel.make("GPS_RAW_INT", *values)]


def home_position(vessel: Vessel) -> list[Any]:
    """HOME_POSITION: at the surface."""
    home = vessel.home_ned()
    level = (1.0, 0.0, 0.0, 0.0)
    return [vessel.make("HOME_POSITION", *globe(vessel, home), *home, level, 0.0, 0.0, -1.0, vessel.view.boot_us)]


def gps_global_origin(vessel: Vessel) -> list[Any]:
    """GPS_GLOBAL_ORIGIN: where on the globe position 0 is."""
    return [vessel.make("GPS_GLOBAL_ORIGIN", *globe(vessel, (0.0, 0.0, 0.0)), vessel.view.boot_us)]


def odometry(vessel: Vessel) -> list[Any]:
    """ODOMETRY: the whole state; no covariance is known."""
    m, view = vessel.mavlink, vessel.view
    frames = m.MAV_FRAME_LOCAL_NED, m.MAV_FRAME_BODY_FRD
    covariances = _COVARIANCE_UNKNOWN, _COVARIANCE_UNKNOWN
    pose = *view.position_ned, view.quaternion
    twist = *view.velocity_body, *view.rates
    return [
        vessel.make("ODOMETRY", view.boot_us, *frames, *pose, *twist, *covariances, 0, m.MAV_ESTIMATOR_TYPE_AUTOPILOT)
    ]


def altitude(vessel: Vessel) -> list[Any]:
    """ALTITUDE: over the surface, and over the bottom where there is one."""
    view = vessel.view
    up = -view.position_ned[2]
    above_bottom = view.altitude if view.altitude < 1e5 else math.nan
    amsl = vessel.frame.altitude + up
    return [vessel.make("ALTITUDE", view.boot_us, up, amsl, up, up, math.nan, above_bottom)]


def ahrs2(vessel: Vessel) -> list[Any]:
    """AHRS2, from which Cockpit takes the altitude."""
    view = vessel.view
    latitude, longitude, millimetres = globe(vessel, view.position_ned)
    return [vessel.make("AHRS2", *view.euler, millimetres / _MM, latitude, longitude)]
