"""Validation of the law's inputs: measurements, weights, thruster health."""

# All outputs are finite, whatever the inputs are.

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from controller.arithmetic import square
from controller.law import VehicleState
from controller.laws.deployable import actuator_lag, model, observer
from controller.laws.deployable import attitude as attitude_loop
from controller.laws.deployable import estimate as estimate_state
from controller.laws.deployable.estimate import Estimate
from controller.laws.deployable.gains import DeployableGains
from controller.laws.deployable.memory import DeployableMemory
from controller.linear_algebra import norm
from controller.quaternion import rotation_matrix
from controller.stack_array import Array, Matrix3, Vector3, Vector4, Vector6

_FARTHEST = 1e6  # m, bound of each coordinate of a plausible position
_JUMP = 0.5  # fraction of an estimated position's standard deviation that is noise
_STEADY = 0.01  # m/s, standard deviation above which a velocity's error is lasting, so that its noise is increased
_FASTEST = 100.0  # m/s, rad/s: bound of plausible velocities and body rates
# sums over the axes: velocity [m/s] below which the vehicle rests; acceleration [m/s2] above which it starts to move
_RESTING, _PUSHED = 0.02, 0.05


def smooth_weights(weights: Array, smoothed: Array, hard: NDArray[np.bool_], fraction: float) -> None:
    """Write the arbiter's weights, shape (2, n), those of hard regions low-pass filtered in two stages."""
    # The first stage follows the arbiter, the second one the first, each by a fraction of its difference in a step. The
    # first weights are not filtered. The arbiter's weights are clipped to [0, 1]; NaN becomes 1, the cautious value.
    for i in range(weights.size):
        weight = 1.0 if np.isnan(weights[i]) else min(max(weights[i], 0.0), 1.0)
        if not hard[i] or np.isnan(smoothed[0, i]):
            smoothed[0, i] = smoothed[1, i] = weight
        smoothed[0, i] += fraction * (weight - smoothed[0, i])
        smoothed[1, i] += fraction * (smoothed[0, i] - smoothed[1, i])


def reports_change(reported: Array, before: Array, health: Array) -> bool:
    """Return True if the reported health differs from the last report, or from that of an isolated thruster."""
    # A health of 0 or below reports a failure; any other value, NaN too, a working thruster.
    changed = False
    for j in range(reported.size):
        working = 0.0 if reported[j] <= 0.0 else 1.0
        changed = changed or working != before[j] or (working == 0.0 and health[j] != 0.0)
    return changed


def update_thrusters(memory: DeployableMemory, reported: Array) -> None:
    """Apply the reported health of the thrusters, and allocate to those that work."""
    health = memory.thrusters.health
    for j in range(reported.size):
        working = 0.0 if reported[j] <= 0.0 else 1.0
        if working != memory.reported[j] or working == 0.0:
            if working != health[j]:
                estimate_state.set_effectiveness(memory.state_estimate, j, working)
            health[j] = memory.reported[j] = working
            if working > 0.0:
                memory.thrusters.stuck[j] = np.nan
            memory.fault_state.tentative[j] = 0 if working > 0.0 else 2
    model.reallocate(memory.thrusters)


def process_measurement(memory: DeployableMemory, state: VehicleState, gains: DeployableGains) -> bool:
    """Propagate the estimate over the last period and correct it; return True if the measurement was accepted."""
    estimate, period = memory.state_estimate, memory.period
    valid = _is_plausible_attitude(state.quaternion, state.velocity_body)
    if valid:
        memory.quaternion = state.quaternion / norm(state.quaternion)
        memory.omega = state.velocity_body[3:]
    else:
        _propagate_attitude(memory)
        memory.attitude.started = 0.0  # the next change of the rates would span several periods
        estimate.bias[:3] = 0.0
    R, deviation = rotation_matrix(memory.quaternion), memory.deviation
    deviation[:] = np.where(state.deviation >= 0.0, np.minimum(state.deviation, _FARTHEST), _FARTHEST)
    # an estimated state drifts, and jumps by a fraction of its deviation
    max_deviation = np.max(deviation[3:6])
    position_noise = max(gains.position_noise, _JUMP * np.max(deviation[:3]))
    velocity_noise = max(gains.velocity_noise, square(max_deviation) / _STEADY)
    estimate.weight = 1.0 if max_deviation <= _STEADY else square(_STEADY / max_deviation)
    position = np.where(abs(state.position) < _FARTHEST, state.position, np.nan)
    velocity = R @ state.velocity_body[:3]
    if not (valid and np.all(abs(velocity) < _FASTEST)):
        velocity[:] = np.nan
    position_repeats = _repeats(state.position, estimate.last_measured[:3])
    velocity_repeats = _repeats(state.velocity_body[:3], estimate.last_measured[3:])

    actuator_lag.update_forces(estimate, memory.thrusters, period)
    started = estimate.time_since_measurement >= 0.0
    if started:
        acceleration = memory.thruster_acceleration
        observer.predict(estimate, memory.dynamics, memory.thrusters, acceleration, R, memory.omega, gains, period)
        if not _is_plausible_motion(estimate.position, estimate.velocity):  # diverged after a false measurement
            _reset_estimate(memory)
            started = False
    if valid:
        _correct_by_rates(memory, R, started, gains)
    if not started:
        if not valid or np.any(np.isnan(position)):
            return False
        estimate_state.initialize(estimate, position, velocity, gains)
        return True
    position_used = _is_new(estimate, 0, position_repeats, gains) and _correct_group(
        memory, estimate_state.POSITION, position, position_noise, gains
    )
    velocity_used = _is_new(estimate, 1, velocity_repeats, gains) and _correct_group(
        memory, estimate_state.VELOCITY, velocity, velocity_noise, gains
    )
    if position_used or velocity_used:
        estimate.longest_gap = max(estimate.longest_gap, estimate.time_since_measurement)
        estimate.time_since_measurement = 0.0
    return position_used or velocity_used


def _is_new(estimate: Estimate, group: int, repeats: bool, gains: DeployableGains) -> bool:
    """Return True if a position or velocity is new: not a repetition, or a repetition of a fast sensor at rest."""
    v, a = estimate.velocity, estimate.acceleration
    rests = np.sum(abs(v)) < _RESTING
    moves = not rests or np.sum(abs(a)) > _PUSHED
    if repeats and moves:
        estimate.slow[group] = 1.0
    elif not repeats and estimate.repeated[group] == 0.0:
        estimate.slow[group] = 0.0
    estimate.repeated[group] = 1.0 if repeats else 0.0
    if not repeats or (not moves and estimate.slow[group] == 0.0):
        return True
    return bool(rests and estimate.time_since_valid[group] > gains.coast)


def _correct_group(
    memory: DeployableMemory, first: int, measured: Vector3, noise: float, gains: DeployableGains
) -> bool:
    """Correct by a position or a velocity; replace the estimate if all were rejected for longer than `coast`."""
    estimate, group = memory.state_estimate, 0 if first == estimate_state.POSITION else 1
    corrected = observer.correct(estimate, first, measured, noise, gains)
    if not np.all(np.isnan(measured)):
        memory.samples += 1.0
        memory.rejected_samples += 0.0 if corrected else 1.0
    if corrected:
        estimate.time_since_valid[group] = 0.0
        return True
    if estimate.time_since_valid[group] > gains.coast and not np.any(np.isnan(measured)):
        estimate_state.start_from(estimate, first, measured, noise)
    return False


def _repeats(measured: Vector3, last: Vector3) -> bool:
    """Return True if a measurement equals the last one bit for bit; store it as the last one."""
    repeats = np.all(np.where(np.isnan(measured), np.isnan(last), measured == last))
    last[:] = measured
    return bool(repeats)


def _correct_by_rates(memory: DeployableMemory, R: Matrix3, predicted: bool, gains: DeployableGains) -> None:
    """Correct the estimate by the moment from the change of the rates, if the estimate was `predicted`."""
    estimate, attitude, period = memory.state_estimate, memory.attitude, memory.period
    known = attitude_loop.measure_moment(attitude, memory.dynamics, R, memory.omega, estimate, period)
    if known and predicted:
        observer.correct_by_moment(
            estimate,
            attitude.measured_moment,
            attitude.by_current,
            memory.deviation[9:],
            memory.dynamics,
            memory.thrusters,
            R,
            memory.quaternion,
            memory.omega,
            gains,
            period,
        )


def _is_plausible_attitude(quaternion: Vector4, velocity_body: Vector6) -> bool:
    """Return True if a quaternion has length 1 and the rates are plausible."""
    return bool(abs(quaternion @ quaternion - 1.0) < 1e-2 and np.sum(abs(velocity_body[3:])) < _FASTEST)


def _propagate_attitude(memory: DeployableMemory) -> None:
    """Propagate attitude and rates over the last period by the model."""
    estimate, thrusters, period = memory.state_estimate, memory.thrusters, memory.period
    R = rotation_matrix(memory.quaternion)
    loads = model.Loads(
        estimate.water_velocity, estimate.net_weight, estimate.moments, estimate.yaw_moment, estimate.drag
    )
    acceleration = model.free_acceleration(memory.dynamics, R, estimate.velocity, memory.omega, loads)
    acceleration += model.thrust_acceleration(memory.dynamics, thrusters, R, thrusters.acting)
    memory.omega = np.clip(memory.omega + period * acceleration[3:], -_FASTEST, _FASTEST)
    memory.quaternion = attitude_loop.integrate_attitude(memory.quaternion, memory.omega, period)


def _is_plausible_motion(position: Vector3, velocity: Vector3) -> bool:
    """Return True if position [m] and velocity [m/s] are finite and plausible."""
    return bool(np.all(abs(velocity) < _FASTEST) and np.all(abs(position) < _FARTHEST))


def _reset_estimate(memory: DeployableMemory) -> None:
    """Reset the estimate to its state before the first measurement."""
    estimate_state.reset(memory.state_estimate)
    memory.fault_state.ratio[:] = 0.0
