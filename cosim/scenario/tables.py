"""The tables of a scenario's file: each key with its type, range, unit and meaning."""

from __future__ import annotations

import math
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Any, Literal, NamedTuple

import msgspec

from controller import LAWS
from cosim.scenario.fmu_tables import ComponentEntry, FmuTable, UserFmu
from cosim.scenario.region_tables import PAPER_CRITERIA, CriterionEntry, RegionEntry, Vector3, Vector4, Vector6
from plant_fmu.toml_tables import Finite, NonNegative, Positive, Table, Unlimited, hint, key, require

RuleVariant = Literal["ordered", "reversed", "crisp", "none"]
MAX_TEXT = 200  # maximum number of characters of a text
MAX_POINTS = 100_001  # maximum number of samples of the arbiter's output universe
MAX_OBSTACLES = 100  # maximum number of obstacle slots


def require_text(name: str, text: str) -> None:
    """Require one printable line, without control characters for terminals."""
    ok = text.isprintable() and len(text) <= MAX_TEXT
    require(ok, name, repr(text), f"one line of at most {MAX_TEXT} printable characters")


def _require_unit(name: str, quaternion: Vector4) -> None:
    ok = abs(math.hypot(*quaternion) - 1.0) < 1e-6
    require(ok, name, quaternion, "four numbers of length 1")


class PlantSetup(FmuTable, frozen=True):
    """Setup of the plant."""

    fmi: Annotated[Literal[2, 3], key("FMI version of the plant, 2 or 3")] = 3
    current: Annotated[Vector3, key("velocity of the water, north east down", "m/s")] = (0.0, 0.0, 0.0)
    substep: Annotated[Positive, key("maximum integration step", "s")] = 0.005
    parameters: Annotated[
        dict[str, bool | Finite],
        key("parameters of the FMU over those of the vehicle, such as `mass` or `r_G.z`", more="; not for the law"),
    ] = msgspec.field(default_factory=dict)
    initial: Annotated[
        dict[str, str],
        key("part of the start pose or velocity for its parameters and start values", default="those of equal names"),
    ] = msgspec.field(default_factory=dict)

    def __post_init__(self) -> None:
        super().__post_init__()
        for name in ("inputs", "outputs", "initial", "digest"):
            require(bool(self.file or not getattr(self, name)), name, repr(getattr(self, name)), "none without file")


class Initial(Table, frozen=True):
    """State of the vehicle at time 0."""

    position: Annotated[Vector3, key("position at time 0, north east down", "m")]
    quaternion: Annotated[Vector4, key("attitude at time 0, body to world, scalar first")] = (1.0, 0.0, 0.0, 0.0)
    velocity: Annotated[Vector6, key("velocity at time 0, body frame", "m/s, rad/s")] = (0.0, 0.0, 0.0, 0.0, 0.0, 0.0)

    def __post_init__(self) -> None:
        _require_unit("quaternion", self.quaternion)


class ArbiterSetup(Table, frozen=True):
    """Setup of the arbiter, which computes weights from memberships or other signals."""

    engine: Annotated[
        Literal["closed", "exact", "grid", "skfuzzy"],
        key("`closed`, `exact`, `grid` or `skfuzzy`", more="; see [arbiter.md](arbiter.md#engines)"),
    ] = "closed"
    ramp: Annotated[
        NonNegative, key("width over which a membership falls outside its region; rad for regions of attitude", "m")
    ] = 0.2
    points: Annotated[int, key("samples of the output universe, for `grid` and `skfuzzy`", ge=3, le=MAX_POINTS)] = 101
    rules: Annotated[
        RuleVariant,
        key(
            "`ordered`: by the criteria's order; `reversed`, `crisp`, `none`: to compare with",
            more=", see [criteria.md](criteria.md#to-compare-with); not beside a file",
        ),
    ] = "ordered"
    file: Annotated[
        str,
        key(
            "rules of one's own, beside the file that names it",
            more=": any format of [fuzzy_arbiter](arbiter.md#formats), see [criteria.md](criteria.md#your-own-rules)",
        ),
    ] = ""
    text: Annotated[str, key("content of that file", more="; runs write it into their folder")] = ""
    inputs: Annotated[dict[str, Any], key("signal for each input of these rules")] = msgspec.field(default_factory=dict)


class Limit(Table, frozen=True):
    """Limit of the direct body wrench, followed by a lag."""

    force: Annotated[
        Unlimited,
        key(
            "limit on the norm of the direct body force", "N",
            "; direction kept, moment left alone; not with thrusters",
        ),
    ] = math.inf  # fmt: skip
    time_constant: Annotated[NonNegative, key("lag behind that limit", "s")] = 0.0


class Actuation(Table, frozen=True):
    """Path of the law's wrench to the body."""

    through: Annotated[
        Literal["wrench", "thrusters"],
        key(
            "`wrench` on the body, or `thrusters`",
            more=": through the allocation, or set by a law that drives thrusters",
        ),
    ] = "wrench"
    limits: Annotated[
        Literal["direction", "per-thruster"], key("`direction` scales all thrusters together, `per-thruster` cuts each")
    ] = "direction"


class Failure(Table, frozen=True):
    """A thruster that gives less force, or a constant one, from some time on."""

    thruster: Annotated[int, key("number of the thruster, from 1")]
    time: Annotated[NonNegative, key("time of the failure", "s")]
    effectiveness: Annotated[float, key("part of its force that remains, 0 to 1", ge=0.0, le=1.0)] = 0.0
    stuck: Annotated[bool, key("it keeps the force that was commanded last")] = False

    def __post_init__(self) -> None:
        ok = not (self.stuck and self.effectiveness)
        require(ok, "effectiveness", self.effectiveness, "none of a thruster that is stuck")

    @property
    def is_total(self) -> bool:
        """True if it no longer follows its command at all."""
        return self.stuck or self.effectiveness == 0.0


class Outage(Table, frozen=True):
    """A period in which a sensor gives no samples."""

    sensor: Annotated[
        Literal["depth_sensor", "dvl", "imu", "compass", "usbl"],
        key("`depth_sensor`, `dvl`, `imu`, `compass` or `usbl`"),
    ]
    time: Annotated[NonNegative, key("beginning of the outage", "s")]
    duration: Annotated[NonNegative, key("duration of the outage", "s")]


class Sensing(Table, frozen=True):
    """Source of the state for law and arbiter: the plant's state, or a navigation filter with the plant's sensors."""

    # The plant's position and linear velocity may have white noise, drawn anew at each control step; its attitude and
    # body rates are exact.

    through: Annotated[
        Literal["state", "sensors"],
        key(
            "`state`, with noise on position and velocity, or `sensors`",
            more=": what the navigation filter makes of them, see [navigation.md](navigation.md)",
        ),
    ] = "state"
    position_noise: Annotated[NonNegative, key("standard deviation of each measured coordinate", "m")] = 0.0
    velocity_noise: Annotated[
        NonNegative, key("standard deviation of each measured linear velocity, body frame", "m/s")
    ] = 0.0
    seed: Annotated[int, key("seed of the noise", ge=0)] = 0
    dead_from: Annotated[Unlimited, key("time at which measured position and linear velocity are lost", "s")] = math.inf
    dead_for: Annotated[NonNegative, key("duration of that loss", "s")] = 0.0
    frozen: Annotated[bool, key("the last values are held during that loss, instead of NaN")] = False

    def __post_init__(self) -> None:
        for name in ("position_noise", "velocity_noise", "dead_for") if self.through == "sensors" else ():
            expected = "0 with sensing.through = 'sensors': plant.parameters and outages say it"
            require(getattr(self, name) == 0.0, name, getattr(self, name), expected)

    @property
    def exact(self) -> bool:
        """True if law and arbiter receive the true state."""
        noisy = self.position_noise > 0.0 or self.velocity_noise > 0.0 or self.through == "sensors"
        return not noisy and (self.dead_for == 0.0 or self.dead_from == math.inf)


class Commands(Table, frozen=True):
    """Setup of commands to the running vehicle."""

    enabled: Annotated[
        bool,
        key("the running vehicle takes [commands](mavlink.md) from outside", more="; `cosim run --commands` sets it"),
    ] = False
    await_arm: Annotated[bool, key("nothing moves before it is armed", more="; `--await-arm` sets it")] = False
    obstacles: Annotated[
        int, key("maximum number of obstacles that commands add during the run, up to 100", ge=0, le=MAX_OBSTACLES)
    ] = 8
    obstacle_radius: Annotated[Positive, key("radius of an obstacle whose size is not given", "m")] = 0.5
    obstacle_gain: Annotated[NonNegative, key("gain of each obstacle, per unit of g", "N")] = 100.0
    hold_radius: Annotated[Positive, key("radius of the target sphere in modes hold and surface", "m")] = 0.3
    surface_depth: Annotated[
        float, key("depth of that sphere's center in mode surface", "m", ge=0.0, le=1e3)
    ] = 0.5  # fmt: skip
    pilot_gain: Annotated[
        float, key("fraction of the maximum wrench along an axis that a full stick commands", ge=0.0, le=1.0)
    ] = 0.5


class MasterSetup(Table, frozen=True):
    """Order in which a step calls its parts."""

    order: Annotated[
        Literal["gauss-seidel", "jacobi"],
        key(
            "`gauss-seidel`, or `jacobi`: each part uses the outputs of the step before",
            more=", see [The order of a step](#the-order-of-a-step)",
        ),
    ] = "gauss-seidel"


class RecordSetup(Table, frozen=True):
    """Optional signals of the record."""

    lyapunov: Annotated[
        bool,
        key(
            "record V of (31) and its rate, with the paper's law",
            more=", in three forms; see [theory.md](theory.md#where-the-theory-holds)",
        ),
    ] = False


class Time(Table, frozen=True):
    """Periods; each is a whole multiple of the step."""

    duration: Annotated[Positive, key("duration of the run", "s")]
    step: Annotated[Positive, key("co-simulation step; the other periods are whole multiples", "s")] = 0.001
    control: Annotated[Positive, key("period of the law", "s", default="the step")] = 0.0
    arbiter: Annotated[Positive, key("period of the arbiter", "s", default="the step")] = 0.0

    def __post_init__(self) -> None:
        for name in ("control", "arbiter"):
            msgspec.structs.force_setattr(self, name, getattr(self, name) or self.step)


class NoGains(NamedTuple):
    """Gains of a custom law in a scenario: none."""


@dataclass(frozen=True)
class LawSetup:
    """Name, desired attitude and gains of the law."""

    name: str  # one of controller.LAWS; with a colon: source of a custom law, such as mine.py:steer
    desired_quaternion: Vector4  # attitude to be kept, body to world, scalar first
    gains: Any  # gains of that law's gains_type; `NoGains` for a custom law
    fmu: UserFmu | None = None

    @property
    def is_custom(self) -> bool:
        """True if it is none of `controller.LAWS`: an FMU, or a law of Python, whose code is not in the file."""
        return isinstance(self.gains, NoGains)


class LawEntry(FmuTable, frozen=True):
    """Name and gains of the law; gains that are not given are the law's own."""

    name: Annotated[
        str,
        key(
            "one of `controller.LAWS`",
            more="; naming another one than the base drops the base's gains. In the folder of a run that "
            "[a law of one's own](howto/own-law.md) flew: where that is from, such as `mine.py:steer`",
        ),
    ] = "ismail_dunnigan"
    desired_quaternion: Annotated[
        Vector4, key("attitude to be kept, body to world, scalar first")
    ] = (1.0, 0.0, 0.0, 0.0)  # fmt: skip
    gains: Annotated[
        dict[str, float],
        key(
            "gains of that law",
            more="; the paper's law, section VII: `k_p1 k_p2 k_q k_v1 k_v2 sigma_p sigma_a gamma`",
            default="the law's own",
        ),
    ] = msgspec.field(default_factory=dict)
    parameters: Annotated[dict[str, float | bool | str], key("values of its parameters", default="its own")] = (
        msgspec.field(default_factory=dict)
    )

    def __post_init__(self) -> None:
        super().__post_init__()
        _require_unit("desired_quaternion", self.desired_quaternion)
        if self.file:
            file = Path(self.file)
            require(self.name in ("ismail_dunnigan", file.name), "name", repr(self.name), "none beside file")
            msgspec.structs.force_setattr(self, "name", file.name)
        for field in ("inputs", "outputs", "parameters", "digest"):
            require(
                bool(self.file or not getattr(self, field)), field, repr(getattr(self, field)), "none without law.file"
            )
        require_text("name", self.name)
        if self.is_custom:
            if self.gains:
                of = "an FMU as the law" if self.file else "a law in Python"
                raise ValueError(f"gains has {next(iter(self.gains))!r}, expected no gains with {of}")
            return
        if self.name not in LAWS:
            new = "'ismail_dunnigan': the paper's law has its authors' names now" if self.name == "printed" else ""
            require(False, "name", repr(self.name), new or f"one of {', '.join(map(repr, sorted(LAWS)))}")
        known = LAWS[self.name].gains_type._fields
        for name in self.gains:
            if name not in known:
                raise ValueError(f"gains.{name}: unknown key; {hint(name, known)}")

    @property
    def setup(self) -> LawSetup:
        """The law with all of its gains."""
        gains = NoGains() if self.is_custom else LAWS[self.name].gains_type(**self.gains)
        fmu = self.fmu("law", self.parameters) if self.file else None
        return LawSetup(self.name, self.desired_quaternion, gains, fmu)

    @property
    def is_custom(self) -> bool:
        """True if it is an FMU, or if the name is the source of a custom law, such as ``mine.py:steer``."""
        return bool(self.file) or ":" in self.name


class File(Table, frozen=True):
    """A whole scenario file."""

    vehicle: Annotated[
        str, key("a shipped vehicle, or a TOML file beside the file that names it", more=" (with `--set`: here)")
    ]
    time: Time
    initial: Initial
    goal: Annotated[dict[str, Any], key("a shape in space: the primary region", more=", see below")] = msgspec.field(
        default_factory=dict
    )
    title: Annotated[str, key("one line for the report, at most 200 characters", default="the name")] = ""
    log: Annotated[
        str,
        key(
            "name of the log that a run was imported from",
            more="; `cosim import` writes it into the run folder, and no scenario with it can be run",
            default="none",
        ),
    ] = ""
    changed: Annotated[
        tuple[str, ...],
        key(
            "keys that were changed since the title was written",
            more=", see [below](#titles); runs write it into their folder",
            default="none",
        ),
    ] = ()
    compare: Annotated[Literal["", "paper"], key('`"paper"` puts the paper\'s claims beside the run')] = ""
    intersection: Annotated[
        tuple[str, ...], key("names of the regions, to be kept out of, whose overlap is reported", default="all")
    ] = ()
    report_failures: Annotated[bool, key("law and allocation are informed when a thruster fails")] = False
    plant: PlantSetup = PlantSetup()
    law: LawEntry = LawEntry()
    arbiter: ArbiterSetup = ArbiterSetup()
    criteria: Annotated[
        tuple[CriterionEntry, ...],
        key(
            "reasons for which regions ask for attention",
            more=", see [criteria.md](criteria.md)",
            default="the paper's three",
        ),
    ] = PAPER_CRITERIA
    limit: Limit = Limit()
    actuation: Actuation = Actuation()
    sensing: Sensing = Sensing()
    failures: Annotated[
        tuple[Failure, ...], key("thrusters that fail; only where `thrusters` carry the wrench", default="none")
    ] = ()
    outages: Annotated[
        tuple[Outage, ...],
        key("times in which a sensor gives no samples; where sensing is through `sensors`", default="none"),
    ] = ()
    components: Annotated[
        tuple[ComponentEntry, ...], key("FMUs [beside the plant](howto/your-fmu.md#4-beside-the-plant)", default="none")
    ] = ()
    master: MasterSetup = MasterSetup()
    record: RecordSetup = RecordSetup()
    commands: Commands = Commands()
    regions: Annotated[tuple[RegionEntry, ...], key("secondary regions", default="none")] = ()

    def __post_init__(self) -> None:
        for name in ("title", "log"):
            require_text(name, getattr(self, name))
        for changed in self.changed:
            require_text("changed", changed)
