"""Quantities of a log: components, units and maximum plausible values."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Literal

Kind = Literal["state", "command", "sensor", "voltage"]


@dataclass(frozen=True)
class Quantity:
    """A quantity of a log, in SI units, world frame NED, body frame FRD."""

    name: str  # name in a column map
    size: int  # number of components; 0 for one per thruster
    unit: str  # unit of each component
    # ``state``: interpolated between samples; ``command``, ``sensor`` or ``voltage``: held until the next sample
    kind: Kind
    max: float  # maximum plausible magnitude of a component; a greater one indicates wrong units
    frame: str  # ``world``, ``body`` or empty: frame that a column map converts
    what: str  # description in words


QUANTITIES = {
    quantity.name: quantity
    for quantity in (
        Quantity("position", 3, "m", "state", 1e6, "world", "position north, east, down"),
        Quantity("attitude", 4, "", "state", 1.01, "", "attitude from body to world, a unit quaternion"),
        Quantity("velocity_world", 3, "m/s", "state", 30.0, "world", "velocity over ground north, east, down"),
        Quantity("velocity", 3, "m/s", "state", 30.0, "body", "velocity over ground along the body axes"),
        Quantity("rates", 3, "rad/s", "state", 35.0, "body", "angular velocity about the body axes"),
        Quantity("altitude", 1, "m", "sensor", 1e4, "", "height above the bottom"),
        Quantity("depth", 1, "m", "sensor", 1.2e4, "", "depth from a pressure sensor, positive down"),
        Quantity("pressure", 1, "Pa", "sensor", 1.3e8, "", "absolute pressure of the water"),
        Quantity("dvl", 3, "m/s", "sensor", 30.0, "body", "velocity over ground from a DVL, body axes"),
        Quantity("acceleration", 3, "m/s2", "sensor", 400.0, "body", "specific force from an IMU, body axes"),
        Quantity("gyro", 3, "rad/s", "sensor", 35.0, "body", "angular velocity from an IMU, body axes"),
        Quantity("heading", 1, "rad", "sensor", 2.0 * math.pi + 0.01, "", "heading from a compass"),
        Quantity("fix", 3, "m", "sensor", 1e6, "world", "position from outside, such as of a USBL"),
        Quantity("thrust", 0, "N", "command", 1e5, "", "commanded force of each thruster"),
        Quantity("effort", 0, "", "command", 1.001, "", "part of its greatest force asked of each thruster"),
        Quantity("pulses", 0, "us", "command", 2500.0, "", "pulse that each thruster's speed controller gets"),
        Quantity("wrench", 6, "N, N m", "command", 1e6, "body", "commanded wrench on the body"),
        Quantity(
            "sticks", 6, "", "command", 1.001, "body", "sticks from -1 to 1: surge, sway, heave, roll, pitch, yaw"
        ),
        Quantity("voltage", 1, "V", "voltage", 1000.0, "", "voltage of the thrusters' supply"),
    )
}
COMMANDS = ("thrust", "pulses", "effort", "wrench", "sticks")  # in order of preference
