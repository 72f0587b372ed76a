"""Convert a log's commands to forces of the vehicle's thrusters, or to a wrench on its body."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Literal

import msgspec
import numpy as np

from cosim.errors import ImportLogError
from cosim.logs.topics import Topic
from cosim.simulation.commands.command_handler import greatest_wrench
from cosim.simulation.signals import Array
from plant_fmu import Vehicle
from plant_fmu.autopilot import Autopilot, effort_of_pulse
from plant_fmu.t200 import VOLTAGES, force_of_pulse

CURVES = ("linear", "quadratic", "t200")
PILOT_GAIN = 0.5  # fraction of the greatest wrench that full sticks command, ArduSub's default
_MOTORS = 33  # SERVOn_FUNCTION of the first motor
_MOST_MOTORS = 8
_NEUTRAL = 1500.0  # us, pulse at which a T200 rests


@dataclass(frozen=True)
class Commands:
    """Conversion of a log's commands to forces."""

    quantity: str  # quantity of the commands
    through: Literal["thrusters", "wrench"]  # ``thrusters`` or ``wrench``
    # function from the log's commands and voltages [V], shapes (n, size) and (n,), to forces of the thrusters [N],
    # shape (n, thrusters), or wrenches [N, N m], shape (n, 6)
    forces: Callable[[Array, Array], Array]
    words: str  # description in a sentence


def commands_of(
    topic: Topic, vehicle: Vehicle, curve: str | None, voltage: str, parameters: Mapping[str, float]
) -> Commands:
    """Return the conversion of a topic's commands to forces."""
    n = vehicle.n_thrusters
    if topic.quantity == "wrench":
        return Commands(topic.quantity, "wrench", lambda values, _: values, f"body wrench of {topic.name}")
    if not n:
        raise ImportLogError(f"vehicle {vehicle.name!r} has no thrusters, expected a log with a body wrench")
    if topic.quantity == "sticks":
        reach = PILOT_GAIN * greatest_wrench(vehicle.thruster_matrix, vehicle.thrust_min, vehicle.thrust_max)
        words = f"sticks of {topic.name}, full ones as {PILOT_GAIN:g} of the greatest wrench: no servo output is there"
        return Commands(topic.quantity, "wrench", lambda values, _: values * reach, words)
    if topic.quantity == "pulses":
        return _of_pulses(topic, vehicle, curve, voltage, parameters)
    if topic.size != n:
        raise ImportLogError(
            f"{topic.name}: commands of {topic.size} thrusters, expected {n} as vehicle {vehicle.name!r} has"
        )
    if topic.quantity == "thrust":
        return Commands(topic.quantity, "thrusters", lambda values, _: values, f"thruster forces of {topic.name}")
    least, most = vehicle.thrust_min, vehicle.thrust_max
    words = f"{topic.name}, each part of the thruster's greatest force"
    return Commands(
        topic.quantity, "thrusters", lambda values, _: np.where(values < 0.0, -values * least, values * most), words
    )


def _of_pulses(
    topic: Topic, vehicle: Vehicle, curve: str | None, voltage: str, parameters: Mapping[str, float]
) -> Commands:
    table = vehicle.autopilot
    if table is None:
        raise ImportLogError(
            f"vehicle {vehicle.name!r} has no table [autopilot], expected one: {topic.name} gives servo pulses"
        )
    channels = channels_of(table, vehicle, parameters)
    beyond = [channel for channel in channels if channel > topic.size]
    if beyond:
        raise ImportLogError(
            f"{topic.name}: has {topic.size} outputs, expected {max(beyond)} for vehicle {vehicle.name!r}"
        )
    given = table.signs if isinstance(table.signs, tuple) else (table.signs,) * vehicle.n_thrusters
    turned = [parameters.get(f"MOT_{i + 1}_DIRECTION", 1.0) for i in range(vehicle.n_thrusters)]
    signs = np.array([sign * (-1 if turn < 0.0 else 1) for sign, turn in zip(given, turned, strict=True)])
    places = np.array([max(channel - 1, 0) for channel in channels])
    used = np.array([float(channel > 0) for channel in channels])
    if (curve or table.curve) == "t200":
        if not voltage:
            raise ImportLogError("--curve t200 needs the voltage, expected --voltage V: the log does not have it")

        def thrust(values: Array, volts: Array) -> Array:
            pulses = np.where(values[:, places] <= 0.0, _NEUTRAL, values[:, places])  # 0: the output is off
            at = np.repeat(volts[:, None], len(places), axis=1)
            force: Array = used * signs * force_of_pulse(pulses, at)
            return force

        words = f"pulses of {topic.name} by the T200's published curve, at {voltage}, cut at {VOLTAGES[0]:g} V"
        return Commands(topic.quantity, "thrusters", thrust, f"{words} and {VOLTAGES[-1]:g} V")
    shape = msgspec.structs.replace(table, curve=curve or table.curve)
    efforts = [np.vectorize(effort_of_pulse(shape, int(sign)), otypes=[float]) for sign in signs]

    def forces(values: Array, _: Array) -> Array:
        with np.errstate(invalid="ignore"):
            parts = np.column_stack([effort(values[:, at]) for effort, at in zip(efforts, places, strict=True)])
        missing = np.isnan(values[:, places])
        scaled = np.where(parts < 0.0, -parts * vehicle.thrust_min, parts * vehicle.thrust_max)
        return used * np.where(missing, np.nan, scaled)

    return Commands(
        topic.quantity, "thrusters", forces, f"pulses of {topic.name} by the {shape.curve} curve of {vehicle.name}"
    )


def channels_of(table: Autopilot, vehicle: Vehicle, parameters: Mapping[str, float]) -> tuple[int, ...]:
    """Return the servo output of each thruster, from 1; 0 for none."""
    # The autopilot's own parameters take precedence over the vehicle's file.
    motors = {
        int(function) - _MOTORS + 1: n
        for n in range(1, 33)
        if _MOTORS <= (function := parameters.get(f"SERVO{n}_FUNCTION", 0.0)) < _MOTORS + _MOST_MOTORS
    }
    driven = [i for i, channel in enumerate(table.channels) if channel]
    if not motors:
        return table.channels
    if len(motors) != len(driven) or set(motors) != set(range(1, len(driven) + 1)):
        raise ImportLogError(
            f"the log drives {len(motors)} motors (SERVOn_FUNCTION), expected {len(driven)} as vehicle "
            f"{vehicle.name!r} has"
        )
    order = iter(range(1, len(driven) + 1))
    return tuple(motors[next(order)] if channel else 0 for channel in table.channels)
