"""The tables of a scenario: as in its file, and checked."""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from typing import Any, Literal, NamedTuple

from controller.regions import Region

Vector3 = tuple[float, float, float]
Vector4 = tuple[float, float, float, float]
Vector6 = tuple[float, float, float, float, float, float]

PARKED_POSITION: Vector3 = (0.0, 0.0, -1e5)  # m, NED: position of free obstacle slots


# ---- the same in the file and checked ------------------------------------------------------------------------------


@dataclass(frozen=True)
class PlantSetup:
    """Setup of the plant."""

    fmi: Literal[2, 3] = 3
    current: Vector3 = (0.0, 0.0, 0.0)  # m/s, velocity of the water, world frame
    substep: float = 0.005  # s, greatest integration step
    parameters: dict[str, float | bool] = field(default_factory=dict)  # FMU parameters that override the vehicle's


@dataclass(frozen=True)
class Initial:
    """State of the vehicle at time 0."""

    position: Vector3  # m, NED
    quaternion: Vector4 = (1.0, 0.0, 0.0, 0.0)  # unit quaternion from body to world, scalar first
    velocity: Vector6 = (0.0, 0.0, 0.0, 0.0, 0.0, 0.0)  # m/s, rad/s, body frame


@dataclass(frozen=True)
class ArbiterSetup:
    """Setup of the arbiter, which computes weights from memberships or other signals."""

    engine: Literal["closed", "exact", "grid", "skfuzzy"] = "closed"
    ramp: float = 0.2  # m (rad for regions of attitude), width over which a membership falls from 1 to 0 outside
    points: int = 101  # samples of the output universe, for grid and skfuzzy
    rules: Literal["ordered", "reversed", "crisp", "none"] = "ordered"  # rule variant without a file
    file: str = ""  # rule file in a format of fuzzy_arbiter; empty: rules by the order of the criteria
    text: str = ""  # content of the file
    inputs: dict[str, Any] = field(default_factory=dict)  # signal, number or course of each input of the file's rules


@dataclass(frozen=True)
class Limit:
    """Limit of the direct body wrench, followed by a lag."""

    force: float = math.inf  # N, on the norm of the body force; its direction is kept, the moment left alone
    time_constant: float = 0.0  # s, time constant of the lag


@dataclass(frozen=True)
class Actuation:
    """Path of the law's wrench to the body."""

    through: Literal["wrench", "thrusters"] = "wrench"
    limits: Literal["direction", "per-thruster"] = "direction"  # scale all thruster forces alike, or cut each


@dataclass(frozen=True)
class Failure:
    """A thruster that gives less force, or a constant one, from some time on."""

    thruster: int  # number of the thruster, from 1
    time: float  # s, time of the failure
    effectiveness: float = 0.0  # remaining fraction of its force
    stuck: bool = False  # True: it keeps the force that was commanded last

    @property
    def is_total(self) -> bool:
        """True if it no longer follows its command at all."""
        return self.stuck or self.effectiveness == 0.0


@dataclass(frozen=True)
class Outage:
    """A period in which a sensor gives no samples."""

    sensor: Literal["depth_sensor", "dvl", "imu", "compass", "usbl"]
    time: float  # s, beginning of the outage
    duration: float  # s


@dataclass(frozen=True)
class Sensing:
    """Source of the state for law and arbiter: the plant's state, or a navigation filter with the plant's sensors."""

    # The plant's position and linear velocity may have noise; its attitude and body rates are exact.

    through: Literal["state", "sensors"] = "state"
    position_noise: float = 0.0  # m, standard deviation of each coordinate, white, drawn anew at each control step
    velocity_noise: float = 0.0  # m/s, standard deviation of each linear velocity, likewise
    seed: int = 0  # seed of the noise
    dead_from: float = math.inf  # s, time at which both are lost
    dead_for: float = 0.0  # s, duration of the loss
    frozen: bool = False  # True: the last values are held meanwhile; False: they are NaN

    @property
    def exact(self) -> bool:
        """True if law and arbiter receive the true state."""
        noisy = self.position_noise > 0.0 or self.velocity_noise > 0.0 or self.through == "sensors"
        return not noisy and (self.dead_for == 0.0 or self.dead_from == math.inf)


@dataclass(frozen=True)
class Commands:
    """Setup of commands to the running vehicle."""

    enabled: bool = False
    await_arm: bool = False  # True: the run starts once the vehicle is armed
    obstacles: int = 8  # number of obstacle slots
    obstacle_radius: float = 0.5  # m, radius of obstacles without a given size
    obstacle_gain: float = 100.0  # N per unit of g, gain of each obstacle
    hold_radius: float = 0.3  # m, radius of the target sphere in modes hold and surface
    surface_depth: float = 0.5  # m, depth of that sphere's centre in mode surface
    pilot_gain: float = 0.5  # fraction of the greatest wrench at full stick


@dataclass(frozen=True)
class MasterSetup:
    """Order in which a step calls its parts."""

    # gauss-seidel: each part uses outputs of this step; jacobi: all parts use outputs of the step before
    order: Literal["gauss-seidel", "jacobi"] = "gauss-seidel"


@dataclass(frozen=True)
class RecordSetup:
    """Optional signals of the record."""

    lyapunov: bool = False  # V of (31) and its rate, with the paper's law


# ---- as in the file ------------------------------------------------------------------------------------------------


@dataclass(frozen=True)
class TimeEntry:
    """Periods; defaults depend on the step."""

    duration: float  # s
    step: float = 0.001  # s
    control: float | None = None  # s, default: the step
    arbiter: float | None = None  # s, default: the step


@dataclass(frozen=True)
class LawEntry:
    """Name and gains of the law, not checked yet."""

    name: str = "ismail_dunnigan"
    desired_quaternion: Vector4 = (1.0, 0.0, 0.0, 0.0)
    gains: dict[str, float] = field(default_factory=dict)


@dataclass(frozen=True)
class CriterionEntry:
    """A criterion for which regions are weighed."""

    name: str
    order: int | None = None  # rank, the least of which comes first; default: its index in the list, from 1
    colour: str = ""  # #RRGGBB; default: an unused one
    membership: dict[str, Any] = field(default_factory=dict)  # terms by quantity; default: the arbiter's ramp


# section VI of the paper; the colours are Okabe and Ito's, which are safe for colour blindness
PAPER_CRITERIA = (
    CriterionEntry("obstacle", 1, "#D55E00"),
    CriterionEntry("shape", 2, "#E69F00"),
    CriterionEntry("depth", 3, "#56B4E9"),
)


@dataclass(frozen=True)
class RegionEntry:
    """A secondary region; the keys of its shape depend on the shape."""

    name: str
    criterion: str  # name of a criterion
    keep: Literal["in", "out"]
    gain: float
    shape: dict[str, Any]
    velocity: Vector3 = (0.0, 0.0, 0.0)  # m/s, NED
    streamed: bool = False  # True: moved from outside during the run
    hard: bool = True  # True: must not be violated, for laws that distinguish hard and soft regions
    deviation: float | tuple[float, float, float] = 0.0  # m, standard deviation of its position: one number, or NED
    priority: float = 1.0  # factor of its violation in the score; laws do not receive it


@dataclass(frozen=True)
class File:
    """A whole scenario file."""

    vehicle: str
    time: TimeEntry
    initial: Initial
    goal: dict[str, Any] = field(default_factory=dict)  # empty only for an imported log without a goal
    title: str = ""
    log: str = ""  # name of the file that the run was imported from
    changed: tuple[str, ...] = ()  # keys that were changed since the title was written
    compare: Literal["", "paper"] = ""
    intersection: tuple[str, ...] = ()
    report_failures: bool = False
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


def is_custom_law(law: str) -> bool:
    """Return True if a law's name is the source of a custom law, such as ``mine.py:steer``."""
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
    """Gains of a custom law in a scenario: none."""


@dataclass(frozen=True)
class LawSetup:
    """Name, desired attitude and gains of the law."""

    name: str  # one of controller.LAWS; with a colon: source of a custom law, such as mine.py:steer
    desired_quaternion: Vector4  # attitude to be kept, from body to world, scalar first
    gains: Any  # gains of that law's gains_type; `NoGains` for a custom law

    @property
    def own(self) -> bool:
        """True if it is a custom law, whose code is not in the file."""
        return is_custom_law(self.name)


@dataclass(frozen=True)
class SecondaryRegion:
    """A region and its criterion."""

    region: Region
    criterion: str  # name of a criterion of the scenario
    streamed: bool = False  # True: moved from outside during the run
    is_dynamic: bool = False  # slot for an obstacle that commands may add during the run
    priority: float = 1.0  # factor of its violation in the score

    @property
    def moves(self) -> bool:
        """True if it may move away from its position in the scenario."""
        return self.streamed or any(self.region.velocity)
