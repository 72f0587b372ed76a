"""Inputs of the arbiter, computed from clearances and the measured state: for the master and the fused loop."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from controller import VehicleState
from controller.arithmetic import length3
from controller.linear_algebra import norm
from controller.quaternion import rate, rotation_matrix
from controller.regions.region_set import PackedRegions, clearance_of_pose
from controller.state import State
from cosim.scenario.arbiter_rules import ArbiterRules
from cosim.scenario.criteria import CriterionSetup
from cosim.scenario.region_tables import SecondaryRegion
from cosim.step.memberships import PackedMemberships, compute_memberships, pack_memberships

Array = NDArray[np.float64]

_KINDS = ("membership", "clearance", "closing_speed", "approach_time", "depth", "speed", "time", "given")
_MEMBERSHIP, _CLEARANCE, _CLOSING_SPEED, _APPROACH_TIME, _DEPTH, _SPEED, _TIME, _GIVEN = range(len(_KINDS))
_AHEAD = 1e-5  # s, step of a closing speed's difference quotient: rounding and curvature each err by 1e-9 m/s


class PackedInputs(NamedTuple):
    """Source of each of the m inputs of the arbiter's rules; no rows where the inputs are the memberships."""

    memberships: PackedMemberships
    kinds: NDArray[np.int64]  # (m,) in the order of `_KINDS`
    places: NDArray[np.int64]  # (m,) index of the criterion, or of the region with 0 for the goal
    upper: Array  # (m,) upper end of the universe, also the value of an input that is infinite or NaN
    offsets: NDArray[np.int64]  # (m + 1,) into `times` and `values`
    times: Array  # s: times of the points of given signals, one signal behind the other
    values: Array  # values of these points
    of_goal: bool  # True if an input depends on the goal
    by_speed: bool  # True if an input or a membership needs closing speeds


class ArbiterSignals(State):
    """Output of `compute_inputs` for the goal and n regions."""

    memberships: Array  # (criteria,) in [0, 1]
    inputs: Array  # (m,) value of each input of the rules, in its unit
    goal_clearance: float  # m, clearance of the goal
    closing_speeds: Array  # (n + 1,) m/s or rad/s, the goal's first; above 0 where the clearance shrinks
    approach_times: Array  # (n,) s, 0 where violated, inf where the clearance does not shrink


def pack_inputs(
    regions: Sequence[SecondaryRegion], criteria: Sequence[CriterionSetup], rules: ArbiterRules, ramp: float
) -> PackedInputs:
    """Pack the inputs of an arbiter into arrays; ramp [m or rad]."""
    signals, system = rules.signals, rules.system
    memberships = pack_memberships(regions, criteria, ramp)
    courses = [signal.course for signal in signals]
    return PackedInputs(
        memberships=memberships,
        kinds=np.array([_KINDS.index(signal.kind) for signal in signals], np.int64),
        places=np.array([signal.of for signal in signals], np.int64),
        upper=np.array([variable.universe[1] for variable in system.inputs[: len(signals)]]),
        offsets=np.cumsum([0, *map(len, courses)], dtype=np.int64),
        times=np.array([time for course in courses for time, _ in course], float),
        values=np.array([value for course in courses for _, value in course], float),
        of_goal=any(s.of == 0 and s.kind in ("clearance", "closing_speed", "approach_time") for s in signals),
        by_speed=memberships.by_time or any(s.kind in ("closing_speed", "approach_time") for s in signals),
    )


def empty_signals(packed: PackedInputs, n_regions: int, n_criteria: int) -> ArbiterSignals:
    """Return signals for `compute_inputs` to fill: zeros, and infinite approach times."""
    memberships = np.zeros(n_criteria)
    inputs = np.zeros(packed.kinds.size) if packed.kinds.size else memberships
    return ArbiterSignals(
        memberships=memberships,
        inputs=inputs,
        closing_speeds=np.zeros(n_regions + 1),
        approach_times=np.full(n_regions, np.inf),
    )


def empty_state() -> VehicleState:
    """Return a state of zeros for `write_arbiter_state` to fill."""
    return VehicleState(np.zeros(3), np.zeros(4), np.zeros(6), np.zeros(0))


def write_arbiter_state(measured: VehicleState, expected: Array, out: VehicleState) -> None:
    """Write the state that the arbiter uses: the law's prediction, which has less noise than the measurement."""
    lost = np.isnan(expected[:3] + measured.position)
    out.position[:] = np.where(lost, measured.position, expected[:3])
    out.velocity_body[:3] = np.where(lost, measured.velocity_body[:3], expected[3:])
    out.velocity_body[3:] = measured.velocity_body[3:]
    out.quaternion[:] = measured.quaternion


def compute_inputs(
    packed: PackedInputs,
    goal: PackedRegions,
    regions: PackedRegions,
    state: VehicleState,
    now: float,
    clearances: Array,
    signals: ArbiterSignals,
) -> None:
    """Compute the memberships and the inputs of the arbiter's rules; now [s], clearances (n,) [m or rad]."""
    if packed.of_goal:
        signals.goal_clearance = clearance_of_pose(goal, 0, state.position, state.quaternion)
    if packed.by_speed:
        speeds = signals.closing_speeds
        if packed.of_goal:
            speeds[0] = _closing_speed(goal, 0, state, signals.goal_clearance)
        for i in range(clearances.size):
            speeds[1 + i] = _closing_speed(regions, i, state, clearances[i])
            signals.approach_times[i] = _approach_time(clearances[i], speeds[1 + i])
    compute_memberships(packed.memberships, clearances, signals.approach_times, signals.memberships)
    for k in range(packed.kinds.size):
        x = _input(packed, k, state, now, clearances, signals)
        signals.inputs[k] = x if x <= packed.upper[k] else packed.upper[k]  # NaN too


def _input(
    packed: PackedInputs, k: int, state: VehicleState, now: float, clearances: Array, signals: ArbiterSignals
) -> float:
    kind, index = packed.kinds[k], packed.places[k]
    x: float = now
    if kind == _MEMBERSHIP:
        x = signals.memberships[index]
    elif kind == _DEPTH:
        x = state.position[2]
    elif kind == _SPEED:
        x = length3(state.velocity_body[0], state.velocity_body[1], state.velocity_body[2])
    elif kind == _GIVEN:
        x = _given(packed, k, now)
    elif kind == _CLOSING_SPEED:
        x = signals.closing_speeds[index]
    elif kind != _TIME:
        x = signals.goal_clearance if index == 0 else clearances[index - 1]
        if kind == _APPROACH_TIME:
            x = _approach_time(x, signals.closing_speeds[index])
    return x


def _given(packed: PackedInputs, k: int, now: float) -> float:
    """Return the value of a given signal at a time [s]: linear between its points, constant beyond them."""
    first, end = packed.offsets[k], packed.offsets[k + 1]
    value: float = packed.values[first]
    for i in range(first + 1, end):
        before, left, right = packed.times[i - 1], packed.values[i - 1], packed.values[i]
        if now > before:
            share = min((now - before) / (packed.times[i] - before), 1.0)
            value = left + (right - left) * share
    return value


def _approach_time(clearance: float, speed: float) -> float:
    """Return the time to contact [s] at constant closing speed: 0 where violated, inf where there is none."""
    time: float = 0.0
    if clearance > 0.0:
        time = clearance / speed if speed > 0.0 else math.inf
    return time


def _closing_speed(regions: PackedRegions, i: int, state: VehicleState, clearance: float) -> float:
    """Return the closing speed of a region [m/s or rad/s]: the rate at which its clearance shrinks."""
    e, nu = state.quaternion, state.velocity_body
    ahead = state.position + _AHEAD * (rotation_matrix(e) @ nu[:3] - regions.velocities[i])
    turned = e + _AHEAD * rate(e, nu[3:])
    later = clearance_of_pose(regions, i, ahead, turned / norm(turned))
    speed: float = (clearance - later) / _AHEAD
    return speed
