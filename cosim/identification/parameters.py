"""Free parameters of an identification, with their priors: keys of the vehicle's file and nuisances of the runs."""

from __future__ import annotations

import itertools
import re
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from typing import Any, Literal

import numpy as np

from cosim.errors import IdentificationError
from cosim.identification.actuation import CHANGES, Actuation, CommandedForces
from cosim.identification.log import SENSORS_OF, TOPICS, Log
from cosim.identification.measurements import Errors
from cosim.simulation.signals import Array
from plant_fmu.vehicle import Vehicle

Kind = Literal["plant", "lag", "thrust", "current", "force", "delay", "lever", "bias", "scale", "asymmetry", "phase"]

# what is freed unless the user says otherwise: mass, weight, center of gravity and inertia are known better by scales
DEFAULT_FREE = (
    "hydrodynamics.added_mass", "hydrodynamics.linear_damping", "hydrodynamics.quadratic_damping",
    "hydrostatics.buoyancy", "hydrostatics.center_of_buoyancy", "thrusters.time_constant", "sensors.dvl_position",
)  # fmt: skip
# with attitude and angular velocity as inputs: what moves along the axes alone
TRANSLATION_FREE = (
    *(f"hydrodynamics.added_mass.{i}.{i}" for i in (1, 2, 3)),
    *(f"hydrodynamics.{kind}_damping.{i}" for kind in ("linear", "quadratic") for i in (1, 2, 3)),
    "hydrostatics.buoyancy", "thrusters.delay",
)  # fmt: skip
NUISANCES: tuple[Kind, ...] = ("current", "force", "delay", "bias", "scale", "asymmetry", "phase")
RANDOM_FORCE = "random_force"  # a nuisance that is eliminated from each window, and no parameter
DEFAULT_NUISANCES = ("current", "bias", "scale", "phase")

_ELEMENT = re.compile(r"(?P<key>[a-z_]+\.[a-z_]+)(?:\.(?P<row>\d+)(?:\.(?P<column>\d+))?|\.(?P<part>diagonal))?")
_COUPLING = 0.3  # standard deviation of an off-diagonal element, in geometric means of its diagonal elements
_RELATIVE = 1.0  # of damping and added mass: the start is known to about a factor of two
_MIN_DAMPING = {"linear_damping": (10.0, 0.5), "quadratic_damping": (50.0, 1.0)}  # deviations along and about the axes
_DAMPING_UNITS = {"linear_damping": ("N s/m", "N m s/rad"), "quadratic_damping": ("N s2/m2", "N m s2/rad2")}
_FORCES = {"mass": ("kg", 0.02), "weight": ("N", 0.02), "buoyancy": ("N", 0.05)}  # unit, relative deviation
_INERTIA = 0.2  # relative deviation
_CENTER = 0.03  # m
_TRIM = (3.0, 0.5)  # N, N m
_LAG, _MAX_LAG = 0.2, 2.0  # s
_MIN_DELAY = 1e-3  # s, of a sensor behind the others; shorter ones are not written
_DELAY, _LEVER = 0.1, 0.3  # s, m
_THRUST = 0.1  # relative deviation of each thruster: 3.5 % of all eight together
_KEYS = (
    "rigid_body.mass", "rigid_body.weight", "rigid_body.inertia", "rigid_body.center_of_gravity",
    "hydrostatics.buoyancy", "hydrostatics.center_of_buoyancy", "hydrostatics.trim", "hydrodynamics.added_mass",
    "hydrodynamics.linear_damping", "hydrodynamics.quadratic_damping", "thrusters.time_constant", "thrusters.delay",
    "thrusters.matrix", "sensors.dvl_position",
)  # fmt: skip
_NUISANCES: dict[str, tuple[str, str, float, str]] = {  # label, unit, deviation of the prior, axes
    "current": ("current", "m/s", 0.3, "xy"),
    "force": ("constant force", "N", 0.5, "xy"),
    "delay": ("delay of", "s", _DELAY, ""),
    "bias": ("gyro bias", "rad/s", 0.01, "pqr"),
    "scale": ("DVL scale error", "", 0.01, " "),
    "asymmetry": ("loss backward of thruster", "", 0.1, ""),
    "phase": ("changes between samples:", "", 1.0, ""),
}
_CHANGE_PRIORS = {  # unit and deviation of the prior: those of a step at a time uniform in a period
    "lateness": ("periods", 0.29), "spread": ("periods2", 0.037), "smoothness": ("periods2/12", 1.0),
}  # fmt: skip
_OF_RUN = ("current", "force", "bias", "phase")  # nuisances that differ between runs


@dataclass(frozen=True)
class Parameter:
    """A free parameter, and its distribution before any run."""

    name: str  # a key of the vehicle's file with its element, or a nuisance
    unit: str
    kind: Kind
    start: float
    deviation: float  # standard deviation of the prior
    min: float = -np.inf
    max: float = np.inf
    plant: str = ""  # the FMU's parameter
    index: int = 0  # thruster or axis
    run: int | None = None  # run of a nuisance; None: all runs

    @property
    def topics(self) -> tuple[str, ...]:
        """Topics that a delay shifts."""
        return (self.plant,) if self.plant else TOPICS

    @property
    def is_nuisance(self) -> bool:
        """True for a nuisance, which is no number of the vehicle."""
        return self.kind in NUISANCES and self.name != "thrusters.delay"


def free_parameters(vehicle: Vehicle, keys: Sequence[str]) -> list[Parameter]:
    """Return the free parameters of a vehicle."""
    parameters: dict[str, Parameter] = {}
    for key in keys:
        match = _ELEMENT.fullmatch(key.strip())
        if match is None or match["key"] not in _KEYS:
            raise IdentificationError(f"--free {key}: is no key that can be free, expected some of {', '.join(_KEYS)}")
        elements = {p.name: p for p in _elements(vehicle, match["key"]) if _is_selected(p, match)}
        if not elements:
            raise IdentificationError(
                f"--free {key}: has no such element, expected indices from 1 within the key's own"
            )
        parameters |= elements
    return list(parameters.values())


def nuisances(names: Sequence[str], logs: Sequence[Log]) -> list[Parameter]:
    """Return the free parameters that are not of the vehicle."""
    for name, key in (("trim", "hydrostatics.trim"), ("lever", "sensors.dvl_position")):
        if name in names:
            raise IdentificationError(f"--nuisance {name}: is a vehicle's number, expected --free {key}")
    if unknown := [name for name in names if name not in (*NUISANCES, RANDOM_FORCE)]:
        expected = ", ".join((*NUISANCES, RANDOM_FORCE))
        raise IdentificationError(f"--nuisance {unknown[0]}: is unknown, expected some of {expected}")
    components = {
        "delay": [name for name in TOPICS if any(log.topic(name) for log in logs)],
        "asymmetry": [f"{i + 1}" for i in range(logs[0].thrust.shape[1])],
        "phase": list(CHANGES),
    }
    parameters: list[Parameter] = []
    for name in (known for known in NUISANCES if known in names):
        label, unit, deviation, axes = _NUISANCES[name]
        runs = [run for run, log in enumerate(logs) if name != "phase" or log.sampled]
        for run in runs if name in _OF_RUN else (None,):
            suffix = "" if run is None else f" of run {run + 1}"
            for index, axis in enumerate(components.get(name, list(axes))):
                if name == "phase":
                    unit, deviation = _CHANGE_PRIORS[axis.split(" ")[0]]
                plant = f"current.{axis}" if name == "current" else axis if name == "delay" else ""
                full_name = f"{label} {axis}".strip() + suffix
                parameters.append(Parameter(full_name, unit, name, 0.0, deviation, plant=plant, index=index, run=run))
    return parameters


def with_values(vehicle: Vehicle, parameters: Sequence[Parameter], values: Array) -> Vehicle:
    """Return a vehicle with identified values; values (p,)."""
    changed: dict[str, Any] = {name: np.array(getattr(vehicle, name)) for name in (
        "added_mass", "linear_damping", "quadratic_damping", "r_B", "r_G", "inertia", "thruster_matrix",
        "thrust_time_constant", "mass", "weight", "buoyancy", "trim", "dvl_position", "command_delay",
    )}  # fmt: skip
    late = {
        SENSORS_OF[p.plant]: float(x) for p, x in zip(parameters, values, strict=True) if p.kind == "delay" and p.plant
    }
    for p, value in zip(parameters, values, strict=True):
        if p.kind == "lag":
            changed["thrust_time_constant"][:] = value
        elif p.kind == "thrust":
            changed["thruster_matrix"][:, p.index] = vehicle.thruster_matrix[:, p.index] * value
        elif p.kind == "lever":
            changed["dvl_position"][p.index] = value
        elif p.kind == "delay" and not p.plant:
            changed["command_delay"] = np.array(max(value, 0.0))
        elif p.kind == "plant":
            name, index = _vehicle_element(p.plant)
            changed[name][index] = value
            changed[name][index[::-1]] = value
    if late:  # what all have in common is that of the commands
        changed["command_delay"] = np.array(max(0.0, min(late.values())))
    for array in changed.values():
        array.setflags(write=False)
    numbers = {name: float(changed[name]) for name in (*_FORCES, "command_delay")}
    rest = {sensor: x - numbers["command_delay"] for sensor, x in late.items()}
    sensor_delay = {**vehicle.sensor_delay, **{sensor: x for sensor, x in rest.items() if x > _MIN_DELAY}}
    return replace(vehicle, **changed | numbers, sensor_delay=sensor_delay)


@dataclass(frozen=True)
class Setting:
    """Settings of one run by the free parameters."""

    plant: dict[str, float]
    actuation: Actuation
    force: Array  # (3,) N
    errors: Errors
    delays: dict[str, float]  # s, by topic


def setting_of(
    parameters: Sequence[Parameter], values: Array, run: int, forces: CommandedForces, vehicle: Vehicle
) -> Setting:
    """Return the setting of a run; values (p,)."""
    n, plant, lag = forces.thrusters, dict[str, float](), float(vehicle.thrust_time_constant.mean())
    delays = dict.fromkeys(TOPICS, vehicle.command_delay)
    vectors = {
        "thrust": np.ones(n), "asymmetry": np.zeros(n), "phase": np.zeros(len(CHANGES)), "force": np.zeros(3),
        "lever": np.array(vehicle.dvl_position), "bias": np.zeros(3), "scale": np.zeros(1),
    }  # fmt: skip
    for p, x in zip(parameters, values, strict=True):
        if p.run not in (None, run):
            continue
        match p.kind:
            case "plant" | "current":
                plant[p.plant] = float(x)
            case "lag":
                lag = float(x)
            case "delay":
                delays |= dict.fromkeys(p.topics, float(x))
            case kind:
                vectors[kind][p.index] = x
    actuation = forces.actuation(lag, vectors["thrust"], vectors["asymmetry"], vectors["phase"])
    errors = Errors(vectors["lever"], float(vectors["scale"][0]), vectors["bias"])
    return Setting(plant, actuation, vectors["force"], errors, delays)


def with_mean_nuisances(parameters: Sequence[Parameter], values: Array) -> tuple[list[Parameter], Array]:
    """Return parameters and values for runs that were not fitted; values (p,), returns (k,)."""
    # The nuisances of single runs, such as the current, are unknown there: their mean over the fitted runs takes the
    # place of them.
    groups: dict[Parameter, list[float]] = {}
    for p, x in zip(parameters, values, strict=True):
        shared = p if p.run is None else replace(p, name=p.name.partition(" of run ")[0], run=None)
        groups.setdefault(shared, []).append(float(x))
    return list(groups), np.array([np.mean(x) for x in groups.values()])


def _vehicle_element(name: str) -> tuple[str, tuple[int, ...]]:
    """Return the vehicle's attribute and the index in it of a parameter of the FMU."""
    if match := re.fullmatch(r"(\w+)\[([\d,]+)\]", name):
        return match[1], tuple(int(i) - 1 for i in match[2].split(","))
    attribute, _, axes = name.partition(".")
    return attribute, tuple(("XYZKMN" if attribute == "trim" else "xyz").index(axis) for axis in axes)


def _is_selected(p: Parameter, match: re.Match[str]) -> bool:
    index = tuple(int(x) for x in p.name.split(".")[2:])
    if match["part"]:
        return len(index) == 2 and index[0] == index[1]
    selected = tuple(int(x) for x in (match["row"], match["column"]) if x)
    return not selected or selected in (index, index[::-1])


def _elements(vehicle: Vehicle, key: str) -> Iterator[Parameter]:
    """Yield the elements of a key of the vehicle's file."""
    name = key.partition(".")[2]
    match name:
        case "mass" | "weight" | "buoyancy":
            unit, part = _FORCES[name]
            start, reference = getattr(vehicle, name), vehicle.weight if unit == "N" else vehicle.mass
            yield Parameter(key, unit, "plant", start, part * reference, 1e-6 if name == "mass" else 0.0, plant=name)
        case "inertia":
            for i, j in ((0, 0), (1, 1), (2, 2), (0, 1), (0, 2), (1, 2)):
                size = float(np.sqrt(vehicle.inertia[i, i] * vehicle.inertia[j, j]))
                deviation = (_INERTIA if i == j else _INERTIA / 2.0) * size
                plant = f"inertia.{'xyz'[i]}{'xyz'[j]}"
                full = f"{key}.{i + 1}.{j + 1}"
                yield Parameter(full, "kg m2", "plant", vehicle.inertia[i, j], deviation, plant=plant)
        case "center_of_gravity" | "center_of_buoyancy":
            symbol = "r_G" if name == "center_of_gravity" else "r_B"
            for i, x in enumerate(getattr(vehicle, symbol)):
                yield Parameter(f"{key}.{i + 1}", "m", "plant", float(x), _CENTER, plant=f"{symbol}.{'xyz'[i]}")
        case "trim":
            for i, x in enumerate(vehicle.trim.tolist()):
                unit = "N" if i < 3 else "N m"
                yield Parameter(f"{key}.{i + 1}", unit, "plant", x, _TRIM[i > 2], plant=f"trim.{'XYZKMN'[i]}")
        case "added_mass":
            A = vehicle.added_mass
            body = np.diag(vehicle.mass_matrix) - np.diag(A)
            diagonal = np.maximum(np.diag(A), 0.3 * body)  # what a start without added mass means
            for i, j in itertools.combinations_with_replacement(range(6), 2):
                unit = ("kg", "kg m", "kg m2")[(i > 2) + (j > 2)]
                size = float(_RELATIVE * diagonal[i] if i == j else _COUPLING * np.sqrt(diagonal[i] * diagonal[j]))
                plant = f"added_mass[{i + 1},{j + 1}]"
                yield Parameter(f"{key}.{i + 1}.{j + 1}", unit, "plant", float(A[i, j]), size, plant=plant)
        case "linear_damping" | "quadratic_damping":
            for i, x in enumerate(getattr(vehicle, name).tolist()):
                deviation, unit = max(_RELATIVE * x, _MIN_DAMPING[name][i > 2]), _DAMPING_UNITS[name][i > 2]
                yield Parameter(f"{key}.{i + 1}", unit, "plant", x, deviation, 0.0, plant=f"{name}[{i + 1}]")
        case "dvl_position":
            for i, x in enumerate(vehicle.dvl_position.tolist()):
                plant = f"dvl.position.{'xyz'[i]}"
                yield Parameter(f"{key}.{i + 1}", "m", "lever", x, _LEVER, plant=plant, index=i)
        case "time_constant" | "delay":
            lag = Parameter(key, "s", "lag", float(vehicle.thrust_time_constant.mean()), _LAG, 0.0, _MAX_LAG)
            yield lag if name != "delay" else Parameter(key, "s", "delay", vehicle.command_delay, _DELAY)
        case _:
            for i in range(vehicle.n_thrusters):
                yield Parameter(f"{key}.{i + 1}", "", "thrust", 1.0, _THRUST, 0.1, 10.0, index=i)
