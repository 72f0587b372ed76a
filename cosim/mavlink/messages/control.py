"""Messages about law, arbiter and thrusters. Each function returns the messages of one kind."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any

from cosim.mavlink.messages.pose import degrees
from cosim.mavlink.vehicle.vehicle_context import VehicleContext
from cosim.mavlink.wire.encode import wrap_time

_CENTER, _SWING = 1500, 400  # µs of PWM: at rest, and to either end
_MAX_SERVOS, _MAX_OUTPUTS = 16, 32
_MAX_NAME = 10  # characters of a named value
_POSITION_AND_VELOCITY = 0b110111000000  # type_mask: all but these is ignored

# reports of laws that are sent as named values
_NAMED_REPORTS = {
    "law.constraint_slack": "qp_slack",
    "law.barriers": "barriers",
    "law.desired_speed": "des_speed",
    "law.time_since_measurement": "meas_age",
    "law.failed_thruster": "failed_thr",
}

# DEBUG_FLOAT_ARRAY: what an array_id holds
WEIGHTS, VALUES, CLEARANCES, THRUSTS, REPORTS = 1, 2, 3, 4, 5


def nav_controller_output(context: VehicleContext) -> list[Any]:
    """NAV_CONTROLLER_OUTPUT: bearing and distance of the target's center; the altitude error is that of its depth."""
    view = context.view
    north, east, down = (a - b for a, b in zip(view.target, view.position_ned, strict=True))
    bearing = degrees(math.atan2(east, north))
    heading = degrees(view.euler[2])
    roll, pitch = degrees(view.euler[0]), degrees(view.euler[1])
    values = roll, pitch, heading, bearing, math.hypot(north, east), -down, 0.0, 0.0
    return [context.make("NAV_CONTROLLER_OUTPUT", *values)]


def servo_output_raw(context: VehicleContext) -> list[Any]:
    """SERVO_OUTPUT_RAW: thruster commands as pulses [µs], 0 for unused outputs; its time wraps."""
    pulses = (context.servo_pulses() + [0] * _MAX_SERVOS)[:_MAX_SERVOS]
    return [context.make("SERVO_OUTPUT_RAW", wrap_time(context.view.boot_us, 1), 0, *pulses)]


def actuator_output_status(context: VehicleContext) -> list[Any]:
    """ACTUATOR_OUTPUT_STATUS: force of each thruster as a fraction of its limit, from -1 to 1."""
    fractions = context.thrust_fractions()[:_MAX_OUTPUTS]
    return [context.make("ACTUATOR_OUTPUT_STATUS", context.view.boot_us, (1 << len(fractions)) - 1, fractions)]


def rc_channels(context: VehicleContext) -> list[Any]:
    """RC_CHANNELS: the last applied sticks, in the order of ArduSub: pitch roll up yaw forward lateral."""
    surge, sway, heave, roll, pitch, yaw = context.sticks
    order = pitch, roll, -heave, yaw, surge, sway
    pulses = [_CENTER + _SWING * stick for stick in order] + [0xFFFF] * 12
    return [context.make("RC_CHANNELS", wrap_time(context.view.boot_us), len(order), *pulses, 0xFF)]


def position_target_local_ned(context: VehicleContext) -> list[Any]:
    """POSITION_TARGET_LOCAL_NED: the center of the target region."""
    m, view = context.mavlink, context.view
    none = (0.0,) * 8
    mask = _POSITION_AND_VELOCITY | 0b111000
    return [
        context.make(
            "POSITION_TARGET_LOCAL_NED", wrap_time(view.boot_us), m.MAV_FRAME_LOCAL_NED, mask, *view.target, *none
        )
    ]


def named_values(context: VehicleContext) -> list[tuple[str, float]]:
    """Return names of up to ten characters and values of the main quantities."""
    view = context.view
    values = list(zip(weight_names(view.criteria), view.weights, strict=True))
    values += [(f"phi{i}", phi) for i, phi in enumerate(view.estimate, 1)]
    clearances = view.clearances
    values.append(("g_goal", view.region_values[0]))
    values.append(("goal_clear", clearances[0]))
    nearest = min((c for c in clearances[1:] if not math.isnan(c)), default=math.nan)
    values.append(("clearance", nearest))  # the minimum of all regions
    values.append(("thrust", max(map(abs, context.thrust_fractions()), default=0.0)))
    values.append(("force", math.hypot(*view.wrench[:3])))
    values.append(("saturated", float(view.saturated)))
    values += [(_NAMED_REPORTS[name], value) for name, value in view.reports() if name in _NAMED_REPORTS]
    return values


def weight_names(criteria: Sequence[str]) -> list[str]:
    """Return names of the criteria's weights, of up to ten characters: ``w_obstacle``, ``w_visibili``."""
    # A number at the end distinguishes equal names.
    names: list[str] = []
    for criterion in criteria:
        name, number = f"w_{criterion}"[:_MAX_NAME], 2
        while name in names:
            name, number = f"w_{criterion}"[: _MAX_NAME - len(str(number))] + str(number), number + 1
        names.append(name)
    return names


def named_value_float(context: VehicleContext) -> list[Any]:
    """NAMED_VALUE_FLOAT: one for each of `named_values`."""
    time = wrap_time(context.view.boot_us)
    return [context.make("NAMED_VALUE_FLOAT", time, name, value) for name, value in named_values(context)]


def debug_float_array(context: VehicleContext) -> list[Any]:
    """DEBUG_FLOAT_ARRAY: all outputs and reports of law and arbiter, by array_id."""
    # 1, `weights`: memberships, then weights, in the order of the criteria. 2, `values`: g of the goal, then of each
    # region of the scenario. 3, `clearances`: in the same order. 4, `thrusts`: the force of each thruster [N], then its
    # command. 5, `law`: reports of the law, in the order of the columns. Each has 58 numbers at most.
    view = context.view
    arrays: list[tuple[int, str, Sequence[float]]] = [
        (WEIGHTS, "weights", [*view.memberships, *view.weights]),
        (VALUES, "values", view.region_values),
        (CLEARANCES, "clearances", view.clearances),
        (THRUSTS, "thrusts", [*view.thruster_forces, *view.thruster_commands]),
    ]
    reports = [value for _, value in view.reports()]
    if reports:
        arrays.append((REPORTS, "law", reports))
    return [context.make("DEBUG_FLOAT_ARRAY", view.boot_us, name, number, data) for number, name, data in arrays]
