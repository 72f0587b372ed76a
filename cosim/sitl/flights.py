"""All runs of one call: an autopilot that starts again begins a new one."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

from cosim.errors import CosimError, RunError
from cosim.results.run_result import Run
from cosim.sitl.flight import Flight
from cosim.sitl.law import AutopilotLaw
from cosim.sitl.scenario import SCENARIO, scenario_to_fly
from plant_fmu import PlantFmuError, Vehicle
from plant_fmu.build import cached_fmu

RESTARTED = "ended: the autopilot started again"

_SOME_RATE = 1000  # Hz, with which a scenario is tried before an autopilot comes


@dataclass
class Counts:
    """Frames of the autopilot, by what became of them."""

    steps: int = 0
    waited: int = 0  # before the first one, with the vehicle held
    resent: int = 0  # answered again, without a step
    lost: int = 0  # that have not come
    malformed: int = 0
    refused: int = 0  # of a second sender
    unsent: int = 0  # answers that the network did not take


@dataclass(frozen=True)
class Outcome:
    """What an autopilot leaves."""

    runs: list[Run]
    counts: Counts


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
        """End the present run, if there is one, with a summary that says how; its report waits for the end of all."""
        flight, self.flight = self.flight, None
        if flight is not None:
            flight.end()
            if flight.steps:
                self._ended.append((flight, status))
                flight.conclude(status, report=False)

    def fly(self, work: Callable[[], str], counts: Counts) -> Outcome:
        """Let a server work until it ends, and conclude what it leaves.

        Parameters
        ----------
        work : callable
            Begins and steps flights; returns how it ended.
        counts : Counts
            Of the server.

        Returns
        -------
        Outcome
            The status of its last run says how it ended.

        Raises
        ------
        RunError
            If a run cannot be written, or no autopilot came.
        PlantFmuError, CosimError
            If a run fails; what was recorded until then is left readable.
        KeyboardInterrupt
            If Ctrl-C came before there was a run.
        """
        failure: Exception | None = None
        interrupted = False
        try:
            status = work()
        except KeyboardInterrupt:
            status, interrupted = "interrupted", True
        except (PlantFmuError, CosimError) as error:
            status, failure = f"failed: {error}", error
        self.end(status)
        runs = self._conclude()
        if failure:
            raise failure
        if not runs:
            raise KeyboardInterrupt if interrupted else RunError(f"no autopilot came: {status}")
        return Outcome(runs, counts)

    def _conclude(self) -> list[Run]:
        """Write the reports of all runs that made a step, unless they are not wanted, and return these runs."""
        report = self._options.report
        return [flight.conclude(status, report) for flight, status in self._ended]
