"""What the law believes of what it is given: measurements, weights, and which thrusters work.

Whatever comes in, what goes on from here is finite.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from controller.jit.jit import part
from controller.jit.stack_array import zeros
from controller.law import VehicleState
from controller.laws.deployable import attitude as attitude_loop
from controller.laws.deployable import fault_detection, model, observer
from controller.laws.deployable.gains import DeployableGains
from controller.laws.deployable.linear_algebra import copy
from controller.laws.deployable.memory import DeployableMemory
from controller.quaternion import write_rotation

Array = NDArray[np.float64]

_FARTHEST = 1e6  # m, beyond which no position is one
_FASTEST = 100.0  # m/s, rad/s


@part
def sanitize_weights(weights: Array, believed: Array) -> None:
    """Write the arbiter's weights, each within [0, 1]; what is no number counts as 1, for it may matter."""
    for i in range(weights.size):
        believed[i] = 1.0 if np.isnan(weights[i]) else min(max(weights[i], 0.0), 1.0)


@part
def says_more(reported: Array, before: Array, health: Array) -> bool:
    """Return whether what is told of the thrusters differs from what was, or from what is believed of a failed one.

    A thruster is told to have failed by a health of 0 or below; whatever else comes says that it works.
    """
    more = False
    for j in range(reported.size):
        works = 0.0 if reported[j] <= 0.0 else 1.0
        more = more or works != before[j] or (works == 0.0 and health[j] != 0.0)
    return more


@part
def take_in_thrusters(memory: DeployableMemory, reported: Array, failed: int) -> None:
    """Take in which thrusters are told to have failed, or to work again, and one found to have failed, -1 for none."""
    health = memory.thrusters.health
    if failed >= 0:
        fault_detection.give_up(memory.suspicion, memory.thrusters, failed)
    for j in range(reported.size):
        works = 0.0 if reported[j] <= 0.0 else 1.0
        if works != memory.reported[j] or works == 0.0:
            health[j] = memory.reported[j] = works
    model.reallocate(memory.thrusters)


@part
def take_in_measurement(memory: DeployableMemory, state: VehicleState, gains: DeployableGains) -> bool:
    """Carry the estimate over the last period and take in the measurement; return whether it was believed."""
    seen, period = memory.observed, memory.period[0]
    good = _can_be_turned(state.quaternion, state.velocity_body)
    if good:
        e = state.quaternion
        length = np.sqrt(e[0] ** 2 + e[1] ** 2 + e[2] ** 2 + e[3] ** 2)
        for i in range(4):
            memory.quaternion[i] = e[i] / length
        copy(state.velocity_body[3:], memory.omega)
    else:
        _carry_attitude(memory)
    R, velocity, frozen = zeros(3, 3), zeros(3), True
    write_rotation(memory.quaternion, R)
    for i in range(3):
        for k in range(3):
            velocity[i] += R[i, k] * state.velocity_body[k]
    good = good and _can_be(state.position, velocity)
    for i in range(3):
        frozen = frozen and state.position[i] == seen.last_measured[i]
        frozen = frozen and state.velocity_body[i] == seen.last_measured[3 + i]
        seen.last_measured[i], seen.last_measured[3 + i] = state.position[i], state.velocity_body[i]

    begun = seen.silence[0] >= 0.0
    if begun:
        observer.predict(seen, memory.dynamics, memory.thrusters, R, memory.omega, gains, period)
        if not _can_be(seen.position, seen.velocity):  # a false measurement led it away
            _forget(memory)
            begun = False
    attitude_loop.adapt(
        memory.attitude, memory.dynamics, memory.thrusters, memory.quaternion, memory.omega, gains, period
    )
    if not begun:
        if good:
            observer.begin(seen, state.position, velocity, gains)
        return good
    moving = abs(seen.velocity[0]) + abs(seen.velocity[1]) + abs(seen.velocity[2]) > 0.02
    if not good or (frozen and moving):
        return False
    if observer.correct(seen, state.position, velocity, gains):
        return True
    if seen.silence[0] > gains.coast:  # it has been saying so for long: believe it
        observer.begin(seen, state.position, velocity, gains)
    return False


@part
def _can_be_turned(quaternion: Array, velocity_body: Array) -> bool:
    """Return whether attitude and rates are such as a vehicle can have."""
    size, fastest = 0.0, 0.0
    for i in range(4):
        size += quaternion[i] ** 2
    for i in range(3):
        fastest += abs(velocity_body[3 + i])
    return abs(size - 1.0) < 1e-2 and fastest < _FASTEST


@part
def _carry_attitude(memory: DeployableMemory) -> None:
    """Carry attitude and rates over the last period by the model."""
    R, turning, pushed, period = zeros(3, 3), zeros(3), zeros(6), memory.period[0]
    write_rotation(memory.quaternion, R)
    attitude_loop.free_turning(memory.attitude, memory.dynamics, memory.quaternion, memory.omega, turning)
    model.thrust_acceleration(memory.dynamics, memory.thrusters, R, memory.thrusters.forces, pushed)
    for i in range(3):
        memory.omega[i] += period * (turning[i] + pushed[3 + i])
        memory.omega[i] = min(max(memory.omega[i], -_FASTEST), _FASTEST)
    attitude_loop.turn(memory.quaternion, memory.omega, period, memory.quaternion)


@part
def _can_be(position: Array, velocity: Array) -> bool:
    """Return whether position [m] and velocity [m/s] are numbers that a vehicle can have."""
    can = True
    for i in range(3):
        can = can and abs(position[i]) < _FARTHEST and abs(velocity[i]) < _FASTEST
    return can


@part
def _forget(memory: DeployableMemory) -> None:
    """Bring the estimate to where it was before the first measurement."""
    seen = memory.observed
    seen.position[:], seen.velocity[:], seen.water[:], seen.restoring[0] = 0.0, 0.0, 0.0, 0.0
    seen.covariance[:, :, :] = 0.0
    seen.innovation[:], seen.spread[:], seen.gain[:] = 0.0, 1.0, 0.0
    seen.silence[0] = -1.0
    memory.suspicion.ratio[:] = 0.0
    memory.suspicion.lag[:, :] = 0.0
