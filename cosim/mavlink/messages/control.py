"""Messages about law, arbiter and thrusters. Each function yields the fields of each message of one kind."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence

from cosim.mavlink.messages.pose import degrees
from cosim.mavlink.vehicle.ardusub_sticks import channel_pulses
from cosim.mavlink.vehicle.vehicle_context import VehicleContext
from cosim.mavlink.wire.encode import Fields

_MAX_SERVOS, _MAX_OUTPUTS = 16, 32
_MAX_NAME = 10  # characters of a named value
_POSITION_ALONE = 0b110111111000  # type_mask: all else is ignored

# reports of laws that are sent as named values
_NAMED_REPORTS = {
    "law.constraint_slack": "qp_slack",
    "law.barriers": "barriers",
    "law.desired_speed": "des_speed",
    "law.time_since_measurement": "meas_age",
    "law.failed_thruster": "failed_thr",
}


def nav_controller_output(context: VehicleContext) -> Iterator[Fields]:
    """NAV_CONTROLLER_OUTPUT: bearing and distance of the target's center; the altitude error is that of its depth."""
    view = context.view
    north, east, down = (a - b for a, b in zip(view.target, view.position_ned, strict=True))
    bearing = degrees(math.atan2(east, north))
    roll, pitch, heading = map(degrees, view.euler)
    yield roll, pitch, heading, bearing, math.hypot(north, east), -down, 0.0, 0.0


def servo_output_raw(context: VehicleContext) -> Iterator[Fields]:
    """SERVO_OUTPUT_RAW: thruster commands as pulses [µs], 0 for unused outputs; its time wraps."""
    pulses = (context.servo_pulses() + [0] * _MAX_SERVOS)[:_MAX_SERVOS]
    yield context.view.boot_us & 0xFFFFFFFF, 0, *pulses


def actuator_output_status(context: VehicleContext) -> Iterator[Fields]:
    """ACTUATOR_OUTPUT_STATUS: force of each thruster as a fraction of its limit, from -1 to 1."""
    fractions = context.thrust_fractions()[:_MAX_OUTPUTS]
    yield context.view.boot_us, (1 << len(fractions)) - 1, fractions


def rc_channels(context: VehicleContext) -> Iterator[Fields]:
    """RC_CHANNELS: the last sticks, of an ArduSub times the gain, in its order: pitch roll up yaw forward lateral."""
    pulses = channel_pulses(context.sticks)
    yield context.view.boot_ms, len(pulses), *pulses, *[0xFFFF] * 12, 0xFF


def position_target_local_ned(context: VehicleContext) -> Iterator[Fields]:
    """POSITION_TARGET_LOCAL_NED: the center of the target region."""
    view = context.view
    yield view.boot_ms, context.mavlink.MAV_FRAME_LOCAL_NED, _POSITION_ALONE, *view.target, *(0.0,) * 8


def named_values(context: VehicleContext) -> list[tuple[str, float]]:
    """Return names of up to ten characters and values of the main quantities."""
    view = context.view
    goal_clearance, *clearances = view.clearances
    return [
        *zip(weight_names(view.criteria), view.weights, strict=True),
        *((f"phi{i}", phi) for i, phi in enumerate(view.estimate, 1)),
        ("g_goal", view.region_values[0]),
        ("goal_clear", goal_clearance),
        ("clearance", min((c for c in clearances if not math.isnan(c)), default=math.nan)),  # of all regions
        ("thrust", max(map(abs, context.thrust_fractions()), default=0.0)),
        ("force", math.hypot(*view.wrench[:3])),
        ("saturated", float(view.saturated)),
        *((_NAMED_REPORTS[name], value) for name, value in view.reports() if name in _NAMED_REPORTS),
    ]


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


def named_value_float(context: VehicleContext) -> Iterator[Fields]:
    """NAMED_VALUE_FLOAT: one for each of `named_values`."""
    for name, value in named_values(context):
        yield context.view.boot_ms, name, value


def debug_float_array(context: VehicleContext) -> Iterator[Fields]:
    """DEBUG_FLOAT_ARRAY: all outputs and reports of law and arbiter, by array_id."""
    # 1, `weights`: memberships, then weights, in the order of the criteria. 2, `values`: g of the goal, then of each
    # region of the scenario. 3, `clearances`: in the same order. 4, `thrusts`: the force of each thruster [N], then its
    # command. 5, `law`: reports of the law, in the order of the columns. Each has 58 numbers at most.
    view = context.view
    arrays = {
        "weights": [*view.memberships, *view.weights],
        "values": view.region_values,
        "clearances": view.clearances,
        "thrusts": [*view.thruster_forces, *view.thruster_commands],
        "law": [value for _, value in view.reports()],
    }
    for number, (name, data) in enumerate(arrays.items(), 1):
        if data:
            yield view.boot_us, name, number, data
