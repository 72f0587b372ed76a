"""A scenario flown on a real vehicle: from the first heartbeat to the run's folder."""

from __future__ import annotations

import contextlib
import gc
import math
import time
from collections.abc import Callable, Iterator, Sequence
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from controller.laws.deployable.gains import SPREADS
from cosim.companion.autopilot_link import AutopilotLink
from cosim.companion.companion_options import CompanionOptions, SteerBy
from cosim.companion.placement import MAX_DISTANCE, Placement, format_distance
from cosim.companion.remote_vehicle import RemoteVehicle
from cosim.companion.safety import State
from cosim.companion.session import AutopilotSession
from cosim.companion.set_points import MAX_LAW_SPEED
from cosim.companion.warm_up import warm_up
from cosim.errors import RunError
from cosim.mavlink.vehicle.speed import drag_limited_speed
from cosim.mavlink.wire.options import ProfileName
from cosim.results.recorder import Recorder
from cosim.results.run_result import Run
from cosim.results.wording import DRY_RUN, verdict
from cosim.run.run_folder import claim, conclude
from cosim.scenario.law_factory import require_no_fmus
from cosim.scenario.scenario import Scenario
from cosim.simulation.commands.command_handler import greatest_wrench
from cosim.simulation.master import Master, Observer
from cosim.simulation.signals import Array
from plant_fmu import Vehicle

if TYPE_CHECKING:  # websockets wait until a flight is shown
    from cosim.live.live_view import LiveView

_RELEASE_TIME = 2.0  # s, maximum time to release the sticks and change to the hold mode at the end
_DRIFT_NOISE = 0.1  # m, drift between two position sources that still counts as noise
_RESERVE = 0.3  # fraction of the thrusters' force that stays free for the autopilot's moments
_MIN_UNCERTAINTY = 0.05  # m, position error of an autopilot that no measurement reveals


# Errors of an autopilot's estimate are slow: its velocity may be off by some cm/s for a minute, its position has no
# white noise. With a smaller velocity noise, the law's position would shift by (velocity error) / (rate of its filter).
# Innovations stay biased, so they are no reason to let disturbances drift.
# Current and drag are then poorly distinguished: an integral supplies the force that is missing to stay in the goal.
_NOISE_GAINS = {
    "law.gains.position_noise": 0.01,
    "law.gains.velocity_noise": 0.05,
    "law.gains.max_drift": 1.0,
    "law.gains.integral": 0.2,
}
# the autopilot allocates the forces: a thruster's force is not the one that the law commanded
_WITHOUT_ISOLATION = {"law.gains.failure_threshold": 0.0}
# the autopilot's attitude loop makes the moments: a law that estimates restoring moments, or the effectiveness of each
# thruster, from the effect of its own moments would estimate the stiffness of that loop, and work against it
_WITHOUT_MOMENTS = _WITHOUT_ISOLATION | {
    "law.gains.adaptation": 0.0,
    "law.gains.moment_bound": 1e-3,
    "law.gains.effectiveness_estimation": 0.0,
}
# the depth loop compensates the weight
_WITHOUT_WEIGHT = {"law.gains.restoring_drift": 0.0, "law.gains.restoring_bound": 1e-3}
# the velocity loop compensates weight, moments, current, drag and lag: estimates of them by the law would be wrong
_WITHOUT_ESTIMATES = _WITHOUT_WEIGHT | {
    "law.gains.lag_bound": 0.0,
    "law.gains.current_bound": 1e-3,
    "law.gains.drag_estimation": 0.0,
}


def scenario_to_steer(scenario: Scenario, steer_by: SteerBy = "sticks", profile: ProfileName = "ardusub") -> Scenario:
    """Return a scenario as the companion flies it: a step is a control period, and the autopilot reports the state."""
    require_no_fmus(scenario, "a real vehicle")
    refused = {
        "failures": scenario.failures,
        "record.lyapunov": scenario.record.lyapunov,
        "goal.then": scenario.goal_then,
    }
    for key, value in refused.items():
        if value:
            raise RunError(f"{scenario.name}: {key} is set, expected none with a real vehicle")
    period = scenario.time.control
    arbiter = max(1, round(scenario.time.arbiter / period)) * period
    duration = max(1, round(scenario.time.duration / period)) * period
    gains: dict[str, float] = _WITHOUT_ISOLATION
    if steer_by != "wrench":
        fastest = MAX_LAW_SPEED if steer_by == "velocity" else _speed_with_reserve(scenario.vehicle)
        gains = _WITHOUT_MOMENTS | {"law.gains.speed": min(getattr(scenario.law.gains, "speed", fastest), fastest)}
    if steer_by == "attitude" and profile == "ardusub":
        gains |= _WITHOUT_WEIGHT
    if steer_by == "velocity":
        gains |= _WITHOUT_ESTIMATES
    return scenario.replace(
        (_NOISE_GAINS | gains if scenario.law.name == "deployable" else {})
        | {
            "time.step": period,
            "time.arbiter": arbiter,
            "time.duration": duration,
            "sensing.through": "state",
            "sensing.position_noise": 0.0,
            "sensing.velocity_noise": 0.0,
            "sensing.dead_for": 0.0,
            "commands.enabled": True,
            "commands.await_arm": True,
            "commands.obstacles": 0,
        }
    )


@contextlib.contextmanager
def _frozen_objects() -> Iterator[None]:
    """Exclude present objects from garbage collection: a full one takes 30 ms, and more on a vehicle's computer."""
    gc.collect()
    gc.freeze()
    try:
        yield
    finally:
        gc.unfreeze()


def _speed_with_reserve(vehicle: Vehicle) -> float:
    """Return the forward speed [m/s] whose drag takes 70 % of the thrusters' force; the rest is for moments."""
    return drag_limited_speed(vehicle, 0, (1.0 - _RESERVE) * float(greatest_wrench(vehicle)[0]))


class Companion:
    """Steers a vehicle through its autopilot by a scenario's regions, arbiter and law.

    Parameters
    ----------
    scenario : Scenario
        Scenario to fly, as written for simulation.
    link : AutopilotLink
        Link to the autopilot; the caller closes it.
    options : CompanionOptions
        Outputs, alignment and limits of the flight.

    Attributes
    ----------
    scenario : Scenario
        Scenario as it is flown, converted by `scenario_to_steer`.
    session : AutopilotSession
        Message exchange with the autopilot.
    placement : str
        Position in the scene, with the distances to goal and nearest hard region; empty until the frame is known.

    Raises
    ------
    RunError, ScenarioError
        If `scenario_to_steer` or `AutopilotSession` raises it.

    Examples
    --------
    >>> import cosim
    >>> with cosim.NetworkLink(cosim.parse_endpoint("udpout:127.0.0.1:14599")) as link:
    ...     companion = cosim.Companion(cosim.load_scenario("pipe-inspection"), link, cosim.CompanionOptions())
    >>> companion.scenario.time.step, companion.session.supervisor.state
    (0.02, 'waiting')
    """

    def __init__(self, scenario: Scenario, link: AutopilotLink, options: CompanionOptions) -> None:
        self.scenario = scenario_to_steer(scenario, options.steer_by, options.profile)
        self._options = options
        self.session = AutopilotSession(link, self.scenario.vehicle, options)
        self._reported = ("", "")
        self.placement = ""
        self._placed_by: tuple[Array | None, bool, frozenset[int]] = (None, False, frozenset())
        self._scene = Placement(self.scenario)
        self._ranged, self._nearer_since = 0, math.inf  # processed DISTANCE_SENSOR messages; our time [s]
        self.session.dive.clearance = self._clearance

    def run(
        self,
        out: str | Path | None = None,
        report: bool = True,
        on_state: Callable[[State, str], None] | None = None,
        live: LiveView | None = None,
    ) -> Run:
        """Wait until the vehicle can be steered, steer it for the scenario's duration, and release it.

        Parameters
        ----------
        out : str or Path, optional
            The run folder, as for `run_scenario`.
        report : bool
            True to write report and figures too.
        on_state : callable, optional
            Function of the state and the text of the conditions it waits for; called when either changes.
        live : LiveView, optional
            View that shows the flight, from before steering begins; its buttons hold and resume.

        Returns
        -------
        Run
            Recorded run; its status is ``completed``, ``dry run``, ``interrupted``, or the final state with its reason.

        Raises
        ------
        RunError
            If steering cannot begin in time, the autopilot would ignore the sticks, or the folder cannot be written.
        BuildError, LawError, DefinitionError
            If law or arbiter cannot be set up.
        KeyboardInterrupt
            If Ctrl-C came before steering began.
        """
        warm_up(self.scenario, self._options)

        def show_state(state: State, missing: str) -> None:
            if on_state is not None:
                on_state(state, missing)
            if live is not None:
                if self.placement and state in ("aligning", "dry_run"):
                    live.say(self.placement)
                live.say(state.replace("_", " ") + ("" if missing == "nothing" else f", waits for {missing}"))

        with Master(self.scenario, plant=RemoteVehicle(self.scenario, self.session)) as master, _frozen_objects():
            if live is not None:
                live.begin(self.scenario, master.signals.columns, self.session.commands)
            self.prepare(show_state)
            folder, recorder = claim(None if out is None else Path(out), self.scenario), None
            with folder.writing():
                started = time.perf_counter()
                try:
                    recorder = Recorder(folder.path, master.signals.columns)
                    status = self._steer(master, [recorder] if live is None else [recorder, live], show_state)
                finally:
                    self.session.release(_RELEASE_TIME)
                    wall_time = time.perf_counter() - started
                    has_rows = folder.keep(recorder)
                if not has_rows:
                    raise RunError(f"{folder.path}: ended before the first step")
                run = conclude(folder.path, self.scenario, status, wall_time, report)
            if live is not None:
                live.end(status, verdict(run.summary))
            return run

    def prepare(self, on_state: Callable[[State, str], None] | None = None) -> None:
        """Exchange messages until the vehicle can be steered; RunError if that takes longer than the options allow.

        `on_state` is the function that `run` accepts.
        """
        session, period = self.session, self.scenario.time.step
        start = session.clock()
        while not session.supervisor.is_steering:
            now = session.clock()
            session.exchange(np.zeros(6), now, now + period)
            if reason := session.stick_rejection():
                raise RunError(reason)
            self._report(on_state)
            if self._options.timeout is not None and now - start > self._options.timeout:
                raise RunError(f"{self._options.timeout:g} s have passed while waiting for {session.missing()}")

    def _steer(self, master: Master, observers: Sequence[Observer], on_state: Callable[[State, str], None]) -> str:
        session = self.session
        clearances = master.signals.view("goal.clearance", len(self.scenario.regions) + 1)
        master.plant.initialize()
        try:
            for k in range(self.scenario.steps + 1):
                master.step(k, session)
                for observer in observers:
                    observer.observe(k, master.row)
                master.environment.inflate_position_uncertainty(self._position_uncertainty() / SPREADS)
                violated = clearances[self._scene.hard]
                session.outside = float(max(0.0, -np.nanmin(violated))) if np.isfinite(violated).any() else 0.0
                self._report(on_state)
        except KeyboardInterrupt:
            return "interrupted"
        state, reason = session.supervisor.state, session.supervisor.reason
        if state == "dry_run":
            return DRY_RUN
        return "completed" if session.supervisor.is_steering else f"{state}: {reason}"

    def _clearance(self, position: Array) -> float:
        """Return the minimum clearance of hard regions [m] at a position of the autopilot's local frame."""
        return self._scene.clearance(self.session.alignment.to_scene(position), self.session.reported.quaternion)

    def _position_uncertainty(self) -> float:
        """Return the maximum expected position error [m]: undetected error, drift, and dead reckoning."""
        alignment = self.session.alignment
        drift = alignment.drift if alignment.drift > _DRIFT_NOISE else 0.0
        return _MIN_UNCERTAINTY + drift + self._options.reckoning_error * alignment.reckoned

    def _report(self, on_state: Callable[[State, str], None] | None) -> None:
        """Call `on_state` if the state, or the text of the conditions it waits for, has changed."""
        self._update_placement()
        state = self.session.supervisor.state, self.session.missing()
        if on_state is not None and state != self._reported:
            on_state(*state)
        self._reported = state

    def _watch_ranges(self, position: Array) -> None:
        """Note for how long ranges have been shorter than the scene's, at a position [m, NED] in it."""
        session, reported = self.session, self.session.reported
        if self._ranged == reported.message_counts["DISTANCE_SENSOR"]:
            return
        now, self._ranged = session.clock(), reported.message_counts["DISTANCE_SENSOR"]
        is_nearer = self._scene.is_nearer(position, reported.quaternion, reported.ranges)
        self._nearer_since = min(self._nearer_since, now) if is_nearer else math.inf
        session.nearer_time = max(0.0, now - self._nearer_since)

    def _update_placement(self) -> None:
        """Describe where the vehicle is once its frame is known; let it be armed and steered near the scene alone."""
        session, offset = self.session, self.session.alignment.offset
        position = session.alignment.to_scene(session.reported.position)
        if not np.isfinite(position).all():
            session.is_placed, self._placed_by = False, (None, False, frozenset())
            return
        self._watch_ranges(position)
        if session.supervisor.is_steering and session.is_placed:
            return
        distance = self._scene.distance(position)
        is_near = distance <= MAX_DISTANCE
        quaternion = session.reported.quaternion
        contradictions = self._scene.contradictions(position, quaternion, session.reported.ranges)
        placed_by = offset, is_near, frozenset(contradictions)
        if self._placed_by[0] is not offset or self._placed_by[1:] != placed_by[1:]:
            self.placement = "; WARNING: ".join([self._scene.describe(position, quaternion), *contradictions.values()])
            session.misplaced = "" if is_near else f"{format_distance(distance)} from everything in it"
            self.placement += f"; {session.misplaced}" if session.misplaced else ""
        self._placed_by = placed_by
        session.is_placed = is_near or self._options.dry_run
