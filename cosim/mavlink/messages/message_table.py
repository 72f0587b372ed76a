"""The table of messages that are streamed or sent on request."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import dataclass
from functools import cache
from typing import Any

from cosim.mavlink.messages import control, pose, sensors, status
from cosim.mavlink.vehicle.vehicle_context import VehicleContext
from cosim.mavlink.wire.dialect import dialect
from cosim.mavlink.wire.encode import Fields
from cosim.mavlink.wire.options import PROFILES, ProfileName

# MAV_DATA_STREAM
RAW_SENSORS, EXTENDED_STATUS, RC, POSITION, EXTRA1, EXTRA2, EXTRA3 = 1, 2, 3, 6, 10, 11, 12


@dataclass(frozen=True)
class Spec:
    """A message that the vehicle streams, or sends on request."""

    name: str
    fields: Callable[[VehicleContext], Iterable[Fields]]  # of each message
    rate: float  # Hz, in simulated time; 0: on request only
    group: int = 0  # MAV_DATA_STREAM of REQUEST_DATA_STREAM; 0: no group
    profiles: tuple[ProfileName, ...] = PROFILES  # profiles that stream it by default
    count: int = 1  # approximate number of messages at once

    @property
    def id(self) -> int:
        """Id of the message in the dialect."""
        return int(getattr(dialect(), f"MAVLINK_MSG_ID_{self.name}"))

    def build(self, context: VehicleContext) -> list[Any]:
        """Return the messages to send now: none, one, or several."""
        return [context.make(self.name, *fields) for fields in self.fields(context)]

    def default_rate(self, profile: ProfileName) -> float:
        """Return the default rate [Hz] of a `profile`; 0 for none."""
        return self.rate if profile in self.profiles else 0.0


_TABLE = (
    Spec("HEARTBEAT", status.heartbeat, 1.0),
    Spec("SYS_STATUS", status.sys_status, 2.0, EXTENDED_STATUS),
    Spec("SYSTEM_TIME", status.system_time, 1.0, EXTRA3),
    Spec("GPS_RAW_INT", pose.gps_raw_int, 1.0, EXTENDED_STATUS),
    Spec("SCALED_PRESSURE", sensors.scaled_pressure, 5.0, RAW_SENSORS),
    Spec("ATTITUDE", pose.attitude, 10.0, EXTRA1),
    Spec("ATTITUDE_QUATERNION", pose.attitude_quaternion, 10.0),
    Spec("LOCAL_POSITION_NED", pose.local_position_ned, 10.0, POSITION),
    Spec("GLOBAL_POSITION_INT", pose.global_position_int, 5.0, POSITION),
    Spec("SERVO_OUTPUT_RAW", control.servo_output_raw, 5.0, RC),
    Spec("MISSION_CURRENT", status.mission_current, 1.0, EXTENDED_STATUS),
    Spec("GPS_GLOBAL_ORIGIN", pose.gps_global_origin, 0.2),
    Spec("NAV_CONTROLLER_OUTPUT", control.nav_controller_output, 2.0, EXTENDED_STATUS),
    Spec("RC_CHANNELS", control.rc_channels, 2.0, RC),
    Spec("VFR_HUD", pose.vfr_hud, 5.0, EXTRA2),
    Spec("POSITION_TARGET_LOCAL_NED", control.position_target_local_ned, 2.0),
    Spec("HIGHRES_IMU", sensors.highres_imu, 0.0),
    Spec("SCALED_IMU2", sensors.scaled_imu2, 0.0, RAW_SENSORS),
    Spec("DISTANCE_SENSOR", sensors.distance_sensor, 2.0, EXTRA3),
    Spec("SCALED_PRESSURE2", sensors.scaled_pressure2, 5.0, RAW_SENSORS),
    Spec("ALTITUDE", pose.altitude, 0.0),
    Spec("BATTERY_STATUS", sensors.battery_status, 1.0, EXTRA3),
    Spec("AUTOPILOT_VERSION", status.autopilot_version, 0.0),
    Spec("RANGEFINDER", sensors.rangefinder, 2.0, EXTRA3, ("ardusub",)),
    Spec("AHRS2", pose.ahrs2, 10.0, EXTRA1, ("ardusub",)),
    Spec("EKF_STATUS_REPORT", sensors.ekf_status_report, 2.0, EXTRA3, ("ardusub",)),
    Spec("ESTIMATOR_STATUS", sensors.estimator_status, 1.0, 0, ("px4", "generic")),
    Spec("HOME_POSITION", pose.home_position, 1.0),
    Spec("EXTENDED_SYS_STATE", status.extended_sys_state, 1.0),
    Spec("NAMED_VALUE_FLOAT", control.named_value_float, 2.0, EXTENDED_STATUS, count=18),
    Spec("OBSTACLE_DISTANCE", sensors.obstacle_distance, 1.0),
    Spec("ODOMETRY", pose.odometry, 0.0),
    Spec("DEBUG_FLOAT_ARRAY", control.debug_float_array, 1.0, count=5),
    Spec("ACTUATOR_OUTPUT_STATUS", control.actuator_output_status, 0.0),
    Spec("AVAILABLE_MODES", status.available_modes, 0.0),
    Spec("CURRENT_MODE", status.current_mode, 0.5),
    Spec("AVAILABLE_MODES_MONITOR", status.available_modes_monitor, 0.2),
    Spec("OBSTACLE_DISTANCE_3D", sensors.obstacle_distance_3d, 1.0, count=8),
    Spec("WATER_DEPTH", sensors.water_depth, 2.0, EXTRA3),
)


def build_messages(context: VehicleContext, *names: str) -> list[Any]:
    """Return the messages of these names."""
    return [message for name in names for spec in _TABLE if spec.name == name for message in spec.build(context)]


@cache
def message_specs() -> dict[int, Spec]:
    """Return the messages of the table by their ids."""
    return {spec.id: spec for spec in _TABLE}
