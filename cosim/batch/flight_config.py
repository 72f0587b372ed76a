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
    criteria: NDArray[np.int64]  # (n,) of each region
    priorities: Array  # (n,) of each region, for the score alone
    inputs: PackedInputs  # of the arbiter
    step: float  # s, of the plant
    steps: int  # of the plant
    control_every: int  # plant steps
    arbiter_every: int  # plant steps
    moving: bool  # True if any region moves
    goal_places: Array  # (p, 3) m, NED: shifts of the goal to its next positions, in turn
    goal_stay: int  # plant steps that the vehicle has to stay in the goal before it moves to its next position
    exact: bool  # True if law and arbiter receive the true state
    noise: Array  # (control steps, 6) m, m/s: added to position and linear velocity; (0, 6) if exact
    dead_from: float  # s, time at which position and linear velocity are lost
    dead_until: float  # s
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
    bound: int  # index of the law's bound of the clearances in its report, -1: it has none
    clock: NDArray[np.int64]  # of `c_calls.Clock`; (0,) if the law is not timed


class Allocator(NamedTuple):
    """Arguments of `controller.allocation.allocate`, with a stage for each number of reported failures."""

    inverse: Array  # (stages, m, 6)
    lower: Array  # (stages, m)
    upper: Array  # (stages, m)
    direction: bool


class BoundLaw(NamedTuple):
    """A law for the loop: a C function with its arguments, some of which belong to the loop."""

    address: int
    words: int
    is_wrench: bool  # True: it gives a wrench; False: thruster forces
    estimate: Array  # (4,) in its memory
    expected: Array  # (6,) in its memory, prediction for the next step: m, NED, and m/s, body
    report: Array  # (r,) in its memory


class BoundArbiter(NamedTuple):
    """An arbiter for the loop: a C function with the workspace's signals and weights as its arguments."""

    address: int
    words: int


class Workspace(NamedTuple):
    """Arrays of a flight in progress."""

    state: VehicleState  # measured, for the law
    arbiter_state: VehicleState  # for the arbiter
    measurements: Measurements
    navigation: NavigationMemory
    now: Array  # (1,) s
    signals: ArbiterSignals
    by_criterion: Array  # (criteria,) weights
    weights: Array  # (n,)
    clearances: Array  # (n,) true ones
    seen: Array  # (n,) those at the arbiter's pose
    goal_clearance: Array  # (1,) m or rad
    wrench: Array  # (6,) N, N m, body frame
    before: Array  # (i,) inputs of the step before
    stuck: Array  # (i,) inputs of stuck thrusters, NaN for others
    at: Array  # (3,)
    ticks: NDArray[np.int64]  # (2,)


def make_workspace(setup: FlightConfig, criteria: int, inputs: int, thrusters: int) -> Workspace:
    """Make the workspace of a flight.

    Parameters
    ----------
    setup : FlightConfig
        Of the flight.
    criteria, inputs, thrusters : int
        Number of criteria, plant inputs and thrusters.

    Returns
    -------
    Workspace
        With zeros, and all thrusters healthy.
    """
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
        seen=np.zeros(n),
        goal_clearance=np.zeros(1),
        wrench=np.zeros(6),
        before=np.zeros(inputs),
        stuck=np.full(inputs, np.nan),
        at=np.zeros(3),
        ticks=np.zeros(2, np.int64),
    )


class FlightMetrics(NamedTuple):
    """Metrics of a flight. Steps are those of the plant, -1 for none."""

    first_inside: float  # first step inside the goal region at the last of its positions
    last_entered: float  # first step of the last visit of the goal
    inside: bool  # True if inside at the end
    least_clearance: float  # m, least over hard regions in space; negative: violated; inf: there is none
    least_angle: float  # rad, the same for hard regions of attitude
    goal_clearance: float  # m, greatest
    effort: float  # N s, integral of the magnitude of the force on the body
    thrust_effort: float  # N s, sum over thrusters of the integral of the given force's magnitude
    thrust_variation: float  # N, sum of the absolute changes of the commands, from 0 on
    max_force: float  # N, on the body
    max_speed: float  # m/s, over ground
    worst_step: float  # s of the wall clock, longest time of law and allocation in a step
    failed_step: float  # step in which the FMU failed
    bound_excess: float  # m, greatest excess of the law's bound over a clearance; -inf: no bound
    weighted_violation: float  # m s, rad s: sum over regions of priority times the integral of the violation depth


class FlightOutputs(NamedTuple):
    """Outputs of a flight."""

    metrics: Array  # (15,) in the order of `FlightMetrics`
    estimate: Array  # (4,) used in the last control step
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
