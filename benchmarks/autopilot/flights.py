"""Flights of the companion with a real ArduSub on our plant, each in simulated time, judged by the plant's own state.

Plant, autopilot and companion wait for each other, so the load of the machine changes nothing. Every flight is a line
of a file; a flight that the file has is not flown again, so that an interrupted campaign goes on.
"""

from __future__ import annotations

import contextlib
import json
import math
import shutil
import subprocess
import sys
import tempfile
import time
from collections import deque
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np

from benchmarks.autopilot_scenes import random_scene
from controller import VehicleState
from controller.regions.region_set import of_attitude
from cosim.companion.companion import Companion
from cosim.companion.frame_alignment import SceneOrigin
from cosim.companion.link import COMPANION
from cosim.companion.options import CompanionOptions
from cosim.errors import CosimError, RunError
from cosim.mavlink.wire.dialect import dialect
from cosim.mavlink.wire.endpoint import parse_endpoint
from cosim.mavlink.wire.ground_end import GROUND_STATION, GroundLink, Heard
from cosim.mavlink.wire.options import ORIGIN
from cosim.results.record import Record, load_record
from cosim.scenario.scenario import Scenario, load_scenario
from cosim.simulation.environment import RegionEnvironment
from cosim.simulation.signals import Array
from cosim.sitl.autopilot_link import AutopilotLink, DvlOptions
from cosim.sitl.flights import FlightOptions, Flights
from cosim.sitl.law import law_of_pwm
from cosim.sitl.server import JsonServer

RATE = 400  # Hz, frames of the autopilot: as many as its main loop has
PARAMETERS = Path(__file__).with_name("ardusub.parm")
FAULT_AFTER = 5.0  # s of steering, before something fails on purpose
OF_A_FAULT = 12.0  # s of such a flight
DURATION = {"docking": 30.0, "harbour": 30.0, "pipe-inspection": 16.0}  # s
RANDOM_DURATION = 45.0  # s
_STAYED = 2.0  # s at the end, in which the goal is not left
_DOWN, _UP = 0.010, 0.020  # s, of messages from the autopilot and to it
_READ_EVERY = 0.004  # s
_LOWERED = 12.0  # s, after which the vehicle is at its start
_LONGEST = 400.0  # s of the plant
_PATIENCE = 120.0  # s of the wall clock without a frame
_WITHOUT_GPS = {"VISO_TYPE": 1, "EK3_SRC1_VELXY": 6, "EK3_SRC1_POSXY": 0, "EK3_SRC1_VELZ": 0, "GPS1_TYPE": 0}
_WATER = 1023.6  # kg/m3, of ArduPilot's simulator


@dataclass(frozen=True)
class Task:
    """A flight that is to be made."""

    scenario: str  # a shipped name, or random-SEED
    steer_by: str = "sticks"
    sticks_by: str = "manual-control"
    fault: str = ""
    level_dive: float = 0.6  # m
    parameters: tuple[str, ...] = ()  # NAME=VALUE, beside those of the file

    @property
    def key(self) -> str:
        """The flight's name in the file."""
        return json.dumps([self.scenario, self.steer_by, self.sticks_by, self.fault, self.level_dive, self.parameters])

    def load(self) -> Scenario:
        """Return the scenario with the flight's duration."""
        seed = self.scenario.removeprefix("random-")
        if seed.isdecimal():
            scenario, duration = random_scene(int(seed)), RANDOM_DURATION
        else:
            scenario = load_scenario(self.scenario)
            duration = DURATION.get(self.scenario, scenario.time.duration)
        return scenario.replace({"time.duration": FAULT_AFTER + OF_A_FAULT if self.fault else duration})


class SimulatedLink:
    """The companion's link, whose time is the plant's: waiting for a message lets plant and autopilot go on.

    Parameters
    ----------
    flights : Flights
        Whose plant flies.
    server : JsonServer
        Answers the autopilot's frames.
    endpoint : str
        Port of the autopilot.

    Attributes
    ----------
    cut : bool
        Whether no message passes in either direction.
    lost : set of str
        Names of messages of the autopilot, and of the companion, that do not pass.
    """

    def __init__(self, flights: Flights, server: JsonServer, endpoint: str) -> None:
        self._flights, self._server = flights, server
        self._link = GroundLink(parse_endpoint(endpoint), identity=COMPANION)
        self.name, self.identity = endpoint, COMPANION
        self.cut, self.lost = False, set[str]()
        self.others: GroundLink | None = None  # a pilot's station
        self._up: deque[tuple[float, Any]] = deque()
        self._down: deque[Heard] = deque()
        self._read_at = -math.inf
        self.events: list[tuple[float, Callable[[], None]]] = []

    def clock(self) -> float:
        """Return the plant's time since the autopilot's first frame [s]."""
        flight = self._flights.flight
        return 0.0 if flight is None else (flight.waited + flight.steps) * flight.scenario.time.step

    def receive(self, timeout: float) -> Sequence[Heard]:
        """Let time go by, and return the messages that have come meanwhile."""
        until = self.clock() + timeout
        while self.clock() < until - 1e-9:
            self.advance()
        heard = []
        while self._down and self._down[0].time <= self.clock():
            heard.append(self._down.popleft())
        return heard

    def send(self, message: Any) -> bool:
        """Send a message, which arrives 20 ms later."""
        if not self.cut and message.get_type() not in self.lost:
            self._up.append((self.clock() + _UP, message))
        return True

    def advance(self) -> None:
        """Answer one frame of the autopilot."""
        if status := self._server.poll():
            raise RunError(f"the autopilot's run: {status}")
        now = self.clock()
        while self.events and self.events[0][0] <= now:
            self.events.pop(0)[1]()
        while self._up and self._up[0][0] <= now:
            self._link.send(self._up.popleft()[1])
        if now - self._read_at < _READ_EVERY:
            return
        self._read_at = now
        if self.others is not None:
            self.others.receive(0.0)  # which connects it, too
        for one in self._link.receive(0.0):
            if not self.cut and one.kind not in self.lost:
                self._down.append(one._replace(time=now + _DOWN))

    def close(self) -> None:
        """Close it."""
        self._link.close()


# ---- what fails on purpose ----


def _pilot_takes(mode: int) -> Callable[[Any], None]:
    def take(link: Any) -> None:
        link.others.send(dialect().MAVLink_command_long_message(1, 1, 176, 0, 1, mode, 0, 0, 0, 0, 0))

    return take


def _pause(link: Any) -> None:
    system, component = COMPANION
    m = dialect().MAVLink_command_long_message(system, component, 193, 0, 0, 0, 0, 0, 0, 0, 0)
    link._down.append(Heard(link.clock() + _DOWN, *GROUND_STATION, 0, m.get_type(), m))


FAULTS: dict[str, Callable[[Any], None]] = {
    "pilot takes ALT_HOLD": _pilot_takes(2),
    "pilot takes MANUAL": _pilot_takes(19),
    "estimate stops": lambda link: link.lost.update({"LOCAL_POSITION_NED", "ODOMETRY"}),
    "link cut": lambda link: setattr(link, "cut", True),
    "DO_PAUSE_CONTINUE": _pause,
}


# ---- a flight ----


@dataclass
class Flown:
    """What happened in a flight, by the times of the plant [s]."""

    states: list[tuple[float, str]] = field(default_factory=list)
    failed_at: float = math.nan
    status: str = ""
    offset: list[float] = field(default_factory=lambda: [math.nan] * 3)
    begun: float = math.nan  # of the plant's record

    def first(self, *states: str) -> float:
        """Return when one of some states was first entered; NaN if none was."""
        return next((at for at, state in self.states if state in states), math.nan)


def fly(task: Task, ardusub: Path, instance: int, folder: Path) -> dict[str, Any]:
    """Make a flight, and judge it.

    Parameters
    ----------
    task : Task
        The flight.
    ardusub : Path
        ArduSub's program for SITL.
    instance : int
        Of ArduSub: its ports are 5760 + 10 × instance and two above.
    folder : Path
        For its files; what it has is removed.

    Returns
    -------
    dict
        For JSON.
    """
    shutil.rmtree(folder, ignore_errors=True)
    folder.mkdir(parents=True)
    begun = time.monotonic()
    scenario = task.load()
    file = folder / "scenario.toml"
    file.write_text(scenario.toml(), encoding="utf-8")
    no_gps = task.scenario.startswith("random-")
    port = 5760 + 10 * instance
    endpoints = [parse_endpoint(f"tcp:127.0.0.1:{port + i}") for i in (2, 3)]
    with contextlib.ExitStack() as stack:
        estimate = AutopilotLink(endpoints[0], DvlOptions(8.0, 0.05) if no_gps else None)
        stack.callback(estimate.close)
        options = FlightOptions(
            file, (f"time.duration={_LONGEST}",), out=folder / "plant", record_rate=100.0, report=False
        )  # fmt: skip
        flights = Flights(options, "ardupilot", lambda vehicle: law_of_pwm(vehicle, estimate))
        server = JsonServer(flights, ("127.0.0.1", 0), timeout=_PATIENCE)
        stack.callback(server.close)
        stack.enter_context(_running(ardusub, instance, server.address[1], folder, task, no_gps))
        link = SimulatedLink(flights, server, f"tcp:127.0.0.1:{port}")
        stack.callback(link.close)
        if task.fault:
            link.others = stack.enter_context(GroundLink(endpoints[1], identity=GROUND_STATION))
        flown = Flown()
        with contextlib.suppress(RunError):  # the companion's; the plant's record stays
            flights.fly(lambda: _steer(task, scenario, link, flown, folder, no_gps), server.counts)
    result = {"key": task.key, "status": flown.status, "wall": round(time.monotonic() - begun, 1)}
    return result | _judge(scenario, flown, folder / "plant", task)


@contextlib.contextmanager
def _running(ardusub: Path, instance: int, port: int, folder: Path, task: Task, no_gps: bool) -> Iterator[None]:
    given = "".join(f"{name} {value}\n" for name, value in _WITHOUT_GPS.items()) if no_gps else ""
    given += "".join(one.replace("=", " ") + "\n" for one in task.parameters)
    (folder / "own.parm").write_text(PARAMETERS.read_text(encoding="utf-8") + given, encoding="utf-8")
    command = [
        str(ardusub.resolve()), "--model", "JSON:127.0.0.1", "--home", "{},{},0,0".format(*ORIGIN), "--speedup", "100",
        "--instance", str(instance), "--sim-port-out", str(port), "--defaults", "own.parm", "--serial0", "tcp:0",
        "--rate", str(RATE),
    ]  # fmt: skip
    with (folder / "ardusub.log").open("wb") as log:
        process = subprocess.Popen(command, cwd=folder, stdout=log, stderr=log)
        try:
            yield
        finally:
            process.kill()  # no signal ends it while it waits for the plant
            process.wait()


def _steer(task: Task, scenario: Scenario, link: SimulatedLink, flown: Flown, folder: Path, no_gps: bool) -> str:
    """Wait until the vehicle is at its start, and let the companion fly it; return the status of the plant's run."""
    m = dialect()
    while link.clock() < _LOWERED:
        link.advance()
    if no_gps:
        place = [round(1e7 * angle) for angle in ORIGIN]
        link.send(m.MAVLink_set_gps_global_origin_message(1, *place, 0))
    options = CompanionOptions(
        steer_by=task.steer_by, sticks_by=task.sticks_by, origin=SceneOrigin(geodetic=ORIGIN, density=_WATER),  # type: ignore[arg-type]
        arm=True, pilot_gain=1.0, level_dive=task.level_dive, timeout=90.0,
    )  # fmt: skip
    companion = Companion(scenario, link, options)

    def note(state: str, missing: str) -> None:
        if not flown.states or flown.states[-1][1] != state:
            flown.states.append((link.clock(), state))
        offset = companion.session.alignment.offset
        if offset is not None:
            flown.offset = offset.tolist()
        if state == "steering" and task.fault and not link.events:
            flown.failed_at = link.clock() + FAULT_AFTER
            link.events.append((flown.failed_at, lambda: FAULTS[task.fault](link)))

    try:
        flown.status = companion.run(folder / "companion", report=False, on_state=note).summary["status"]
    except CosimError as error:
        flown.status = f"failed: {error}"
    flight = link._flights.flight
    if flight is not None:
        flown.begun = flight.waited * flight.scenario.time.step
    return "completed"


def _judge(scenario: Scenario, flown: Flown, folder: Path, task: Task) -> dict[str, Any]:
    """Return what the plant's record says of the time since the vehicle began to dive or to be steered."""
    since, steered = flown.first("diving", "steering"), flown.first("steering")
    if not math.isfinite(steered) or not folder.exists():
        return {"reached": False, "states": flown.states}
    record = load_record(folder)
    at = record["time"] + flown.begun
    end = steered + scenario.time.duration
    rows = (at >= since) & (at <= end)
    if task.fault:
        return {"states": flown.states} | _after_fault(record, at, flown, scenario)
    found = _clearances(scenario, record, at - steered)
    place: dict[str, float] = {}
    attitude: dict[str, float] = {}
    for i, secondary in enumerate(scenario.regions, 1):
        region = secondary.region
        if region.hard:
            kept = at >= (steered if of_attitude(region.shape) else since)
            least = float(found[rows & kept, i].min())
            (attitude if of_attitude(region.shape) else place)[region.name] = round(least, 4)
    goal = found[:, 0]
    inside = (goal >= 0.0) & rows & (at >= steered)
    entered = float(at[np.argmax(inside)] - steered) if inside.any() else None
    angles = [record[f"attitude.{name}"][rows] for name in ("roll", "pitch", "yaw")]
    own = [record[f"law.estimate.{name}"][rows] for name in ("x", "y", "z", "yaw")]
    true = [record[f"position.{axis}"][rows] for axis in "xyz"]
    errors = [np.abs(e + o - t) for e, o, t in zip(own[:3], flown.offset, true, strict=True)]
    turned = np.abs(np.remainder(own[3] - angles[2] + np.pi, 2.0 * np.pi) - np.pi)
    tilt = np.degrees(np.arccos(np.cos(angles[0]) * np.cos(angles[1])))
    last = rows & (at > end - _STAYED)
    return {
        "reached": entered is not None,
        "entered": entered and round(entered, 2),
        "stayed": bool((goal[last] >= 0.0).all()),
        "violated": [name for name, least in (place | attitude).items() if least < 0.0],
        "least": min(place.values(), default=None),
        "least_attitude": min(attitude.values(), default=None),
        "clearances": {name: least for name, least in (place | attitude).items() if least < 1.0},
        "dive": None if since == steered else round(steered - since, 2),
        "tilt": round(float(tilt.max()), 1),
        "position_error": [round(float(np.nanmax(error)), 3) for error in errors],
        "heading_error": round(float(np.degrees(np.nanmax(turned[at[rows] >= steered]))), 2),
        "states": [(round(t, 2), state) for t, state in flown.states],
    }


def _clearances(scenario: Scenario, record: Record, time: Array) -> Array:
    """Return the true clearances of goal and regions, shape (rows, n + 1); their motion begins at time 0.

    The plant's record has them in motion since the plant began.
    """
    n = len(scenario.regions) + 1
    environment, shifts, found = (
        RegionEnvironment(scenario),
        np.zeros((len(scenario.moving), 3)),
        np.zeros((len(time), n)),
    )
    evaluation = environment.empty_evaluation(np.zeros(n), np.zeros(n))
    working = np.ones(scenario.vehicle.n_thrusters)
    positions = np.stack([record[f"position.{axis}"] for axis in "xyz"], axis=1)
    quaternions = np.stack([record[f"quaternion.e{i}"] for i in range(4)], axis=1)
    for row, (t, position, quaternion) in enumerate(zip(time.tolist(), positions, quaternions, strict=True)):
        environment.update_positions(max(t, 0.0), shifts)
        environment.evaluate(VehicleState(position, quaternion, np.zeros(6), working), evaluation)
        found[row] = evaluation.clearances
    return found


def _after_fault(record: Any, at: Any, flown: Flown, scenario: Scenario) -> dict[str, Any]:
    """Return what happened after the fault: when steering was left, which mode followed, and how far it went."""
    failed = flown.failed_at
    left = flown.first("held", "pilot")
    velocity = np.linalg.norm([record[f"velocity.{name}"] for name in "uvw"], axis=0)
    way = np.cumsum(velocity) * float(np.median(np.diff(at)))

    def then(seconds: float) -> int:
        return min(int(np.searchsorted(at, failed + seconds)), len(at) - 1)

    modes = record["law.mode"]
    changed = [i for i in range(then(0.0), len(at)) if modes[i] != modes[then(0.0)]]
    armed = record["law.armed"]
    disarmed = [i for i in range(then(0.0), len(at)) if armed[i] == 0.0]
    pulses = np.array([record[f"law.pwm{i + 1}"] for i in range(scenario.vehicle.n_thrusters)])
    still = np.all(np.abs(pulses - 1500.0) < 2.0, axis=0).tolist()
    neutral = [i for i in range(then(0.0), len(at)) if still[i]]
    tilt = np.degrees(np.arccos(np.cos(record["attitude.roll"]) * np.cos(record["attitude.pitch"])))

    def when(found: list[int]) -> float | None:
        return round(float(at[found[0]] - failed), 2) if found else None

    return {
        "left": None if math.isnan(left) else round(left - failed, 2),
        "mode": int(modes[-1]),
        "mode_after": when(changed),
        "neutral_after": when(neutral),
        "disarmed_after": when(disarmed),
        "speed": [round(float(velocity[then(s)]), 2) for s in (0.0, 1.0, 3.0)],
        "way": round(float(way[then(1.0)] - way[then(0.0)]), 2),
        "way_to_end": round(float(way[-1] - way[then(0.0)]), 2),
        "tilt": round(float(tilt[then(0.0) :].max()), 1),
        "violated": [
            s.region.name
            for s in scenario.regions
            if s.region.hard and record[f"{s.region.name}.clearance"][then(0.0) :].min() < 0.0
        ],
    }


# ---- many flights ----


def main(tasks: Sequence[Task], ardusub: Path, instance: int, out: Path | None, keep: Path | None = None) -> None:
    """Make flights, print a line of JSON for each, and their summary.

    Parameters
    ----------
    tasks : sequence of Task
        The flights.
    ardusub : Path
        ArduSub's program for SITL.
    instance : int
        Of ArduSub.
    out : Path, optional
        File of the flights, to which new ones are added; those that it has are not repeated.
    keep : Path, optional
        Folder in which each flight's files are kept.
    """
    known = {}
    if out is not None and out.exists():
        known = {one["key"]: one for one in map(json.loads, out.read_text(encoding="utf-8").splitlines())}
    flown = []
    for task in tasks:
        result = known.get(task.key)
        if result is None:
            with tempfile.TemporaryDirectory() as folder:
                name = "-".join(filter(None, (task.scenario, task.steer_by, task.sticks_by[:2], task.fault)))
                result = fly(task, ardusub, instance, Path(folder) if keep is None else keep / name.replace(" ", "_"))
            line = json.dumps(result)
            print(line, flush=True)
            if out is not None:
                with out.open("a", encoding="utf-8") as file:
                    file.write(line + "\n")
        flown.append(result)
    judged = [one for one in flown if "violated" in one and "entered" in one]
    least = min((one["least"] for one in judged if one["least"] is not None), default=math.nan)
    print(
        f"{len(flown)} flights: {sum(one.get('reached', False) for one in flown)} reached, "
        f"{sum(one.get('stayed', False) for one in flown)} stayed, {sum(bool(one['violated']) for one in judged)} "
        f"violated; least clearance {least:.3f} m",
        file=sys.stderr,
    )
