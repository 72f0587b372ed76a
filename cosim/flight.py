"""The fused loop: a scene from start to end in compiled code, stepping the FMU through its C functions.

The stages are those of `cosim.master`: measure, regions, arbiter, law, allocation, FMU; then the score, on the true
position at every plant step.
"""

from __future__ import annotations

import functools
import types
from collections.abc import Callable
from pathlib import Path
from typing import Any, NamedTuple

import numba
import numpy as np
from numpy.typing import NDArray

import fuzzy_arbiter
import plant_fmu
from controller import LAWS, CompiledLaw, VehicleState
from controller.allocation import allocate
from controller.compiled import compiled
from controller.laws import printed
from controller.regions import PackedRegions, Sphere, clearance_of_place, clearance_of_sphere
from cosim.native import advance, read, seconds, send
from fuzzy_arbiter import Arbiter
from fuzzy_arbiter.membership import ramp
from plant_fmu.running.native import Native

Array = NDArray[np.float64]

# the folders of what the compiled loop is made of beside this one and that of the laws
_FOREIGN = (Path(fuzzy_arbiter.__file__).parent, Path(plant_fmu.__file__).parent / "running")

_weigh = Arbiter().compiled()
_ramp: Any = numba.njit(ramp)
_step: Any = printed.step  # of a law, and whether it gives a wrench: `flight_of` puts others in their places
_is_wrench = True
_SPHERE = Sphere.kind


class Setup(NamedTuple):
    """What a flight is made of, beside law and plant."""

    goal: PackedRegions
    regions: PackedRegions
    criteria: NDArray[np.int64]  # (n,) of each region
    ramp: float  # m, width of the memberships
    controls: int  # control steps
    plant_steps: int  # plant steps a control step
    plant_step: float  # s
    settled_steps: int  # plant steps inside the goal region, at the end, that count as having reached it
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

    reached: bool  # inside the goal region for the last `settled_steps`
    reach_time: float  # s, since when it was inside without a break; inf if it is outside at the end
    min_clearance: float  # m, least over all regions, the start and all plant steps; negative: violated
    effort: float  # N s, sum over thrusters of the integral of the given force's magnitude
    thrust_variation: float  # N, sum over thrusters of the changes of the commanded force, from 0 on
    worst_step: float  # s of the wall clock, the longest that law and allocation took
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
) -> tuple[bool, float, float, float, float, float, int]:
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
    tuple
        What `Score` is made of, of the whole flight, or up to where the FMU failed. Were it a named tuple, Numba would
        call Python to make it, and crash where that raises, as after Ctrl-C in mid-flight.
    """
    m, n = native.inputs.size, setup.regions.kinds.size
    position, quaternion, velocity = np.empty(3), np.empty(4), np.empty(6)
    health, weights, memberships = np.ones(m), np.zeros(n), np.zeros(3)
    by_criterion, wrench, before = np.zeros(3), np.zeros(6), np.zeros(m)
    clearances, goal_clearance = np.zeros(n), np.zeros(1)
    room = np.zeros(2, np.int64)
    state = VehicleState(position, quaternion, velocity, health)
    effort, variation, worst = 0.0, 0.0, 0.0
    if not read(native):
        return (False, np.inf, np.nan, effort, variation, worst, 0)
    true_position = native.outputs[:3]
    _move(setup, 0.0)
    _clearances(setup.regions, true_position, clearances)
    _clearances(setup.goal, true_position, goal_clearance)
    least = _least(clearances, np.inf)
    inside_since = 0 if goal_clearance[0] >= 0.0 else -1  # plant step; -1: outside
    done = 0  # plant steps

    for k in range(setup.controls):
        now = done * setup.plant_step
        # what fails
        if k == setup.failure_control and setup.failed >= 0:
            effectiveness.inputs[:] = 1.0
            effectiveness.inputs[setup.failed] = 0.0
            if not send(effectiveness):
                return (False, np.inf, least, effort, variation, worst, done)
            if setup.tell:
                health[setup.failed] = 0.0
        # measure
        position[:] = native.outputs[:3] + setup.noise[k, :3]
        quaternion[:] = native.outputs[3:7]
        velocity[:] = native.outputs[7:13]
        velocity[:3] += setup.noise[k, 3:]
        # regions and arbiter
        _move(setup, now)
        _clearances(setup.regions, position, clearances)
        memberships[:] = 0.0
        for i in range(n):
            degree = _ramp(clearances[i], setup.ramp)
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
            return (False, np.inf, least, effort, variation, worst, done)
        for _ in range(setup.plant_steps):
            if not (advance(native, done * setup.plant_step, setup.plant_step) and read(native)):
                return (False, np.inf, least, effort, variation, worst, done)
            done += 1
            _move(setup, done * setup.plant_step)
            _clearances(setup.regions, true_position, clearances)
            _clearances(setup.goal, true_position, goal_clearance)
            least = _least(clearances, least)
            if not goal_clearance[0] >= 0.0:
                inside_since = -1
            elif inside_since < 0:
                inside_since = done
            for j in range(m):
                effort += abs(native.outputs[13 + j]) * setup.plant_step
    reached = inside_since >= 0 and done - inside_since >= setup.settled_steps
    reach_time = inside_since * setup.plant_step if inside_since >= 0 else np.inf
    return (reached, reach_time, least, effort, variation, worst, -1)


@compiled
def _move(setup: Setup, now: float) -> None:
    """Put all regions where they are at a time [s]."""
    for regions in (setup.goal, setup.regions):
        for i in range(regions.kinds.size):
            for axis in range(3):
                regions.shifts[i, axis] = regions.velocities[i, axis] * now


@compiled
def _clearances(regions: PackedRegions, position: Array, clearances: Array) -> None:
    """Write the clearance [m] of each region, none of which depends on attitude, at a position into `clearances`."""
    room = np.empty(3)
    for i in range(regions.kinds.size):
        if regions.kinds[i] == _SPHERE:
            clearances[i] = clearance_of_sphere(regions, i, position)
        else:
            clearances[i] = clearance_of_place(regions, i, position, room)


@compiled
def _least(clearances: Array, least: float) -> float:
    """Return the least of numbers and one more; what is no number stays."""
    for clearance in clearances:
        if clearance < least or np.isnan(clearance):
            least = clearance
    return least


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
    chosen: Any = LAWS[law]
    loop = _compiled(law, chosen)
    return lambda *arguments: Score(*loop(*arguments))


@functools.cache
def _compiled(name: str, law: type[CompiledLaw]) -> Callable[..., tuple[Any, ...]]:
    return compiled(_plain(name, law), *_FOREIGN)


def _plain(name: str, law: type[CompiledLaw]) -> Callable[..., tuple[Any, ...]]:
    """Return the loop for a law, left to Python."""
    names = globals() | {"_step": law.function, "_is_wrench": law.output == "wrench"}
    copy = types.FunctionType(_fly.__code__, names, f"_fly_{name}")
    copy.__qualname__ = copy.__name__
    return copy
