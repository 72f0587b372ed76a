"""Checks of a scenario's tables against each other: each error names the first invalid key."""

from __future__ import annotations

import errno
import functools
import hashlib
import math
import re
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any, TypeVar

import msgspec
import numpy as np

from controller import LAWS
from controller.driven_axes import AXES, PITCH, require_driven
from controller.quaternion import down_in_body
from controller.regions import Mesh, Points, Region, Sphere
from controller.regions.region_set import of_attitude
from controller.regions.shape import Shape
from controller.regions.shapes import ENTRIES
from cosim.errors import ScenarioError
from cosim.scenario.fmu_tables import ComponentEntry, FmuTable, UserFmu
from cosim.scenario.goal_mission import GoalMotion, Mission
from cosim.scenario.region_tables import PARKED_POSITION, AnyShape, RegionEntry, SecondaryRegion
from cosim.scenario.tables import Commands, File, LawEntry, LawSetup, Limit, PlantSetup
from cosim.scenario.vehicle_model import vehicle_model
from plant_fmu.toml_tables import decode, hint
from plant_fmu.variables import variables
from plant_fmu.vehicle import Vehicle

_Fmu = TypeVar("_Fmu", bound=FmuTable)

ROUNDING = 1e-6  # tolerance of a multiple of the step, as a fraction of the step
_LEVEL = 1e-6  # cosine of the vertical up to which an attitude is level
MAX_STEPS = 100_000_000  # maximum number of plant steps of a run

# parameters of the FMU for which a scenario has other keys
_OWN_KEYS = {
    "wrench_force_limit": "limit.force",
    "wrench_time_constant": "limit.time_constant",
    "substep": "plant.substep",
    "current": "plant.current",
}


def check_goal(file: File) -> tuple[Shape, GoalMotion]:
    """Check the goal; return its shape and motion."""
    # The run of a log may have no goal: then it is a sphere far away, which no figure or summary uses.
    if not file.goal and file.log:
        return Sphere(PARKED_POSITION, 1.0), GoalMotion()
    if not file.goal:
        raise ScenarioError("goal is missing, expected a shape")
    own = ENTRIES[kind].units if isinstance(kind := file.goal.get("type"), str) and kind in ENTRIES else ()
    beside = [key for key in GoalMotion.__struct_fields__ if key not in own]  # the feature of a cone is the shape's
    table = {key: value for key, value in file.goal.items() if key not in beside}
    shape: Shape = decode(table, AnyShape, "goal").shape
    _require(not of_attitude(shape), "goal.type", repr(table["type"]), "a shape in space")
    motion: GoalMotion = decode({key: file.goal[key] for key in beside if key in file.goal}, GoalMotion, "goal")
    Region("goal", shape, "in", motion.velocity)  # raises an error if invalid
    if motion.then:
        _require(not any(motion.velocity), "goal.velocity", motion.velocity, "0 0 0 beside goal.then")
        _require(not motion.streamed, "goal.streamed", "true", "false beside goal.then")
    for name in ("then", "heading", "feature", "speed"):
        if getattr(motion, name) not in (None, ()):
            mission, one = f"false beside goal.{name}: a mission says what is next", "V is of one target and attitude"
            _require(not file.commands.enabled, "commands.enabled", "true", mission)
            _require(not file.record.lyapunov, "record.lyapunov", "true", f"false beside goal.{name}: {one}")
    return shape, motion


def check_regions(entries: tuple[RegionEntry, ...]) -> tuple[SecondaryRegion, ...]:
    """Check the regions; return the secondary regions."""
    names = [entry.name for entry in entries]
    regions = []
    for i, entry in enumerate(entries):
        _require(names.count(entry.name) == 1, f"regions[{i}].name", f"{entry.name!r}, used twice", "a name of its own")
        region = Region(
            entry.name, entry.shape.shape, entry.keep, entry.velocity, entry.gain, entry.hard, entry.deviation
        )
        regions.append(SecondaryRegion(region, entry.criterion, entry.streamed, priority=entry.priority))
    return tuple(regions)


def check_intersection(names: tuple[str, ...], regions: tuple[SecondaryRegion, ...]) -> tuple[int, ...]:
    """Return the indices of the regions whose overlap is reported: those that are named, else all to keep out of."""
    kept_out = {r.region.name: i for i, r in enumerate(regions) if r.region.keep == "out"}
    _require(len(set(names)) == len(names), "intersection", f"{list(names)}", "each name once")
    for name in names:
        if name not in kept_out:
            raise ScenarioError(f"intersection: {name!r} is no region to be kept out of; {hint(name, kept_out)}")
    return tuple(kept_out[name] for name in names or kept_out)


def check_tables(file: File, regions: tuple[SecondaryRegion, ...], vehicle: Vehicle) -> None:
    """Raise `ScenarioError` unless tables that depend on each other fit."""
    wrench, thrusters = file.actuation.through == "wrench", file.actuation.through == "thrusters"
    of_wrench = "none with actuation.through = 'wrench': no thruster is used"
    if file.failures and wrench:
        raise ScenarioError(f"failures are given, expected {of_wrench}")
    of_thrusters = "none with actuation.through = 'thrusters': it is of the direct wrench"
    _require(not thrusters or file.limit == Limit(), "limit", "given", of_thrusters)
    for i, failure in enumerate(file.failures):
        ok = 1 <= failure.thruster <= vehicle.n_thrusters
        _require(ok, f"failures[{i}].thruster", failure.thruster, f"1 to {vehicle.n_thrusters}")
    of_state = "none with sensing.through = 'state': no sensor is used"
    if file.outages and file.sensing.through == "state":
        raise ScenarioError(f"outages are given, expected {of_state}")
    ends: dict[str, float] = {}
    for i, outage in sorted(enumerate(file.outages), key=lambda item: item[1].time):
        last = ends.get(outage.sensor, -math.inf)
        _require(outage.time > last, f"outages[{i}].time", outage.time, f"above {last} s, the end of the one before")
        ends[outage.sensor] = outage.time + outage.duration
    if file.record.lyapunov:
        _require(file.law.name == "ismail_dunnigan", "record.lyapunov", "true", "false: V of (31) is the paper's law's")
        names = [r.region.name for r in regions if of_attitude(r.region.shape)]
        _require(not names, "record.lyapunov", "true", f"false: the analysis knows no attitude in regions ({names})")


def check_grids(goal: Region, regions: Sequence[SecondaryRegion]) -> None:
    """Check that shapes from files err on the safe side: larger where kept out of, smaller where kept within."""
    for key, region in (("goal", goal), *((f"regions.{r.region.name}.shape", r.region) for r in regions)):
        if region.keep == "in" and isinstance(region.shape, Mesh):
            offset = region.shape.offset
            _require(offset < 0.0, f"{key}.offset", offset, "below 0 m: kept within, the mesh must err inward")
        _require(
            region.keep == "out" or not isinstance(region.shape, Points), f"{key}.type", "'points'",
            "another shape to keep within: points are kept out of",
        )  # fmt: skip


def expand_parameters(parameters: Mapping[str, float], vehicle: Vehicle) -> dict[str, float]:
    """Return the value of each parameter of the FMU, for names that may be patterns with ``*`` or lack an index."""
    known, values = known_parameters(vehicle), dict[str, float]()
    for name, value in parameters.items():
        pattern = re.compile(re.escape(name).replace(r"\*", ".*") + r"(\[.*\])?")
        matches = [name] if name in known else [one for one in known if pattern.fullmatch(one)]
        if not matches:
            own = _OWN_KEYS.get(name.partition(".")[0])
            tip = f"set {own} instead" if own else hint(name, known)
            raise ScenarioError(f"plant.parameters.{name} is no parameter of the FMU, expected one; {tip}")
        values |= dict.fromkeys(matches, value)
    return values


@functools.lru_cache(maxsize=8)
def known_parameters(vehicle: Vehicle) -> dict[str, float]:
    """Return the start values by name of the FMU's parameters that no other key of a scenario sets."""
    parameters = [v for v in variables(vehicle) if v.role == "parameter"]
    return {v.name: v.start for v in parameters if v.name.partition(".")[0] not in _OWN_KEYS}


def obstacle_slots(file: File) -> tuple[SecondaryRegion, ...]:
    """Check the commands; return the regions of the obstacle slots, none if commands are not enabled."""
    commands: Commands = file.commands
    if not commands.enabled:
        _require(not commands.await_arm, "commands.await_arm", "true", "false without commands.enabled: no way to arm")
        return ()
    law = file.law
    _require(not file.record.lyapunov, "record.lyapunov", "true", "false with commands.enabled: V is of one target")
    of_python = law.is_custom and not law.file
    _require(not of_python, "commands.enabled", "true", f"false with {law.name}: laws of Python take no commands")
    slots = [f"seen {i}" for i in range(1, commands.obstacles + 1)]
    for i, entry in enumerate(file.regions):
        expected = "another one: obstacles that come in have it"
        _require(entry.name not in slots, f"regions[{i}].name", repr(entry.name), expected)
    far = Sphere(PARKED_POSITION, commands.obstacle_radius)
    regions = (Region(name, far, "out", gain=commands.obstacle_gain) for name in slots)
    return tuple(SecondaryRegion(region, "obstacle", streamed=True, is_dynamic=True) for region in regions)


def check_law(entry: LawEntry, through: str, vehicle: Vehicle, period: float, n_regions: int) -> LawSetup:
    """Check gains and period [s] of a built-in law by setting it up; a custom law has its own."""
    if not entry.is_custom:
        _check_builtin_law(entry.setup, through, vehicle, period, n_regions)
    return entry.setup


@functools.lru_cache(maxsize=16)  # in sweeps one scenario after another has the same law
def _check_builtin_law(setup: LawSetup, through: str, vehicle: Vehicle, period: float, n_regions: int) -> None:
    law, attitude = LAWS[setup.name], np.array(setup.desired_quaternion)
    if law.output == "thrusters" and through != "thrusters":
        raise ScenarioError(f"actuation.through is {through!r}, expected 'thrusters': law {setup.name!r} drives them")
    model = vehicle_model(vehicle)
    if through == "thrusters":
        left = require_driven(model.thruster_matrix, model.thrust_min, model.thrust_max, model.righting_moment)
        down = down_in_body(attitude)
        for axis in left:
            level = abs(down[PITCH - axis]) <= _LEVEL
            _require(level, "law.desired_quaternion", f"tilted in {AXES[axis]}", "no tilt there: no thruster drives it")
    law.for_vehicle(model, setup.gains, attitude, period, n_regions)


def check_mission(mission: Mission, law: LawSetup) -> None:
    """Raise `ScenarioError` unless the law takes the headings and speeds of a mission."""
    if mission.turns and law.is_custom:
        expected = "'kept' at each place: a law in Python gets no attitude"
        raise ScenarioError(f"goal: headings for law {law.name}, expected heading = {expected}")
    takers = [name for name, kind in sorted(LAWS.items()) if kind.takes_speed]
    if mission.limits_speed and law.name not in takers:
        raise ScenarioError(f"goal: speeds for law {law.name}, expected none, or one of the laws {', '.join(takers)}")


def with_digests(file: File) -> File:
    """Return the file with the digests of all FMUs of the user's, which have to be those that it states."""
    components = tuple(_with_digest(f"components.{entry.name}", entry) for entry in file.components)
    law, plant = _with_digest("law", file.law), _with_digest("plant", file.plant)
    return msgspec.structs.replace(file, law=law, plant=plant, components=components)


def _with_digest(path: str, entry: _Fmu) -> _Fmu:
    """Return the table of an FMU with its digest, which has to be the one that it states; itself without an FMU."""
    if not entry.file:
        return entry
    try:
        fmu = Path(entry.file)
        if not fmu.is_file():
            raise FileNotFoundError(errno.ENOENT, "No such file")
        status = fmu.stat()
        digest = _digest(fmu, status.st_mtime_ns, status.st_size)
    except OSError as error:
        raise ScenarioError(f"{path}.file: {entry.file}: {error.strerror or error}") from error
    if entry.digest not in ("", digest):
        raise ScenarioError(f"{path}.file: {fmu.name} has the digest {digest[:12]}..., expected {entry.digest[:12]}...")
    return msgspec.structs.replace(entry, digest=digest)


def check_components(entries: tuple[ComponentEntry, ...], fmi: int) -> tuple[UserFmu, ...]:
    """Check the FMUs beside the plant; return them."""
    names = [entry.name for entry in entries]
    for i, name in enumerate(names):
        _require(names.count(name) == 1, f"components[{i}].name", f"{name!r}, used twice", "a name of its own")
    _require(not entries or fmi == 3, "plant.fmi", fmi, "3 with components")
    return tuple(entry.fmu(f"components.{entry.name}", entry.parameters) for entry in entries)


def check_plant(file: File) -> UserFmu | None:
    """Check that an FMU of the user's needs nothing that the vehicle's own plant has; return it."""
    plant, default = file.plant, PlantSetup()
    if not plant.file:
        return None
    of_vehicle = "its default with plant.file: it is of the vehicle's own FMU"
    for name, key, received, fits in (
        ("plant", "fmi", plant.fmi, plant.fmi == default.fmi),
        ("plant", "current", plant.current, plant.current == default.current),
        ("plant", "substep", plant.substep, plant.substep == default.substep),
        ("limit", "force", file.limit.force, file.limit.force == Limit().force),
        ("limit", "time_constant", file.limit.time_constant, file.limit.time_constant == 0.0),
        ("sensing", "through", repr(file.sensing.through), file.sensing.through == "state"),
        ("record", "lyapunov", "true", not file.record.lyapunov),
    ):
        _require(fits, f"{name}.{key}", received, of_vehicle)
    _require(not file.failures, "failures", "given", f"none with plant.file: {Path(plant.file).name} knows none")
    return plant.fmu("plant", dict(plant.parameters), plant.initial)


@functools.lru_cache(maxsize=8)
def _digest(path: Path, modified: int, size: int) -> str:
    return hashlib.sha256(path.read_bytes()).hexdigest()


def steps_per_period(key: str, period: float, step: float) -> int:
    """Return the number of steps of length `step` [s] in a `period` [s], which must be a whole multiple."""
    ratio = period / step if period / step < MAX_STEPS + 1 else math.inf
    _require(ratio < math.inf, key, f"{period} s, {period / step:.3g} steps", f"at most {MAX_STEPS} steps")
    n = round(ratio)
    _require(n >= 1 and abs(ratio - n) < ROUNDING, key, period, f"a whole multiple of time.step ({step} s)")
    return n


def _require(ok: bool, key: str, received: Any, expected: str) -> None:
    if not ok:
        raise ScenarioError(f"{key} is {received}, expected {expected}")
