"""A nonlinear model predictive controller (CasADi) on scored scenes, with the knowledge that the laws have.

It plans every `PERIOD` by `benchmarks.peers.casadi_nmpc`, in the peers' environment, with the observer of `pid_cbf`;
the forces hold until the next plan. The time that a plan takes is measured, and not part of the simulation.
"""

from __future__ import annotations

import contextlib
import json
import statistics
from collections.abc import Iterable, Iterator
from pathlib import Path
from typing import Any, ClassVar, NamedTuple

import msgspec
import numpy as np

from benchmarks.baselines import FIRST_SEED, KINDS, format_outcome, outcome
from benchmarks.peer_environment import Environment
from benchmarks.peer_process import PeerProcess, peer
from controller import LAWS, VehicleModel, VehicleState
from controller.compiling.function import CompiledFunction
from controller.law import Array, CompiledLaw, Output, validate_gains
from controller.laws.pid_cbf import PidCbfGains, PidCbfLaw, observe
from controller.quaternion import error_parts, write_rotation
from controller.regions import Sphere
from controller.regions.region_set import PackedRegions
from cosim.campaigns.scenes.as_scenario import VEHICLE
from cosim.campaigns.scenes.conditions import Conditions
from cosim.campaigns.scenes.flyer import SceneFlyer, Score
from cosim.campaigns.scenes.generator import make_scene
from cosim.campaigns.scenes.scene import Scene
from cosim.scenario.vehicle_model import vehicle_model
from plant_fmu import load_vehicle

PERIOD = 0.1  # s between plans
OBSTACLES = 8  # the nearest, that a plan knows of
ITERATIONS = 15  # of the solver, at most
DURATION = 40.0  # s of a flight, of which the last 10 s must be within the goal region
COUNT = 100  # scenes of a kind
SEARCHED = 15  # scenes of a kind that each setting flies in the search
_OBSERVE = CompiledFunction(observe)


class NmpcGains(NamedTuple):
    """Numbers of the controller; horizon, margin and price of force are what `search` found best."""

    stages: float = 12.0
    interval: float = 0.3  # s, of a stage
    margin: float = 0.1  # m
    w_p: float = 10.0  # 1/m, of the distance to the set point
    w_u: float = 1e-3  # 1/N2, of the forces
    w_m: float = 0.1  # 1/N2, of moments that the attitude's loop asks for
    w_v: float = 50.0  # s2/m2, of the last velocity
    observer: float = 2.0  # rad/s
    k_p2: float = 36.0  # N m, section VII
    k_v2: float = 40.0  # N m s/rad, section VII


HORIZONS = ((8.0, 0.3), (12.0, 0.3), (12.0, 0.5))  # stages, and their length [s], of the search
MARGINS = (0.05, 0.1)  # m, of the search


class _Step:
    """The law's function, which the loop calls back: the observer at each step, a plan at some."""

    process: PeerProcess | None = None
    times: ClassVar[list[float]] = []  # s, of all plans
    failures = 0  # plans that did not converge

    def __call__(
        self,
        state: VehicleState,
        goal: PackedRegions,
        regions: PackedRegions,
        weights: Array,
        gains: NmpcGains,
        memory: _Memory,
        forces: Array,
    ) -> None:
        observer, R = memory.observer, np.zeros((3, 3))
        write_rotation(state.quaternion, R)
        _OBSERVE(observer.memory, state, R, observer.gains)
        if memory.steps[0] % memory.plan_every == 0:
            forces[:] = self._plan(state, goal, regions, gains, observer, R, memory.steps[0] == 0)
            observer.memory.thrusters.forces[:] = forces
        memory.steps[0] += 1

    def _plan(
        self,
        state: VehicleState,
        goal: PackedRegions,
        regions: PackedRegions,
        gains: NmpcGains,
        observer: PidCbfLaw,
        R: Array,
        again: bool,
    ) -> list[float]:
        known = observer.memory
        error = np.array(error_parts(known.desired_quaternion, state.quaternion)[1:])
        lost = known.dynamics.mass[3:, 3:] @ known.disturbance[3:]
        balls, band = [], (-1e3, 1e3)
        for i in range(regions.kinds.size):
            first = regions.offsets[i]
            if regions.kinds[i] == Sphere.kind:
                center = regions.numbers[first : first + 3] + regions.shifts[i]
                balls.append([*center, regions.numbers[first + 3], *regions.velocities[i]])
            else:
                middle, half = regions.numbers[first : first + 2]
                band = (middle - half, middle + half)
        first = goal.offsets[0]
        given = {
            "position": known.position.tolist(),
            "velocity": known.velocity[:3].tolist(),
            "R": R.tolist(),
            "disturbance": known.disturbance[:3].tolist(),
            "moment": (-gains.k_p2 * error - gains.k_v2 * known.velocity[3:] - lost).tolist(),
            "hold": (-lost).tolist(),
            "goal": (goal.numbers[first : first + 3] + goal.shifts[0]).tolist(),
            "spheres": balls,
            "band": band,
            "margin": gains.margin,
            "again": again,
        }
        assert self.process is not None
        answer = self.process.exchange(json.dumps(given))
        self.times.append(answer["seconds"])
        self.failures += not answer["success"]
        return list(answer["forces"])


class _Memory(NamedTuple):
    estimate: Array
    report: Array
    observer: PidCbfLaw
    plan_every: int
    steps: list[int]


class NmpcLaw(CompiledLaw):
    """The controller as a law that scenes are flown by."""

    name = "nmpc"
    output: ClassVar[Output] = "thrusters"
    function = _Step()
    gains_type = NmpcGains

    @classmethod
    def for_vehicle(
        cls, vehicle: VehicleModel, gains: NmpcGains, desired_quaternion: Array, period: float, n_regions: int
    ) -> NmpcLaw:
        """Return the law, as `CompiledLaw.for_vehicle`."""
        law = cls()
        observing = PidCbfGains(observer=gains.observer)
        observer = PidCbfLaw(vehicle, observing, desired_quaternion, period, n_regions)
        law.gains, law.n_regions = validate_gains(gains, ("stages", "interval", "observer")), n_regions
        law.n_forces = vehicle.thruster_matrix.shape[1]
        law.memory = _Memory(np.zeros(4), np.zeros(0), observer, max(round(PERIOD / period), 1), [0])
        return law


def _setup(gains: NmpcGains, vehicle: VehicleModel) -> dict[str, Any]:
    """Return the setup of the peer."""
    weights = {name: value for name, value in gains._asdict().items() if name.startswith("w_")}
    return weights | {
        "stages": round(gains.stages),
        "interval": gains.interval,
        "period": PERIOD,
        "obstacles": OBSTACLES,
        "iterations": ITERATIONS,
        "mass": (vehicle.rigid_mass + vehicle.added_mass)[:3, :3].tolist(),
        "linear": vehicle.linear_damping[:3].tolist(),
        "quadratic": vehicle.quadratic_damping[:3].tolist(),
        "thrusters": vehicle.thruster_matrix.tolist(),
        "least": vehicle.thrust_min.tolist(),
        "most": vehicle.thrust_max.tolist(),
    }


@contextlib.contextmanager
def planner(gains: NmpcGains, environment: Environment) -> Iterator[None]:
    """Start the peer that plans for `NmpcLaw` by some gains, whose margin may still change.

    Parameters
    ----------
    gains : NmpcGains
        Of the controller.
    environment : Environment
        That has CasADi.

    Raises
    ------
    NotMeasuredError
        If CasADi is not installed, or cannot begin.
    """
    LAWS["nmpc"] = NmpcLaw
    setup = _setup(gains, vehicle_model(load_vehicle(VEHICLE)))
    with peer(environment, "casadi", "casadi_nmpc", "controller", setup) as NmpcLaw.function.process:
        yield


def fly(gains: NmpcGains, kind: str, seed: int, count: int) -> list[Score]:
    """Fly scenes of a kind, of some seeds on, with the peer started; `NmpcLaw.function` then has the plans' times."""
    NmpcLaw.function.times.clear()
    NmpcLaw.function.failures = 0
    with SceneFlyer("nmpc", Conditions(duration=DURATION), gains) as flyer:
        return [flyer.fly(msgspec.convert(make_scene(seed + i, kind), Scene))[0] for i in range(count)]


def search(environment: Environment) -> NmpcGains:
    """Fly each of `HORIZONS` with each of `MARGINS`; return the best, by the order of `benchmarks.baselines`."""
    found: list[tuple[tuple[int, int, float], NmpcGains]] = []
    for stages, interval in HORIZONS:
        gains = NmpcGains(stages=stages, interval=interval)
        with planner(gains, environment):
            for margin in MARGINS:
                gains = gains._replace(margin=margin)
                flown = outcome(score for kind in KINDS for score in fly(gains, kind, FIRST_SEED, SEARCHED))
                print(f"{stages:g} stages of {interval} s, margin {margin} m: {format_outcome(flown)}", flush=True)
                found.append((flown.rank, gains))
    return min(found)[1]


def main(
    kinds: Iterable[str], seed: int, count: int, searches: bool, python: str | None = None, out: Path | None = None
) -> None:
    """Fly scenes of some kinds, and print the outcome; or search first.

    Parameters
    ----------
    kinds : iterable of str
        Of scenes.
    seed : int
        Of the first scene.
    count : int
        Scenes of a kind.
    searches : bool
        Search the settings, instead of the defaults.
    python : str, optional
        That has CasADi; default: the benchmarks' own.
    out : Path, optional
        Receives a line of JSON for each flight.
    """
    environment = Environment(python)
    gains = search(environment) if searches else NmpcGains()
    with planner(gains, environment):
        for kind in kinds:
            scores = fly(gains, kind, seed, count)
            times, failures = sorted(1e3 * t for t in NmpcLaw.function.times), NmpcLaw.function.failures
            least = min(score.min_clearance for score in scores)
            print(f"{kind}: {format_outcome(outcome(scores))}; least clearance {least:.3f} m")
            print(
                f"  a plan: median {statistics.median(times):.1f} ms, 99 % {times[int(0.99 * len(times))]:.1f} ms, "
                f"longest {times[-1]:.1f} ms; {failures} of {len(times)} not converged",
                flush=True,
            )
            if out is not None:
                with out.open("a", encoding="utf-8") as file:
                    file.writelines(json.dumps({"kind": kind} | score._asdict()) + "\n" for score in scores)
