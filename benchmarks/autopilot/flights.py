"""Make flights with a real ArduSub.

Plant, autopilot and companion run in lockstep, so the load of the machine does not change the results. Every flight is
a line of a file; a flight that is already in the file is not repeated, so that an interrupted campaign can continue.
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
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from benchmarks.autopilot.flight_evaluation import FlightEvents, evaluate_flight
from benchmarks.autopilot.scenes import random_scene
from benchmarks.autopilot.simulated_link import FAULTS, SimulatedLink
from cosim.command_line.process import kills_interrupt
from cosim.companion.companion_options import CompanionOptions
from cosim.companion.companion_run import Companion
from cosim.companion.frame_alignment import SceneOrigin
from cosim.errors import CosimError, RunError
from cosim.mavlink.wire.endpoint import parse_endpoint
from cosim.mavlink.wire.ground_end import GROUND_STATION, GroundLink
from cosim.mavlink.wire.options import ORIGIN
from cosim.scenario.scenario import Scenario, load_scenario
from cosim.sitl.json_server import JsonServer
from cosim.sitl.law import make_pwm_law
from cosim.sitl.sitl_link import DvlOptions, SitlLink
from cosim.sitl.sitl_session import FlightOptions, SitlSession

# prefixes of random scenes, before the seed; the plant of the second ones has the other published drag and added mass
RANDOM, OTHER = "random-", "other-"
RATE = 400  # Hz, rate of the autopilot's frames, that of its main loop
PARAMETERS = Path(__file__).with_name("ardusub.parm")
FAULT_AFTER = 5.0  # s, duration of steering before the fault
OF_A_FAULT = 12.0  # s, duration of a flight after its fault
DURATION = {"docking": 30.0, "harbour": 30.0, "pipe-inspection": 16.0}  # s, durations of flights by scenario
RANDOM_DURATION = 45.0  # s, duration of a flight in a random scene
_LOWERED = 12.0  # s, time of the plant at which the vehicle is at its start
_LONGEST = 400.0  # s, duration of the plant's scenario
_PATIENCE = 120.0  # s of the wall clock without a frame, after which a flight ends
# parameters of ArduSub for a DVL in place of GPS, whose name was the last one before 4.6
_WITHOUT_GPS = {
    "VISO_TYPE": 1, "EK3_SRC1_VELXY": 6, "EK3_SRC1_POSXY": 0, "EK3_SRC1_VELZ": 0,
    "GPS1_TYPE": 0, "GPS_TYPE": 0,
}  # fmt: skip
_WATER = 1023.6  # kg/m3, density of the water in ArduPilot's simulator


@dataclass(frozen=True)
class Task:
    """Definition of a flight."""

    scenario: str  # name of a shipped scenario, or random-SEED, or other-SEED
    steer_by: str = "sticks"  # output of the companion, one of `SteerBy`
    sticks_by: str = "manual-control"  # message that carries the sticks, one of `SticksBy`
    fault: str = ""  # one of `FAULTS`, or empty
    level_dive: float = CompanionOptions.level_dive  # m, depth of the dive after arming
    parameters: tuple[str, ...] = ()  # NAME=VALUE of ArduSub, in addition to `PARAMETERS`

    @property
    def key(self) -> str:
        """The flight's key in the file of results."""
        return json.dumps([self.scenario, self.steer_by, self.sticks_by, self.fault, self.level_dive, self.parameters])

    @property
    def is_random(self) -> bool:
        """True for a flight in a random scene; those have a DVL in place of GPS."""
        return self.scenario.startswith((RANDOM, OTHER)) and self.scenario.partition("-")[2].isdecimal()

    def load(self) -> Scenario:
        """Return the scenario with the flight's duration."""
        if self.is_random:
            prefix, _, seed = self.scenario.rpartition("-")
            scenario, duration = random_scene(int(seed), f"{prefix}-" == OTHER), RANDOM_DURATION
        else:
            scenario = load_scenario(self.scenario)
            duration = DURATION.get(self.scenario, scenario.time.duration)
        return scenario.replace({"time.duration": FAULT_AFTER + OF_A_FAULT if self.fault else duration})


def fly(task: Task, ardusub: Path, instance: int, folder: Path) -> dict[str, Any]:
    """Make a flight into an emptied folder, and evaluate it; ports are 5760 + 10 × instance and 2, 3 above."""
    shutil.rmtree(folder, ignore_errors=True)
    folder.mkdir(parents=True)
    begun = time.monotonic()
    scenario = task.load()
    file = folder / "scenario.toml"
    file.write_text(scenario.toml(), encoding="utf-8")
    port = 5760 + 10 * instance
    endpoints = [parse_endpoint(f"tcp:127.0.0.1:{port + i}") for i in (2, 3)]
    with contextlib.ExitStack() as stack:
        estimate = SitlLink(endpoints[0], DvlOptions(8.0, 0.05) if task.is_random else None)
        stack.callback(estimate.close)
        options = FlightOptions(
            file, (f"time.duration={_LONGEST}",), out=folder / "plant", record_rate=100.0, report=False
        )  # fmt: skip
        flights = SitlSession(options, "ardupilot", lambda vehicle: make_pwm_law(vehicle, estimate))
        server = JsonServer(flights, ("127.0.0.1", 0), timeout=_PATIENCE)
        stack.callback(server.close)
        stack.enter_context(_running(ardusub, instance, server.address[1], folder, task))
        link = SimulatedLink(flights, server, f"tcp:127.0.0.1:{port}")
        stack.callback(link.close)
        if task.fault:
            link.others = stack.enter_context(GroundLink(endpoints[1], identity=GROUND_STATION))
        events = FlightEvents()
        with contextlib.suppress(RunError):  # a flight that fails; the plant's record remains
            flights.fly(lambda: _steer(task, scenario, link, events, folder), server.counts)
    result = {"key": task.key, "status": events.status, "wall": round(time.monotonic() - begun, 1)}
    return result | evaluate_flight(scenario, events, folder / "plant")


@contextlib.contextmanager
def _running(ardusub: Path, instance: int, port: int, folder: Path, task: Task) -> Iterator[None]:
    given = "".join(f"{name} {value}\n" for name, value in _WITHOUT_GPS.items()) if task.is_random else ""
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


def _steer(task: Task, scenario: Scenario, link: SimulatedLink, events: FlightEvents, folder: Path) -> str:
    """Wait until the vehicle is at its start, fly it with the companion, and return the status of the plant's run."""
    while link.clock() < _LOWERED:
        link.advance()
    options = CompanionOptions(
        steer_by=task.steer_by, sticks_by=task.sticks_by, origin=SceneOrigin(geodetic=ORIGIN, density=_WATER),  # type: ignore[arg-type]
        arm=True, pilot_gain=1.0, level_dive=task.level_dive, timeout=90.0,
        global_origin=ORIGIN if task.is_random else None,
    )  # fmt: skip
    companion = Companion(scenario, link, options)

    def note(state: str, missing: str) -> None:
        if not events.states or events.states[-1][1] != state:
            events.states.append((link.clock(), state))
        offset = companion.session.alignment.offset
        if offset is not None:
            events.offset = offset.tolist()
        if state == "steering" and task.fault and math.isnan(events.failed_at):
            events.failed_at = link.clock() + FAULT_AFTER
            link.events.append((events.failed_at, lambda: FAULTS[task.fault](link)))

    try:
        events.status = companion.run(folder / "companion", report=False, on_state=note).summary["status"]
    except CosimError as error:
        events.status = f"failed: {error}"
    except KeyboardInterrupt:
        events.status = "interrupted"
        raise
    events.begun = link.waited()
    return "completed"


def make_flights(
    tasks: Sequence[Task], ardusub: Path, instance: int, out: Path | None, keep: Path | None = None
) -> None:
    """Make the flights that are not in a file of results, print a line of JSON for each, and a summary."""
    # New flights are appended to the file without those that have failed: they are flown again the next time. A signal
    # that ends it ends ArduSub too.
    known = {}
    if out is not None and out.exists():
        known = {one["key"]: one for one in map(json.loads, out.read_text(encoding="utf-8").splitlines())}
    results = []
    for task in tasks:
        result = known.get(task.key)
        if result is None:
            with tempfile.TemporaryDirectory() as folder, kills_interrupt():
                name = "-".join(filter(None, (task.scenario, task.steer_by, task.sticks_by[:2], task.fault)))
                result = fly(task, ardusub, instance, Path(folder) if keep is None else keep / name.replace(" ", "_"))
            if result["status"] == "interrupted":
                raise KeyboardInterrupt
            line = json.dumps(result)
            print(line, flush=True)
            if out is not None and result["status"] and not result["status"].startswith("failed"):
                with out.open("a", encoding="utf-8") as file:
                    file.write(line + "\n")
        results.append(result)
    evaluated = [one for one in results if "violated" in one and "entered" in one]
    clearances = [one["min_clearance"] if "min_clearance" in one else one["least"] for one in evaluated]  # former name
    minimum = min((clearance for clearance in clearances if clearance is not None), default=math.nan)
    print(
        f"{len(results)} flights: {sum(one.get('reached', False) for one in results)} reached, "
        f"{sum(one.get('stayed', False) for one in results)} stayed, {sum(bool(one['violated']) for one in evaluated)} "
        f"violated; minimum clearance {minimum:.3f} m",
        file=sys.stderr,
    )
