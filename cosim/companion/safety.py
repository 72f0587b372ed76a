"""States of the companion and conditions that end steering: one table for code, tests and documentation."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal, NamedTuple, get_args

State = Literal["waiting", "aligning", "disarmed", "engaging", "dry_run", "steering", "held", "pilot", "diving"]

STATES: tuple[State, ...] = get_args(State)  # a state's index is its number in the record


@dataclass(frozen=True)
class Condition:
    """A reason to end steering."""

    name: str  # name in statuses, texts and `Observation.values`
    limit: float  # limit above which the observed value ends steering [unit]; 0 for conditions that are true or false
    unit: str  # unit of the limit
    words: str  # description of the observed value
    next_state: State  # state after the condition has ended steering


GAIN_TOLERANCE = 0.01  # of the pilot gain

CONDITIONS: tuple[Condition, ...] = (
    Condition(
        "pilot's sticks",
        0.0,
        "",
        "deflected sticks that are not ours are heard, or shown by an ArduSub's RC_CHANNELS",
        "pilot",
    ),
    Condition("takeover", 0.0, "", "the user holds, by terminal, page or DO_PAUSE_CONTINUE", "held"),
    Condition("disarmed", 0.0, "", "the vehicle is disarmed", "pilot"),
    Condition("mode taken", 0.0, "", "the autopilot has left the steering mode", "pilot"),
    Condition("refused mode", 0.8, "s", "since the mode was requested, without success", "held"),
    Condition("pilot gain", GAIN_TOLERANCE, "", "the autopilot's pilot gain differs from the user's", "held"),
    Condition("unfinished dive", 20.0, "s", "since the dive began, without its end", "held"),
    Condition("lost link", 0.4, "s", "since the last message from the autopilot", "held"),
    Condition("stale estimate", 0.5, "s", "age of the older of position and attitude", "held"),
    Condition("late loop", 0.3, "s", "delay of the start of a step", "held"),
    Condition("autopilot failsafe", 0.0, "", "the heartbeat says CRITICAL or EMERGENCY", "held"),
    Condition("frame jump", 0.5, "m", "leap of the position that the velocity does not explain", "held"),
    Condition("heading leap", 0.05, "rad", "leap of the heading that the rates do not explain", "held"),
    Condition("frame drift", 0.5, "m", "difference between the local position and global position or pressure", "held"),
    Condition("geofence", 0.1, "m", "depth of the violation of a hard region", "held"),
    Condition("battery", 0.0, "", "the remaining charge is below the user's limit", "held"),
    Condition("leak", 0.0, "", "the autopilot has reported a leak", "held"),
    Condition(
        "unexpected range",
        1.0,
        "s",
        "since a distance sensor shows something over 0.5 m nearer than the scene's hard regions",
        "held",
    ),
)


class Observation(NamedTuple):
    """Inputs of the supervisor's decision at one step."""

    now: float  # s, our time
    has_state: bool  # True if position and attitude are known, and the wait for failsafe parameters is over
    is_aligned: bool  # True if the offset of the autopilot's frame in the scene is known
    is_armed: bool
    is_in_mode: bool  # True if the autopilot is in the mode for the dive, or without a dive for steering
    values: dict[str, float]  # observed values by condition name; one above its limit ends steering
    needs_dive: bool = False  # True while the dive before steering is not finished


class Supervisor:
    """Decides the companion's state at each step."""

    def __init__(self, dry_run: bool = False) -> None:
        self.state: State = "waiting"
        self.reason = ""
        self._dry_run = dry_run
        self._requested_at: float | None = None  # s, our time of the first request of the mode

    @property
    def is_steering(self) -> bool:
        """True while the law steers."""
        return self.state in ("steering", "dry_run")

    def record_mode_request(self, now: float) -> None:
        """Store the time `now` [s] of the first request of the mode."""
        if self._requested_at is None:
            self._requested_at = now

    def mode_wait_time(self, now: float) -> float:
        """Return the time since the first request of a mode that is not on yet [s]; 0 without a request."""
        return 0.0 if self._requested_at is None else now - self._requested_at

    def resume(self) -> None:
        """Start again from ``waiting``, after ``held`` or ``pilot``."""
        # A condition that still applies ends steering again.
        if self.state in ("held", "pilot"):
            self.state, self.reason, self._requested_at = "waiting", "", None

    def update(self, observation: Observation) -> State:
        """Return the state of the coming step."""
        if self.state in ("diving", "engaging", "steering", "dry_run"):
            self._check_conditions(observation)
        if self.state in ("held", "pilot"):
            return self.state
        if self.state not in ("steering", "dry_run"):
            self.state = self._next_state(observation)
        return self.state

    def _check_conditions(self, observation: Observation) -> None:
        for condition in CONDITIONS:
            if observation.values.get(condition.name, 0.0) > condition.limit:
                self.state, self.reason = condition.next_state, condition.name
                return

    def _next_state(self, observation: Observation) -> State:
        if not observation.has_state:
            return "waiting"
        if not observation.is_aligned:
            return "aligning"
        if self._dry_run:
            return "dry_run"
        if not observation.is_armed:
            return "disarmed"
        if observation.needs_dive:
            self._requested_at = None if observation.is_in_mode else self._requested_at
            return "diving"
        if self.state == "diving":
            self._requested_at = None
            return "engaging"
        if not observation.is_in_mode:
            return "engaging"
        self._requested_at = None
        return "steering"
