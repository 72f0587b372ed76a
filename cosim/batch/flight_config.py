"""What a flight in the fused loop is made of, and what it fills."""

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
    """What a flight is made of, beside law and plant."""

    goal: PackedRegions
    regions: PackedRegions
    criteria: NDArray[np.int64]  # (n,) of each region
    priorities: Array  # (n,) of each region, for the score alone
    inputs: PackedInputs  # what the arbiter decides by
    step: float  # s, of the plant
    steps: int  # of the plant
    control_every: int  # plant steps
    arbiter_every: int  # plant steps
    moving: bool  # whether any region moves
    goal_places: Array  # (p, 3) m, NED: how far the goal is from where the scenario has it at its next places, in turn
    goal_stay: int  # plant steps that the vehicle has to stay within it before it goes on
    exact: bool  # what is measured is the truth
    noise: Array  # (control steps, 6) added to position and linear velocity, anew at each of them; (0, 6) if exact
    dead_from: float  # s, when position and linear velocity are lost
    dead_until: float  # s
    frozen: bool  # their last values are held in that time; otherwise they are NaN
    through_sensors: bool  # the state that is given is the navigation filter's estimate
    sensors: SensorModel  # what that knows of them
    outage_steps: NDArray[np.int64]  # (o,) plant steps before which a sensor's probability of loss changes, in order
    outage_sensors: NDArray[np.int64]  # (o,) whose
    outage_losses: Array  # (o,) to what
    failed: NDArray[np.int64]  # (f,) thrusters that fail, from 0, in the order of their failures
    failure_steps: NDArray[np.int64]  # (f,) plant steps before which they do
    remaining: Array  # (f,) effectiveness that is left; NaN of one that is stuck at its last force
    tell: bool  # whether the law is told
    thrusters: int  # that carry the wrench; 0: it acts on the body directly
    bound: int  # place of the law's bound of the clearances among its reports, -1: it gives none
    clock: NDArray[np.int64]  # of `native.Clock`; (0,) if the law is not to be timed


class Allocator(NamedTuple):
    """Arguments of `controller.allocation.allocate`, one stage after another as thrusters are told to have failed."""

    inverse: Array  # (stages, m, 6)
    lower: Array  # (stages, m)
    upper: Array  # (stages, m)
    direction: bool


class BoundLaw(NamedTuple):
    """A law as the loop calls it: a function of C, with its arguments, of which some are the loop's own."""

    address: int
    words: int
    is_wrench: bool  # what it gives; the forces of the thrusters otherwise
    estimate: Array  # (4,) in its memory
    expected: Array  # (6,) likewise, of the next step: m, NED, and m/s, body
    report: Array  # (r,) likewise


class BoundArbiter(NamedTuple):
    """An arbiter as the loop calls it: a function of C, with the workspace's signals and weights as its arguments."""

    address: int
    words: int


class Workspace(NamedTuple):
    """Where a flight is computed."""

    state: VehicleState  # as it is told
    arbiter_state: VehicleState  # what the arbiter decides by
    measurements: Measurements
    navigation: NavigationMemory
    now: Array  # (1,) s
    signals: ArbiterSignals
    by_criterion: Array  # (criteria,) weights
    weights: Array  # (n,)
    clearances: Array  # (n,) true ones
    seen: Array  # (n,) those that the arbiter is told
    goal_clearance: Array  # (1,) m or rad
    wrench: Array  # (6,) N, N m, body frame
    before: Array  # (i,) inputs of the step before
    stuck: Array  # (i,) inputs of thrusters that are stuck, NaN of others
    at: Array  # (3,)
    ticks: NDArray[np.int64]  # (2,)


def make_workspace(setup: FlightConfig, criteria: int, inputs: int, thrusters: int) -> Workspace:
    """Return the workspace of a flight.

    Parameters
    ----------
    setup : FlightConfig
        Of the flight.
    criteria, inputs, thrusters : int
        How many there are.

    Returns
    -------
    Workspace
        All zero, all thrusters healthy.
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
    """What a flight came to. Steps are those of the plant; -1: there was none."""

    first_inside: float  # step at which it was inside the goal region first, at the last of its places
    last_entered: float  # step since when it was inside the last time
    inside: bool  # it still was at the end
    least_clearance: float  # m, of all hard regions of place; negative: violated; inf: there is none
    least_angle: float  # rad, the same of hard regions of attitude
    goal_clearance: float  # m, greatest
    effort: float  # N s, integral of the magnitude of the force on the body
    thrust_effort: float  # N s, sum over thrusters of the integral of the given force's magnitude
    thrust_variation: float  # N, sum of the changes of what is commanded, from 0 on
    max_force: float  # N, on the body
    max_speed: float  # m/s, over ground
    worst_step: float  # s of the wall clock, the longest that law and allocation took
    failed_step: float  # that the FMU refused
    bound_excess: float  # m, by which a clearance was below the law's bound, greatest; -inf: no bound
    weighted_violation: float  # m s, rad s: integral of how deep each region is violated, times its priority, summed


class FlightOutputs(NamedTuple):
    """What a flight fills."""

    metrics: Array  # (15,) in the order of `FlightMetrics`
    estimate: Array  # (4,) that the last decision rests on
    trace: Array  # (control steps, 17 + c + i + r), or (0, 0) if none is kept; a row: time, true position, quaternion
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
    """Return the place of a law's bound of the clearances among its reports, -1 if it gives none."""
    return next((place for place, diagnostic in enumerate(diagnostics) if diagnostic.name == "bound"), -1)
