"""The sticks of an ArduSub: each thruster adds the commands of all sticks, and rate sticks have dead zones."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from controller.driven_axes import undriven_axes
from cosim.mavlink.wire.manual_control import clip_stick
from cosim.scenario.region_tables import Vector6
from cosim.simulation.signals import Array
from plant_fmu import Vehicle

CENTER, SWING = 1500.0, 400.0  # us, pulse of a channel at rest; change of it by a full stick
MAX_LEAN = math.radians(45.0)  # tilt that a full stick of roll or pitch commands: ANGLE_MAX
# deflections of a stick at a pilot gain of 1 up to which it commands nothing
YAW_DEAD_ZONE = 0.1  # 40 of 400 us
LEAN_DEAD_ZONE = 0.075  # 30 of 400 us
CLIMB_DEAD_ZONE = 0.2  # THR_DZ: 100 of 500
_MIN_FRACTION = 0.6  # of a thruster's maximum matrix element above which it is mixed into an axis


class MotorMixer:
    """Add the commands of the sticks to each thruster, 1, 0 or -1 for a full stick, and square the sum."""

    def __init__(self, vehicle: Vehicle) -> None:
        self._matrix, table = vehicle.thruster_matrix, vehicle.autopilot
        size = np.abs(self._matrix)
        self.commands: Array = np.where(
            size > _MIN_FRACTION * size.max(axis=1, keepdims=True), np.sign(self._matrix), 0.0
        ).T
        self.commands[:, undriven_axes(self._matrix, vehicle.thrust_min, vehicle.thrust_max)] = 0.0
        # maximum force of each thruster [N], the mean of both directions
        self.max_forces: Array = 0.5 * (vehicle.thrust_max - vehicle.thrust_min)
        self.is_quadratic = table is not None and table.curve == "quadratic"

    def wrench(self, sticks: Array) -> Array:
        """Return the wrench, shape (6,) [N, N m], of sticks of X Y Z K M N that include the gain."""
        sums = np.clip(self.commands @ sticks, -1.0, 1.0)
        result: Array = self._matrix @ (self.max_forces * (sums * np.abs(sums) if self.is_quadratic else sums))
        return result


def channel_pulses(sticks: Sequence[float]) -> list[float]:
    """Return the pulses of channels 1 to 6 [us], pitch, roll, up, yaw, forward, right, of sticks of X Y Z K M N."""
    surge, sway, heave, roll, pitch, yaw = sticks
    return [CENTER + SWING * part for part in (pitch, roll, -heave, yaw, surge, sway)]


def channel_sticks(pulses: Sequence[float]) -> Vector6:
    """Return the sticks of X Y Z K M N, -1 to 1, of the pulses of channels 1 to 6 [us]."""
    pitch, roll, up, yaw, surge, sway = (clip_stick((pulse - CENTER) / SWING) for pulse in pulses)
    return surge, sway, -up + 0.0, roll, pitch, yaw


def apply_dead_zone(deflection: float, dead_zone: float) -> float:
    """Return the fraction of a full rate that a stick commands."""
    beyond = abs(deflection) - dead_zone
    return math.copysign(beyond / (1.0 - dead_zone), deflection) if beyond > 0.0 else 0.0


def invert_dead_zone(part: float, dead_zone: float) -> float:
    """Return the deflection that commands a fraction of a full rate: the inverse of `apply_dead_zone`; 0 for 0."""
    return math.copysign(dead_zone + (1.0 - dead_zone) * abs(part), part) if part else 0.0
