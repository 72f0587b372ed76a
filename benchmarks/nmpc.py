"""A nonlinear model predictive controller (CasADi) on scored scenes, with the knowledge that the laws have.

It plans every `PERIOD` by `benchmarks.peers.casadi_nmpc`, in the peers' environment, with the observer of `pid_cbf`;
the forces hold until the next plan. The time that a plan takes is measured, and not part of the simulation.

It is given the lag of the thrusters, which the laws are not: the observer gets the forces behind it, and a plan begins
at the state that they lead to.

Spheres and bands of depth are constraints as they are. Of every other region it knows the tangent plane nearest to
where the plan before is at each stage.
"""

from __future__ import annotations

import contextlib
import json
import math
from typing import Any, ClassVar, NamedTuple

import numpy as np

from benchmarks.peer_environment import Environment
from benchmarks.peer_process import PeerProcess, peer
from controller import LAWS, VehicleState
from controller.compiling.function import CompiledFunction
from controller.law import Array, CompiledLaw, Output, VehicleModel, validate_gains
from controller.laws.pid_cbf import PidCbfGains, PidCbfLaw, observe
from controller.quaternion import error, rotation_matrix
from controller.regions import DepthBand, Sphere
from controller.regions.kinds import FIRST_OF_ATTITUDE
from controller.regions.region_set import PackedRegions, position_clearance

PERIOD = 0.1  # s, time between plans
ITERATIONS = 15  # maximum number of the solver's iterations
# numbers of constraints of a plan among spheres: the nearest spheres, and the two planes of a depth band
SPHERES = {"obstacles": 8, "hard": 2, "soft": 0}
SHAPES = {"obstacles": 0, "hard": 2, "soft": 3}  # numbers of constraints of a plan among regions of other shapes
_FREE = (0.0, 0.0, 0.0, -1e3)  # a plane that is always satisfied
_OBSERVE = CompiledFunction(observe)


class NmpcGains(NamedTuple):
    """Numbers of the controller; all but the last five are from `benchmarks.nmpc_search`."""

    stages: float = 12.0  # number of stages of the horizon
    interval: float = 0.3627  # s, duration of a stage
    margin: float = 0.05005  # m, distance to keep from regions
    w_u: float = 0.115  # weight of the forces, as fractions of the greatest forces
    w_m: float = 10.58  # weight of the attitude loop's moments that the plan lacks, scaled by 1.52 rad/s2 times inertia
    w_v: float = 211.6  # s2/m2, weight of the velocity at the end of the horizon
    observer: float = 6.281  # rad/s, bandwidth of the observer
    w_p: float = 10.0  # 1/m, weight of the distance to the goal
    w_s: float = 100.0  # 1/m, weight of the depth within soft regions
    k_p2: float = 4.5  # 1/s2, attitude gain by section VII for the inertia of ODIN
    k_v2: float = 5.0  # 1/s, gain of the angular velocity by section VII
    lag: float = 0.0  # s, time constant of the thrusters


class _Step:
    """The law's function: it runs the observer at each step, and makes a plan every `PERIOD`."""

    def __init__(self, process: PeerProcess | None = None) -> None:
        self.process = process
        self.times: list[float] = []  # s, computation times of all plans
        self.failures = 0  # number of plans that did not converge

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
        observer = memory.observer
        memory.R[:] = rotation_matrix(state.quaternion)
        _OBSERVE(observer.memory, state, memory.R, observer.gains)
        if memory.steps[0] % memory.plan_every == 0:
            forces[:] = self._plan(state, goal, regions, gains, memory)
        given = observer.memory.thrusters.forces  # forces of the thrusters behind their lag [N]
        given += (1.0 - memory.left) * (forces - given)
        memory.steps[0] += 1

    def _plan(
        self, state: VehicleState, goal: PackedRegions, regions: PackedRegions, gains: NmpcGains, memory: _Memory
    ) -> list[float]:
        known, again = memory.observer.memory, memory.steps[0] == 0
        if again:
            memory.path[:] = known.position
        mass, R, lag, velocity = known.dynamics.mass, memory.R, gains.lag, known.velocity
        inertia, body = mass[3:, 3:], R.T @ velocity[:3]
        lost = inertia @ known.disturbance[3:] - np.cross(body, mass[:3, :3] @ body)  # Munk moment
        # predict the state over the lag of the thrusters, with their present forces
        wrench = np.array(memory.vehicle["thrusters"]) @ known.thrusters.forces
        drag = (memory.vehicle["linear"] + memory.vehicle["quadratic"] * np.abs(body)) * body
        later = velocity + lag * known.disturbance
        later[:3] += lag * R @ np.linalg.solve(mass[:3, :3], wrench[:3] - drag)
        later[3:] += lag * np.linalg.solve(inertia, wrench[3:] + lost - inertia @ known.disturbance[3:])
        e_att = error(known.desired_quaternion, state.quaternion)[1:] + 0.5 * lag * velocity[3:]
        turning = inertia @ (gains.k_p2 * e_att + gains.k_v2 * later[3:])
        first = goal.offsets[0]
        given = {
            "position": (known.position + lag * velocity[:3]).tolist(),
            "velocity": later[:3].tolist(),
            "R": R.tolist(),
            "disturbance": known.disturbance[:3].tolist(),
            "moment": (-turning - lost).tolist(),
            "hold": (-lost).tolist(),
            "goal": (goal.numbers[first : first + 3] + goal.shifts[0] + lag * goal.velocities[0]).tolist(),
            "goal_velocity": goal.velocities[0].tolist(),
            "weights": gains._asdict(),
            "again": again,
            **constraints(regions, memory.path, gains.interval),
        }
        if again:
            given["vehicle"] = memory.vehicle
        assert self.process is not None
        answer = self.process.exchange(json.dumps(given))
        self.times.append(answer["seconds"])
        self.failures += not answer["success"]
        memory.path[:] = answer["path"]
        return list(answer["forces"])


def constraints(regions: PackedRegions, path: Array, interval: float) -> dict[str, Any]:
    """Return the constraints of a plan that stand for regions; path (stages, 3) [m, NED], interval [s]."""
    # Spheres have center [m, NED], radius [m] and velocity [m/s, NED]; planes of hard and soft regions a row for each
    # stage: a unit normal [NED], and the least coordinate along it [m].
    spheres: list[list[float]] = []
    planes: dict[bool, list[Any]] = {True: [], False: []}
    slope = np.zeros(3)
    for i in range(regions.kinds.size):
        first, hard = regions.offsets[i], bool(regions.hard[i])
        if regions.kinds[i] == Sphere.kind and regions.signs[i] < 0.0:
            center = regions.numbers[first : first + 3] + regions.shifts[i]
            spheres.append([*center, regions.numbers[first + 3], *regions.velocities[i]])
        elif regions.kinds[i] == DepthBand.kind and regions.signs[i] > 0.0:
            middle, half = regions.numbers[first : first + 2]
            middle += regions.shifts[i, 2]
            planes[hard] += [
                [(0.0, 0.0, 1.0, middle - half)] * len(path),
                [(0.0, 0.0, -1.0, -middle - half)] * len(path),
            ]
        elif regions.kinds[i] < FIRST_OF_ATTITUDE:
            rows = []
            for k, place in enumerate(path):
                moved = (k + 1) * interval * regions.velocities[i]
                clearance = position_clearance(regions, i, place - moved, slope)
                along = float(slope @ place)
                rows.append((*slope.tolist(), along - clearance) if slope.any() else _FREE)
            planes[hard].append(rows)
    return {"spheres": spheres, "hard": planes[True], "soft": planes[False]}


class _Memory(NamedTuple):
    estimate: Array
    report: Array
    observer: PidCbfLaw
    R: Array  # (3, 3) rotation matrix from body to world
    path: Array  # (stages, 3) m, NED, expected positions of the vehicle at the stages of the next plan
    vehicle: dict[str, Any]  # vehicle as the planner receives it
    plan_every: int  # number of steps between plans
    left: float  # remaining fraction of a force error after a period, by the lag of the thrusters
    steps: list[int]


class NmpcLaw(CompiledLaw):
    """The controller as a law that scenes are flown by."""

    name = "nmpc"
    output: ClassVar[Output] = "thrusters"
    function: ClassVar[_Step] = _Step()
    gains_type = NmpcGains

    @classmethod
    def for_vehicle(
        cls, vehicle: VehicleModel, gains: NmpcGains, desired_quaternion: Array, period: float, n_regions: int
    ) -> NmpcLaw:
        """Return the law for a vehicle, like `CompiledLaw.for_vehicle`."""
        law = cls()
        observing = PidCbfGains(observer=gains.observer)
        observer = PidCbfLaw(vehicle, observing, desired_quaternion, period, n_regions)
        law.gains, law.n_regions = validate_gains(gains, ("stages", "interval", "observer")), n_regions
        law.n_forces = vehicle.thruster_matrix.shape[1]
        law.memory = _Memory(
            estimate=np.zeros(4),
            report=np.zeros(0),
            observer=observer,
            R=np.zeros((3, 3)),
            path=np.zeros((round(gains.stages), 3)),
            vehicle=_plain(vehicle),
            plan_every=max(round(PERIOD / period), 1),
            left=math.exp(-period / gains.lag) if gains.lag > 0.0 else 0.0,
            steps=[0],
        )
        return law


def _plain(vehicle: VehicleModel) -> dict[str, Any]:
    """Return the vehicle as the planner receives it."""
    return {
        "mass": (vehicle.rigid_mass + vehicle.added_mass)[:3, :3].tolist(),
        "inertia": np.diag(vehicle.rigid_mass + vehicle.added_mass)[3:].tolist(),
        "linear": vehicle.linear_damping[:3].tolist(),
        "quadratic": vehicle.quadratic_damping[:3].tolist(),
        "thrusters": vehicle.thruster_matrix.tolist(),
        "least": vehicle.thrust_min.tolist(),
        "most": vehicle.thrust_max.tolist(),
    }


class Planners:
    """Start the peers that plan for `NmpcLaw`, one for each number of stages and kind of constraints."""

    def __init__(self, environment: Environment) -> None:
        LAWS["nmpc"] = NmpcLaw
        self._environment, self._started = environment, contextlib.ExitStack()
        self._peers: dict[tuple[int, bool], PeerProcess] = {}

    def choose(self, stages: int, spheres: bool) -> None:
        """Select the planner of `NmpcLaw`: its number of stages, and constraints for spheres or for other shapes."""
        if (stages, spheres) not in self._peers:
            setup = {"stages": stages, "period": PERIOD, "iterations": ITERATIONS} | (SPHERES if spheres else SHAPES)
            started = peer(self._environment, "casadi", "casadi_nmpc", "controller", setup)
            self._peers[stages, spheres] = self._started.enter_context(started)
        NmpcLaw.function = _Step(self._peers[stages, spheres])

    def close(self) -> None:
        """End the peers."""
        self._started.close()
