"""States of the companion and conditions that end steering: one table for code, tests and documentation."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal, NamedTuple, get_args

State = Literal["waiting", "aligning", "disarmed", "engaging", "dry_run", "steering", "held", "pilot", "diving"]

STATES: tuple[State, ...] = get_args(State)  # a state's index is its number in the record

MEANINGS: dict[State, str] = {
    "waiting": "no vehicle, or no position, attitude or failsafe parameters of it yet; nothing is sent but requests",
    "aligning": "the autopilot's frame is not known in the scene yet; nothing is sent but requests",
    "disarmed": "all is known; arming is awaited, or asked for where the user said so",
    "engaging": "armed; the mode that is steered in is asked for",
    "dry_run": "the law is computed and recorded, and nothing is sent",
    "steering": "sticks or velocities are sent at each step",
    "held": "sticks are released and the hold mode is asked for, until somebody resumes",
    "pilot": "somebody else steers; sticks are released once, and nothing is sent until somebody resumes",
    "diving": "an ArduSub was armed, and dives level until its heading is aligned; the mode for that is asked for",
}


@dataclass(frozen=True)
class Condition:
    """A reason to end steering.

    Attributes
    ----------
    name : str
        Name in statuses, texts and `Observation.values`.
    limit : float
        Limit above which the observed value ends steering [unit]; 0 for conditions that are true or false.
    unit : str
        Unit of the limit.
    words : str
        Description of the observed value.
    then : State
        State after the condition has ended steering.
    """

    name: str
    limit: float
    unit: str
    words: str
    then: State


GAIN_OFF = 0.01  # tolerance of the pilot gain

CONDITIONS: tuple[Condition, ...] = (
    Condition("pilot's sticks", 0.0, "", "somebody else sends sticks that are deflected", "pilot"),
    Condition("takeover", 0.0, "", "DO_PAUSE_CONTINUE with 0 came for the companion", "held"),
    Condition("disarmed", 0.0, "", "the vehicle is disarmed", "pilot"),
    Condition("mode taken", 0.0, "", "the mode that is steered in was on, and is not any more", "pilot"),
    Condition("refused mode", 0.8, "s", "since the mode was asked for, without it", "held"),
    Condition("pilot gain", GAIN_OFF, "", "the autopilot's pilot gain differs from the user's", "held"),
    Condition("unfinished dive", 20.0, "s", "since the dive began, without its end", "held"),
    Condition("lost link", 0.4, "s", "since anything came from the autopilot", "held"),
    Condition("stale estimate", 0.5, "s", "age of the older one of position and attitude", "held"),
    Condition("late loop", 0.3, "s", "by which a step begins too late", "held"),
    Condition("autopilot failsafe", 0.0, "", "the heartbeat says CRITICAL or EMERGENCY", "held"),
    Condition("frame jump", 0.5, "m", "leap of the position that the velocity does not explain", "held"),
    Condition("heading leap", 0.05, "rad", "leap of the heading that the rates do not explain", "held"),
    Condition("frame drift", 0.5, "m", "by which local position and globe or pressure have come apart", "held"),
    Condition(
        "geofence", 0.1, "m", "inside a hard region that is to be kept out of, or outside one to stay in", "held"
    ),
    Condition("battery", 0.0, "", "the battery has less left than the user's limit", "held"),
    Condition("leak", 0.0, "", "the autopilot has reported a leak", "held"),
)


class Observation(NamedTuple):
    """Inputs of the supervisor's decision at one step."""

    now: float  # s, our time
    has_state: bool  # True if position and attitude are known, and the wait for failsafe parameters is over
    frame_known: bool  # True if the offset of the autopilot's frame in the scene is known
    is_armed: bool
    in_mode: bool  # True if the autopilot is in the mode for the dive, or without a dive for steering
    values: dict[str, float]  # observed values by condition name; one above its limit ends steering
    has_to_dive: bool = False  # True while the dive before steering is not finished


class Supervisor:
    """Decides the companion's state at each step.

    Parameters
    ----------
    dry_run : bool
        True to compute the law without steering.

    Attributes
    ----------
    state : State
        Present state.
    reason : str
        Name of the condition that ended steering last; empty if none did.
    """

    def __init__(self, dry_run: bool = False) -> None:
        self.state: State = "waiting"
        self.reason = ""
        self._dry_run = dry_run
        self._asked_at: float | None = None  # s, our time of the first request of the mode

    @property
    def is_steering(self) -> bool:
        """True while the law steers."""
        return self.state in ("steering", "dry_run")

    def asked_for_mode(self, now: float) -> None:
        """Store the time `now` [s] of the first request of the mode."""
        if self._asked_at is None:
            self._asked_at = now

    def waited_for_mode(self, now: float) -> float:
        """Return the time since the first request of a mode that is not on yet [s]; 0 without a request."""
        return 0.0 if self._asked_at is None else now - self._asked_at

    def resume(self) -> None:
        """Start again from ``waiting``, after ``held`` or ``pilot``.

        A condition that still applies ends steering again.
        """
        if self.state in ("held", "pilot"):
            self.state, self.reason, self._asked_at = "waiting", "", None

    def update(self, seen: Observation) -> State:
        """Return the state of the coming step.

        Parameters
        ----------
        seen : Observation
            Observation at the beginning of the step.
        """
        if self.state in ("diving", "engaging", "steering", "dry_run"):
            self._judge(seen)
        if self.state in ("held", "pilot"):
            return self.state
        if self.state not in ("steering", "dry_run"):
            self.state = self._progress(seen)
        return self.state

    def _judge(self, seen: Observation) -> None:
        for condition in CONDITIONS:
            if seen.values.get(condition.name, 0.0) > condition.limit:
                self.state, self.reason = condition.then, condition.name
                return

    def _progress(self, seen: Observation) -> State:
        if not seen.has_state:
            return "waiting"
        if not seen.frame_known:
            return "aligning"
        if self._dry_run:
            return "dry_run"
        if not seen.is_armed:
            return "disarmed"
        if seen.has_to_dive:
            self._asked_at = None if seen.in_mode else self._asked_at
            return "diving"
        if self.state == "diving":
            self._asked_at = None
            return "engaging"
        if not seen.in_mode:
            return "engaging"
        self._asked_at = None
        return "steering"
