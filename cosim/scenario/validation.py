"""Checks of a scenario's tables: each error names the first invalid key."""

from __future__ import annotations

import functools
import math
import re
from dataclasses import dataclass
from typing import Any

import numpy as np

from controller import LAWS
from controller.errors import RegionError
from controller.law import validate_quaternion
from controller.regions import Region, Sphere
from controller.regions.region_set import SHAPES, deviations_of, of_attitude
from controller.regions.shape import Shape
from cosim.errors import ScenarioError
from cosim.scenario.tables import (
    PARKED_POSITION,
    Commands,
    Failure,
    File,
    LawEntry,
    LawSetup,
    Limit,
    NoGains,
    Outage,
    RecordSetup,
    RegionEntry,
    SecondaryRegion,
    Sensing,
    Time,
    TimeEntry,
    Vector3,
    is_custom_law,
)
from cosim.scenario.vehicle_model import vehicle_model
from plant_fmu.toml_tables import decode, hint
from plant_fmu.variables import variables
from plant_fmu.vehicle import Vehicle

ROUNDING = 1e-6  # tolerance of a multiple of the step, as a fraction of the step
MAX_STEPS = 100_000_000  # greatest number of plant steps of a run
MAX_POINTS = 100_001  # greatest number of samples of the arbiter's output universe
MAX_TEXT = 200  # greatest number of characters of a text
MAX_OBSTACLES = 100  # greatest number of obstacle slots
REGION_NAME = re.compile(r"[A-Za-z0-9][A-Za-z0-9 _-]{0,39}")  # valid in column names and labels of figures

# parameters of the FMU for which a scenario has other keys
_OWN_KEYS = {
    "wrench_force_limit": "limit.force",
    "wrench_time_constant": "limit.time_constant",
    "substep": "plant.substep",
    "current": "plant.current",
}


@dataclass(frozen=True)
class GoalMotion:
    """Keys of the goal beside those of its shape."""

    velocity: Vector3 = (0.0, 0.0, 0.0)  # m/s, NED
    streamed: bool = False  # True: moved from outside during the run
    then: tuple[Vector3, ...] = ()  # m, NED: next positions of the goal's centre, in turn
    stay: float = 5.0  # s, time within the goal before it moves to the next position


def check_texts(file: File) -> None:
    """Raise `ScenarioError` unless the texts are one printable line, without control characters for terminals."""
    texts = (("title", file.title), ("log", file.log), ("law.name", file.law.name))
    for key, text in (*texts, *(("changed", key) for key in file.changed)):
        good = text.isprintable() and len(text) <= MAX_TEXT
        _require(good, key, repr(text), f"one line of at most {MAX_TEXT} printable characters")


def check_numbers(file: File) -> None:
    """Raise `ScenarioError` unless the numbers outside of goal, regions and lists are within their ranges."""
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
    _check_sensing(file.sensing)


def _check_sensing(sensing: Sensing) -> None:
    for key in ("position_noise", "velocity_noise", "dead_for"):
        value = getattr(sensing, key)
        _require(0.0 <= value < math.inf, f"sensing.{key}", value, "a finite number, 0 or above")
    _require(sensing.dead_from >= 0.0, "sensing.dead_from", sensing.dead_from, "0 s or above (inf for never)")
    _require(sensing.seed >= 0, "sensing.seed", sensing.seed, "a whole number, 0 or above")
    if sensing.through == "sensors":
        for key in ("position_noise", "velocity_noise", "dead_for"):
            expected = "0 with sensing.through = 'sensors': plant.parameters and outages say it"
            _require(getattr(sensing, key) == 0.0, f"sensing.{key}", getattr(sensing, key), expected)


def check_failures(failures: tuple[Failure, ...], through: str, vehicle: Vehicle) -> None:
    """Raise `ScenarioError` unless the failures are of thrusters that the run uses."""
    if failures and through != "thrusters":
        raise ScenarioError("failures are given, expected none with actuation.through = 'wrench': no thruster is used")
    for i, failure in enumerate(failures):
        known = 1 <= failure.thruster <= vehicle.n_thrusters
        _require(known, f"failures.{i}.thruster", failure.thruster, f"1 to {vehicle.n_thrusters}")
        _require(0.0 <= failure.time < math.inf, f"failures.{i}.time", failure.time, "0 s or above")
        _require(0.0 <= failure.effectiveness <= 1.0, f"failures.{i}.effectiveness", failure.effectiveness, "0 to 1")
        _require(
            not (failure.stuck and failure.effectiveness), f"failures.{i}.effectiveness", failure.effectiveness,
            "none of a thruster that is stuck",
        )  # fmt: skip


def check_outages(outages: tuple[Outage, ...], through: str) -> None:
    """Raise `ScenarioError` unless the run uses sensors, and outages of one sensor do not overlap."""
    if outages and through != "sensors":
        raise ScenarioError("outages are given, expected none with sensing.through = 'state': no sensor is used")
    ends: dict[str, float] = {}
    for i, outage in sorted(enumerate(outages), key=lambda item: item[1].time):
        for key in ("time", "duration"):
            value = getattr(outage, key)
            _require(0.0 <= value < math.inf, f"outages.{i}.{key}", value, "a finite number, 0 s or above")
        last = ends.get(outage.sensor, -math.inf)
        _require(outage.time > last, f"outages.{i}.time", outage.time, f"above {last} s, the end of the one before")
        ends[outage.sensor] = outage.time + outage.duration


def check_record(record: RecordSetup, law: LawSetup, regions: tuple[SecondaryRegion, ...]) -> None:
    """Raise `ScenarioError` unless the recorded signals are defined for the law and the regions."""
    if not record.lyapunov:
        return
    _require(law.name == "ismail_dunnigan", "record.lyapunov", "true", "false: V of (31) is the paper's law's")
    names = [r.region.name for r in regions if of_attitude(r.region.shape)]
    _require(not names, "record.lyapunov", "true", f"false: the analysis knows no attitude in regions ({names})")


def check_commands(
    commands: Commands, record: RecordSetup, law: str, names: tuple[str, ...]
) -> tuple[SecondaryRegion, ...]:
    """Check the commands; return the regions of the obstacle slots, none if commands are not enabled."""
    if not commands.enabled:
        _require(not commands.await_arm, "commands.await_arm", "true", "false without commands.enabled: no way to arm")
        return ()
    _require(not record.lyapunov, "record.lyapunov", "true", "false with commands.enabled: V is of one target")
    _require(not is_custom_law(law), "commands.enabled", "true", f"false with {law}: only built-in laws take commands")
    _require(
        0 <= commands.obstacles <= MAX_OBSTACLES, "commands.obstacles", commands.obstacles, f"0 to {MAX_OBSTACLES}"
    )
    for key in ("obstacle_radius", "hold_radius"):
        value = getattr(commands, key)
        _require(0.0 < value < math.inf, f"commands.{key}", value, "above 0 m")
    for key, greatest in (("obstacle_gain", math.inf), ("surface_depth", 1e3), ("pilot_gain", 1.0)):
        value = getattr(commands, key)
        _require(0.0 <= value <= greatest and value < math.inf, f"commands.{key}", value, f"0 to {greatest:g}")
    slots = [f"seen {i}" for i in range(1, commands.obstacles + 1)]
    for name in slots:
        _require(name not in names, f"regions.{name}.name", "used", "another one: obstacles that come in have it")
    far = Sphere(PARKED_POSITION, commands.obstacle_radius)
    return tuple(
        SecondaryRegion(
            Region(name, far, "out", gain=commands.obstacle_gain), "obstacle", streamed=True, is_dynamic=True
        )
        for name in slots
    )


def check_goal(file: File) -> tuple[Shape, GoalMotion]:
    """Check the goal; return its shape and motion, or raise a ScenarioError."""
    # The run of a log may have no goal: then it is a sphere far away, which no figure or summary uses.
    table = file.goal
    if not table and file.log:
        return Sphere(PARKED_POSITION, 1.0), GoalMotion()
    if not table:
        raise ScenarioError("file: table missing required field 'goal'")
    beside = ("velocity", "streamed", "then", "stay")
    shape = _shape({key: value for key, value in table.items() if key not in beside}, "goal")
    _require(not of_attitude(shape), "goal.type", repr(table["type"]), "a shape in space")
    motion = decode({key: table[key] for key in beside if key in table}, GoalMotion, "goal")
    _require(all(map(math.isfinite, motion.velocity)), "goal.velocity", motion.velocity, "finite numbers")
    Region("goal", shape, "in", motion.velocity)  # raises an error if invalid
    _require(0.0 <= motion.stay < math.inf, "goal.stay", motion.stay, "a finite number, 0 s or above")
    for i, place in enumerate(motion.then):
        _require(all(map(math.isfinite, place)), f"goal.then.{i}", place, "finite numbers")
    if motion.then:
        _require(not any(motion.velocity), "goal.velocity", motion.velocity, "0 0 0 beside goal.then")
        _require(not motion.streamed, "goal.streamed", "true", "false beside goal.then")
        _require(
            not file.commands.enabled, "commands.enabled", "true", "false beside goal.then: a mission says what is next"
        )
        _require(not file.record.lyapunov, "record.lyapunov", "true", "false beside goal.then: V is of one target")
    return shape, motion


def check_regions(entries: tuple[RegionEntry, ...]) -> tuple[SecondaryRegion, ...]:
    """Check the regions; return the secondary regions."""
    names = [entry.name for entry in entries]
    regions = []
    for entry in entries:
        key = f"regions.{entry.name}"
        good = REGION_NAME.fullmatch(entry.name) is not None and entry.name != "goal"
        _require(good, f"{key}.name", repr(entry.name), "at most 40 letters, digits, blanks, - and _, and not goal")
        _require(names.count(entry.name) == 1, f"{key}.name", "used twice", "a name of its own")
        _require(0.0 <= entry.gain < math.inf, f"{key}.gain", entry.gain, "a finite number, 0 or above")
        good = all(0.0 <= deviation < math.inf for deviation in deviations_of(entry.deviation))
        _require(good, f"{key}.deviation", entry.deviation, "finite, 0 m or above, one number or three")
        _require(all(map(math.isfinite, entry.velocity)), f"{key}.velocity", entry.velocity, "finite numbers")
        shape = _shape(entry.shape, f"{key}.shape")
        region = Region(entry.name, shape, entry.keep, entry.velocity, entry.gain, entry.hard, entry.deviation)
        _require(0.0 <= entry.priority < math.inf, f"{key}.priority", entry.priority, "a finite number, 0 or above")
        regions.append(SecondaryRegion(region, entry.criterion, entry.streamed, priority=entry.priority))
    return tuple(regions)


def check_intersection(wanted: tuple[str, ...], regions: tuple[SecondaryRegion, ...]) -> tuple[int, ...]:
    """Return the indices of the regions whose overlap is reported: those that are named, else all to keep out of."""
    # Raise a ScenarioError if a name is unknown.
    kept_out = {r.region.name: i for i, r in enumerate(regions) if r.region.keep == "out"}
    _require(len(set(wanted)) == len(wanted), "intersection", f"{list(wanted)}", "each name once")
    for name in wanted:
        if name not in kept_out:
            raise ScenarioError(f"intersection: {name!r} is no region to be kept out of; {hint(name, kept_out)}")
    return tuple(kept_out[name] for name in wanted or kept_out)


def check_parameters(given: dict[str, float | bool], vehicle: Vehicle) -> None:
    """Raise `ScenarioError` unless the FMU has these parameters, and no other key of the scenario sets them."""
    known = known_parameters(vehicle)
    for name in given:
        if name not in known:
            own = _OWN_KEYS.get(name.partition(".")[0])
            tip = f"set {own} instead" if own else hint(name, known)
            raise ScenarioError(f"plant.parameters.{name} is no parameter of the FMU, expected one; {tip}")


@functools.lru_cache(maxsize=8)
def known_parameters(vehicle: Vehicle) -> dict[str, float]:
    """Return the start values by name of the FMU's parameters that no other key of a scenario sets."""
    parameters = [v for v in variables(vehicle) if v.role == "parameter"]
    return {v.name: v.start for v in parameters if v.name.partition(".")[0] not in _OWN_KEYS}


def check_time(entry: TimeEntry) -> Time:
    """Check the periods, and fill in the defaults [s]."""
    for key in ("duration", "step", "control", "arbiter"):
        value = getattr(entry, key)
        _require(value is None or 0.0 < value < math.inf, f"time.{key}", value, "above 0 s")
    return Time(entry.duration, entry.step, entry.control or entry.step, entry.arbiter or entry.step)


def check_law(entry: LawEntry, through: str, vehicle: Vehicle, period: float, n_regions: int) -> LawSetup:
    """Check name, gains and period [s] of a built-in law by setting it up; of a custom law check the name only."""
    if is_custom_law(entry.name):
        if entry.gains:
            raise ScenarioError(f"law.gains has {next(iter(entry.gains))!r}, expected nothing with a law of one's own")
        validate_quaternion(np.array(entry.desired_quaternion))
        return LawSetup(entry.name, entry.desired_quaternion, NoGains())
    if entry.name == "printed":
        raise ScenarioError(
            "law.name is 'printed', expected 'ismail_dunnigan': the paper's law has its authors' names now"
        )
    if entry.name not in LAWS:
        known = ", ".join(map(repr, sorted(LAWS)))
        raise ScenarioError(f"law.name is {entry.name!r}, expected one of {known}")
    law = LAWS[entry.name]
    for key in entry.gains:
        if key not in law.gains_type._fields:
            raise ScenarioError(f"law.gains.{key}: unknown key; {hint(key, law.gains_type._fields)}")
    if law.output == "thrusters" and through != "thrusters":
        raise ScenarioError(f"actuation.through is {through!r}, expected 'thrusters': law {entry.name!r} drives them")
    gains = law.gains_type(**entry.gains)
    law.for_vehicle(vehicle_model(vehicle), gains, np.array(entry.desired_quaternion), period, n_regions)
    return LawSetup(entry.name, entry.desired_quaternion, gains)


def steps_per_period(key: str, period: float, step: float) -> int:
    """Return the number of steps of length `step` [s] in a `period` [s], which must be a whole multiple."""
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


def _require(good: bool, key: str, received: object, expected: str) -> None:
    if not good:
        raise ScenarioError(f"{key} is {received}, expected {expected}")
