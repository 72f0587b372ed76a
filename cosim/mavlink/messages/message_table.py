"""The table of messages that are streamed or sent on request."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

from cosim.mavlink.messages import control, obstacle_distance, pose, sensors, status
from cosim.mavlink.vehicle.vehicle_context import VehicleContext
from cosim.mavlink.wire.options import PROFILES, ProfileName

HEARTBEAT = 0

# MAV_DATA_STREAM
RAW_SENSORS, EXTENDED_STATUS, RC, POSITION, EXTRA1, EXTRA2, EXTRA3 = 1, 2, 3, 6, 10, 11, 12


@dataclass(frozen=True)
class Spec:
    """A message that the vehicle streams, or sends on request."""

    id: int
    build: Callable[[VehicleContext], list[Any]]
    rate: float  # Hz, in simulated time; 0: on request only
    group: int = 0  # MAV_DATA_STREAM of REQUEST_DATA_STREAM; 0: no group
    profiles: tuple[ProfileName, ...] = PROFILES  # profiles that stream it by default
    several: int = 1  # approximate number of messages at once

    def default_rate(self, profile: ProfileName) -> float:
        """Return the default rate [Hz] of a `profile`; 0 for none."""
        return self.rate if profile in self.profiles else 0.0


_TABLE = (
    Spec(HEARTBEAT, status.heartbeat, 1.0),
    Spec(1, status.sys_status, 2.0, EXTENDED_STATUS),
    Spec(2, status.system_time, 1.0, EXTRA3),
    Spec(24, pose.gps_raw_int, 1.0, EXTENDED_STATUS),
    Spec(29, sensors.scaled_pressure, 5.0, RAW_SENSORS),
    Spec(30, pose.attitude, 10.0, EXTRA1),
    Spec(31, pose.attitude_quaternion, 10.0),
    Spec(32, pose.local_position_ned, 10.0, POSITION),
    Spec(33, pose.global_position_int, 5.0, POSITION),
    Spec(36, control.servo_output_raw, 5.0, RC),
    Spec(42, status.mission_current, 1.0, EXTENDED_STATUS),
    Spec(49, pose.gps_global_origin, 0.2),
    Spec(62, control.nav_controller_output, 2.0, EXTENDED_STATUS),
    Spec(65, control.rc_channels, 2.0, RC),
    Spec(74, pose.vfr_hud, 5.0, EXTRA2),
    Spec(85, control.position_target_local_ned, 2.0),
    Spec(105, sensors.highres_imu, 0.0),
    Spec(116, sensors.scaled_imu2, 0.0, RAW_SENSORS),
    Spec(132, sensors.distance_sensor, 2.0, EXTRA3),
    Spec(137, sensors.scaled_pressure2, 5.0, RAW_SENSORS),
    Spec(141, pose.altitude, 0.0),
    Spec(147, sensors.battery_status, 1.0, EXTRA3),
    Spec(148, status.autopilot_version, 0.0),
    Spec(173, sensors.rangefinder, 2.0, EXTRA3, ("ardusub",)),
    Spec(178, pose.ahrs2, 10.0, EXTRA1, ("ardusub",)),
    Spec(193, sensors.ekf_status_report, 2.0, EXTRA3, ("ardusub",)),
    Spec(230, sensors.estimator_status, 1.0, 0, ("px4", "generic")),
    Spec(242, pose.home_position, 1.0),
    Spec(245, status.extended_sys_state, 1.0),
    Spec(251, control.named_value_float, 2.0, EXTENDED_STATUS, several=18),
    Spec(330, obstacle_distance.obstacle_distance, 1.0),
    Spec(331, pose.odometry, 0.0),
    Spec(350, control.debug_float_array, 1.0, several=5),
    Spec(375, control.actuator_output_status, 0.0),
    Spec(435, status.available_modes, 0.0),
    Spec(436, status.current_mode, 0.5),
    Spec(437, status.available_modes_monitor, 0.2),
    Spec(11037, obstacle_distance.obstacle_distance_3d, 1.0, several=8),
    Spec(11038, sensors.water_depth, 2.0, EXTRA3),
)

MESSAGES: dict[int, Spec] = {spec.id: spec for spec in _TABLE}
