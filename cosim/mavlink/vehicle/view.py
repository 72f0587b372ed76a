"""A snapshot of the run, by named quantities."""

from __future__ import annotations

import math
from collections.abc import Callable
from functools import cached_property

from cosim.mavlink.vehicle.row_layout import RowLayout
from cosim.scenario.region_tables import Vector3
from cosim.simulation.commands.commands import MODES, Mode
from cosim.simulation.signals import Array

_MICRO = 1e6
_MAX_TIME = 1e12  # s; later times are invalid
_HALF_TURN = 2.0 * math.pi


class _Vector:
    """Property of three values from a column on."""

    def __init__(self, first: str) -> None:
        self._first = first

    def __get__(self, view: View, owner: type[View]) -> Vector3:
        return view.vector(self._first)


class _Numbers:
    """Property of the values from a column on, as many as a quantity of the layout has."""

    def __init__(self, first: str, count: Callable[[RowLayout], int]) -> None:
        self._first, self._count = first, count

    def __get__(self, view: View, owner: type[View]) -> list[float]:
        return view.numbers(self._first, self._count(view.layout))


def _rotate(e0: float, e: list[float], v: Vector3) -> Vector3:
    """Rotate `v` by the quaternion (e0, e): (3) as v + 2 e x (e x v + e0 v)."""
    # floats: an array of three takes several times as long, and warns of absurd numbers
    (a, b, c), (x, y, z) = e, v
    p, q, r = b * z - c * y + e0 * x, c * x - a * z + e0 * y, a * y - b * x + e0 * z
    return x + 2.0 * (b * r - c * q), y + 2.0 * (c * p - a * r), z + 2.0 * (a * q - b * p)


class View:
    """One row, by named quantities; no property raises for any numbers; row (n,), waited_us [µs]."""

    def __init__(self, layout: RowLayout, row: Array, waited_us: int = 0) -> None:
        self.layout, self._row, self._waited_us = layout, row.tolist(), waited_us

    def number(self, name: str, default: float = 0.0) -> float:
        """Return a column's value, or `default` if the row has no such column."""
        index = self.layout.index.get(name)
        return default if index is None else self._row[index]

    def numbers(self, first: str, n: int) -> list[float]:
        """Return n values from a column on; zeros if the row has no such column."""
        index = self.layout.index.get(first)
        return [0.0] * n if index is None else self._row[index : index + n]

    def vector(self, first: str) -> Vector3:
        """Return three values from a column on."""
        x, y, z = self.numbers(first, 3)
        return x, y, z

    @cached_property
    def boot_us(self) -> int:
        """Time since boot [µs]: time of waiting plus simulated time."""
        return self._waited_us + self.simulated_us

    @property
    def boot_ms(self) -> int:
        """Time since boot [ms], modulo 2**32."""
        return self.boot_us // 1000 & 0xFFFFFFFF

    @cached_property
    def simulated_us(self) -> int:
        """Simulated time [µs]; 0 if it is NaN, negative or above 1e12 s."""
        time = self._row[0]
        return round(time * _MICRO) if 0.0 <= time <= _MAX_TIME else 0

    # ---- pose and motion ----

    position_ned = _Vector("position.x")
    """Position of the body origin [m]."""

    quaternion = _Numbers("quaternion.e0", lambda layout: 4)
    """Unit quaternion from body to world, scalar first."""

    euler = _Vector("attitude.roll")
    """Roll, pitch and yaw [rad]."""

    velocity_body = _Vector("velocity.u")
    """Velocity over ground, body frame [m/s]."""

    rates = _Vector("velocity.p")
    """Angular velocity, body frame [rad/s]."""

    def to_world(self, vector_body: Vector3) -> Vector3:
        """Rotate a vector from the body frame to the world, NED."""
        e0, *e = self.quaternion
        return _rotate(e0, e, vector_body)

    def to_body(self, vector_ned: Vector3) -> Vector3:
        """Rotate a vector from the world, NED, to the body frame."""
        e0, *e = self.quaternion
        return _rotate(-e0, e, vector_ned)

    @cached_property
    def velocity_ned(self) -> Vector3:
        """Velocity over ground, NED [m/s], (15)."""
        return self.to_world(self.velocity_body)

    @cached_property
    def heading(self) -> float:
        """Yaw from 0 to 2 pi [rad]; NaN if it is not finite."""
        yaw = self.euler[2]
        return yaw % _HALF_TURN if math.isfinite(yaw) else math.nan

    # ---- sensors ----

    @property
    def depth(self) -> float:
        """Depth from the pressure sensor [m]."""
        return self.number("measured.depth", self.position_ned[2])

    acceleration = _Vector("measured.acceleration.x")
    """Specific force from the IMU, body frame [m/s2]."""

    measured_rates = _Vector("measured.angular_velocity.p")
    """Angular velocity from the IMU, body frame [rad/s]."""

    @property
    def altitude(self) -> float:
        """Height above the bottom from the DVL [m]."""
        return self.number("measured.altitude", math.inf)

    @property
    def touches_bottom(self) -> bool:
        """True if the hull is in contact with the bottom."""
        return self.number("bottom_contact") > 0.0

    # ---- forces ----

    thruster_forces = _Numbers("thruster_force[1]", lambda layout: layout.thrusters)
    """Force of each thruster [N]."""

    thruster_commands = _Numbers("thrust[1]", lambda layout: layout.thrusters)
    """Commanded force of each thruster [N]."""

    wrench = _Numbers("command.X", lambda layout: 6)
    """Commanded wrench of the law, body frame [N, N m], shape (6,)."""

    @property
    def saturated(self) -> bool:
        """True if a limit is active."""
        return any(self._row[i] > 0.0 for i in self.layout.saturations)

    # ---- law and arbiter ----

    region_values = _Numbers("goal.value", lambda layout: 1 + len(layout.regions))
    """Region function g of the goal, then of each region: above 0 where violated."""

    clearances = _Numbers("goal.clearance", lambda layout: 1 + len(layout.regions))
    """Clearance of the goal, then of each region: 0 or above where satisfied [m or rad]."""

    @property
    def criteria(self) -> tuple[str, ...]:
        """Names of the criteria, in order of priority."""
        return self.layout.criteria

    @property
    def memberships(self) -> list[float]:
        """Memberships of the criteria, in order of priority."""
        return self.numbers(f"membership.{self.criteria[0]}", len(self.criteria))

    @property
    def weights(self) -> list[float]:
        """Weights of the criteria, in order of priority."""
        return self.numbers(f"weight.{self.criteria[0]}", len(self.criteria))

    estimate = _Numbers("estimate.phi1", lambda layout: 4)
    """Estimate of phi in (12) [N, N m], shape (4,)."""

    def reports(self) -> list[tuple[str, float]]:
        """Return the law's reports as pairs of column name and value."""
        return [(name, self.number(name)) for name in self.layout.reports]

    def shift(self, region: str) -> Vector3:
        """Return the displacement of a region, or ``"goal"``, from its position in the scenario [m, NED]."""
        return self.vector(f"{region}.shift.x")

    # ---- the command handler ----

    @property
    def armed(self) -> bool:
        """True if the thrusters are enabled."""
        return self.number("commands.armed", 1.0) > 0.0

    @property
    def mode(self) -> Mode:
        """Mode of the command handler."""
        number = self.number("commands.mode", float(MODES.index("reach")))
        return MODES[int(number)] if 0.0 <= number < len(MODES) else "reach"

    @property
    def item(self) -> int:
        """Current item of the mission; -1 for none."""
        number = self.number("commands.item", -1.0)
        return int(number) if 0.0 <= number < 1e6 else -1

    @property
    def target(self) -> Vector3:
        """Center of the target region [m, NED]."""
        if "target.x" in self.layout.index:
            return self.vector("target.x")
        x, y, z = self.layout.goal_center
        dx, dy, dz = self.shift("goal")
        return x + dx, y + dy, z + dz
