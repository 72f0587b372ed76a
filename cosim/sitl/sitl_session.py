"""The runs of one SITL session: a restart of the autopilot begins a new one."""

from __future__ import annotations

import dataclasses
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path

from cosim.errors import CosimError, RunError
from cosim.results.run_result import Run
from cosim.scenario.scenario import Scenario, load_scenario
from cosim.scenario.validation import MAX_STEPS
from cosim.simulation.commands.sources import RUNS
from cosim.sitl.law import AutopilotLaw
from cosim.sitl.sitl_flight import Flight
from plant_fmu import PlantFmuError, Vehicle
from plant_fmu.build import cached_fmu

SCENARIO = "sitl"  # default scenario
MIN_RATE = 11  # Hz: an autopilot's frame is shorter than 0.1 s
RESTARTED = "ended: the autopilot restarted"

_VALIDATION_RATE = 1000  # Hz, frame rate for the validation of a scenario before an autopilot connects


@dataclass
class FrameCounts:
    """Counts of the autopilot's frames, by treatment."""

    steps: int = 0
    waited: int = 0  # before the first one, with the vehicle held
    resent: int = 0  # repeated frames, answered without a step
    lost: int = 0  # never received
    malformed: int = 0
    rejected: int = 0  # frames of a second sender
    unsent: int = 0  # answers that could not be sent


@dataclass(frozen=True)
class Outcome:
    """Runs of a SITL session, and counts of its frames."""

    runs: list[Run]
    counts: FrameCounts


@dataclass(frozen=True)
class FlightOptions:
    """Scenario, vehicle, output folder and recording of a SITL session."""

    scenario: str | Path = SCENARIO
    overrides: tuple[str, ...] = ()
    vehicle: str | None = None  # None: the scenario's
    out: Path | None = None  # run folder; later runs have a number after its name
    record_rate: float = 100.0  # Hz, simulated
    report: bool = True


def scenario_to_fly(
    name_or_file: str | Path, overrides: Sequence[str], vehicle: str | None, frame_rate: int, autopilot: str
) -> Scenario:
    """Load a scenario for an autopilot to fly; frame_rate [Hz]."""
    changes = [*overrides, "actuation.through=thrusters"]
    if vehicle is not None:
        changes.append(f"vehicle='{vehicle}'")
    base = load_scenario(name_or_file, changes)
    for key, value in (("commands.enabled", base.commands.enabled), ("record.lyapunov", base.record.lyapunov)):
        if value:
            raise RunError(f"{name_or_file}: {key} is true, expected false: the autopilot steers")
    if base.plant_fmu:
        raise RunError(
            f"{name_or_file}: plant.file is set, expected none: an autopilot needs the sensors of the vehicle's own FMU"
        )
    step = 1.0 / frame_rate
    for key, period in (("duration", base.time.duration), ("arbiter", base.time.arbiter), ("control", step)):
        changes.append(f"time.{key}={min(max(1, round(period * frame_rate)), MAX_STEPS) * step!r}")
    scenario = load_scenario(name_or_file, [*changes, f"time.step={step!r}"])
    table = scenario.table | {"changed": base.table["changed"]}  # its steps are the autopilot's, which the title names
    return dataclasses.replace(scenario, law=dataclasses.replace(scenario.law, name=autopilot), table=table)


class SitlSession:
    """The runs of one SITL session: the present one and those before it."""

    def __init__(self, options: FlightOptions, autopilot: str, make_law: Callable[[Vehicle], AutopilotLaw]) -> None:
        self._options, self._autopilot, self._make_law = options, autopilot, make_law
        out = options.out
        if out and out.exists() and not (out.is_dir() and not any(out.iterdir())):
            raise RunError(f"{out}: exists and is not empty; expected a new folder")
        scenario = scenario_to_fly(options.scenario, options.overrides, options.vehicle, _VALIDATION_RATE, autopilot)
        self._vehicle = scenario.vehicle
        self.law = make_law(self._vehicle)
        cached_fmu(self._vehicle, scenario.plant.fmi)
        self.flight: Flight | None = None
        self._ended: list[tuple[Flight, str]] = []

    def begin(self, frame_rate: int) -> Flight:
        """Start a run at the rate of an autopilot's frames [Hz]."""
        if len(self._ended) >= RUNS:
            raise RunError(f"the autopilot has restarted too often: expected at most {RUNS} runs of a session")
        o = self._options
        scenario = scenario_to_fly(o.scenario, o.overrides, o.vehicle, frame_rate, self._autopilot)
        self.law = self._make_law(scenario.vehicle)
        out = o.out and (o.out.with_name(f"{o.out.name}-{len(self._ended) + 1}") if self._ended else o.out)
        self.flight = Flight(scenario, self.law, out, o.record_rate)
        return self.flight

    def end(self, status: str) -> None:
        """End the present run, if there is one, and write its summary; `fly` writes its report at the session's end."""
        flight, self.flight = self.flight, None
        if flight is not None:
            flight.end()
            if flight.steps:
                self._ended.append((flight, status))
                flight.conclude(status, report=False)

    def fly(self, serve: Callable[[], str], counts: FrameCounts) -> Outcome:
        """Run a server until it ends, and conclude its runs."""
        failure: Exception | None = None
        interrupted = False
        try:
            status = serve()
        except KeyboardInterrupt:
            status, interrupted = "interrupted", True
        except (PlantFmuError, CosimError) as error:
            status, failure = f"failed: {error}", error
        self.end(status)
        runs = [flight.conclude(status, self._options.report) for flight, status in self._ended]
        if failure:
            raise failure
        if not runs:
            raise KeyboardInterrupt if interrupted else RunError(f"no autopilot connected: {status}")
        return Outcome(runs, counts)
