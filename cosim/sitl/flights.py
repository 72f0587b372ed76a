"""All runs of one call: an autopilot that starts again begins a new one."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

from cosim.errors import RunError
from cosim.run import Run
from cosim.sitl.flight import Flight
from cosim.sitl.law import AutopilotLaw
from cosim.sitl.scenario import SCENARIO, scenario_to_fly
from plant_fmu import Vehicle, cached_fmu

_SOME_RATE = 1000  # Hz, with which a scenario is tried before an autopilot comes


@dataclass(frozen=True)
class FlightOptions:
    """What is flown, and what is left of it."""

    scenario: str | Path = SCENARIO
    overrides: tuple[str, ...] = ()
    vehicle: str | None = None  # None: the scenario's
    out: Path | None = None  # run folder; those of later runs have a number behind it
    record_rate: float = 100.0  # Hz, simulated
    report: bool = True


class Flights:
    """The present run and those before it.

    Parameters
    ----------
    options : FlightOptions
        What is flown.
    autopilot : str
        What stands for the law in summary and report.
    law_of : callable
        Makes the law of a vehicle.

    Attributes
    ----------
    flight : Flight or None
        The present one.
    law : AutopilotLaw
        Of the present one.

    Raises
    ------
    ScenarioError, RunError, BuildError
        If what is to be flown cannot be: it is tried at once, before anybody waits for an autopilot.
    """

    def __init__(self, options: FlightOptions, autopilot: str, law_of: Callable[[Vehicle], AutopilotLaw]) -> None:
        self._options, self._autopilot, self._law_of = options, autopilot, law_of
        out = options.out
        if out and out.exists() and not (out.is_dir() and not any(out.iterdir())):
            raise RunError(f"{out}: exists and is not empty; expected a new folder")
        scenario = scenario_to_fly(options.scenario, options.overrides, options.vehicle, _SOME_RATE, autopilot)
        self._vehicle = scenario.vehicle
        self.law = law_of(self._vehicle)
        cached_fmu(self._vehicle, scenario.plant.fmi)
        self.flight: Flight | None = None
        self._ended: list[tuple[Flight, str]] = []

    def begin(self, frame_rate: int) -> Flight:
        """Begin a run at the rate of an autopilot's frames [Hz].

        Raises
        ------
        RunError, ScenarioError, PlantError, BuildError, DefinitionError
            As `scenario_to_fly` and `Flight`.
        """
        o = self._options
        scenario = scenario_to_fly(o.scenario, o.overrides, o.vehicle, frame_rate, self._autopilot)
        self.law = self._law_of(scenario.vehicle)
        out = o.out and (o.out.with_name(f"{o.out.name}-{len(self._ended) + 1}") if self._ended else o.out)
        self.flight = Flight(scenario, self.law, out, o.record_rate)
        return self.flight

    def end(self, status: str) -> None:
        """End the present run, if there is one, with a summary that says how; its report waits for `conclude`."""
        flight, self.flight = self.flight, None
        if flight is not None:
            self._ended.append((flight, status))
            flight.end()
            flight.conclude(status, report=False)

    def conclude(self) -> list[Run]:
        """Write the reports of all runs, unless they are not wanted, and return those that came to a record.

        Raises
        ------
        RunError
            If one cannot be written.
        """
        runs = []
        for flight, status in self._ended:
            summary = flight.conclude(status, self._options.report)
            if summary is not None:
                runs.append(Run(flight.folder, summary))
        return runs
