"""Scenarios: one TOML file holds everything a run depends on."""

from __future__ import annotations

import dataclasses
import math
import re
from collections.abc import Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, Literal

import msgspec
import numpy as np
import tomli_w
from numpy.typing import NDArray

from controller import ControllerError, Gains, RegionError
from controller.printed_law import check_gains
from controller.regions import SHAPES, Region, Shape
from controller.restoring import parameters
from cosim.errors import ScenarioError
from cosim.scenario_file import flat, override, read_table, shipped_scenarios
from fuzzy_arbiter import SECTION_VI
from plant_fmu.errors import PlantFmuError
from plant_fmu.tables import decode, hint
from plant_fmu.variables import variables
from plant_fmu.vehicle import Vehicle, load_vehicle

Vector3 = tuple[float, float, float]
Vector4 = tuple[float, float, float, float]
Vector6 = tuple[float, float, float, float, float, float]

CRITERIA = tuple(c.name for c in SECTION_VI)
ROUNDING = 1e-6  # of one period, within which periods count as multiples
MAX_STEPS = 100_000_000
MAX_POINTS = 100_001
REGION_NAME = re.compile(r"[A-Za-z0-9][A-Za-z0-9 _-]{0,39}")  # a column of the record, a label of figures
VEHICLE_COPY = "vehicle.toml"  # name in a run folder of a vehicle that is not shipped


@dataclass(frozen=True)
class Time:
    """Periods; each is a whole multiple of the step."""

    duration: float  # s
    step: float  # s, co-simulation step of the plant
    control: float  # s, period of the law
    arbiter: float  # s, period of the arbiter


@dataclass(frozen=True)
class PlantSetup:
    """How the plant is run."""

    fmi: Literal[2, 3] = 3
    current: Vector3 = (0.0, 0.0, 0.0)  # m/s, of the water, world frame
    substep: float = 0.005  # s, greatest integration step
    parameters: dict[str, float | bool] = field(default_factory=dict)  # of the FMU, by name, over those of the vehicle


@dataclass(frozen=True)
class Initial:
    """State of the vehicle at time 0."""

    position: Vector3  # m, NED
    quaternion: Vector4 = (1.0, 0.0, 0.0, 0.0)  # from body to world, scalar first
    velocity: Vector6 = (0.0, 0.0, 0.0, 0.0, 0.0, 0.0)  # m/s, rad/s, body frame


@dataclass(frozen=True)
class LawSetup:
    """Which law, with which gains."""

    name: Literal["printed"]
    desired_quaternion: Vector4  # attitude to be kept, from body to world, scalar first
    gains: Gains


@dataclass(frozen=True)
class ArbiterSetup:
    """How memberships become weights."""

    engine: Literal["closed", "exact", "grid", "skfuzzy"] = "closed"
    ramp: float = 0.2  # m, width over which a membership falls from 1 to 0 outside its region
    points: int = 101  # of the output universe, for grid and skfuzzy


@dataclass(frozen=True)
class Limit:
    """Of the direct body wrench: first the limit, then the lag."""

    force: float = math.inf  # N, on the norm of the body force; its direction is kept, the moment left alone
    time_constant: float = 0.0  # s


@dataclass(frozen=True)
class Actuation:
    """What carries the law's wrench to the body."""

    through: Literal["wrench", "thrusters"] = "wrench"
    limits: Literal["direction", "per-thruster"] = "direction"  # how thruster forces are brought within limits


@dataclass(frozen=True)
class RecordSetup:
    """What a run records beyond its signals."""

    lyapunov: bool = False  # V of (31) and its rate, with the printed law


@dataclass(frozen=True)
class SecondaryRegion:
    """A region and the criterion it belongs to."""

    region: Region
    criterion: str  # one of CRITERIA


# parameters of the FMU that have a key of their own in a scenario
_OWN_KEYS = {
    "wrench_force_limit": "limit.force",
    "wrench_time_constant": "limit.time_constant",
    "substep": "plant.substep",
    "current": "plant.current",
}


# ---- as they stand in the file -------------------------------------------------------------------------------------


@dataclass(frozen=True)
class _TimeEntry:
    duration: float
    step: float = 0.001
    control: float | None = None  # default: the step
    arbiter: float | None = None  # default: the step


@dataclass(frozen=True)
class _LawEntry:
    name: Literal["printed"] = "printed"
    desired_quaternion: Vector4 = (1.0, 0.0, 0.0, 0.0)
    gains: dict[str, float] = field(default_factory=dict)


@dataclass(frozen=True)
class _RegionEntry:
    name: str
    criterion: Literal["obstacle", "shape", "depth"]
    keep: Literal["in", "out"]
    gain: float
    shape: dict[str, Any]
    velocity: Vector3 = (0.0, 0.0, 0.0)  # m/s, NED
    hard: bool = True  # must not be violated, for laws that tell hard regions from soft ones


@dataclass(frozen=True)
class _File:
    vehicle: str
    time: _TimeEntry
    initial: Initial
    goal: dict[str, Any]
    title: str = ""
    compare: Literal["", "paper"] = ""
    intersection: tuple[str, ...] = ()
    plant: PlantSetup = PlantSetup()
    law: _LawEntry = _LawEntry()
    arbiter: ArbiterSetup = ArbiterSetup()
    limit: Limit = Limit()
    actuation: Actuation = Actuation()
    record: RecordSetup = RecordSetup()
    regions: tuple[_RegionEntry, ...] = ()


@dataclass(frozen=True, eq=False)
class Scenario:
    """A checked scenario."""

    name: str
    title: str
    vehicle: Vehicle
    vehicle_file: Path | None  # where it came from, unless shipped
    time: Time
    steps: int  # of the plant
    control_every: int  # steps
    arbiter_every: int  # steps
    plant: PlantSetup
    initial: Initial
    law: LawSetup
    arbiter: ArbiterSetup
    limit: Limit
    actuation: Actuation
    record: RecordSetup
    goal: Shape  # the primary region, kept within
    regions: tuple[SecondaryRegion, ...]
    intersection: tuple[int, ...]  # indices of the regions whose overlap the summary reports
    compare: str  # the claims that the report holds the run against
    table: dict[str, Any]  # as in the file, defaults filled in

    def toml(self, vehicle: str | None = None) -> str:
        """Return the scenario as the file that repeats it, with another name for the vehicle's file if one is given."""
        return tomli_w.dumps(self.table | ({"vehicle": vehicle} if vehicle else {}))

    @property
    def true_restoring_parameters(self) -> NDArray[np.float64]:
        """Phi of (12), shape (4,) [N, N m]: of the vehicle with the parameters that the plant is given over its own."""
        v, over = self.vehicle, self.plant.parameters
        r_G, r_B = (
            np.array([over.get(f"{name}.{axis}", value) for axis, value in zip("xyz", values, strict=True)])
            for name, values in (("r_G", v.r_G), ("r_B", v.r_B))
        )
        return parameters(over.get("weight", v.weight), over.get("buoyancy", v.buoyancy), r_G, r_B)


def load_scenario(name_or_file: str | Path, overrides: Sequence[str] = ()) -> Scenario:
    """Load a shipped scenario by name, or any scenario by its file.

    Parameters
    ----------
    name_or_file : str or Path
        Such as ``"paper"`` or ``"mine.toml"``.
    overrides : sequence of str
        ``key=value``, with dots between the keys and a TOML value; regions go by index or by name.

    Returns
    -------
    Scenario
        The checked scenario.

    Raises
    ------
    ScenarioError
        If there is no such scenario, a key is unknown, missing or mistyped, or a value cannot be.
    """
    text = str(name_or_file)
    if not text.endswith(".toml") and text not in shipped_scenarios():
        known = hint(text, shipped_scenarios())
        raise ScenarioError(f"scenario {text!r} is unknown; {known} (or a file ending in .toml)")
    try:
        table, name = read_table(text)
        for change in overrides:
            override(table, change)
        return _check(table, name)
    except (PlantFmuError, ControllerError, ScenarioError) as error:
        raise ScenarioError(f"{text}: {error}") from error


def _check(table: dict[str, Any], name: str) -> Scenario:
    """Turn the file's table into a scenario, and name the first key that cannot be right."""
    plant = table.get("plant")
    if isinstance(plant, dict) and isinstance(plant.get("parameters"), dict):
        plant["parameters"] = flat(plant["parameters"])
    file = decode(table, _File)
    time = _check_time(file.time)
    _check_numbers(file)
    gains = _check_gains(file.law.gains)
    regions = _check_regions(file.regions)
    overlapping = _check_intersection(file.intersection, regions)
    vehicle_file = Path(file.vehicle) if file.vehicle.endswith(".toml") else None
    vehicle = load_vehicle(vehicle_file or file.vehicle)
    _check_parameters(file.plant.parameters, vehicle)

    filled = dataclasses.replace(
        file,
        title=file.title or name,
        time=_TimeEntry(time.duration, time.step, time.control, time.arbiter),
        law=dataclasses.replace(file.law, gains=gains._asdict()),
        intersection=tuple(regions[i].region.name for i in overlapping),
    )
    return Scenario(
        name=name,
        title=file.title or name,
        vehicle=vehicle,
        vehicle_file=vehicle_file,
        time=time,
        steps=_multiple("time.duration", time.duration, time.step),
        control_every=_multiple("time.control", time.control, time.step),
        arbiter_every=_multiple("time.arbiter", time.arbiter, time.step),
        plant=file.plant,
        initial=file.initial,
        law=LawSetup(file.law.name, file.law.desired_quaternion, gains),
        arbiter=file.arbiter,
        limit=file.limit,
        actuation=file.actuation,
        record=file.record,
        goal=_shape(file.goal, "goal"),
        regions=regions,
        intersection=overlapping,
        compare=file.compare,
        table=msgspec.to_builtins(filled),
    )


def _check_numbers(file: _File) -> None:
    limit, arbiter = file.limit, file.arbiter
    _require(file.plant.substep > 0.0, "plant.substep", file.plant.substep, "above 0 s")
    _require(limit.force >= 0.0, "limit.force", limit.force, "0 N or above (inf for none)")
    _require(0.0 <= limit.time_constant < math.inf, "limit.time_constant", limit.time_constant, "0 s or above")
    _require(0.0 <= arbiter.ramp < math.inf, "arbiter.ramp", arbiter.ramp, "0 m or above")
    _require(3 <= arbiter.points <= MAX_POINTS, "arbiter.points", arbiter.points, f"3 to {MAX_POINTS}")
    for key, values in (
        ("initial.position", file.initial.position),
        ("initial.velocity", file.initial.velocity),
        ("plant.current", file.plant.current),
        *((f"plant.parameters.{k}", (v,)) for k, v in file.plant.parameters.items()),
    ):
        _require(all(map(math.isfinite, values)), key, values, "finite numbers")
    for key, quaternion in (
        ("initial.quaternion", file.initial.quaternion),
        ("law.desired_quaternion", file.law.desired_quaternion),
    ):
        _require(abs(math.hypot(*quaternion) - 1.0) < 1e-6, key, quaternion, "four numbers of length 1")
    if file.actuation.through == "thrusters":
        none_given = limit == Limit()
        _require(none_given, "limit", "given", "none with actuation.through = 'thrusters': it is of the direct wrench")
    if file.record.lyapunov:
        _require(file.law.name == "printed", "record.lyapunov", "true", "false: V of (31) is the printed law's")


def _check_regions(entries: tuple[_RegionEntry, ...]) -> tuple[SecondaryRegion, ...]:
    names = [entry.name for entry in entries]
    regions = []
    for entry in entries:
        key = f"regions.{entry.name}"
        good = REGION_NAME.fullmatch(entry.name) is not None and entry.name != "goal"
        _require(good, f"{key}.name", repr(entry.name), "at most 40 letters, digits, blanks, - and _, and not goal")
        _require(names.count(entry.name) == 1, f"{key}.name", "used twice", "a name of its own")
        _require(0.0 <= entry.gain < math.inf, f"{key}.gain", entry.gain, "a finite number, 0 or above")
        _require(all(map(math.isfinite, entry.velocity)), f"{key}.velocity", entry.velocity, "finite numbers")
        shape = _shape(entry.shape, f"{key}.shape")
        region = Region(entry.name, shape, entry.keep, entry.velocity, entry.gain, entry.hard)
        regions.append(SecondaryRegion(region, entry.criterion))
    return tuple(regions)


def _check_intersection(wanted: tuple[str, ...], regions: tuple[SecondaryRegion, ...]) -> tuple[int, ...]:
    """Return the indices of the regions whose overlap is reported: those that are named, else all to be kept out of."""
    kept_out = {r.region.name: i for i, r in enumerate(regions) if r.region.keep == "out"}
    _require(len(set(wanted)) == len(wanted), "intersection", f"{list(wanted)}", "each name once")
    for name in wanted:
        if name not in kept_out:
            raise ScenarioError(f"intersection: {name!r} is no region to be kept out of; {hint(name, kept_out)}")
    return tuple(kept_out[name] for name in wanted or kept_out)


def _check_parameters(given: dict[str, float | bool], vehicle: Vehicle) -> None:
    names = [v.name for v in variables(vehicle) if v.role == "parameter"]
    known = [name for name in names if name.partition(".")[0] not in _OWN_KEYS]
    for name in given:
        own = _OWN_KEYS.get(name.partition(".")[0])
        tip = f"set {own} instead" if own else hint(name, known)
        _require(name in known, f"plant.parameters.{name}", "no parameter of the FMU", f"one; {tip}")


def _check_time(entry: _TimeEntry) -> Time:
    for key in ("duration", "step", "control", "arbiter"):
        value = getattr(entry, key)
        _require(value is None or 0.0 < value < math.inf, f"time.{key}", value, "above 0 s")
    return Time(entry.duration, entry.step, entry.control or entry.step, entry.arbiter or entry.step)


def _check_gains(table: dict[str, float]) -> Gains:
    for key in table:
        if key not in Gains._fields:
            raise ScenarioError(f"law.gains.{key}: unknown key; {hint(key, Gains._fields)}")
    return check_gains(Gains(**table))


def _multiple(key: str, period: float, step: float) -> int:
    """Return how many steps a period takes; it must be a whole number."""
    ratio = period / step if period / step < MAX_STEPS + 1 else math.inf
    _require(ratio < math.inf, key, f"{period} s, {period / step:.3g} steps", f"at most {MAX_STEPS} steps")
    n = round(ratio)
    _require(n >= 1 and abs(ratio - n) < ROUNDING, key, period, f"a whole multiple of time.step ({step} s)")
    return n


def _shape(table: dict[str, Any], where: str) -> Shape:
    kind = table.get("type")
    if kind is None:
        raise ScenarioError(f"{where}.type is missing, expected one of {', '.join(sorted(SHAPES))}")
    if not isinstance(kind, str) or kind not in SHAPES:
        raise ScenarioError(f"{where}.type is {kind!r}, unknown shape; {hint(str(kind), SHAPES)}")
    try:
        return decode({key: value for key, value in table.items() if key != "type"}, SHAPES[kind], where)
    except RegionError as error:
        raise ScenarioError(f"{where}: {error}") from error


def _require(good: bool, key: str, came: object, expected: str) -> None:
    if not good:
        raise ScenarioError(f"{key} is {came}, expected {expected}")
