"""A scenario flown on a real vehicle: from the first heartbeat to the run's folder."""

from __future__ import annotations

import math
import time
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from controller.laws.deployable.gains import SPREADS
from controller.regions.region_set import of_attitude
from cosim.companion.link import AutopilotLink
from cosim.companion.options import CompanionOptions
from cosim.companion.outputs import SteerBy
from cosim.companion.remote_vehicle import RemoteVehicle
from cosim.companion.safety import State
from cosim.companion.session import AutopilotSession
from cosim.companion.set_points import FASTEST
from cosim.companion.warm_up import warm_up
from cosim.errors import RunError
from cosim.mavlink.wire.options import ProfileName
from cosim.results.recorder import Recorder
from cosim.results.run_result import Run
from cosim.results.wording import verdict
from cosim.run.run_folder import claim, conclude
from cosim.scenario.scenario import Scenario
from cosim.scenario.tables import SecondaryRegion
from cosim.simulation.commands.command_handler import greatest_wrench
from cosim.simulation.environment import RegionEnvironment
from cosim.simulation.master import Master, Observer
from cosim.simulation.signals import Array
from plant_fmu import Vehicle

if TYPE_CHECKING:  # websockets wait until a flight is shown
    from cosim.live.view import LiveView

_RELEASE = 2.0  # s at the most, that letting go takes at the end
_NO_COMMANDS = "a companion's page shows alone: take over at the autopilot's ground station"
_STEADY = 0.1  # m, of drift between two sources, up to which it is their noise
_RESERVE = 0.3  # of the thrusters' force, for moments that the autopilot gives
_UNSEEN = 0.05  # m, by which an autopilot's position may be off without a sign of it


# Errors of an autopilot's estimate are slow: its velocity may be off by some cm/s for a minute, its position has no
# white noise. A velocity that is trusted more shifts the law's position by what it is off, over the filter's rate.
_FILTERED = {"law.gains.position_noise": 0.01, "law.gains.velocity_noise": 0.05}
# the autopilot has the thrusters: what one of them does is not what the law asked of it
_NOT_ISOLATED = {"law.gains.failure_threshold": 0.0}
# its attitude loop gives the moments: a law that finds out restoring moments, or the effectiveness of each thruster, by
# what its own moments do, finds the stiffness of that loop, and works against it
_NOT_TURNED = _NOT_ISOLATED | {
    "law.gains.adaptation": 0.0,
    "law.gains.moment_bound": 1e-3,
    "law.gains.effectiveness_estimation": 0.0,
}
_NOT_LIFTED = {"law.gains.restoring_drift": 0.0, "law.gains.restoring_bound": 1e-3}  # its depth loop, of weight
# its velocity loop takes care of weight, moments, current and lag: what the law would find out of them is not so
_NOT_ESTIMATED = _NOT_LIFTED | {"law.gains.lag_bound": 0.0, "law.gains.current_bound": 1e-3}


def scenario_to_steer(scenario: Scenario, steer_by: SteerBy = "sticks", profile: ProfileName = "ardusub") -> Scenario:
    """Return a scenario as the companion flies it: a step is a control period, and the state is what is reported.

    Parameters
    ----------
    scenario : Scenario
        As it is simulated.
    steer_by : str
        What the autopilot gets: ``sticks``, ``wrench``, ``velocity`` or ``attitude``.
    profile : str
        Which autopilot it is.

    Raises
    ------
    RunError
        If it asks for what a real vehicle cannot be made to do.
    ScenarioError
        If its periods do not fit.
    """
    for key, asked in (("failures", scenario.failures), ("record.lyapunov", scenario.record.lyapunov)):
        if asked:
            raise RunError(f"{scenario.name}: {key} is set, expected none: the vehicle is a real one")
    period = scenario.time.control
    arbiter = max(1, round(scenario.time.arbiter / period)) * period
    duration = max(1, round(scenario.time.duration / period)) * period
    gains: dict[str, float] = _NOT_ISOLATED
    if steer_by != "wrench":
        fastest = FASTEST if steer_by == "velocity" else _speed_with_reserve(scenario.vehicle)
        gains = _NOT_TURNED | {"law.gains.speed": min(getattr(scenario.law.gains, "speed", fastest), fastest)}
    if steer_by == "attitude" and profile == "ardusub":
        gains |= _NOT_LIFTED
    if steer_by == "velocity":
        gains |= _NOT_ESTIMATED
    return scenario.replace(
        (_FILTERED | gains if scenario.law.name == "deployable" else {})
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


def _speed_with_reserve(vehicle: Vehicle) -> float:
    """Return the speed ahead [m/s] at which drag leaves the autopilot a part of the thrusters, for its moments."""
    force = (1.0 - _RESERVE) * greatest_wrench(vehicle.thruster_matrix, vehicle.thrust_min, vehicle.thrust_max)[0]
    linear, quadratic = float(vehicle.linear_damping[0]), float(vehicle.quadratic_damping[0])
    slope = linear + math.sqrt(linear**2 + 4.0 * quadratic * force)
    return 2.0 * float(force) / slope if slope > 0.0 else math.inf


def _is_fence(secondary: SecondaryRegion) -> bool:
    return secondary.region.hard and not of_attitude(secondary.region.shape)


class Companion:
    """Steers a vehicle through its autopilot by a scenario's regions, arbiter and law.

    Parameters
    ----------
    scenario : Scenario
        What is to be flown, as it is simulated.
    link : AutopilotLink
        To the autopilot; it stays open.
    options : CompanionOptions
        How.

    Attributes
    ----------
    scenario : Scenario
        As it is flown.
    session : AutopilotSession
        With the autopilot.

    Raises
    ------
    RunError, ScenarioError
        As `scenario_to_steer`.

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
        hard = [i for i, secondary in enumerate(self.scenario.regions, 1) if _is_fence(secondary)]
        self._hard = np.array(hard, dtype=int)
        self._environment = RegionEnvironment(self.scenario)  # for the dive, before the master's environment exists
        self.session.dive.clearance = self._clearance

    def run(
        self,
        out: Path | None = None,
        report: bool = True,
        on_state: Callable[[State, str], None] | None = None,
        live: LiveView | None = None,
    ) -> Run:
        """Wait until the vehicle can be steered, steer it for the scenario's time, and let go.

        Parameters
        ----------
        out : Path, optional
            The run folder, as for `run_scenario`.
        report : bool
            Write report and figures too.
        on_state : callable, optional
            Called with each new state, and with what it waits for.
        live : LiveView, optional
            Shows the flight while it goes on, from before steering begins; it takes no commands.

        Returns
        -------
        Run
            Its status is ``completed``, or says in which state it ended and why.

        Raises
        ------
        RunError
            If steering cannot begin in time, or the folder cannot be written.
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
                live.say(state.replace("_", " ") + ("" if missing == "nothing" else f", waits for {missing}"))

        with Master(self.scenario, plant=RemoteVehicle(self.scenario, self.session)) as master:
            if live is not None:
                live.begin(self.scenario, master.signals.columns, _NO_COMMANDS)
            self.prepare(show_state)
            folder = claim(out, self.scenario)
            try:
                recorder = Recorder(folder.path, master.signals.columns)
            except BaseException:
                folder.discard()
                raise
            started = time.perf_counter()
            try:
                status = self._steer(master, [recorder] if live is None else [recorder, live], show_state)
            finally:
                self.session.release(_RELEASE)
                wall_time = time.perf_counter() - started
                kept = folder.keep(recorder)
            if not kept:
                raise RunError(f"{folder.path}: ended before the first step")
            run = conclude(folder.path, self.scenario, status, wall_time, report)
            if live is not None:
                live.end(status, verdict(run.summary))
            return run

    def prepare(self, on_state: Callable[[State, str], None] | None = None) -> None:
        """Exchange messages until the vehicle can be steered; RunError if that takes longer than the options allow.

        `on_state` is as of `run`.
        """
        session, period = self.session, self.scenario.time.step
        begun = session.clock()
        while not session.supervisor.is_steering:
            now = session.clock()
            session.exchange(np.zeros(6), now, now + period)
            self._report(on_state)
            self._require_accepted_sticks()
            if self._options.timeout is not None and now - begun > self._options.timeout:
                raise RunError(f"{self._options.timeout:g} s have gone by, waiting for {session.missing()}")

    def _require_accepted_sticks(self) -> None:
        """Raise `RunError` if the autopilot would ignore or misread the sticks."""
        refused = self.session.stick_refusal()
        if refused:
            raise RunError(refused)

    def _steer(self, master: Master, observers: Sequence[Observer], on_state: Callable[[State, str], None]) -> str:
        session = self.session
        clearances = master.signals.view("goal.clearance", len(self.scenario.regions) + 1)
        master.plant.initialise()
        try:
            for k in range(self.scenario.steps + 1):
                master.step(k, session)
                for observer in observers:
                    observer.observe(k, master.row)
                master.environment.inflate_position_uncertainty(self._doubt() / SPREADS)
                violated = clearances[self._hard]
                session.outside = float(max(0.0, -np.nanmin(violated))) if np.isfinite(violated).any() else 0.0
                self._report(on_state)
        except KeyboardInterrupt:
            return "interrupted"
        state, reason = session.supervisor.state, session.supervisor.reason
        return "completed" if session.supervisor.is_steering else f"{state}: {reason}"

    def _clearance(self, position: Array) -> float:
        """Return the least clearance of hard regions [m] at a position of the autopilot's local frame."""
        if not len(self._hard):
            return math.inf
        place = self.session.alignment.to_scene(position)
        found = self._environment.clearances(place, self.session.reported.quaternion)
        return float(np.min(found[self._hard]))

    def _doubt(self) -> float:
        """Return by how much the position may be off [m]: as its sources have come apart, and as it was reckoned."""
        alignment = self.session.alignment
        drift = alignment.drift if alignment.drift > _STEADY else 0.0
        return _UNSEEN + drift + self._options.reckoning_error * alignment.reckoned

    def _report(self, on_state: Callable[[State, str], None] | None) -> None:
        """Call `on_state` where the state, or what it waits for, has changed."""
        now = self.session.supervisor.state, self.session.missing()
        if on_state is not None and now != self._reported:
            on_state(*now)
        self._reported = now
