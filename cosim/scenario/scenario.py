"""Scenarios: one TOML file holds everything that a run depends on."""

from __future__ import annotations

import dataclasses
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import msgspec
import numpy as np
from numpy.typing import NDArray

from controller import LAWS, ControllerError
from controller.regions import Region
from controller.regions.region_set import shape_center, shape_entry
from controller.regions.shape import Shape
from controller.restoring import parameters
from cosim.errors import ScenarioError
from cosim.scenario.arbiter_rules import ArbiterRules, check_rules, read_rules, with_crossing_costs
from cosim.scenario.changes import changed_keys, differing_keys, join_keys, shown_title, with_values
from cosim.scenario.criteria import PAPER, CriterionSetup, check_criteria, check_criteria_of_regions, fill_criteria
from cosim.scenario.fmu_tables import UserFmu
from cosim.scenario.goal_mission import Mission, make_mission
from cosim.scenario.keys import comments, hint_of_key, without_defaults
from cosim.scenario.region_tables import PAPER_CRITERIA, SecondaryRegion, Vector3
from cosim.scenario.roll_pitch_yaw import with_quaternions
from cosim.scenario.tables import (
    Actuation,
    ArbiterSetup,
    Commands,
    Failure,
    File,
    Initial,
    LawSetup,
    Limit,
    MasterSetup,
    Outage,
    PlantSetup,
    RecordSetup,
    Sensing,
    Time,
)  # fmt: skip
from cosim.scenario.toml_file import flatten, list_scenarios, override, read_table, rename_former_keys, set_key
from cosim.scenario.toml_text import scenario_text
from cosim.scenario.validation import (
    check_components,
    check_goal,
    check_grids,
    check_intersection,
    check_law,
    check_mission,
    check_plant,
    check_regions,
    check_tables,
    expand_parameters,
    obstacle_slots,
    steps_per_period,
    with_digests,
)
from plant_fmu.errors import PlantFmuError
from plant_fmu.toml_tables import decode, hint, require_bounded
from plant_fmu.vehicle import Vehicle, load_vehicle

__all__ = ["Limit", "Scenario", "Time", "load_scenario"]

_AS_READ = (  # fields of a scenario that are those of its file
    "time", "initial", "arbiter", "limit", "actuation", "sensing", "failures", "outages", "master", "record",
    "commands", "report_failures", "compare",
)  # fmt: skip


@dataclass(frozen=True, eq=False)
class Scenario:
    """A checked scenario.

    Examples
    --------
    >>> import cosim
    >>> scenario = cosim.load_scenario("paper-limited")
    >>> scenario.limit.force, scenario.replace({"limit.force": 500.0}).limit.force
    (108.0, 500.0)
    """

    name: str
    vehicle: Vehicle
    vehicle_file: Path | None  # file of the vehicle; None for a shipped one
    time: Time
    steps: int  # number of plant steps
    control_every: int  # number of plant steps between two control steps
    arbiter_every: int  # number of plant steps between two evaluations of the arbiter
    plant: PlantSetup
    initial: Initial
    plant_fmu: UserFmu | None  # FMU of the user's that is the plant
    components: tuple[UserFmu, ...]  # FMUs beside the plant
    law: LawSetup
    arbiter: ArbiterSetup
    criteria: tuple[CriterionSetup, ...]  # criteria by descending priority
    rules: ArbiterRules  # rules that weigh the criteria
    limit: Limit
    actuation: Actuation
    sensing: Sensing
    failures: tuple[Failure, ...]
    outages: tuple[Outage, ...]
    master: MasterSetup
    record: RecordSetup
    commands: Commands
    report_failures: bool  # True: the law receives failures when they happen
    goal: Shape  # primary region, kept within, at its position at time 0
    goal_velocity: Vector3  # m/s, NED
    goal_streamed: bool  # True: the goal is moved from outside during the run
    mission: Mission  # what the goal asks for in turn
    regions: tuple[SecondaryRegion, ...]
    intersection: tuple[int, ...]  # indices of the regions whose overlap the summary reports
    compare: str  # name of the claims with which the report compares the run
    table: dict[str, Any]  # table of the file with defaults filled in

    def toml(self, vehicle: str | None = None, commented: bool = False, short: bool = False) -> str:
        """Format the scenario as a TOML file.

        Parameters
        ----------
        vehicle : str, optional
            Other name for the vehicle's file.
        commented : bool
            True to add a comment with unit and meaning to each key.
        short : bool
            True to leave out the keys that have their default.

        Returns
        -------
        str
            TOML text.
        """
        table = self.table | ({"vehicle": vehicle} if vehicle else {})
        if short:
            defaults = LAWS[self.law.name].gains_type()._asdict() if self.law.name in LAWS else {}
            gains = dict(table["law"]["gains"].items() - defaults.items())
            table = without_defaults(table | {"law": table["law"] | {"gains": gains}})
        return scenario_text(table, comments(self.law.name, self.vehicle) if commented else {})

    def replace(self, changes: Mapping[str, Any]) -> Scenario:
        """Return a scenario with other values of some keys.

        Parameters
        ----------
        changes : mapping of str to value
            Values by key, with dots between its parts, as for ``--set``; regions by index or by name.

        Returns
        -------
        Scenario
            Checked scenario, whose title lists the changes.

        Raises
        ------
        ScenarioError
            If a key is unknown, or a value is invalid.

        Examples
        --------
        >>> load_scenario("paper").replace({"limit.force": 500.0, "regions.SR1.gain": 5000.0}).limit.force
        500.0
        """
        table = with_values(self.table, {})
        try:
            for key, value in changes.items():
                set_key(table, key, value.tolist() if isinstance(value, np.generic | np.ndarray) else value)
            require_bounded(table)
            scenario = validate_scenario(table, self.name)
            return _with_changes(scenario, table, self.table)
        except (PlantFmuError, ControllerError, ScenarioError) as error:
            raise ScenarioError(f"{self.name}: {error}") from error

    def __repr__(self) -> str:
        regions = ", ".join(region.region.name for region in self.regions) or "none"
        return f"Scenario({self.title!r}, law={self.law.name!r}, vehicle={self.vehicle.name!r}, regions: {regions})"

    @property
    def title(self) -> str:
        """The title of the file, with the changes since it was written."""
        return shown_title(self.table, self.vehicle, self.law.name)

    @property
    def criterion_names(self) -> tuple[str, ...]:
        """Names of the criteria, by descending priority."""
        return tuple(criterion.name for criterion in self.criteria)

    @property
    def criterion_places(self) -> tuple[int, ...]:
        """Index of the criterion of each secondary region."""
        names = self.criterion_names
        return tuple(names.index(secondary.criterion) for secondary in self.regions)

    @property
    def has_paper_criteria(self) -> bool:
        """True if criteria and rules are the paper's, with one ramp for all criteria."""
        return not self.arbiter.file and self.arbiter.rules == "ordered" and self.criteria == PAPER

    @property
    def log(self) -> str:
        """Name of the log that a run was imported from; empty where it was simulated."""
        return str(self.table["log"])

    @property
    def has_goal(self) -> bool:
        """True if there is a goal; an imported log may have none."""
        return bool(self.table["goal"])

    @property
    def goal_region(self) -> Region:
        """The goal as a region."""
        return Region("goal", self.goal, "in", self.goal_velocity)

    @property
    def goal_then(self) -> tuple[Vector3, ...]:
        """Center of the goal at its next places, in turn [m, NED]."""
        return self.mission.places[1:]

    @property
    def moving(self) -> tuple[str, ...]:
        """Names of the regions, goal included, that may move away from their position in the scenario."""
        goal = ("goal",) if self.goal_streamed or self.goal_then or any(self.goal_velocity) else ()
        commanded = self.commands.enabled  # commands can move all regions in space
        regions = [
            s
            for i, s in enumerate(self.regions)
            if s.moves or i in self.mission.views or (commanded and shape_entry(s.region.shape).has_position)
        ]
        return (*goal, *(secondary.region.name for secondary in regions))

    @property
    def true_restoring_parameters(self) -> NDArray[np.float64]:
        """Phi of (12), shape (4,) [N, N m], of the vehicle with the scenario's `plant.parameters`."""
        v, over = self.vehicle, self.plant.parameters
        r_G, r_B = (
            np.array([over.get(f"{name}.{axis}", value) for axis, value in zip("xyz", values, strict=True)])
            for name, values in (("r_G", v.r_G), ("r_B", v.r_B))
        )
        return parameters(over.get("weight", v.weight), over.get("buoyancy", v.buoyancy), r_G, r_B)


def load_scenario(name_or_file: str | Path, overrides: Sequence[str] = (), imported: bool = False) -> Scenario:
    """Load a shipped scenario by name, or any scenario by its file.

    Parameters
    ----------
    name_or_file : str or Path
        Name or file, such as ``"paper"`` or ``"mine.toml"``.
    overrides : sequence of str
        Changes ``key=value``, with dots between the keys and a TOML value; regions by index or by name.
    imported : bool
        True to accept the scenario of a run that was imported from a log, which cannot be run.

    Returns
    -------
    Scenario
        Checked scenario.

    Raises
    ------
    ScenarioError
        If there is no such scenario, a key is unknown or missing, or a value is invalid.

    Examples
    --------
    >>> import cosim
    >>> cosim.load_scenario("paper", ["time.duration=2.0"]).time.duration
    2.0
    """
    text = str(name_or_file)
    if not text.endswith(".toml") and text not in list_scenarios():
        known = hint(text, list_scenarios())
        raise ScenarioError(f"scenario {text!r} is unknown; {known} (or a file ending in .toml)")
    try:
        table, name, titled = read_table(text)
        for one in (table, titled):  # so that keys of the default can be set
            one.setdefault("criteria", [msgspec.to_builtins(entry) for entry in PAPER_CRITERIA])
        for change in overrides:
            override(table, change)
        require_bounded(table)
        if table.get("title") != titled.get("title"):  # a new title covers all changes so far
            table.pop("changed", None)
            titled = table
        scenario = validate_scenario(table, name)
        if scenario.log and not imported:
            raise ScenarioError(f"log is {scenario.log!r}, expected none: a run that was imported cannot be run")
        return scenario if table == titled else _with_changes(scenario, table, titled)
    except (PlantFmuError, ControllerError, ScenarioError) as error:
        raise ScenarioError(f"{text}: {error}") from error


def to_scenario(scenario: Scenario | str | Path) -> Scenario:
    """Return a scenario itself, or load it by its name or file."""
    return scenario if isinstance(scenario, Scenario) else load_scenario(scenario)


def _with_changes(scenario: Scenario, table: dict[str, Any], titled: dict[str, Any]) -> Scenario:
    """Return the scenario with the list of keys in which its table differs from the one that has its title."""
    try:
        before = msgspec.to_builtins(read_tables(titled, scenario.name))
    except (PlantFmuError, ControllerError, ScenarioError):  # an incomplete base: keys that complete it are changes too
        keys: Iterable[str] = differing_keys(titled, table)
    else:
        keys = changed_keys(before, scenario.table, scenario.vehicle)
    return dataclasses.replace(scenario, table=scenario.table | {"changed": join_keys(scenario.table["changed"], keys)})


def validate_scenario(table: dict[str, Any], name: str, vehicle: Vehicle | None = None) -> Scenario:
    """Make a scenario from the table of its file."""
    return make_scenario(read_tables(table, name, vehicle), name, vehicle)


def read_tables(table: dict[str, Any], name: str, vehicle: Vehicle | None = None) -> File:
    """Check each table of a scenario's file, and fill in the defaults."""
    table = with_quaternions(rename_former_keys(table))
    for key in ("plant", "law"):
        table = table | ({key: _with_flat_maps(table[key])} if key in table else {})
    if isinstance(components := table.get("components"), list | tuple):
        table = table | {"components": [_with_flat_maps(entry) for entry in components]}
    for key in table.keys() - File.__struct_fields__:
        raise ScenarioError(f"{key}: unknown key; {hint_of_key(key, table.get('vehicle'))}")
    file: File = decode(table, File)
    parameters = file.plant.parameters
    if not file.plant.file:
        parameters = expand_parameters(parameters, vehicle or _vehicle_of(file))
    file = with_digests(file)
    return msgspec.structs.replace(
        file,
        title=file.title or name,
        plant=msgspec.structs.replace(file.plant, parameters=parameters),
        law=msgspec.structs.replace(file.law, gains=file.law.setup.gains._asdict()),
        criteria=fill_criteria(file.criteria),
        arbiter=read_rules(file.arbiter),
    )


def _with_flat_maps(entry: Any) -> Any:
    """Return the table of an FMU with the names of its variables as keys, which TOML nests at their dots."""
    if not isinstance(entry, dict):
        return entry
    maps = ("inputs", "outputs", "parameters", "initial")
    return entry | {name: flatten(entry[name]) for name in maps if isinstance(entry.get(name), dict)}


def _vehicle_of(file: File) -> Vehicle:
    return load_vehicle(Path(file.vehicle) if file.vehicle.endswith(".toml") else file.vehicle)


def make_scenario(file: File, name: str, vehicle: Vehicle | None = None) -> Scenario:
    """Check the tables of a scenario against each other and the vehicle."""
    time = file.time
    goal, motion = check_goal(file)
    regions = check_regions(file.regions)
    check_grids(Region("goal", goal, "in"), regions)
    criteria = check_criteria(file.criteria)
    overlapping = check_intersection(file.intersection, regions)
    slots = obstacle_slots(file)
    check_criteria_of_regions(regions + slots, criteria)
    rules = check_rules(file.arbiter, criteria, regions)
    vehicle = vehicle or _vehicle_of(file)
    law = check_law(file.law, file.actuation.through, vehicle, time.control, len(regions) + len(slots))
    check_tables(file, regions, vehicle)
    mission = make_mission(goal, shape_center(goal), motion, regions)
    check_mission(mission, law)
    own_plant, components = check_plant(file), check_components(file.components, file.plant.fmi)
    regions = with_crossing_costs(regions, tuple(c.name for c in criteria), rules, file.initial.position[2])
    names = tuple(regions[i].region.name for i in overlapping)
    return Scenario(
        name=name,
        vehicle=vehicle,
        vehicle_file=Path(file.vehicle) if file.vehicle.endswith(".toml") else None,
        plant=msgspec.structs.replace(file.plant, parameters={}) if own_plant else file.plant,
        **{name: getattr(file, name) for name in _AS_READ},
        steps=steps_per_period("time.duration", time.duration, time.step),
        control_every=steps_per_period("time.control", time.control, time.step),
        arbiter_every=steps_per_period("time.arbiter", time.arbiter, time.step),
        plant_fmu=own_plant,
        components=components,
        law=law,
        criteria=criteria,
        rules=rules,
        goal=goal,
        goal_velocity=motion.velocity,
        goal_streamed=motion.streamed or file.commands.enabled,
        mission=mission,
        regions=regions + slots,
        intersection=overlapping,
        table=msgspec.to_builtins(msgspec.structs.replace(file, intersection=names)),
    )
