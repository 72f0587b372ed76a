"""DO_CHANGE_SPEED, as a command and as an item of a mission: which speeds there are."""

from __future__ import annotations

import math

from cosim.errors import CommandError
from cosim.mavlink.vehicle.vehicle_context import VehicleContext
from cosim.simulation.commands.command_handler import greatest_wrench
from plant_fmu import Vehicle

SPEED = "law.gains.speed"  # key of the setting

_AS_IT_IS, _AS_AT_FIRST = -1.0, -2.0  # as the protocol has them


def resolve_speed(context: VehicleContext, speed: float) -> float | None:
    """Return the speed [m/s] that a change of speed asks for, or None where it is to stay as it is.

    Parameters
    ----------
    context : VehicleContext
        Whose law has a speed.
    speed : float
        Parameter 2: -1 for no change, -2 for the scenario's, else [m/s].

    Raises
    ------
    CommandError
        If the vehicle cannot go at that speed.
    """
    if speed == _AS_IT_IS:
        return None
    if speed == _AS_AT_FIRST:
        return float(context.scenario.law.gains.speed)
    most = terminal_speed(context.scenario.vehicle)
    if not 0.0 < speed <= most:
        raise CommandError(f"a speed of {speed:g} m/s, expected above 0 to {most:.3g} m/s, -1 or -2")
    return speed


def terminal_speed(vehicle: Vehicle) -> float:
    """Return the speed through still water at which drag takes all thrust, along the best of the body's axes [m/s].

    Parameters
    ----------
    vehicle : Vehicle
        Its thrusters' limits and damping count. Infinite where an axis has no damping.
    """
    thrust = greatest_wrench(vehicle.thruster_matrix, vehicle.thrust_min, vehicle.thrust_max)[:3].tolist()
    speeds = []
    for axis, force in enumerate(thrust):
        linear, quadratic = float(vehicle.linear_damping[axis]), float(vehicle.quadratic_damping[axis])
        if quadratic > 0.0:
            speeds.append((math.sqrt(linear * linear + 4.0 * quadratic * force) - linear) / (2.0 * quadratic))
        else:
            speeds.append(force / linear if linear > 0.0 else math.inf)
    return max(speeds)
