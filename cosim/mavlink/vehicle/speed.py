"""Speeds of a vehicle: the one that DO_CHANGE_SPEED commands, and those that its thrusters reach."""

from __future__ import annotations

import math

from cosim.errors import CommandError
from cosim.mavlink.vehicle.vehicle_context import VehicleContext
from cosim.simulation.commands.command_handler import greatest_wrench
from plant_fmu import Vehicle

SPEED = "law.gains.speed"  # key of the setting

_UNCHANGED, _DEFAULT = -1.0, -2.0  # special values of the protocol


def resolve_speed(context: VehicleContext, speed: float) -> float | None:
    """Return the speed [m/s] that a change of speed commands, or None for no change."""
    if speed == _UNCHANGED:
        return None
    if speed == _DEFAULT:
        return float(context.scenario.law.gains.speed)
    max_speed = terminal_speed(context.scenario.vehicle)
    if not 0.0 < speed <= max_speed:
        raise CommandError(f"a speed of {speed:g} m/s, expected above 0 to {max_speed:.3g} m/s, -1 or -2")
    return speed


def terminal_speed(vehicle: Vehicle) -> float:
    """Return the maximum speed in still water at full thrust along a body axis, where drag equals thrust [m/s]."""
    return max(drag_limited_speed(vehicle, i, force) for i, force in enumerate(greatest_wrench(vehicle)[:3].tolist()))


def drag_limited_speed(vehicle: Vehicle, axis: int, force: float) -> float:
    """Return the speed [m/s] along a body axis at which the drag in still water equals a force [N]."""
    linear, quadratic = float(vehicle.linear_damping[axis]), float(vehicle.quadratic_damping[axis])
    slope = linear + math.sqrt(linear**2 + 4.0 * quadratic * force)
    return 2.0 * force / slope if slope > 0.0 else math.inf
