"""Validation of the law's inputs: measurements, weights, thruster health.

All outputs are finite, whatever the inputs are.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from controller.arithmetic import square
from controller.law import VehicleState
from controller.laws.deployable import attitude as attitude_loop
from controller.laws.deployable import fault_detection, model, observer
from controller.laws.deployable.gains import DeployableGains
from controller.laws.deployable.linear_algebra import copy
from controller.laws.deployable.memory import DeployableMemory
from controller.quaternion import write_rotation
from controller.stack_array import zeros

Array = NDArray[np.float64]

_FARTHEST = 1e6  # m, of a plausible position
_FASTEST = 100.0  # m/s, rad/s


def sanitize_weights(weights: Array, sanitized: Array) -> None:
    """Write the arbiter's weights, each clipped to [0, 1]; NaN becomes 1, the cautious value."""
    for i in range(weights.size):
        sanitized[i] = 1.0 if np.isnan(weights[i]) else min(max(weights[i], 0.0), 1.0)


def reports_change(reported: Array, before: Array, health: Array) -> bool:
    """Return whether the reported health differs from the last report, or from the assumed health of a failed thruster.

    A health of 0 or below reports a failure; any other value, NaN too, a working thruster.
    """
    changed = False
    for j in range(reported.size):
        working = 0.0 if reported[j] <= 0.0 else 1.0
        changed = changed or working != before[j] or (working == 0.0 and health[j] != 0.0)
    return changed


def update_thrusters(memory: DeployableMemory, reported: Array, failed: int) -> None:
    """Apply the reported health of the thrusters, and isolate a thruster that was detected as failed, -1 for none."""
    health = memory.thrusters.health
    if failed >= 0:
        fault_detection.isolate_thruster(memory.fault_state, memory.thrusters, failed)
    for j in range(reported.size):
        working = 0.0 if reported[j] <= 0.0 else 1.0
        if working != memory.reported[j] or working == 0.0:
            health[j] = memory.reported[j] = working
    model.reallocate(memory.thrusters)


def process_measurement(memory: DeployableMemory, state: VehicleState, gains: DeployableGains) -> bool:
    """Propagate the estimate over the last period and correct it; return whether the measurement was accepted."""
    estimate, period = memory.state_estimate, memory.period[0]
    valid = _is_plausible_attitude(state.quaternion, state.velocity_body)
    if valid:
        e = state.quaternion
        length = np.sqrt(square(e[0]) + square(e[1]) + square(e[2]) + square(e[3]))
        for i in range(4):
            memory.quaternion[i] = e[i] / length
        copy(state.velocity_body[3:], memory.omega)
    else:
        _propagate_attitude(memory)
    R, velocity, frozen = zeros(3, 3), zeros(3), True
    write_rotation(memory.quaternion, R)
    for i in range(3):
        for k in range(3):
            velocity[i] += R[i, k] * state.velocity_body[k]
    valid = valid and _is_plausible_motion(state.position, velocity)
    for i in range(3):
        frozen = frozen and state.position[i] == estimate.last_measured[i]
        frozen = frozen and state.velocity_body[i] == estimate.last_measured[3 + i]
        estimate.last_measured[i], estimate.last_measured[3 + i] = state.position[i], state.velocity_body[i]

    started = estimate.time_since_measurement[0] >= 0.0
    if started:
        observer.predict(estimate, memory.dynamics, memory.thrusters, R, memory.omega, gains, period)
        if not _is_plausible_motion(estimate.position, estimate.velocity):  # diverged after a false measurement
            _reset_estimate(memory)
            started = False
    attitude_loop.adapt(
        memory.attitude, memory.dynamics, memory.thrusters, memory.quaternion, memory.omega, gains, period
    )
    if not started:
        if valid:
            observer.initialize(estimate, state.position, velocity, gains)
        return valid
    moving = abs(estimate.velocity[0]) + abs(estimate.velocity[1]) + abs(estimate.velocity[2]) > 0.02
    if not valid or (frozen and moving):
        return False
    if observer.correct(estimate, state.position, velocity, gains):
        return True
    if estimate.time_since_measurement[0] > gains.coast:  # consistently elsewhere: start from there
        observer.initialize(estimate, state.position, velocity, gains)
    return False


def _is_plausible_attitude(quaternion: Array, velocity_body: Array) -> bool:
    """Return whether a quaternion has length 1 and the rates are plausible."""
    size, fastest = 0.0, 0.0
    for i in range(4):
        size += square(quaternion[i])
    for i in range(3):
        fastest += abs(velocity_body[3 + i])
    return abs(size - 1.0) < 1e-2 and fastest < _FASTEST


def _propagate_attitude(memory: DeployableMemory) -> None:
    """Propagate attitude and rates over the last period by the model."""
    R, turning, thrust_acceleration, period = zeros(3, 3), zeros(3), zeros(6), memory.period[0]
    write_rotation(memory.quaternion, R)
    attitude_loop.free_angular_acceleration(memory.attitude, memory.dynamics, memory.quaternion, memory.omega, turning)
    model.thrust_acceleration(memory.dynamics, memory.thrusters, R, memory.thrusters.forces, thrust_acceleration)
    for i in range(3):
        memory.omega[i] += period * (turning[i] + thrust_acceleration[3 + i])
        memory.omega[i] = min(max(memory.omega[i], -_FASTEST), _FASTEST)
    attitude_loop.integrate_attitude(memory.quaternion, memory.omega, period, memory.quaternion)


def _is_plausible_motion(position: Array, velocity: Array) -> bool:
    """Return whether position [m] and velocity [m/s] are finite and plausible."""
    can = True
    for i in range(3):
        can = can and abs(position[i]) < _FARTHEST and abs(velocity[i]) < _FASTEST
    return can


def _reset_estimate(memory: DeployableMemory) -> None:
    """Reset the estimate to its state before the first measurement."""
    estimate = memory.state_estimate
    estimate.position[:], estimate.velocity[:], estimate.water_velocity[:], estimate.net_weight[0] = 0.0, 0.0, 0.0, 0.0
    estimate.covariance[:, :, :] = 0.0
    estimate.innovation[:], estimate.innovation_deviation[:], estimate.gain[:] = 0.0, 1.0, 0.0
    estimate.time_since_measurement[0] = -1.0
    memory.fault_state.ratio[:] = 0.0
    memory.fault_state.lag[:, :] = 0.0
