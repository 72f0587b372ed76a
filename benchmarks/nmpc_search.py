"""Tune the NMPC gains by random search, and fly scenes with them.

Draws race the best as in `benchmarks.baselines`, safety first. Every flight is a line of a file; a flight that is
already in the file is not repeated, so that an interrupted search or campaign can continue.
"""

from __future__ import annotations

import json
import math
import statistics
from collections.abc import Iterable
from pathlib import Path
from typing import Any, NamedTuple

import msgspec
import numpy as np

from benchmarks.baselines import FIRST_SEED, KINDS, Candidate, draw_gains, format_outcome, outcome, race
from benchmarks.nmpc import NmpcGains, NmpcLaw, Planners
from benchmarks.peer_environment import Environment
from cosim.campaigns.scenes.conditions import Conditions
from cosim.campaigns.scenes.flyer import SceneFlyer, Score
from cosim.campaigns.scenes.generator import MAKERS
from cosim.campaigns.scenes.scenario_scene import ScenarioScene
from cosim.campaigns.scenes.scene import Scene
from plant_fmu.vehicle import load_vehicle

FLOWN = (*KINDS, "conflict")  # kinds of scenes
COUNT = 100  # default number of scenes of a kind
DURATION = 30.0  # s, duration of a flight; a plain or hard scene not reached in it is flown again, for longer
LONGER = {"search": 60.0, "campaign": 120.0}  # s, duration of the second flight
RANGES = {
    "interval": (0.15, 0.6),
    "margin": (0.03, 0.2),
    "w_u": (0.1, 3.0),
    "w_m": (10.0, 300.0),
    "w_v": (5.0, 500.0),
    "observer": (0.5, 8.0),
}
STAGES = (8.0, 12.0)  # candidate numbers of stages
SCENES = 30  # number of scenes, plain and hard ones together
HEATS = ((4, 1.3), (10, 1.15), (SCENES, 1.0))  # like those of `benchmarks.baselines`
PHASES = ((0.5, math.inf), (0.25, 1.5), (0.25, 1.15))  # fraction of the draws, greatest factor from the best
DRAWS = 24


class Flight(NamedTuple):
    """Score of a flight, with the computation times of its plans."""

    score: Score
    times: list[float]  # ms, computation times of the plans
    failures: int  # number of plans that did not converge


class Flights:
    """Fly scenes with the controller, each once; a file, with one flight per line, has the earlier ones."""

    def __init__(self, environment: Environment, path: Path | None = None) -> None:
        self._planners, self._path = Planners(environment), path
        self._known: dict[str, Flight] = {}
        if path is not None and path.exists():
            for line in path.read_text(encoding="utf-8").splitlines():
                flown = json.loads(line)
                self._known[_key(flown)] = Flight(
                    msgspec.convert(flown["score"], Score), flown["times"], flown["failures"]
                )

    def fly(self, gains: NmpcGains, kind: str, seed: int, longer: float) -> Flight:
        """Fly a scene for `DURATION`; fly a plain or hard one whose goal is not reached again, for `longer` [s]."""
        flown = self._fly(gains, kind, seed, DURATION)
        is_final = flown.score.reached or kind not in KINDS  # other scenes have a duration of their own
        return flown if is_final else self._fly(gains, kind, seed, longer)

    def _fly(self, gains: NmpcGains, kind: str, seed: int, duration: float) -> Flight:
        flight_key = {"kind": kind, "seed": seed, "duration": duration, "gains": list(gains)}
        if (key := _key(flight_key)) in self._known:
            return self._known[key]
        self._planners.choose(round(gains.stages), kind in KINDS)
        scene_type: Any = Scene if kind in KINDS else ScenarioScene
        scene = msgspec.convert(MAKERS[kind](seed), scene_type)
        lag = _lag(scene) if isinstance(scene, ScenarioScene) else 0.0
        with SceneFlyer("nmpc", Conditions(duration=duration), gains._replace(lag=lag)) as flyer:
            score, _ = flyer.fly(scene)
        flight = Flight(score, [round(1e3 * t, 2) for t in NmpcLaw.function.times], NmpcLaw.function.failures)
        self._known[key] = flight
        if self._path is not None:
            with self._path.open("a", encoding="utf-8") as file:
                file.write(json.dumps(flight_key | flight._asdict()) + "\n")
        return flight

    def close(self) -> None:
        """End the planners."""
        self._planners.close()


def _lag(scene: ScenarioScene) -> float:
    """Return the lag of the first thruster [s]."""
    parameters = scene.scenario["plant"]["parameters"]
    file = load_vehicle(scene.scenario["vehicle"]).thrust_time_constant
    return float(parameters.get("thrust_time_constant[1]", file[0]))


def _key(flight: dict[str, Any]) -> str:
    return json.dumps([flight[name] for name in ("kind", "seed", "duration", "gains")])


def search(flights: Flights, count: int, seed: int) -> Candidate:
    """Search for the best numbers of the controller, half of the draws from the ranges, the others near the best."""
    rng = np.random.default_rng(seed)

    def fly_on(candidate: Candidate, scenes: Iterable[int]) -> Candidate:
        more = {
            i: flights.fly(candidate.gains, KINDS[i % 2], FIRST_SEED + i // 2, LONGER["search"]).score
            for i in scenes
            if i not in candidate.scores
        }
        return Candidate(candidate.gains, candidate.scores | more)

    best = fly_on(Candidate(NmpcGains(), {}), range(SCENES))
    print(f"nmpc: {best.gains}: {format_outcome(best.outcome)}", flush=True)
    for share, near in PHASES:
        for _ in range(math.ceil(share * count)):
            gains = draw_gains(NmpcGains, RANGES, rng, best.gains if near < math.inf else None, near)
            stages = float(rng.choice(STAGES)) if near == math.inf else best.gains.stages
            candidate = race(gains._replace(stages=stages), best, fly_on, HEATS)
            if len(candidate.scores) == SCENES and candidate.outcome.rank < best.outcome.rank:
                best = candidate
                print(f"nmpc: {best.gains}: {format_outcome(best.outcome)}", flush=True)
    return best


def main(
    kinds: Iterable[str], seed: int, count: int, draws: int, python: str | None = None, out: Path | None = None
) -> None:
    """Fly scenes of some kinds, and print the outcome; or search for the numbers instead."""
    flights = Flights(Environment(python), out)
    try:
        if draws:
            search(flights, draws, seed)
            return
        for kind in kinds:
            flown = [flights.fly(NmpcGains(), kind, seed + i, LONGER["campaign"]) for i in range(count)]
            _print_flights(kind, flown)
    finally:
        flights.close()


def _print_flights(kind: str, flown: list[Flight]) -> None:
    scores = [flight.score for flight in flown]
    times = sorted(t for flight in flown for t in flight.times)
    reached = sorted(score.reach_time for score in scores if score.reached)
    print(f"{kind}: {format_outcome(outcome(scores))}")
    print(
        f"  least clearance {min(score.min_clearance for score in scores):.3f} m; "
        f"slowest 5 % from {reached[int(0.95 * len(reached))] if reached else math.inf:.1f} s on; "
        f"variation of the thrust {statistics.median(score.thrust_variation for score in scores):.0f} N; "
        f"weighted violation {statistics.fmean(score.weighted_violation for score in scores):.1f} m s"
    )
    print(
        f"  a plan: median {statistics.median(times):.1f} ms, 99 % {times[int(0.99 * len(times))]:.1f} ms, longest "
        f"{times[-1]:.1f} ms; {sum(flight.failures for flight in flown)} of {len(times)} not converged",
        flush=True,
    )
