"""Time of one compiled control step of each law, with few and many obstacles."""

from __future__ import annotations

import time
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from benchmarks.table import Row, with_base
from benchmarks.timing import Timing
from controller import LAWS, VehicleState
from controller.compiling.function import BoundCall
from controller.regions import DepthBand, Region, Sphere, pack
from controller.regions.region_set import PackedRegions
from controller.translator.foreign import POINTER, call_c
from cosim.scenario.vehicle_model import vehicle_model
from cosim.step.plant_calls import Clock, seconds
from plant_fmu.vehicle import load_vehicle

STEPS = 2_000
RATIO = "how many times as long as the paper's law"
OBSTACLES = (1, 6, 14, 40)  # numbers of obstacles
_PERIOD = 0.02  # s, control period
_SPEED = 0.6  # m/s, speed of the vehicle along its path


def _scenery(obstacles: int) -> tuple[PackedRegions, PackedRegions]:
    """Return goal and regions as in a scored scene: spheres across the path, and a depth band."""
    rng = np.random.default_rng(obstacles)
    balls = []
    while len(balls) < obstacles:
        center, radius = rng.normal([5.0, 0.0, 3.0], [1.5, 1.5, 1.0]), rng.uniform(0.3, 0.9)
        if min(np.linalg.norm(center - [0.0, 0.0, 3.0]), np.linalg.norm(center - [10.0, 0.0, 3.0])) > radius + 1.2:
            balls.append(Region(f"obstacle {len(balls) + 1}", Sphere(tuple(center.tolist()), float(radius)), "out"))
    band = Region("depth band", DepthBand(3.65, 3.35), "in")
    return pack([Region("goal", Sphere((10.0, 0.0, 3.0), 0.5), "in")]), pack([*balls, band])


class _Track(NamedTuple):
    """The inputs of a law at each step, and the state that it reads them from."""

    state: VehicleState
    places: Any  # (k, 3) m, NED, measured positions
    velocities: Any  # (k, 3) m/s, body frame, measured velocities


def _steps(track: _Track, law: int, words: int, work: Any, clock: Any, times: Any) -> None:
    """Run a law's steps along its path, and write the time of each [s]; call `law`, an address, with its `words`."""
    state = track.state
    for k in range(track.places.shape[0]):
        for axis in range(3):
            state.position[axis] = track.places[k, axis]
            state.velocity_body[axis] = track.velocities[k, axis]
        before = seconds(clock, work)
        call_c(law, (POINTER,), words)
        times[k, 0] = seconds(clock, work) - before
        before = seconds(clock, work)
        times[k, 1] = seconds(clock, work) - before  # time to read the clock


class LawSteps:
    """A contestant: steps of a law on a flight straight at the obstacles, past them and back again, in process time."""

    def __init__(self, law: str, obstacles: int) -> None:
        self._vehicle, self._scenery = vehicle_model(load_vehicle("odin")), _scenery(obstacles)
        self._kind, self._clock = LAWS[law], _process_clock()
        self.each(1)  # compiles

    def seconds(self, count: int) -> float:
        """Run `count` steps, and return the sum of their times [s]."""
        return float(self.each(count).sum())

    def each(self, count: int) -> NDArray[np.float64]:
        """Run `count` steps from a new start, and return the time of each [s]."""
        vehicle, (goal, regions), kind = self._vehicle, self._scenery, self._kind
        gains, n, m = kind.gains_type(), regions.kinds.size, vehicle.thruster_matrix.shape[1]
        forces, level = np.zeros(m if kind.output == "thrusters" else 6), np.array([1.0, 0.0, 0.0, 0.0])
        state = VehicleState(np.zeros(3), level, np.zeros(6), np.ones(m))
        rng, times, work = np.random.default_rng(0), np.zeros((count, 2)), np.zeros(2, np.int64)
        gone = np.arange(count) * _PERIOD * _SPEED
        along = np.abs((gone + 8.0) % 16.0 - 8.0)
        places = np.c_[along, 0.1 * np.sin(along), np.full(count, 3.0)] + 0.02 * rng.normal(size=(count, 3))
        velocities = np.c_[np.where(gone % 16.0 < 8.0, _SPEED, -_SPEED), np.zeros((count, 2))]
        velocities += 0.01 * rng.normal(size=(count, 3))
        law = kind.for_vehicle(vehicle, gains, level, _PERIOD, n).bound(state, goal, regions, np.ones(n), forces)
        BoundCall(_steps, (_Track(state, places, velocities), law.address, law.words, work, self._clock, times)).call()
        taken: NDArray[np.float64] = times[:, 0] - np.median(times[:, 1])
        return taken


def _process_clock() -> Any:
    """Return the numbers of a clock of this process's CPU time; if the system has none, of the usual clock."""
    clock = Clock().numbers
    if hasattr(time, "CLOCK_PROCESS_CPUTIME_ID") and clock[1] >= 0:
        clock[1] = time.CLOCK_PROCESS_CPUTIME_ID
    return clock


def measure(steps: int, repeats: int) -> list[Row]:
    """Time each step of each law on its own, in process time."""
    rows = []
    for obstacles in OBSTACLES:
        timings: dict[str, Timing | str] = {}
        for law in sorted(LAWS, key=lambda name: name != "ismail_dunnigan"):
            contestant = LawSteps(law, obstacles)
            samples = [contestant.each(steps) for _ in range(repeats + 1)][1:]  # the first warms the caches
            timings[f"{law}, {obstacles} obstacles"] = Timing(tuple(np.concatenate(samples).tolist()))
        rows += with_base(timings)
    return rows
