"""The fused loop: a scene from start to end in compiled code, stepping the FMU through its C functions.

The stages are those of `cosim.master`: measure, regions, arbiter, law, allocation, FMU; then the score, on the true
position at every plant step.
"""

from __future__ import annotations

import types
from collections.abc import Callable
from typing import Any, NamedTuple

import numba
import numpy as np
from numpy.typing import NDArray

from controller import LAWS, VehicleState
from controller.allocation import allocate
from controller.compiled import compiled
from controller.laws import printed
from controller.regions import PackedRegions, clearance_at
from cosim.native import advance, read, seconds, send
from fuzzy_arbiter import Arbiter
from fuzzy_arbiter.membership import ramp
from plant_fmu.running.native import Native

Array = NDArray[np.float64]

_weigh = Arbiter().compiled()
_ramp: Any = numba.njit(ramp)
_step: Any = printed.step  # of a law, and whether it gives a wrench: `flight_of` puts others in their places
_is_wrench = True


class Setup(NamedTuple):
    """What a flight is made of, beside law and plant."""

    goal: PackedRegions
    regions: PackedRegions
    criteria: NDArray[np.int64]  # (n,) of each region
    ramp: float  # m, width of the memberships
    controls: int  # control steps
    plant_steps: int  # plant steps a control step
    plant_step: float  # s
    settled: float  # s inside the goal region, at the end, that count as having reached it
    noise: Array  # (controls, 6) what is added to position and linear velocity
    failed: int  # thruster that fails, from 0; -1 for none
    failure_control: int  # control step at which it does
    tell: bool  # whether the law is told
    clock: NDArray[np.int64]  # of `native.Clock`


class Allocator(NamedTuple):
    """Arguments of `controller.allocation.allocate`."""

    inverse: Array  # (m, 6)
    lower: Array  # (m,)
    upper: Array  # (m,)
    direction: bool


class Score(NamedTuple):
    """What a flight came to."""

    reached: bool  # inside the goal region for the last `settled` seconds
    reach_time: float  # s, since when it was inside without a break; inf if it is outside at the end
    min_clearance: float  # m, least over all hard regions and plant steps; negative: violated
    effort: float  # N s, sum over thrusters of the integral of the given force's magnitude
    thrust_variation: float  # N, sum over thrusters of the changes of the commanded force
    worst_step: float  # s of the wall clock, the longest control step
    failed_step: int  # plant step that the FMU refused, -1 for none


OUTPUTS = (
    *(f"position.{axis}" for axis in "xyz"),
    *(f"quaternion.e{i}" for i in range(4)),
    *(f"velocity.{axis}" for axis in "uvwpqr"),
)


def _fly(
    setup: Setup,
    native: Native,
    effectiveness: Native,
    allocator: Allocator,
    gains: Any,
    memory: Any,
    trace: Array,
) -> Score:
    """Fly a scene by the law whose compiled function stands in the place of the global `_step`.

    Parameters
    ----------
    setup : Setup
        The scene.
    native : Native
        The plant: inputs are the thrust commands, outputs `OUTPUTS` and then the thrusters' forces.
    effectiveness : Native
        The same plant: inputs are the thrusters' effectivenesses.
    allocator : Allocator
        For a wrench.
    gains, memory : NamedTuple
        The law's.
    trace : ndarray, shape (controls, 19 + m + r) or (0, 0)
        Receives a row for each control step: time, true position, quaternion and velocity, position as measured, the
        weights of obstacle and depth, m forces commanded, the law's r reports.

    Returns
    -------
    Score
        Of the whole flight, or up to where the FMU failed.
    """
    m, n = native.inputs.size, setup.regions.kinds.size
    position, quaternion, velocity = np.empty(3), np.empty(4), np.empty(6)
    health, weights, memberships = np.ones(m), np.zeros(n), np.zeros(3)
    by_criterion, wrench, before = np.zeros(3), np.zeros(6), np.zeros(m)
    room = np.zeros(2, np.int64)
    state = VehicleState(position, quaternion, velocity, health)
    last_outside, least, effort, variation, worst = 0.0, np.inf, 0.0, 0.0, 0.0
    control_period = setup.plant_steps * setup.plant_step
    if not read(native):
        return Score(False, np.inf, np.nan, effort, variation, worst, 0)

    for k in range(setup.controls):
        now = k * control_period
        # what fails
        if k == setup.failure_control and setup.failed >= 0:
            effectiveness.inputs[:] = 1.0
            effectiveness.inputs[setup.failed] = 0.0
            if not send(effectiveness):
                return Score(False, np.inf, least, effort, variation, worst, k * setup.plant_steps)
            if setup.tell:
                health[setup.failed] = 0.0
        # measure
        position[:] = native.outputs[:3] + setup.noise[k, :3]
        quaternion[:] = native.outputs[3:7]
        velocity[:] = native.outputs[7:13]
        velocity[:3] += setup.noise[k, 3:]
        # regions and arbiter
        _move(setup, now)
        memberships[:] = 0.0
        for i in range(n):
            degree = _ramp(clearance_at(setup.regions, i, position), setup.ramp)
            memberships[setup.criteria[i]] = max(memberships[setup.criteria[i]], degree)
        _weigh(memberships, by_criterion)
        for i in range(n):
            weights[i] = by_criterion[setup.criteria[i]]
        # law and allocation
        started = seconds(setup.clock, room)
        if _is_wrench:
            _step(state, setup.goal, setup.regions, weights, gains, memory, wrench)
            allocate(allocator.inverse, allocator.lower, allocator.upper, allocator.direction, wrench, native.inputs)
        else:
            _step(state, setup.goal, setup.regions, weights, gains, memory, native.inputs)
        worst = max(worst, seconds(setup.clock, room) - started)
        if trace.shape[0]:
            _trace(trace[k], now, native, position, by_criterion, memory.report)
        for j in range(m):
            variation += abs(native.inputs[j] - before[j])
            before[j] = native.inputs[j]
        # plant and score
        if not send(native):
            return Score(False, np.inf, least, effort, variation, worst, k * setup.plant_steps)
        for i in range(setup.plant_steps):
            at = now + i * setup.plant_step
            if not (advance(native, at, setup.plant_step) and read(native)):
                return Score(False, np.inf, least, effort, variation, worst, k * setup.plant_steps + i)
            at = now + (i + 1) * setup.plant_step
            _move(setup, at)
            true_position = native.outputs[:3]
            for j in range(n):
                clearance = clearance_at(setup.regions, j, true_position)
                least = clearance if clearance < least or np.isnan(clearance) else least
            if not clearance_at(setup.goal, 0, true_position) >= 0.0:
                last_outside = at
            for j in range(m):
                effort += abs(native.outputs[13 + j]) * setup.plant_step
    duration = setup.controls * control_period
    inside = last_outside < duration
    reached = inside and duration - last_outside >= setup.settled
    return Score(reached, last_outside if inside else np.inf, least, effort, variation, worst, -1)


@compiled
def _move(setup: Setup, now: float) -> None:
    """Put all regions where they are at a time [s]."""
    for regions in (setup.goal, setup.regions):
        for i in range(regions.kinds.size):
            for axis in range(3):
                regions.shifts[i, axis] = regions.velocities[i, axis] * now


@compiled
def _trace(row: Array, now: float, native: Native, position: Array, weights: Array, report: Array) -> None:
    m = native.inputs.size
    row[0] = now
    row[1:14] = native.outputs[:13]
    row[14:17] = position
    row[17], row[18] = weights[0], weights[2]
    row[19 : 19 + m] = native.inputs
    row[19 + m :] = report


def flight_of(law: str) -> Callable[..., Score]:
    """Return the loop of `_fly` compiled for a law.

    Numba keeps nothing on disk of a function that is given another one, or closes over it. So each law has a copy of
    the loop with its own function among the globals, under a name of its own.

    Parameters
    ----------
    law : str
        One of those in `controller.LAWS`.

    Returns
    -------
    callable
        ``(setup, native, effectiveness, allocator, gains, memory, trace) -> Score``.
    """
    names = globals() | {"_step": LAWS[law].function, "_is_wrench": LAWS[law].output == "wrench"}
    copy = types.FunctionType(_fly.__code__, names, f"_fly_{law}")
    copy.__qualname__ = copy.__name__
    return compiled(copy)
