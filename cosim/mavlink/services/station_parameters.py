"""Read-only parameters that ground stations read by name."""

# QGroundControl reads them when it connects and in its summary of a vehicle. It reports a missing one as a bug of the
# firmware, and a sensor without calibration as a vehicle that needs setup.

from __future__ import annotations

from collections.abc import Callable, Mapping
from functools import partial

from cosim.mavlink.vehicle.vehicle_context import VehicleContext
from cosim.mavlink.wire.options import LossAction
from plant_fmu import Vehicle

_HEAVY = "bluerov2_heavy"
_FRAMES, _CUSTOM_FRAME = {"vectored": 1.0, "vectored_6dof": 2.0}, 7.0  # ArduSub's FRAME_CONFIG
_SERVOS = 14
_MOTORS = (*range(33, 41), *range(82, 86))  # ArduPilot's SERVOn_FUNCTION of motors 1 to 12
_EXACT = 1e-6  # m/s2; offsets of exactly 0 are those of an accelerometer that was never calibrated
_WARN = 1.0  # value of FS_PILOT_INPUT
_BLUEROV2_HEAVY, _UUV = 60002.0, 60000.0  # PX4's SYS_AUTOSTART
_JOYSTICK_ALONE = 1.0  # value of COM_RC_IN_MODE
_STICKS_LAST = 3.0  # s
# NAV_DLL_ACT
_ON_LOSS: dict[LossAction, float] = {"none": 0.0, "warn": 0.0, "hold": 1.0, "surface": 3.0, "disarm": 6.0}
# there is neither magnetometer nor battery, these failures are not detected, and home is at the surface
_ARDUSUB_ZEROS = (
    *(f"COMPASS_DEV_ID{i}" for i in ("", 2, 3)), *(f"COMPASS_OFS{i}_{axis}" for i in ("", 2, 3) for axis in "XYZ"),
    "COMPASS_DEC", "BATT_MONITOR", "FS_EKF_ACTION", "FS_LEAK_ENABLE", "FS_OPTIONS", "FS_PRESS_ENABLE", "FS_TEMP_ENABLE",
)  # fmt: skip
_PX4_ZEROS = (
    "SYS_HAS_MAG", *(f"CAL_MAG{i}_ID" for i in range(3)), "COM_LOW_BAT_ACT", "NAV_RCL_ACT",
    *(f"RC_MAP_{stick}" for stick in ("ROLL", "PITCH", "YAW", "THROTTLE", "FLAPS", "AUX1", "AUX2")),
    "RTL_RETURN_ALT", "RTL_DESCEND_ALT", "RTL_LAND_DELAY",
)  # fmt: skip


def station_parameters(context: VehicleContext) -> dict[str, Callable[[], float]]:
    """Return functions that read the read-only parameters of the vehicle's profile, by name."""
    match context.profile.name:
        case "ardusub":
            return _constants(_ardusub_parameters(context.scenario.vehicle))
        case "px4":
            return _constants(_px4_parameters(context.scenario.vehicle)) | {
                "NAV_DLL_ACT": lambda: _ON_LOSS[context.loss_action],
                "COM_DL_LOSS_T": lambda: context.loss_timeout,
            }
    return {}


def _constants(values: Mapping[str, float]) -> dict[str, Callable[[], float]]:
    return {name: partial(float, value) for name, value in values.items()}


def _ardusub_parameters(vehicle: Vehicle) -> dict[str, float]:
    motors = _MOTORS[: vehicle.n_thrusters]
    functions = [*motors, *[0] * max(0, _SERVOS - len(motors))]
    return dict.fromkeys(_ARDUSUB_ZEROS, 0.0) | {
        "FRAME_CONFIG": _FRAMES.get(vehicle.autopilot.frame, _CUSTOM_FRAME) if vehicle.autopilot else _CUSTOM_FRAME,
        **{f"SERVO{i}_FUNCTION": function for i, function in enumerate(functions, 1)},
        **{f"INS_ACCOFFS_{axis}": _EXACT for axis in "XYZ"},
        "FS_PILOT_INPUT": _WARN,
    }


def _px4_parameters(vehicle: Vehicle) -> dict[str, float]:
    return dict.fromkeys(_PX4_ZEROS, 0.0) | {
        "SYS_AUTOSTART": _BLUEROV2_HEAVY if vehicle.name == _HEAVY else _UUV,
        "CAL_ACC0_ID": 1.0,
        "CAL_GYRO0_ID": 1.0,
        "COM_RC_IN_MODE": _JOYSTICK_ALONE,  # sticks come only by MAVLink, and select no modes
        "COM_RC_LOSS_T": _STICKS_LAST,
        **{f"COM_FLTMODE{i}": -1.0 for i in range(1, 7)},
    }
