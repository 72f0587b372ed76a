"""The sensors of PX4's simulator interface, as MAVLink messages."""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from controller.quaternion import rotation_matrix
from cosim.mavlink.vehicle.geodesy import LocalFrame
from cosim.sitl.motion import Motion

RATE = 250  # Hz, frames per simulated second
FIELD_NED = (0.1755, -0.0026, 0.470)  # gauss, at the default origin, as PX4's own table has it
FLICKER = 5e-4  # gauss, added in every second frame: PX4 takes a field that never changes for a dead sensor
SURFACE_PRESSURE, WATER, AIR = 1013.25, 1000.0, 1.225  # hPa; kg/m3
TEMPERATURE = 15.0  # degrees Celsius

_ALL_BUT_AIRSPEED = 0x1BFF  # fields of HIL_SENSOR: accelerations, rates, field, pressure, its altitude, temperature
_GRAVITY = 9.80665  # m/s2
_INT16, _UINT16 = 32767, 65535


def hil_messages(mavlink: Any, motion: Motion, time_us: int, origin: tuple[float, float], gps: bool) -> list[Any]:
    """Make the messages to PX4 for an instant; the last one, HIL_SENSOR, sets its clock; time_us [us], origin [deg]."""
    latitude, longitude = (round(1e7 * angle) for angle in LocalFrame(*origin).to_global(motion.position_ned)[:2])
    up = -motion.position_ned[2]
    altitude_mm = round(1e3 * up)
    speeds = [_saturate(100.0 * v, _INT16) for v in motion.velocity_ned]  # cm/s
    milli_g = [_saturate(1e3 * f / _GRAVITY, _INT16) for f in motion.specific_force]
    state = time_us, motion.quaternion, *motion.gyro, latitude, longitude, altitude_mm, *speeds, 0, 0, *milli_g
    field = rotation_matrix(np.array(motion.quaternion)).T @ np.array(FIELD_NED)
    field_body: list[float] = (field + FLICKER * (time_us * RATE // 1_000_000 % 2)).tolist()
    air = pressure_at(-up), 0.0, up, TEMPERATURE, _ALL_BUT_AIRSPEED
    messages = [
        mavlink.MAVLink_hil_state_quaternion_message(*state),
        mavlink.MAVLink_hil_sensor_message(time_us, *motion.specific_force, *motion.gyro, *field_body, *air),
    ]
    if gps:
        north, east, _ = motion.velocity_ned
        course = round(math.degrees(math.atan2(east, north)) * 100.0) % 36000
        motion_cm = _saturate(100.0 * math.hypot(north, east), _UINT16), *speeds, course
        fix = time_us, 3, latitude, longitude, altitude_mm, 30, 40, *motion_cm, 12
        messages.insert(0, mavlink.MAVLink_hil_gps_message(*fix))
    return messages


def pressure_at(depth: float) -> float:
    """Return the absolute pressure [hPa] at a depth [m], of fresh water below the surface and of air above it."""
    return SURFACE_PRESSURE + 0.01 * depth * _GRAVITY * (WATER if depth > 0.0 else AIR)


def _saturate(value: float, limit: int) -> int:
    return round(min(max(value, -float(limit)), float(limit)))
