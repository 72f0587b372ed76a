"""The one table of the FMU's variables: modelDescription.xml, the C header and the docs page are all made from it."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Literal

from plant_fmu.errors import VehicleError
from plant_fmu.vehicle import Vehicle

Role = Literal["time", "state", "input", "output", "parameter", "flag"]

AXES = "xyz"
VELOCITIES = "uvwpqr"
FORCES = "XYZKMN"

# unit: exponents of kg, m, s, rad
UNITS: dict[str, dict[str, int]] = {
    "s": {"s": 1},
    "m": {"m": 1},
    "m/s": {"m": 1, "s": -1},
    "rad": {"rad": 1},
    "rad/s": {"rad": 1, "s": -1},
    "kg": {"kg": 1},
    "kg.m": {"kg": 1, "m": 1},
    "kg.m2": {"kg": 1, "m": 2},
    "N": {"kg": 1, "m": 1, "s": -2},
    "N.m": {"kg": 1, "m": 2, "s": -2},
    "N.m/N": {"m": 1},
    "N.s/m": {"kg": 1, "s": -1},
    "N.m.s/rad": {"kg": 1, "m": 2, "s": -1, "rad": -1},
    "N.s2/m2": {"kg": 1, "m": -1},
    "N.m.s2/rad2": {"kg": 1, "m": 2, "rad": -2},
}


@dataclass(frozen=True)
class Quantity:
    """What a number measures, and the domain in which the plant is meant to be used; values beyond it are refused."""

    unit: str  # a key of UNITS, or "" for a pure number
    minimum: float
    maximum: float
    nominal: float = 1.0


TIME = Quantity("s", 0.0, 0.0)
LENGTH = Quantity("m", -1e6, 1e6)
UNIT_NUMBER = Quantity("", -1.0, 1.0)
SPEED = Quantity("m/s", -1e4, 1e4)
ANGULAR_SPEED = Quantity("rad/s", -1e4, 1e4)
HALF_TURN = Quantity("rad", -3.1416, 3.1416)
QUARTER_TURN = Quantity("rad", -1.5708, 1.5708)
FORCE = Quantity("N", -1e9, 1e9, 10.0)  # far above any vehicle
MOMENT = Quantity("N.m", -1e9, 1e9, 10.0)
ALL_FORCES = Quantity("N", -1e12, 1e12, 10.0)
ALL_MOMENTS = Quantity("N.m", -1e12, 1e12, 10.0)
FLAG = Quantity("", 0.0, 0.0)

MASS = Quantity("kg", 1e-3, 1e9)
LEVER = Quantity("m", -1e3, 1e3)
WEIGHT = Quantity("N", 0.0, 1e10)
CURRENT = Quantity("m/s", -100.0, 100.0)
TIME_CONSTANT = Quantity("s", 0.0, 1e3)
SUBSTEP = Quantity("s", 1e-6, 1.0)
FORCE_LIMIT = Quantity("N", 0.0, 1e10)  # its maximum is above the norm of any force: no limit


def _inertial(unit: str, diagonal: bool) -> Quantity:
    return Quantity(unit, 0.0 if diagonal else -1e12, 1e12)


@dataclass(frozen=True)
class Variable:
    """One scalar variable of the FMU."""

    name: str  # structured name, such as ``thrust[1]``
    role: Role
    member: str  # where it lives in the C struct Model
    quantity: Quantity
    description: str
    start: float = 0.0
    depends: tuple[str, ...] = ()  # names of the inputs, states and parameters that an output follows from directly

    @property
    def nominal(self) -> float:
        """A typical magnitude: that of the start value for a parameter, else that of the quantity."""
        return (abs(self.start) if self.role == "parameter" else 0.0) or self.quantity.nominal


def variables(vehicle: Vehicle) -> list[Variable]:
    """Return every variable of a vehicle's FMU; the index in this list is the value reference.

    Parameters
    ----------
    vehicle : Vehicle
        Gives the start values and the number of thrusters.

    Returns
    -------
    list of Variable
        Real variables first, then the Boolean ones (role ``"flag"``).

    Raises
    ------
    VehicleError
        If a number of the vehicle is beyond the range of its parameter.
    """
    rows = [
        Variable("time", "time", "time", TIME, "Simulated time"),
        *_states(),
        *_inputs(vehicle),
        *_outputs(vehicle),
        *_parameters(vehicle),
        *_flags(vehicle),
    ]
    for v in rows:
        q = v.quantity
        if not q.minimum <= v.start <= q.maximum:
            raise VehicleError(
                f"{vehicle.name}: {v.name} is {v.start:g} {q.unit}, expected {q.minimum:g} to {q.maximum:g}"
            )
    return rows


def _along(i: int) -> str:
    """Say along or about which body axis component `i` of a velocity or a wrench is."""
    return f"{'along' if i < 3 else 'about'} body {AXES[i % 3]}"


def _states() -> Iterator[Variable]:
    for i, where in enumerate(("north", "east", "down (depth)")):
        description = f"Position of the body origin, {where}, world frame NED"
        yield Variable(f"position.{AXES[i]}", "state", f"state.rigid[{i}]", LENGTH, description)
    for i, part in enumerate(("scalar part", "vector part x", "vector part y", "vector part z")):
        description = f"Attitude as unit quaternion from body to world, {part} (normalised when initialisation ends)"
        start = 1.0 if i == 0 else 0.0
        yield Variable(f"quaternion.e{i}", "state", f"state.rigid[{3 + i}]", UNIT_NUMBER, description, start)
    for i, name in enumerate(VELOCITIES):
        kind, quantity = ("Velocity over ground", SPEED) if i < 3 else ("Angular velocity", ANGULAR_SPEED)
        yield Variable(f"velocity.{name}", "state", f"state.rigid[{7 + i}]", quantity, f"{kind} {_along(i)}")


def _inputs(vehicle: Vehicle) -> Iterator[Variable]:
    for i in range(vehicle.n_thrusters):
        description = f"Commanded force of thruster {i + 1}, cut at its limits"
        yield Variable(f"thrust[{i + 1}]", "input", f"inputs.thrust[{i}]", FORCE, description)
    for i, name in enumerate(FORCES):
        kind, quantity = ("force", FORCE) if i < 3 else ("moment", MOMENT)
        description = f"Commanded {kind} on the body {_along(i)}, beside the thrusters"
        yield Variable(f"wrench.{name}", "input", f"inputs.wrench[{i}]", quantity, description)


def _thrust_knowns(i: int) -> tuple[str, ...]:
    return tuple(f"{name}[{i + 1}]" for name in ("thrust", "thrust_min", "thrust_max", "thrust_time_constant"))


_FORCE_KNOWNS = ("wrench.X", "wrench.Y", "wrench.Z", "wrench_force_limit", "wrench_time_constant")


def _outputs(vehicle: Vehicle) -> Iterator[Variable]:
    quaternion = tuple(f"quaternion.e{i}" for i in range(4))
    for i, (name, quantity) in enumerate((("roll", HALF_TURN), ("pitch", QUARTER_TURN), ("yaw", HALF_TURN))):
        description = f"Euler angle {name} (order yaw, pitch, roll)"
        yield Variable(f"attitude.{name}", "output", f"outputs.euler[{i}]", quantity, description, depends=quaternion)
    for i in range(vehicle.n_thrusters):
        name, member = f"thruster_force[{i + 1}]", f"outputs.actuators.thrust[{i}]"
        description = f"Force that thruster {i + 1} gives now, after limits and lag"
        yield Variable(name, "output", member, FORCE, description, depends=_thrust_knowns(i))
    for i, name in enumerate(FORCES):
        kind, quantity = ("Force", ALL_FORCES) if i < 3 else ("Moment", ALL_MOMENTS)
        description = f"{kind} of all actuators on the body {_along(i)}"
        direct = _FORCE_KNOWNS if i < 3 else (f"wrench.{name}", "wrench_time_constant")
        pushing = [
            known
            for j in range(vehicle.n_thrusters)
            for known in (*_thrust_knowns(j), f"thruster_matrix[{i + 1},{j + 1}]")
        ]
        member = f"outputs.wrench[{i}]"
        yield Variable(f"actuation.{name}", "output", member, quantity, description, depends=(*direct, *pushing))


def _parameters(vehicle: Vehicle) -> Iterator[Variable]:
    def parameter(name: str, member: str, quantity: Quantity, description: str, start: float) -> Variable:
        return Variable(name, "parameter", f"plant.parameters.{member}", quantity, description, float(start))

    yield parameter("mass", "mass", MASS, "Mass in air", vehicle.mass)
    for k, (i, j) in enumerate(((0, 0), (1, 1), (2, 2), (0, 1), (0, 2), (1, 2))):
        name, description = f"inertia.{AXES[i]}{AXES[j]}", f"Inertia about the origin, element ({i + 1},{j + 1})"
        yield parameter(name, f"inertia[{k}]", _inertial("kg.m2", i == j), description, vehicle.inertia[i, j])
    for name, what, values in (("r_G", "gravity", vehicle.r_G), ("r_B", "buoyancy", vehicle.r_B)):
        for i, axis in enumerate(AXES):
            yield parameter(f"{name}.{axis}", f"{name}[{i}]", LEVER, f"Centre of {what}, body {axis}", values[i])
    yield parameter("weight", "weight", WEIGHT, "Weight", vehicle.weight)
    yield parameter("buoyancy", "buoyancy", WEIGHT, "Buoyancy", vehicle.buoyancy)

    for i in range(6):
        for j in range(i, 6):
            quantity = _inertial(("kg", "kg.m", "kg.m2")[(i > 2) + (j > 2)], i == j)
            mirrored = f", and by symmetry ({j + 1},{i + 1})" if i != j else ""
            name, description = f"added_mass[{i + 1},{j + 1}]", f"Added mass ({i + 1},{j + 1}){mirrored}"
            yield parameter(name, f"added_mass[{i}][{j}]", quantity, description, vehicle.added_mass[i, j])
    for kind, units, values in (
        ("linear", ("N.s/m", "N.m.s/rad"), vehicle.linear_damping),
        ("quadratic", ("N.s2/m2", "N.m.s2/rad2"), vehicle.quadratic_damping),
    ):
        for i, velocity in enumerate(VELOCITIES):
            name, quantity = f"{kind}_damping[{i + 1}]", Quantity(units[i > 2], 0.0, 1e9)
            description = f"{kind.capitalize()} damping of {velocity}"
            yield parameter(name, f"{kind}_damping[{i}]", quantity, description, values[i])
    for i, where in enumerate(("north", "east", "down")):
        yield parameter(f"current.{AXES[i]}", f"current[{i}]", CURRENT, f"Velocity of the water, {where}", 0.0)

    for i, force in enumerate(FORCES):
        quantity = Quantity("" if i < 3 else "N.m/N", -1e3, 1e3)
        for j in range(vehicle.n_thrusters):
            name, member = f"thruster_matrix[{i + 1},{j + 1}]", f"thruster_matrix[{i}][{j}]"
            description = f"{force} on the body of one newton of thruster {j + 1}"
            yield parameter(name, member, quantity, description, vehicle.thruster_matrix[i, j])
    for i in range(vehicle.n_thrusters):
        for name, quantity, what, start in (
            ("thrust_min", FORCE, "Most negative force of thruster {}", vehicle.thrust_min[i]),
            ("thrust_max", FORCE, "Greatest force of thruster {}", vehicle.thrust_max[i]),
            ("thrust_time_constant", TIME_CONSTANT, "Lag of thruster {}, 0 for none", vehicle.thrust_time_constant[i]),
        ):
            yield parameter(f"{name}[{i + 1}]", f"{name}[{i}]", quantity, what.format(i + 1), start)

    description = "Limit on the norm of the wrench input's force; its direction is kept, the moment left alone"
    yield parameter("wrench_force_limit", "wrench_force_limit", FORCE_LIMIT, description, FORCE_LIMIT.maximum)
    description = "Lag of the wrench input, after its limit, 0 for none"
    yield parameter("wrench_time_constant", "wrench_time_constant", TIME_CONSTANT, description, 0.0)
    yield parameter("substep", "substep", SUBSTEP, "Greatest step of the integration", 0.005)


def _flags(vehicle: Vehicle) -> Iterator[Variable]:
    for i in range(vehicle.n_thrusters):
        name, member = f"thrust_saturated[{i + 1}]", f"outputs.thrust_cut[{i}]"
        description = f"The command of thruster {i + 1} is beyond its limits"
        yield Variable(name, "flag", member, FLAG, description, depends=_thrust_knowns(i)[:3])
    description = "The force of the wrench input is beyond its limit"
    yield Variable("wrench_saturated", "flag", "outputs.wrench_cut", FLAG, description, depends=_FORCE_KNOWNS[:4])
