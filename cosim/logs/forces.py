"""Convert a log's commands to forces of the vehicle's thrusters, or to a wrench on its body."""

from __future__ import annotations

import itertools
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Literal

import msgspec
import numpy as np

from cosim.errors import ImportLogError
from cosim.logs.cleaning.topics import Topic
from cosim.simulation.commands.command_handler import greatest_wrench
from cosim.simulation.signals import Array
from plant_fmu import Vehicle
from plant_fmu.autopilot import Autopilot, effort_of_pulse
from plant_fmu.t200 import VOLTAGES, force_of_pulse

CURVES = ("linear", "quadratic", "t200")
PILOT_GAIN = 0.5  # fraction of the maximum wrench that full sticks command, ArduSub's default
_MOTORS = 33  # SERVOn_FUNCTION of the first motor
_MAX_MOTORS = 8
_NEUTRAL = 1500.0  # us, pulse at which a T200 rests


Conversion = Callable[[Array, Array], Array]


@dataclass(frozen=True)
class CommandForces:
    """Conversion of a log's commands to forces."""

    quantity: str  # quantity of the commands
    through: Literal["thrusters", "wrench"]
    # function from the log's commands and voltages [V], shapes (n, size) and (n,), to forces of the thrusters [N],
    # shape (n, thrusters), or wrenches [N, N m], shape (n, 6)
    forces: Conversion
    summary: str  # description in a sentence


def command_forces(
    topic: Topic, vehicle: Vehicle, curve: str | None, voltage: str, parameters: Mapping[str, float]
) -> CommandForces:
    """Return the conversion of a topic's commands to forces."""
    n = vehicle.n_thrusters
    if topic.quantity == "wrench":
        return CommandForces(topic.quantity, "wrench", lambda values, _: values, f"body wrench of {topic.name}")
    if not n:
        raise ImportLogError(f"vehicle {vehicle.name!r} has no thrusters, expected a log with a body wrench")
    if topic.quantity == "sticks":
        full = PILOT_GAIN * greatest_wrench(vehicle)
        summary = f"sticks of {topic.name}, full ones as {PILOT_GAIN:g} of the greatest wrench, without servo outputs"
        return CommandForces(topic.quantity, "wrench", lambda values, _: values * full, summary)
    if topic.quantity == "pulses":
        return _pulse_forces(topic, vehicle, curve, voltage, parameters)
    if topic.size != n:
        raise ImportLogError(
            f"{topic.name}: commands of {topic.size} thrusters, expected {n} as vehicle {vehicle.name!r} has"
        )
    if topic.quantity == "thrust":
        return CommandForces(topic.quantity, "thrusters", lambda values, _: values, f"thruster forces of {topic.name}")
    summary = f"{topic.name}, fractions of each thruster's greatest force"
    return CommandForces(topic.quantity, "thrusters", lambda values, _: _scale_efforts(values, vehicle), summary)


def _scale_efforts(efforts: Array, vehicle: Vehicle) -> Array:
    """Return forces [N] of fractions of each thruster's maximum force, -1 to 1, NaN for NaN."""
    forces: Array = np.where(efforts < 0.0, -efforts * vehicle.thrust_min, efforts * vehicle.thrust_max)
    return forces


def _pulse_forces(
    topic: Topic, vehicle: Vehicle, curve: str | None, voltage: str, parameters: Mapping[str, float]
) -> CommandForces:
    table = vehicle.autopilot
    if table is None:
        raise ImportLogError(
            f"vehicle {vehicle.name!r} has no table [autopilot], expected one: {topic.name} gives servo pulses"
        )
    outputs = np.array(servo_outputs(table, vehicle, parameters))
    if outputs.max() > topic.size:
        raise ImportLogError(
            f"{topic.name}: has {topic.size} outputs, expected {outputs.max()} for vehicle {vehicle.name!r}"
        )
    signs = np.broadcast_to(table.signs, vehicle.n_thrusters) * [
        -1 if parameters.get(f"MOT_{i + 1}_DIRECTION", 1.0) < 0.0 else 1 for i in range(vehicle.n_thrusters)
    ]
    indices, is_connected = np.maximum(outputs - 1, 0), outputs > 0
    curve = curve or table.curve
    if curve == "t200":
        if not voltage:
            raise ImportLogError("--curve t200 needs the voltage, expected --voltage V: the log does not have it")
        summary = f"by the T200's published curve, at {voltage}, clipped to {VOLTAGES[0]:g} to {VOLTAGES[-1]:g} V"

        def forces(values: Array, volts: Array) -> Array:
            pulses = np.where(values[:, indices] <= 0.0, _NEUTRAL, values[:, indices])  # 0: the output is off
            supply = np.repeat(volts[:, None], len(indices), axis=1)
            result: Array = is_connected * signs * force_of_pulse(pulses, supply)
            return result

    else:
        shape = msgspec.structs.replace(table, curve=curve)
        curves = [np.vectorize(effort_of_pulse(shape, int(sign)), otypes=[float]) for sign in signs]
        summary = f"by the {curve} curve of {vehicle.name}"

        def forces(values: Array, volts: Array) -> Array:
            pulses = values[:, indices]
            with np.errstate(invalid="ignore"):
                efforts = np.column_stack([effort(x) for effort, x in zip(curves, pulses.T, strict=True)])
            return is_connected * _scale_efforts(np.where(np.isnan(pulses), np.nan, efforts), vehicle)

    return CommandForces(topic.quantity, "thrusters", forces, f"pulses of {topic.name} {summary}")


def servo_outputs(table: Autopilot, vehicle: Vehicle, parameters: Mapping[str, float]) -> tuple[int, ...]:
    """Return the servo output of each thruster, from 1; 0 for none."""
    # The autopilot's own parameters take precedence over the vehicle's file.
    motors = {
        int(function) - _MOTORS + 1: n
        for n in range(1, 33)
        if _MOTORS <= (function := parameters.get(f"SERVO{n}_FUNCTION", 0.0)) < _MOTORS + _MAX_MOTORS
    }
    driven = [i for i, channel in enumerate(table.channels) if channel]
    if not motors:
        return table.channels
    if len(motors) != len(driven) or set(motors) != set(range(1, len(driven) + 1)):
        raise ImportLogError(
            f"the log drives {len(motors)} motors (SERVOn_FUNCTION), expected {len(driven)} as vehicle "
            f"{vehicle.name!r} has"
        )
    order = itertools.count(1)
    return tuple(motors[next(order)] if channel else 0 for channel in table.channels)
