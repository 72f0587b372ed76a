"""The tables of a scenario: as they stand in its file, and as they are once checked."""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from typing import Any, Literal, NamedTuple

from controller.regions import Region

Vector3 = tuple[float, float, float]
Vector4 = tuple[float, float, float, float]
Vector6 = tuple[float, float, float, float, float, float]

PARKED_POSITION: Vector3 = (0.0, 0.0, -1e5)  # m, NED: where obstacles are that have not come


# ---- the same in the file and checked ------------------------------------------------------------------------------


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
class ArbiterSetup:
    """How memberships, or the signals that a file asks for, become weights."""

    engine: Literal["closed", "exact", "grid", "skfuzzy"] = "closed"
    ramp: float = 0.2  # m (rad for regions of attitude), width over which a membership falls from 1 to 0 outside
    points: int = 101  # of the output universe, for grid and skfuzzy
    rules: Literal["ordered", "reversed", "crisp", "none"] = "ordered"  # by which criteria are weighed, without a file
    file: str = ""  # of a system that fuzzy_arbiter reads; else the criteria are weighed by their order
    text: str = ""  # what stands in it
    inputs: dict[str, Any] = field(default_factory=dict)  # of that system: the signal, number or course that each gets


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
class Failure:
    """A thruster that gives less force, or always the same, from some time on."""

    thruster: int  # from 1
    time: float  # s
    effectiveness: float = 0.0  # part of its force that is left
    stuck: bool = False  # it keeps the force that was commanded last

    @property
    def is_total(self) -> bool:
        """Whether it no longer follows its command at all."""
        return self.stuck or self.effectiveness == 0.0


@dataclass(frozen=True)
class Outage:
    """A time in which a sensor gives no samples."""

    sensor: Literal["depth_sensor", "dvl", "imu", "compass", "usbl"]
    time: float  # s, when it begins
    duration: float  # s


@dataclass(frozen=True)
class Sensing:
    """What law and arbiter are given: the state, or what a navigation filter makes of the plant's sensors.

    Of the state, position and linear velocity may have noise; attitude and body rates are exact.
    """

    through: Literal["state", "sensors"] = "state"
    position_noise: float = 0.0  # m, standard deviation of each coordinate, white, drawn anew at each control step
    velocity_noise: float = 0.0  # m/s, the same of each linear velocity
    seed: int = 0
    dead_from: float = math.inf  # s, when both are lost
    dead_for: float = 0.0  # s, for how long
    frozen: bool = False  # the last values are held in that time; otherwise they are NaN

    @property
    def exact(self) -> bool:
        """Whether what is told is the truth."""
        noisy = self.position_noise > 0.0 or self.velocity_noise > 0.0 or self.through == "sensors"
        return not noisy and (self.dead_for == 0.0 or self.dead_from == math.inf)


@dataclass(frozen=True)
class Commands:
    """What the running vehicle takes from outside."""

    enabled: bool = False
    await_arm: bool = False  # nothing moves before it is armed
    obstacles: int = 8  # spheres that may come in while it runs
    obstacle_radius: float = 0.5  # m, of one whose size is not told
    obstacle_gain: float = 100.0  # N per unit of g
    hold_radius: float = 0.3  # m, of the sphere that is held in, and surfaced in
    surface_depth: float = 0.5  # m, of its centre when surfacing
    pilot_gain: float = 0.5  # part of the greatest wrench that full sticks give


@dataclass(frozen=True)
class MasterSetup:
    """In which order a step calls its parts."""

    # gauss-seidel: each sees what the one before gave in this step; jacobi: what all had given at the step's beginning
    order: Literal["gauss-seidel", "jacobi"] = "gauss-seidel"


@dataclass(frozen=True)
class RecordSetup:
    """What a run records beyond its signals."""

    lyapunov: bool = False  # V of (31) and its rate, with the paper's law


# ---- as they stand in the file -------------------------------------------------------------------------------------


@dataclass(frozen=True)
class TimeEntry:
    """Periods, those that are left out filled in later."""

    duration: float  # s
    step: float = 0.001  # s
    control: float | None = None  # s, default: the step
    arbiter: float | None = None  # s, default: the step


@dataclass(frozen=True)
class LawEntry:
    """Name and gains before anybody knows whether they go together."""

    name: str = "ismail_dunnigan"
    desired_quaternion: Vector4 = (1.0, 0.0, 0.0, 0.0)
    gains: dict[str, float] = field(default_factory=dict)


@dataclass(frozen=True)
class CriterionEntry:
    """A criterion: what regions may ask attention for."""

    name: str
    order: int | None = None  # the least comes first; default: its place in the list
    colour: str = ""  # #RRGGBB; default: one that no other has
    membership: dict[str, Any] = field(default_factory=dict)  # reasons to ask; default: the arbiter's ramp


# section VI of the paper; the colours are Okabe and Ito's, which colour-blind people can tell apart
PAPER_CRITERIA = (
    CriterionEntry("obstacle", 1, "#D55E00"),
    CriterionEntry("shape", 2, "#E69F00"),
    CriterionEntry("depth", 3, "#56B4E9"),
)


@dataclass(frozen=True)
class RegionEntry:
    """A secondary region; the keys of its shape depend on the shape."""

    name: str
    criterion: str  # the name of one
    keep: Literal["in", "out"]
    gain: float
    shape: dict[str, Any]
    velocity: Vector3 = (0.0, 0.0, 0.0)  # m/s, NED
    streamed: bool = False  # moved from outside while the run goes on
    hard: bool = True  # must not be violated, for laws that tell hard regions from soft ones
    deviation: float | tuple[float, float, float] = 0.0  # m, of its place, standard: in any direction, or each of NED
    priority: float = 1.0  # by which its violation counts in the score; no law is given it


@dataclass(frozen=True)
class File:
    """A whole scenario file."""

    vehicle: str
    time: TimeEntry
    initial: Initial
    goal: dict[str, Any] = field(default_factory=dict)  # none only where a log came without one
    title: str = ""
    log: str = ""  # name of the file that the run was imported from
    changed: tuple[str, ...] = ()  # keys, since the title was written
    compare: Literal["", "paper"] = ""
    intersection: tuple[str, ...] = ()
    tell_failures: bool = False
    plant: PlantSetup = PlantSetup()
    law: LawEntry = LawEntry()
    arbiter: ArbiterSetup = ArbiterSetup()
    criteria: tuple[CriterionEntry, ...] = PAPER_CRITERIA
    limit: Limit = Limit()
    actuation: Actuation = Actuation()
    sensing: Sensing = Sensing()
    failures: tuple[Failure, ...] = ()
    outages: tuple[Outage, ...] = ()
    master: MasterSetup = MasterSetup()
    record: RecordSetup = RecordSetup()
    commands: Commands = Commands()
    regions: tuple[RegionEntry, ...] = ()


def is_own(law: str) -> bool:
    """Return whether this is the name of a law of one's own: where it is from, such as ``mine.py:steer``."""
    return ":" in law


# ---- checked -------------------------------------------------------------------------------------------------------


@dataclass(frozen=True)
class Time:
    """Periods; each is a whole multiple of the step."""

    duration: float  # s
    step: float  # s, co-simulation step of the plant
    control: float  # s, period of the law
    arbiter: float  # s, period of the arbiter


class NoGains(NamedTuple):
    """What a scenario can say of the gains of a law of one's own."""


@dataclass(frozen=True)
class LawSetup:
    """Which law, with which gains."""

    name: str  # one of controller.LAWS; with a colon: where a law of one's own is from, such as mine.py:steer
    desired_quaternion: Vector4  # attitude to be kept, from body to world, scalar first
    gains: Any  # of that law's gains_type; none for a law of one's own

    @property
    def own(self) -> bool:
        """Whether it is a law of one's own, which no file can hold."""
        return is_own(self.name)


@dataclass(frozen=True)
class SecondaryRegion:
    """A region and the criterion it belongs to."""

    region: Region
    criterion: str  # the name of one of the scenario's
    streamed: bool = False  # moved from outside while the run goes on
    is_dynamic: bool = False  # stands for an obstacle that may come in while the run goes on
    priority: float = 1.0  # by which its violation counts in the score

    @property
    def moves(self) -> bool:
        """Whether it may be elsewhere than where the scenario has it."""
        return self.streamed or any(self.region.velocity)
