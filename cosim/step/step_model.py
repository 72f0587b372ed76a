"""The constants of a step, and its state and signals: records of arrays that C and Python share."""

from __future__ import annotations

import functools
import math
from collections.abc import Callable
from typing import NamedTuple, Protocol

import numpy as np
from numpy.typing import NDArray

from controller import VehicleState
from controller.navigation.measurements import Measurements, SensorModel
from controller.navigation.navigation_memory import NavigationMemory
from controller.regions.region_set import PackedRegions
from controller.stack_array import Vector3, Vector4
from controller.state import State
from controller.translator.foreign import POINTER, call_c
from cosim.step.arbiter_inputs import ArbiterSignals, PackedInputs
from cosim.step.mission_legs import MissionModel
from cosim.step.region_positions import RegionEvaluation

Array = NDArray[np.float64]
Integers = NDArray[np.int64]

WORDS = (POINTER,)  # argument of the C functions of `StepData.calls`

# indices in `StepData.calls`: law, arbiter, what a run does after measuring and after evaluating the regions, and the
# functions of a plant in Python, which send changed parameters and step it
LAW, ARBITER, MEASURED, LOCATED, PLANT_SET, PLANT_STEP = 0, 2, 4, 6, 8, 10
N_CALLS = 12


class Call(Protocol):
    """A function that C can call: its address, and that of its argument."""

    address: int
    words: int
    on_error: Callable[[], None] | None


class StepModel(NamedTuple):
    """Constants of a scenario."""

    step: float  # s
    steps: int  # number of steps
    control_every: int  # steps between two control steps
    arbiter_every: int  # steps between two evaluations of the arbiter
    jacobi: bool  # True: the plant and the arbiter's weights receive what the step before gave
    commands: bool  # True: a run with commands, which bound the wrench
    for_record: bool  # True: values, gradients and the wrench of thrusters are computed too, for a record
    criteria: Integers  # (n,) index of each region's criterion
    priorities: Array  # (n,) factor of each region's violation in the score; laws do not receive it
    inputs: PackedInputs  # sources of the arbiter's inputs
    moving: bool  # True if any region moves
    moving_regions: Integers  # (moving,) index of each region that moves, 0 for the goal
    goal_center: Array  # (3,) m, NED: center of the goal in the scenario, from which its displacement counts
    mission: MissionModel
    exact: bool  # True if law and arbiter receive the true state
    dead_from: float  # s, time at which position and linear velocity are lost
    dead_until: float  # s, time at which they are measured again
    frozen: bool  # True: their last values are held meanwhile; False: they are NaN
    through_sensors: bool  # True: the law receives the navigation filter's estimate
    sensors: SensorModel  # the filter's model of the sensors
    outage_steps: Integers  # (o,) steps at which a sensor's loss probability changes, in order
    outage_sensors: Integers  # (o,) index of the sensor
    outage_losses: Array  # (o,) new loss probability
    failed: Integers  # (f,) thrusters that fail, from 0, in the order of their failures
    failure_steps: Integers  # (f,) steps at which they fail
    remaining: Array  # (f,) remaining effectiveness; NaN for a thruster that is stuck at its last force
    report_failures: bool  # True if failures are reported to the law
    through_thrusters: bool  # True: thrusters give the wrench; False: it acts on the body directly
    law_gives_wrench: bool  # True: the law gives a wrench; False: thruster forces
    thruster_matrix: Array  # (6, m) body wrench of one newton of each thruster; (6, 0) if the plant takes a wrench
    dead_band: Array  # (m,) fraction of a thruster's range that gives no force, in the vehicle's file
    curve: Array  # (m,) 0: force linear in the command; 1: quadratic
    bound: int  # index in the law's report of its bound of the clearances; -1: it has none
    isolated: int  # the same of the thruster that it isolated last
    limit: int  # the same of the least limit of a thruster that it estimates
    clock: Integers  # (3,) numbers of a `Clock`; (0,) if the law is not timed


class Allocator(NamedTuple):
    """Arguments of `controller.allocation.allocate`, with a stage for each number of reported failures."""

    inverse: Array  # (stages, m, 6) N per N, N m: thruster forces for a wrench
    lower: Array  # (stages, m) N
    upper: Array  # (stages, m) N
    direction: bool  # True: saturation keeps the wrench's direction; False: it clips each thruster


class LawOutputs(NamedTuple):
    """Outputs of a law other than its forces, in its memory."""

    estimate: Array  # (4,) N, N m: estimate of phi (12)
    expected: Array  # (6,) prediction for the next step: m, NED, and m/s, body
    report: Array  # (r,) diagnostics


class StepData(State):
    """State and signals. Signals are parts of the row, if the row has them."""

    row: Array  # (columns,)
    k: int  # number of the step
    now: float  # s
    outputs: Array  # (o,) the plant's outputs, from the beginning of the step, and from `first_applied` on from its end
    first_applied: int  # index of the first output from the end of the step
    forces: Array  # (m,) N, given by the thrusters; (0,) without thrusters
    force: Array  # (3,) N, on the body
    flags: Array  # (f,) Boolean outputs of the plant, from the end of the step
    inputs: Array  # (i,) inputs of the plant, as computed; after the vehicle's own those that others set
    wrench: Array  # (6,) N, N m: that of the inputs
    delayed: Array  # (delay, j) the vehicle's own inputs of the last steps, as many as their delay has
    goal: PackedRegions
    regions: PackedRegions
    goal_center: Array  # (3,) m, NED: center of the present goal, without its shift
    goal_origin: Array  # (1, 3) m, NED: shift of the goal, extrapolated to time 0
    region_origins: Array  # (n, 3) m, NED
    shifts: Array  # (moving, 3) m, NED
    leg: int  # index of the mission's present leg
    shown_stop: float  # index of the goal's place during the step
    inside_since: float = math.inf  # s, time since which the vehicle has been in the goal; inf: it is outside
    arrivals: Array  # (stops,) s, time at which the vehicle first was in each place of the goal; NaN: not yet
    traveled: float  # m, along the way of the leg
    feature: Vector3  # m, NED: what the mission looks at; NaN: nothing
    heading: float  # rad, that the mission asks for, from the law's own attitude
    turned: float  # rad, the heading given to the law
    turned_at: float  # s
    attitude: Vector4  # the law's target, with that heading
    speed_limit: float  # m/s, the law's
    true_state: VehicleState
    state: VehicleState  # measured state, which law and arbiter receive
    arbiter_state: VehicleState  # state that the arbiter uses
    noise: Array  # (c, 6) m, m/s: added to position and linear velocity, in turn; (0, 6) without noise
    measurements: Measurements
    navigation: NavigationMemory
    true_evaluation: RegionEvaluation
    arbiter_evaluation: RegionEvaluation  # at the arbiter's pose
    signals: ArbiterSignals
    shown_inputs: Array  # (m,) the memberships as inputs of a file's rules; (0,) for others
    by_criterion: Array  # (criteria,) weight of each criterion
    weights: Array  # (n,) weight of each region's criterion
    calls: Integers  # (12,) addresses of C functions and of their arguments; 0: none
    components: Integers  # (2 c,) the same of the steps of FMUs beside the plant, in their order
    exchanges: Integers  # (2 e,) the same of what they receive and send before a step (Jacobi)
    component_outputs: Array  # (p,) outputs of these FMUs at the beginning of the step
    component_results: Array  # (p,) their latest outputs
    manual: bool  # True: the command is given, and the law does not compute it
    law: LawOutputs
    expected: Array  # (6,) prediction that the arbiter uses; NaN: none
    estimate: Array  # (4,) N, N m: estimate before the last call of the law
    report: Array  # (r,) diagnostics of the law
    command: Array  # (6,) N, N m, body frame
    saturated: float  # 1 if the limits clipped the command
    thrusts: Array  # (m,) N, commanded thruster forces
    allocator: Allocator
    stage: int  # number of reported failures
    stuck: Array  # (j,) the vehicle's own inputs of stuck thrusters, NaN for others
    failures: int  # number of failures so far
    outages: int  # number of changes of sensors so far
    failed_step: int = -1  # step in which the FMU failed, -1 for none
    ticks: Integers  # (2,) for `plant_calls.seconds`
    max_duration: float  # s of the wall clock, longest time of law and allocation in a step


def set_call(data: StepData, which: int, call: Call) -> None:
    """Let a step call a function, such as at `LAW`, whose errors end it; the caller keeps it alive."""
    register_call(data, data.calls, which, call)


def register_call(data: StepData, calls: Integers, i: int, call: Call) -> None:
    """Let a step call a function by the items `i` and on of an array; its errors end the step."""
    calls[i : i + 2] = call.address, call.words
    call.on_error = functools.partial(_end_step, data)


def call_back(data: StepData, call: int) -> None:
    """Call a C function of `StepData.calls`, if there is one."""
    if data.calls[call] != 0:
        call_c(data.calls[call], WORDS, data.calls[call + 1])


def call_all(data: StepData, calls: Integers) -> None:
    """Call C functions, given by their addresses and those of their arguments, 0 for none, until a step fails."""
    for i in range(0, calls.size, 2):
        if calls[i] != 0 and data.failed_step < 0:
            call_c(calls[i], WORDS, calls[i + 1])


def _end_step(data: StepData) -> None:
    data.failed_step = data.k
