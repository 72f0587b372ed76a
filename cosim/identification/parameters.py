"""Free numbers of an identification, with their priors: keys of the vehicle's file and nuisances of the runs."""

from __future__ import annotations

import re
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray

from cosim.errors import IdentificationError
from cosim.identification.actuation import CHANGES, Actuation, CommandedForces
from cosim.identification.log import TOPICS, Log
from cosim.identification.measurements import Errors
from plant_fmu.vehicle import Vehicle

Array = NDArray[np.float64]
Kind = Literal["plant", "lag", "thrust", "current", "force", "delay", "lever", "bias", "scale", "asymmetry", "phase"]

# what is freed unless the user says otherwise: mass, weight, centre of gravity and inertia are known better by scales
DEFAULT_FREE = (
    "hydrodynamics.added_mass", "hydrodynamics.linear_damping", "hydrodynamics.quadratic_damping",
    "hydrostatics.buoyancy", "hydrostatics.center_of_buoyancy", "thrusters.time_constant",
)  # fmt: skip
NUISANCES: tuple[Kind, ...] = ("current", "force", "delay", "lever", "bias", "scale", "asymmetry", "phase")
RANDOM_FORCE = "random_force"  # a nuisance that is eliminated from each window, and no parameter
DEFAULT_NUISANCES = ("current", "lever", "bias", "scale", "phase")

_ELEMENT = re.compile(r"(?P<key>[a-z_]+\.[a-z_]+)(?:\.(?P<row>\d+)(?:\.(?P<column>\d+))?|\.(?P<part>diagonal))?")
_COUPLING = 0.3  # standard deviation of an off-diagonal element, in geometric means of its diagonal elements
_RELATIVE = 1.0  # of damping and added mass: the start is known to about a factor of two
_LEAST_LINEAR, _LEAST_QUADRATIC = (10.0, 0.5), (50.0, 1.0)  # the least deviations, along and about the axes
_BUOYANCY = 0.05  # of the weight
_CENTER = 0.03  # m
_MASS, _INERTIA = 0.02, 0.2  # parts
_LAG, _MOST_LAG = 0.2, 2.0  # s
_THRUST = 0.1  # part, of each thruster: 3.5 % of all eight together


@dataclass(frozen=True)
class Parameter:
    """One free number, and what is known of it before any run."""

    name: str  # a key of the vehicle's file with its element, or a nuisance
    unit: str
    kind: Kind
    start: float
    deviation: float  # standard, of what is known before
    least: float = -np.inf
    most: float = np.inf
    plant: str = ""  # the FMU's parameter
    index: int = 0  # thruster or axis
    run: int | None = None  # to which a nuisance belongs; None: to all

    @property
    def is_nuisance(self) -> bool:
        """True for a nuisance, which is no number of the vehicle."""
        return self.kind not in ("plant", "lag", "thrust")


def free_parameters(vehicle: Vehicle, keys: Sequence[str]) -> list[Parameter]:
    """Return the free numbers of a vehicle."""
    found: dict[str, Parameter] = {}
    for key in keys:
        match = _ELEMENT.fullmatch(key.strip())
        makers = {name: maker for maker in (_of_body, _of_water, _of_thrusters) for name in _KEYS[maker.__name__]}
        if match is None or match["key"] not in makers:
            raise IdentificationError(f"--free {key}: is no key that can be free, expected some of {', '.join(makers)}")
        elements = [p for p in makers[match["key"]](vehicle, match["key"]) if _is_meant(p, match)]
        if not elements:
            raise IdentificationError(f"--free {key}: has no such element, expected places from 1 within the key's own")
        found |= {p.name: p for p in elements}
    return list(found.values())


def nuisances(names: Sequence[str], logs: Sequence[Log]) -> list[Parameter]:
    """Return the free numbers that are not of the vehicle."""
    places = {
        "delay": [name for name in TOPICS if any(log.topic(name) for log in logs)],
        "asymmetry": [f"{i + 1}" for i in range(logs[0].thrust.shape[1])],
        "phase": list(CHANGES),
    }
    made: list[Parameter] = []
    if odd := [name for name in names if name not in (*NUISANCES, RANDOM_FORCE)]:
        expected = ", ".join((*NUISANCES, RANDOM_FORCE))
        raise IdentificationError(f"--nuisance {odd[0]}: is unknown, expected some of {expected}")
    for name in (known for known in NUISANCES if known in names):
        label, unit, deviation, axes = _NUISANCES[name]
        runs = [run for run, log in enumerate(logs) if name != "phase" or log.sampled]
        for run in runs if name in ("current", "force", "bias", "phase") else (None,):
            said = "" if run is None else f" of run {run + 1}"
            for index, axis in enumerate(places.get(name, list(axes))):
                if name == "phase":
                    unit, deviation = _CHANGE_PRIORS[axis.split(" ")[0]]
                plant = f"current.{axis}" if name == "current" else axis if name == "delay" else ""
                made.append(Parameter(
                    f"{label} {axis}".strip() + said, unit, name, 0.0, deviation, plant=plant, index=index, run=run
                ))  # fmt: skip
    return made


def with_values(vehicle: Vehicle, parameters: Sequence[Parameter], values: Array) -> Vehicle:
    """Return a vehicle with the identified numbers in it; values (p,)."""
    changed: dict[str, Any] = {name: np.array(getattr(vehicle, name)) for name in (
        "added_mass", "linear_damping", "quadratic_damping", "r_B", "r_G", "inertia", "thruster_matrix",
        "thrust_time_constant", "mass", "weight", "buoyancy",
    )}  # fmt: skip
    for p, value in zip(parameters, values, strict=True):
        if p.kind == "lag":
            changed["thrust_time_constant"][:] = value
        elif p.kind == "thrust":
            changed["thruster_matrix"][:, p.index] = vehicle.thruster_matrix[:, p.index] * value
        elif p.kind == "plant":
            name, place = _place_of(p.plant)
            changed[name][place] = value
            changed[name][place[::-1]] = value
    for array in changed.values():
        array.setflags(write=False)
    for name in ("mass", "weight", "buoyancy"):
        changed[name] = float(changed[name])
    return replace(vehicle, **changed)


@dataclass(frozen=True)
class Setting:
    """Settings of one run by the free numbers."""

    plant: dict[str, float]
    actuation: Actuation
    force: Array  # (3,) N
    errors: Errors
    delays: dict[str, float]  # s, by topic


def setting_of(
    parameters: Sequence[Parameter], values: Array, run: int, forces: CommandedForces, lag: float
) -> Setting:
    """Return the setting of a run; values (p,), lag [s]."""
    plant: dict[str, float] = {}
    scales, losses, changes = np.ones(forces.thrusters), np.zeros(forces.thrusters), np.zeros(len(CHANGES))
    delays = dict[str, float]()
    force, lever, bias, scale = np.zeros(3), np.zeros(3), np.zeros(3), 0.0
    for p, x in zip(parameters, values, strict=True):
        if p.run not in (None, run):
            continue
        match p.kind:
            case "plant" | "current":
                plant[p.plant] = float(x)
            case "lag":
                lag = float(x)
            case "thrust":
                scales[p.index] = x
            case "asymmetry":
                losses[p.index] = x
            case "phase":
                changes[p.index] = x
            case "delay":
                delays[p.plant] = float(x)
            case "force":
                force[p.index] = x
            case "lever":
                lever[p.index] = x
            case "bias":
                bias[p.index] = x
            case "scale":
                scale = float(x)
    actuation = forces.actuation(lag, scales, losses, changes)
    return Setting(plant, actuation, force, Errors(lever, scale, bias), delays)


def with_mean_nuisances(parameters: Sequence[Parameter], values: Array) -> tuple[list[Parameter], Array]:
    """Return parameters and values for runs that were not fitted; values (p,), returns (k,)."""
    # The nuisances of single runs, such as the current, are unknown there: their mean over the fitted runs takes the
    # place of them.
    groups: dict[Parameter, list[float]] = {}
    for p, x in zip(parameters, values, strict=True):
        shared = p if p.run is None else replace(p, name=p.name.partition(" of run ")[0], run=None)
        groups.setdefault(shared, []).append(float(x))
    return list(groups), np.array([np.mean(x) for x in groups.values()])


def _place_of(name: str) -> tuple[str, tuple[int, ...]]:
    """Return the vehicle's number that a parameter of the FMU is, and where in it."""
    if match := re.fullmatch(r"(\w+)\[([\d,]+)\]", name):
        return match[1], tuple(int(i) - 1 for i in match[2].split(","))
    base, _, axes = name.partition(".")
    return base, tuple("xyz".index(axis) for axis in axes)


def _is_meant(p: Parameter, match: re.Match[str]) -> bool:
    place = tuple(int(x) for x in p.name.split(".")[2:])
    if match["part"]:
        return len(place) == 2 and place[0] == place[1]
    wanted = tuple(int(x) for x in (match["row"], match["column"]) if x)
    return not wanted or place == wanted or place == wanted[::-1]


def _of_body(vehicle: Vehicle, key: str) -> Iterator[Parameter]:
    if key == "rigid_body.mass":
        yield Parameter(key, "kg", "plant", vehicle.mass, _MASS * vehicle.mass, 1e-6, plant="mass")
    elif key == "rigid_body.weight":
        yield Parameter(key, "N", "plant", vehicle.weight, _MASS * vehicle.weight, 0.0, plant="weight")
    elif key == "hydrostatics.buoyancy":
        yield Parameter(key, "N", "plant", vehicle.buoyancy, _BUOYANCY * vehicle.weight, 0.0, plant="buoyancy")
    elif key == "rigid_body.inertia":
        for i, j in ((0, 0), (1, 1), (2, 2), (0, 1), (0, 2), (1, 2)):
            size = float(np.sqrt(vehicle.inertia[i, i] * vehicle.inertia[j, j]))
            name = f"inertia.{'xyz'[i]}{'xyz'[j]}"
            part = _INERTIA if i == j else _INERTIA / 2.0
            yield Parameter(f"{key}.{i + 1}.{j + 1}", "kg m2", "plant", vehicle.inertia[i, j], part * size, plant=name)
    else:
        symbol, values = ("r_G", vehicle.r_G) if key.startswith("rigid_body") else ("r_B", vehicle.r_B)
        for i, axis in enumerate("xyz"):
            yield Parameter(f"{key}.{i + 1}", "m", "plant", float(values[i]), _CENTER, plant=f"{symbol}.{axis}")


def _of_water(vehicle: Vehicle, key: str) -> Iterator[Parameter]:
    if key == "hydrodynamics.added_mass":
        A = vehicle.added_mass
        body = np.diag(vehicle.mass_matrix) - np.diag(A)
        diagonal = np.maximum(np.diag(A), 0.3 * body)  # what a start without added mass means
        for i in range(6):
            for j in range(i, 6):
                unit = ("kg", "kg m", "kg m2")[(i > 2) + (j > 2)]
                size = _RELATIVE * diagonal[i] if i == j else _COUPLING * np.sqrt(diagonal[i] * diagonal[j])
                name, place = f"added_mass[{i + 1},{j + 1}]", f"{key}.{i + 1}.{j + 1}"
                yield Parameter(place, unit, "plant", float(A[i, j]), float(size), plant=name)
        return
    kind = key.removeprefix("hydrodynamics.")
    values, least = getattr(vehicle, kind), _LEAST_LINEAR if kind == "linear_damping" else _LEAST_QUADRATIC
    units = ("N s/m", "N m s/rad") if kind == "linear_damping" else ("N s2/m2", "N m s2/rad2")
    for i in range(6):
        size = max(_RELATIVE * float(values[i]), least[i > 2])
        yield Parameter(f"{key}.{i + 1}", units[i > 2], "plant", float(values[i]), size, 0.0, plant=f"{kind}[{i + 1}]")


def _of_thrusters(vehicle: Vehicle, key: str) -> Iterator[Parameter]:
    if key == "thrusters.time_constant":
        yield Parameter(key, "s", "lag", float(vehicle.thrust_time_constant.mean()), _LAG, 0.0, _MOST_LAG)
        return
    for i in range(vehicle.n_thrusters):
        yield Parameter(f"{key}.{i + 1}", "", "thrust", 1.0, _THRUST, 0.1, 10.0, index=i)


_NUISANCES: dict[str, tuple[str, str, float, str]] = {  # name, unit, deviation of the prior, axes
    "current": ("current", "m/s", 0.3, "xy"),
    "force": ("constant force", "N", 0.5, "xy"),
    "delay": ("delay of", "s", 0.1, ""),
    "lever": ("DVL lever", "m", 0.3, "xyz"),
    "bias": ("gyro bias", "rad/s", 0.01, "pqr"),
    "scale": ("DVL scale error", "", 0.01, " "),
    "asymmetry": ("loss backward of thruster", "", 0.1, ""),
    "phase": ("changes between samples:", "", 1.0, ""),
}
_CHANGE_PRIORS = {  # unit and deviation of the prior: those of a step at a time uniform in a period
    "lateness": ("periods", 0.29), "spread": ("periods2", 0.037), "smoothness": ("periods2/12", 1.0),
}  # fmt: skip
_KEYS = {
    "_of_body": (
        "rigid_body.mass", "rigid_body.weight", "rigid_body.inertia", "rigid_body.center_of_gravity",
        "hydrostatics.buoyancy", "hydrostatics.center_of_buoyancy",
    ),
    "_of_water": ("hydrodynamics.added_mass", "hydrodynamics.linear_damping", "hydrodynamics.quadratic_damping"),
    "_of_thrusters": ("thrusters.time_constant", "thrusters.matrix"),
}  # fmt: skip
