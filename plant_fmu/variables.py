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

# the domain in which the plant is meant to be used; values beyond it are refused
FORCE_MAX = 1e9  # N, N m: far above any vehicle, so that a limit of this size is none
LENGTH_MAX = 1e6  # m
SPEED_MAX = 1e4  # m/s, rad/s
UNLIMITED_FORCE = FORCE_MAX * 10  # N: above the norm of any force input

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
class Variable:
    """One scalar variable of the FMU."""

    name: str  # structured name, such as ``thrust[1]``
    role: Role
    member: str  # where it lives in the C struct Model
    description: str
    unit: str = ""  # a key of UNITS, or "" for a pure number
    start: float = 0.0
    minimum: float = 0.0
    maximum: float = 0.0
    nominal: float = 1.0
    depends: tuple[str, ...] = ()  # names of the inputs, states and parameters that an output follows from directly


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
        Variable("time", "time", "time", "Simulated time", "s"),
        *_states(),
        *_inputs(vehicle),
        *_outputs(vehicle),
        *_parameters(vehicle),
        *_flags(vehicle),
    ]
    for v in rows:
        if not v.minimum <= v.start <= v.maximum:
            raise VehicleError(
                f"{vehicle.name}: {v.name} is {v.start:g} {v.unit}, expected {v.minimum:g} to {v.maximum:g}"
            )
    return rows


def _states() -> Iterator[Variable]:
    for i, axis in enumerate(AXES):
        where = ("north", "east", "down (depth)")[i]
        yield Variable(
            f"position.{axis}", "state", f"state.rigid[{i}]", f"Position of the body origin, {where}, world frame NED",
            "m", 0.0, -LENGTH_MAX, LENGTH_MAX, 1.0,
        )  # fmt: skip
    for i in range(4):
        part = "scalar part" if i == 0 else f"vector part {AXES[i - 1]}"
        yield Variable(
            f"quaternion.e{i}", "state", f"state.rigid[{3 + i}]",
            f"Attitude as unit quaternion from body to world, {part} (normalised when initialisation ends)",
            "", 1.0 if i == 0 else 0.0, -1.0, 1.0, 1.0,
        )  # fmt: skip
    for i, name in enumerate(VELOCITIES):
        kind, unit = ("Velocity over ground along", "m/s") if i < 3 else ("Angular velocity about", "rad/s")
        yield Variable(
            f"velocity.{name}", "state", f"state.rigid[{7 + i}]", f"{kind} body {AXES[i % 3]}",
            unit, 0.0, -SPEED_MAX, SPEED_MAX, 1.0,
        )  # fmt: skip


def _inputs(vehicle: Vehicle) -> Iterator[Variable]:
    for i in range(vehicle.n_thrusters):
        yield Variable(
            f"thrust[{i + 1}]", "input", f"inputs.thrust[{i}]",
            f"Commanded force of thruster {i + 1}, cut at its limits",
            "N", 0.0, -FORCE_MAX, FORCE_MAX, 10.0,
        )  # fmt: skip
    for i, name in enumerate(FORCES):
        kind, unit = ("force", "N") if i < 3 else ("moment", "N.m")
        yield Variable(
            f"wrench.{name}", "input", f"inputs.wrench[{i}]",
            f"Commanded {kind} on the body {'along' if i < 3 else 'about'} body {AXES[i % 3]}, beside the thrusters",
            unit, 0.0, -FORCE_MAX, FORCE_MAX, 10.0,
        )  # fmt: skip


def _thrust_knowns(i: int) -> tuple[str, ...]:
    return tuple(f"{name}[{i + 1}]" for name in ("thrust", "thrust_min", "thrust_max", "thrust_time_constant"))


_FORCE_KNOWNS = ("wrench.X", "wrench.Y", "wrench.Z", "wrench_force_limit", "wrench_time_constant")


def _outputs(vehicle: Vehicle) -> Iterator[Variable]:
    quaternion = tuple(f"quaternion.e{i}" for i in range(4))
    for i, (name, limit) in enumerate((("roll", 3.1416), ("pitch", 1.5708), ("yaw", 3.1416))):
        yield Variable(
            f"attitude.{name}", "output", f"outputs.euler[{i}]", f"Euler angle {name} (order yaw, pitch, roll)",
            "rad", 0.0, -limit, limit, 1.0, quaternion,
        )  # fmt: skip
    for i in range(vehicle.n_thrusters):
        yield Variable(
            f"thruster_force[{i + 1}]", "output", f"outputs.actuators.thrust[{i}]",
            f"Force that thruster {i + 1} gives now, after limits and lag",
            "N", 0.0, -FORCE_MAX, FORCE_MAX, 10.0, _thrust_knowns(i),
        )  # fmt: skip
    for i, name in enumerate(FORCES):
        kind, unit = ("Force", "N") if i < 3 else ("Moment", "N.m")
        direct = _FORCE_KNOWNS if i < 3 else (f"wrench.{name}", "wrench_time_constant")
        pushing = [
            known
            for j in range(vehicle.n_thrusters)
            for known in (*_thrust_knowns(j), f"thruster_matrix[{i + 1},{j + 1}]")
        ]
        yield Variable(
            f"actuation.{name}", "output", f"outputs.wrench[{i}]",
            f"{kind} of all actuators on the body {'along' if i < 3 else 'about'} body {AXES[i % 3]}",
            unit, 0.0, -1e3 * FORCE_MAX, 1e3 * FORCE_MAX, 10.0, (*direct, *pushing),
        )  # fmt: skip


def _parameters(vehicle: Vehicle) -> Iterator[Variable]:
    def parameter(
        name: str, member: str, description: str, unit: str, start: float, minimum: float, maximum: float
    ) -> Variable:
        nominal = abs(start) or 1.0
        return Variable(
            name, "parameter", f"plant.parameters.{member}", description, unit, float(start), minimum, maximum, nominal
        )

    yield parameter("mass", "mass", "Mass in air", "kg", vehicle.mass, 1e-3, 1e9)
    for k, (i, j) in enumerate(((0, 0), (1, 1), (2, 2), (0, 1), (0, 2), (1, 2))):
        yield parameter(
            f"inertia.{AXES[i]}{AXES[j]}", f"inertia[{k}]", f"Inertia about the origin, element ({i + 1},{j + 1})",
            "kg.m2", vehicle.inertia[i, j], 0.0 if i == j else -1e12, 1e12,
        )  # fmt: skip
    for name, what, values in (("r_G", "gravity", vehicle.r_G), ("r_B", "buoyancy", vehicle.r_B)):
        for i, axis in enumerate(AXES):
            yield parameter(
                f"{name}.{axis}", f"{name}[{i}]", f"Centre of {what}, body {axis}", "m", values[i], -1e3, 1e3
            )
    yield parameter("weight", "weight", "Weight", "N", vehicle.weight, 0.0, 1e10)
    yield parameter("buoyancy", "buoyancy", "Buoyancy", "N", vehicle.buoyancy, 0.0, 1e10)
    for i in range(6):
        for j in range(i, 6):
            unit = ("kg", "kg.m", "kg.m2")[(i > 2) + (j > 2)]
            mirrored = f", and by symmetry ({j + 1},{i + 1})" if i != j else ""
            yield parameter(
                f"added_mass[{i + 1},{j + 1}]", f"added_mass[{i}][{j}]", f"Added mass ({i + 1},{j + 1}){mirrored}",
                unit, vehicle.added_mass[i, j], 0.0 if i == j else -1e12, 1e12,
            )  # fmt: skip
    for name, units, values in (
        ("linear", ("N.s/m", "N.m.s/rad"), vehicle.linear_damping),
        ("quadratic", ("N.s2/m2", "N.m.s2/rad2"), vehicle.quadratic_damping),
    ):
        for i, velocity in enumerate(VELOCITIES):
            yield parameter(
                f"{name}_damping[{i + 1}]", f"{name}_damping[{i}]", f"{name.capitalize()} damping of {velocity}",
                units[i > 2], values[i], 0.0, 1e9,
            )  # fmt: skip
    for i, axis in enumerate(AXES):
        where = ("north", "east", "down")[i]
        yield parameter(
            f"current.{axis}", f"current[{i}]", f"Velocity of the water, {where}", "m/s", 0.0, -100.0, 100.0
        )
    for i, name in enumerate(FORCES):
        for j in range(vehicle.n_thrusters):
            yield parameter(
                f"thruster_matrix[{i + 1},{j + 1}]", f"thruster_matrix[{i}][{j}]",
                f"{name} on the body of one newton of thruster {j + 1}",
                "" if i < 3 else "N.m/N", vehicle.thruster_matrix[i, j], -1e3, 1e3,
            )  # fmt: skip
    for i in range(vehicle.n_thrusters):
        yield parameter(
            f"thrust_min[{i + 1}]", f"thrust_min[{i}]", f"Most negative force of thruster {i + 1}",
            "N", vehicle.thrust_min[i], -FORCE_MAX, FORCE_MAX,
        )  # fmt: skip
        yield parameter(
            f"thrust_max[{i + 1}]", f"thrust_max[{i}]", f"Greatest force of thruster {i + 1}",
            "N", vehicle.thrust_max[i], -FORCE_MAX, FORCE_MAX,
        )  # fmt: skip
        yield parameter(
            f"thrust_time_constant[{i + 1}]", f"thrust_time_constant[{i}]", f"Lag of thruster {i + 1}, 0 for none",
            "s", vehicle.thrust_time_constant[i], 0.0, 1e3,
        )  # fmt: skip
    yield parameter(
        "wrench_force_limit", "wrench_force_limit",
        "Limit on the norm of the wrench input's force; its direction is kept, the moment left alone",
        "N", UNLIMITED_FORCE, 0.0, UNLIMITED_FORCE,
    )  # fmt: skip
    yield parameter(
        "wrench_time_constant", "wrench_time_constant", "Lag of the wrench input, after its limit, 0 for none",
        "s", 0.0, 0.0, 1e3,
    )  # fmt: skip
    yield parameter("substep", "substep", "Greatest step of the integration", "s", 0.005, 1e-6, 1.0)


def _flags(vehicle: Vehicle) -> Iterator[Variable]:
    for i in range(vehicle.n_thrusters):
        yield Variable(
            f"thrust_saturated[{i + 1}]", "flag", f"outputs.thrust_cut[{i}]",
            f"The command of thruster {i + 1} is beyond its limits", depends=_thrust_knowns(i)[:3],
        )  # fmt: skip
    yield Variable(
        "wrench_saturated", "flag", "outputs.wrench_cut", "The force of the wrench input is beyond its limit",
        depends=_FORCE_KNOWNS[:4],
    )  # fmt: skip
