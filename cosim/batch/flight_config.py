"""Inputs, workspace and outputs of a flight in the fused loop."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from controller import VehicleState
from controller.law import Diagnostic
from controller.navigation.estimate import NavigationMemory, empty_memory
from controller.navigation.measurements import SENSORS, VALUES, Measurements, SensorModel, empty_measurements
from controller.regions.region_set import PackedRegions
from cosim.simulation.arbiter_inputs import ArbiterSignals, PackedInputs, empty_signals, empty_state

Array = NDArray[np.float64]


class FlightConfig(NamedTuple):
    """Configuration of a flight, beside law and plant."""

    goal: PackedRegions
    regions: PackedRegions
    criteria: NDArray[np.int64]  # (n,) index of each region's criterion
    priorities: Array  # (n,) factor of each region's violation in the score; laws do not receive it
    inputs: PackedInputs  # sources of the arbiter's inputs
    step: float  # s, co-simulation step of the plant
    steps: int  # number of plant steps
    control_every: int  # plant steps between two control steps
    arbiter_every: int  # plant steps between two evaluations of the arbiter
    moving: bool  # True if any region moves
    goal_places: Array  # (p, 3) m, NED: shifts of the goal to its next positions, in turn
    goal_stay: int  # plant steps that the vehicle has to stay in the goal before it moves to its next position
    exact: bool  # True if law and arbiter receive the true state
    noise: Array  # (control steps, 6) m, m/s: added to position and linear velocity; (0, 6) if exact
    dead_from: float  # s, time at which position and linear velocity are lost
    dead_until: float  # s, time at which they are measured again
    frozen: bool  # True: their last values are held meanwhile; False: they are NaN
    through_sensors: bool  # True: the law receives the navigation filter's estimate
    sensors: SensorModel  # the filter's model of the sensors
    outage_steps: NDArray[np.int64]  # (o,) plant steps before which a sensor's loss probability changes, in order
    outage_sensors: NDArray[np.int64]  # (o,) index of the sensor
    outage_losses: Array  # (o,) new loss probability
    failed: NDArray[np.int64]  # (f,) thrusters that fail, from 0, in the order of their failures
    failure_steps: NDArray[np.int64]  # (f,) plant steps before which they fail
    remaining: Array  # (f,) remaining effectiveness; NaN for a thruster that is stuck at its last force
    report_failures: bool  # True if failures are reported to the law
    thrusters: int  # number of thrusters that give the wrench; 0: it acts on the body directly
    bound: int  # index in the law's report of its bound of the clearances; -1: it has none
    clock: NDArray[np.int64]  # (3,) numbers of a `c_calls.Clock`; (0,) if the law is not timed


class Allocator(NamedTuple):
    """Arguments of `controller.allocation.allocate`, with a stage for each number of reported failures."""

    inverse: Array  # (stages, m, 6) N per N, N m: thruster forces for a wrench
    lower: Array  # (stages, m) N
    upper: Array  # (stages, m) N
    direction: bool  # True: saturation keeps the wrench's direction; False: it cuts each thruster


class BoundLaw(NamedTuple):
    """A law for the loop: a C function with its arguments, some of which belong to the loop."""

    address: int
    words: int
    is_wrench: bool  # True: it gives a wrench; False: thruster forces
    estimate: Array  # (4,) N, N m: estimate of phi (12), in the law's memory
    expected: Array  # (6,) prediction for the next step, in the law's memory: m, NED, and m/s, body
    report: Array  # (r,) diagnostics, in the law's memory


class BoundArbiter(NamedTuple):
    """An arbiter for the loop: a C function with the workspace's signals and weights as its arguments."""

    address: int
    words: int


class Workspace(NamedTuple):
    """Arrays of a flight in progress."""

    state: VehicleState  # measured state, which the law receives
    arbiter_state: VehicleState  # state that the arbiter uses
    measurements: Measurements
    navigation: NavigationMemory
    now: Array  # (1,) s, time of the step
    signals: ArbiterSignals
    by_criterion: Array  # (criteria,) weight of each criterion
    weights: Array  # (n,) weight of each region's criterion
    clearances: Array  # (n,) m or rad, at the true pose
    arbiter_clearances: Array  # (n,) m or rad, at the arbiter's pose
    goal_clearance: Array  # (1,) m or rad
    wrench: Array  # (6,) N, N m, body frame
    before: Array  # (i,) commanded inputs of the step before
    stuck: Array  # (i,) inputs of stuck thrusters, NaN for others
    scratch: Array  # (3,) for `clearance_of_pose`
    ticks: NDArray[np.int64]  # (2,) for `c_calls.seconds`


def make_workspace(setup: FlightConfig, criteria: int, inputs: int, thrusters: int) -> Workspace:
    """Make the workspace of a flight."""
    n = setup.criteria.size
    return Workspace(
        state=VehicleState(np.zeros(3), np.zeros(4), np.zeros(6), np.ones(thrusters), np.zeros(12)),
        arbiter_state=empty_state(),
        measurements=empty_measurements(),
        navigation=empty_memory(),
        now=np.zeros(1),
        signals=empty_signals(setup.inputs, n, criteria),
        by_criterion=np.zeros(criteria),
        weights=np.zeros(n),
        clearances=np.zeros(n),
        arbiter_clearances=np.zeros(n),
        goal_clearance=np.zeros(1),
        wrench=np.zeros(6),
        before=np.zeros(inputs),
        stuck=np.full(inputs, np.nan),
        scratch=np.zeros(3),
        ticks=np.zeros(2, np.int64),
    )


class FlightMetrics(NamedTuple):
    """Metrics of a flight. Steps are those of the plant, -1 for none."""

    first_inside: float  # first step inside the goal region at the last of its positions
    last_entered: float  # first step of the last visit of the goal
    inside: bool  # True if inside at the end
    least_clearance: float  # m, least over hard regions in space; negative: violated; inf: there is none
    least_angle: float  # rad, the same for hard regions of attitude
    goal_clearance: float  # m, greatest; negative: the goal was never reached
    effort: float  # N s, integral of the magnitude of the force on the body
    thrust_effort: float  # N s, sum over thrusters of the integral of the given force's magnitude
    thrust_variation: float  # N, sum of the absolute changes of the commands, from 0 on
    max_force: float  # N, on the body
    max_speed: float  # m/s, over ground
    worst_step: float  # s of the wall clock, longest time of law and allocation in a step
    failed_step: float  # step in which the FMU failed
    bound_excess: float  # m, maximum excess of the law's bound over a clearance; -inf: no bound
    weighted_violation: float  # m s, rad s: sum over regions of priority times the integral of the violation depth


class FlightOutputs(NamedTuple):
    """Outputs of a flight."""

    metrics: Array  # (15,) in the order of `FlightMetrics`
    estimate: Array  # (4,) N, N m: estimate of phi (12) that the last control step used
    trace: Array  # (control steps, 17 + c + i + r), or (0, 0) for none; a row: time, true position, quaternion
    # and velocity, position as measured, the weights of the c criteria, the i inputs, the law's r reports
    reasons: Array  # (control steps, 12 + n + c + m + f), or (0, 0); a row: clearances of the goal and the n regions, c
    # memberships, m inputs of the rules, the estimate, the wrench that is allocated, the goal's place, and f forces


SENSOR_OUTPUTS = (
    *(f"measured.{name}" for name in VALUES),
    *(f"measured.time.{sensor}" for sensor in SENSORS),
)
LOSSES = tuple(f"{sensor}.loss_probability" for sensor in SENSORS)
PLANT_OUTPUTS = (
    *(f"position.{axis}" for axis in "xyz"),
    *(f"quaternion.e{i}" for i in range(4)),
    *(f"velocity.{axis}" for axis in "uvwpqr"),
)


def find_bound(diagnostics: Sequence[Diagnostic]) -> int:
    """Return the index of the bound of the clearances in a law's report, -1 if it has none."""
    return next((place for place, diagnostic in enumerate(diagnostics) if diagnostic.name == "bound"), -1)
