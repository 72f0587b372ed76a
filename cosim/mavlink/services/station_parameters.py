"""Read-only parameters that ground stations read by name."""

# QGroundControl reads them when it connects and in its summary of a vehicle. It reports a missing one as a bug of the
# firmware, and a sensor without calibration as a vehicle that needs setup.

from __future__ import annotations

from collections.abc import Callable
from functools import partial

from cosim.mavlink.vehicle.vehicle_context import VehicleContext
from cosim.mavlink.wire.options import LossAction

_HEAVY = "bluerov2_heavy"
_VECTORED_6DOF, _CUSTOM_FRAME = 2.0, 7.0  # ArduSub's FRAME_CONFIG
_SERVOS = 14
_MOTORS = (*range(33, 41), *range(82, 86))  # ArduPilot's SERVOn_FUNCTION of motors 1 to 12
_EXACT = 1e-6  # m/s2; offsets of exactly 0 are those of an accelerometer that was never calibrated
_WARN = 1.0  # value of FS_PILOT_INPUT
_BLUEROV2_HEAVY, _UUV = 60002.0, 60000.0  # PX4's SYS_AUTOSTART
_JOYSTICK_ALONE = 1.0  # value of COM_RC_IN_MODE
_STICKS_LAST = 3.0  # s
_ON_LOSS: dict[LossAction, float] = {
    "none": 0.0,
    "warn": 0.0,
    "hold": 1.0,
    "surface": 3.0,
    "disarm": 6.0,
}  # NAV_DLL_ACT


def station_parameters(context: VehicleContext) -> dict[str, Callable[[], float]]:
    """Return functions that read the read-only parameters of the vehicle's profile, by name."""
    match context.profile.name:
        case "ardusub":
            values = _of_ardusub(context)
        case "px4":
            values = _of_px4(context)
        case "generic":
            return {}
    table: dict[str, Callable[[], float]] = {name: partial(float, value) for name, value in values.items()}
    if context.profile.name == "px4":
        table["NAV_DLL_ACT"] = lambda: _ON_LOSS[context.loss_action]
        table["COM_DL_LOSS_T"] = lambda: context.loss_timeout
    return table


def _of_ardusub(context: VehicleContext) -> dict[str, float]:
    vehicle = context.scenario.vehicle
    motors = _MOTORS[: vehicle.n_thrusters]
    functions = [*motors, *[0] * max(0, _SERVOS - len(motors))]
    numbers = ("", "2", "3")
    return {
        "FRAME_CONFIG": _VECTORED_6DOF if vehicle.name == _HEAVY else _CUSTOM_FRAME,
        **{f"SERVO{i}_FUNCTION": float(function) for i, function in enumerate(functions, 1)},
        **{f"INS_ACCOFFS_{axis}": _EXACT for axis in "XYZ"},
        # there is neither magnetometer nor battery
        **{f"COMPASS_DEV_ID{i}": 0.0 for i in numbers},
        **{f"COMPASS_OFS{i}_{axis}": 0.0 for i in numbers for axis in "XYZ"},
        "COMPASS_DEC": 0.0,
        "BATT_MONITOR": 0.0,
        # these failures are not detected
        "FS_EKF_ACTION": 0.0,
        "FS_LEAK_ENABLE": 0.0,
        "FS_OPTIONS": 0.0,
        "FS_PRESS_ENABLE": 0.0,
        "FS_TEMP_ENABLE": 0.0,
        "FS_PILOT_INPUT": _WARN,
    }


def _of_px4(context: VehicleContext) -> dict[str, float]:
    sticks = ("ROLL", "PITCH", "YAW", "THROTTLE", "FLAPS", "AUX1", "AUX2")
    return {
        "SYS_AUTOSTART": _BLUEROV2_HEAVY if context.scenario.vehicle.name == _HEAVY else _UUV,
        "CAL_ACC0_ID": 1.0,
        "CAL_GYRO0_ID": 1.0,
        # there is neither magnetometer nor battery
        "SYS_HAS_MAG": 0.0,
        **{f"CAL_MAG{i}_ID": 0.0 for i in range(3)},
        "COM_LOW_BAT_ACT": 0.0,
        # sticks come only by MAVLink, and select no modes
        "COM_RC_IN_MODE": _JOYSTICK_ALONE,
        "COM_RC_LOSS_T": _STICKS_LAST,
        "NAV_RCL_ACT": 0.0,
        **{f"RC_MAP_{stick}": 0.0 for stick in sticks},
        **{f"COM_FLTMODE{i}": -1.0 for i in range(1, 7)},
        # home is at the surface
        "RTL_RETURN_ALT": 0.0,
        "RTL_DESCEND_ALT": 0.0,
        "RTL_LAND_DELAY": 0.0,
    }
