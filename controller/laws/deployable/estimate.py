"""The observer's estimate: state, covariance, and the parts that other modules read."""

from __future__ import annotations

from typing import Annotated

import numpy as np

from controller.arithmetic import square
from controller.law import VehicleModel
from controller.laws.deployable.gains import DeployableGains
from controller.laws.deployable.model import Rows2
from controller.stack_array import Array, Columns3, Shape, Vector3, Vector6, VectorM, zeros
from controller.state import State

Pair = Annotated[Array, Shape(2)]
Innovations = Annotated[Array, Shape(9)]
# of k = 16 + 2 m states and h = 2 m hypotheses
Unknowns = Annotated[Array, Shape("k")]
Covariance = Annotated[Array, Shape("k", "k")]
Sensitivity = Annotated[Array, Shape(3, "k")]
Deviations = Annotated[Array, Shape("h", "k")]
Hypotheses = Annotated[Array, Shape("h")]
Evidence = Annotated[Array, Shape(2, "h")]

# index of the first state of each kind
POSITION, VELOCITY, CURRENT, NET_WEIGHT, MOMENTS, YAW_MOMENT, HEIGHT, DRAG, LAG, EFFECTIVENESS = (
    0, 3, 6, 8, 9, 12, 13, 14, 15, 16,
)  # fmt: skip

_LIGHT = 50.0  # kg, mass above which deviation, drift and bound of W - B, and the bound of moments, grow with the mass
_FIRST_VELOCITY = 0.3  # m/s, initial standard deviation of an unmeasured velocity
_FIRST_CURRENT, _FIRST_RESTORING = 0.3, 15.0  # m/s, N: initial standard deviations of current and W - B
_GRAVITY = 9.81  # m/s2
# m, initial standard deviations: height of the center of gravity; lever arm of the weight in the restoring moments
_FIRST_HEIGHT, _FIRST_ARM = 0.05, 0.15
_FIRST_EFFECTIVENESS, _FIRST_COMMON = 0.12, 0.12  # initial standard deviations: of each thruster alone; common to all
_FIRST_CEILING, _FIRST_COMMON_CEILING = 0.12, 0.2  # the same of the ceilings: a battery that sags weakens all
_FIRST_YAW = 0.02  # m, lever arm of the weight by which the moment about z is unknown at first
_FIRST_DRAG = 0.5  # initial standard deviation of the drag, relative to the vehicle's
_DRAG_RANGE = (0.05, 10.0)  # bounds of it
_FIRST_LAG = 0.3  # s, initial lag and its standard deviation if the vehicle's own is 0
_KNOWN_LAG = 1e-6  # s, standard deviation of a lag that is not estimated
_GREATEST_EFFECTIVENESS = 1.1  # upper bound of an estimated effectiveness, and of a ceiling
_LEAST_CEILING = 0.3  # lower bound of an estimated ceiling


class Estimate(State):
    """State and covariance of the filter, and the parts that other modules read."""

    first_state: Unknowns  # state before the first measurement
    first_covariance: Covariance  # covariance before the first measurement
    state: Unknowns  # in the order of `observer`; SI, NED, moments in body axes
    covariance: Covariance  # covariance of the state
    position: Vector3  # m, NED
    velocity: Vector3  # m/s over ground, NED
    water_velocity: Vector3  # m/s, NED; its down component is 0
    net_weight: float  # N, W - B
    moments: Vector3  # phi_2..phi_4 [N m], body axes
    yaw_moment: float  # N m, about the body's z axis, beside these
    drag: float = 1.0  # drag of translation, relative to the vehicle's
    acceleration: Vector3  # m/s2 over ground, NED, predicted for the last period
    time_since_measurement: float = -1.0  # s since the last valid measurement; negative before the first
    time_since_valid: Pair  # s since the last valid position, and velocity
    repeated: Pair  # 1 if the last position, or velocity, equals the one before bit for bit
    slow: Pair  # 1 if position, or velocity, repeats while the vehicle moves: its sensor is slower than the steps
    longest_gap: float  # s, longest recent time without a measurement
    weight: float = 1.0  # weight of positions and velocities as evidence of failures: below 1 for lasting errors
    last_measured: Vector6  # last measured position [m, NED] and velocity [m/s, body axes]
    mass_scale: float  # mass over 50 kg, at least 1: a heavier vehicle's W - B is less well known
    lags: Vector3  # s: estimated lag less a standard deviation, at least 0; the lag itself; the lag plus one
    bracket: Rows2  # N, forces at the end of the period, for the minimum and the maximum of `lags`
    by_lag: VectorM  # N/s, secant of the acting forces between the minimum and the maximum of `lags`
    curvature: VectorM  # N, difference of the acting forces from that secant
    # N, by the ceiling: derivative of the acting forces; of those at the end of the period; (-) the ceilings
    # of these forces
    by_ceiling: Columns3
    transition: Sensitivity  # derivative of the next velocity by the state
    product: Sensitivity  # transition times covariance
    row: Unknowns  # derivative of a measured number by the state
    gain: Unknowns  # Kalman gain of a measured number
    deviation: Deviations  # true state less estimate by each hypothesis: j, thruster j is lost; m + j, stuck
    supposed: Rows2  # hypothesis of a stuck thruster: its effectiveness; its force [N] at effectiveness 1
    # variance of the drift of disturbances, relative to that by the gains: current north and east, W - B; moments about
    # the body axes
    drift: Vector6
    missing: VectorM  # N, difference of a stuck thruster's force from the expected one
    direct: Hypotheses  # direct effect of the missing force on the last measured number
    # of the last measurements, divided by variances: innovations times those that each hypothesis expects;
    # the expected ones squared
    evidence: Evidence
    bias: Innovations  # low-passed innovations over their standard deviations: of moments, position, velocity
    misfit: float = 1.0  # mean square of `bias`, smoothed, relative to that of a model that fits


def make_estimate(vehicle: VehicleModel) -> Estimate:
    """Return the estimate before the first measurement."""
    mass, m = vehicle.rigid_mass[0, 0], vehicle.thruster_matrix.shape[1]
    mass_scale, n = max(mass / _LIGHT, 1.0), EFFECTIVENESS + 2 * m
    state, deviations = np.zeros(n), np.zeros(n)
    lag = float(np.mean(vehicle.thrust_time_constant)) or _FIRST_LAG
    state[EFFECTIVENESS : EFFECTIVENESS + m], state[EFFECTIVENESS + m :], state[LAG] = 0.95, 1.0, lag
    deviations[CURRENT:NET_WEIGHT] = _FIRST_CURRENT
    deviations[NET_WEIGHT] = _FIRST_RESTORING * mass_scale
    deviations[MOMENTS:YAW_MOMENT], deviations[YAW_MOMENT] = _FIRST_ARM * _GRAVITY * mass, _FIRST_YAW * _GRAVITY * mass
    deviations[HEIGHT], deviations[DRAG], deviations[LAG] = _FIRST_HEIGHT, _FIRST_DRAG, lag
    state[DRAG] = 1.0
    deviations[EFFECTIVENESS : EFFECTIVENESS + m] = _FIRST_EFFECTIVENESS
    deviations[EFFECTIVENESS + m :] = _FIRST_CEILING
    covariance = np.diag(deviations**2)
    covariance[EFFECTIVENESS : EFFECTIVENESS + m, EFFECTIVENESS : EFFECTIVENESS + m] += _FIRST_COMMON**2
    covariance[EFFECTIVENESS + m :, EFFECTIVENESS + m :] += _FIRST_COMMON_CEILING**2
    estimate = Estimate(m=m, k=n, h=2 * m, mass_scale=mass_scale, lags=np.array([0.0, 0.5, 1.0]))
    estimate.first_state, estimate.first_covariance = state, covariance
    estimate.state, estimate.covariance = state, covariance
    estimate.by_ceiling[2], estimate.last_measured[:], estimate.drift[:] = 1.0, np.nan, 1.0
    return estimate


def reset(estimate: Estimate) -> None:
    """Reset all to the state before the first measurement, except the effectiveness of the thrusters."""
    P, P_0 = estimate.covariance, estimate.first_covariance
    estimate.state[:EFFECTIVENESS] = estimate.first_state[:EFFECTIVENESS]
    P[:EFFECTIVENESS], P[:, :EFFECTIVENESS] = P_0[:EFFECTIVENESS], P_0[:, :EFFECTIVENESS]
    estimate.deviation[:, :], estimate.drift[:], estimate.bias[:], estimate.misfit = 0.0, 1.0, 0.0, 1.0
    estimate.time_since_measurement = -1.0
    publish(estimate)


def initialize(estimate: Estimate, position: Vector3, velocity: Vector3, gains: DeployableGains) -> None:
    """Initialize from the first measurement [m, m/s, NED]; an unmeasured velocity is assumed to be zero."""
    start_from(estimate, POSITION, position, gains.position_noise)
    if np.isnan(velocity[0] + velocity[1] + velocity[2]):
        start_from(estimate, VELOCITY, zeros(3), _FIRST_VELOCITY)
    else:
        start_from(estimate, VELOCITY, velocity, gains.velocity_noise)
    project(estimate, gains)
    estimate.time_since_measurement = 0.0


def start_from(estimate: Estimate, first: int, measured: Vector3, deviation: float) -> None:
    """Replace the estimate of position or velocity by a measurement; all other states keep their estimate."""
    estimate.state[first : first + 3] = measured
    for i in range(first, first + 3):
        _decouple(estimate, i, square(deviation))
    estimate.time_since_valid[0 if first == POSITION else 1] = 0.0
    publish(estimate)


def _decouple(estimate: Estimate, i: int, variance: float) -> None:
    """Set the variance of a state, which no longer depends on the others."""
    P = estimate.covariance
    P[i], P[:, i], P[i, i] = 0.0, 0.0, variance
    estimate.deviation[:, i] = 0.0


def publish(estimate: Estimate) -> None:
    """Copy the parts of the state that other modules read."""
    x = estimate.state
    estimate.position, estimate.velocity, estimate.moments = x[:3], x[VELOCITY:CURRENT], x[MOMENTS:YAW_MOMENT]
    estimate.water_velocity[:2], estimate.net_weight = x[CURRENT:NET_WEIGHT], x[NET_WEIGHT]
    estimate.yaw_moment, estimate.drag = x[YAW_MOMENT], x[DRAG]


def set_effectiveness(estimate: Estimate, j: int, value: float) -> None:
    """Set the effectiveness of a thruster: 0 for an isolated one, 1 for one that works again."""
    estimate.state[EFFECTIVENESS + j] = value
    _decouple(estimate, EFFECTIVENESS + j, square(_FIRST_EFFECTIVENESS) * value)


def inflate_effectiveness(estimate: Estimate, j: int) -> None:
    """Inflate the variance of an effectiveness that has changed."""
    estimate.covariance[EFFECTIVENESS + j, EFFECTIVENESS + j] += square(_FIRST_EFFECTIVENESS)


def freeze(estimate: Estimate, gains: DeployableGains) -> None:
    """Freeze drag, lag and effectiveness if the gains exclude them from estimation."""
    P = estimate.covariance
    for i in range(DRAG, estimate.state.size):
        estimated = gains.effectiveness_estimation
        if i == DRAG:
            estimated = gains.drag_estimation
        elif i == LAG:
            estimated = gains.lag_bound
        if estimated == 0.0:
            P[i], P[:, i], P[i, i] = 0.0, 0.0, square(_KNOWN_LAG) if i == LAG else 0.0


def project(estimate: Estimate, gains: DeployableGains) -> None:
    """Project the unknowns onto their bounds."""
    bound = gains.restoring_bound * estimate.mass_scale
    _bound(estimate, NET_WEIGHT, -bound, bound)
    bound = gains.moment_bound * square(estimate.mass_scale)
    for i in range(MOMENTS, YAW_MOMENT + 1):
        _bound(estimate, i, -bound, bound)
    for i in range(CURRENT, NET_WEIGHT):
        _bound(estimate, i, -gains.current_bound, gains.current_bound)
    m = estimate.missing.size
    for j in range(m):
        _bound(estimate, EFFECTIVENESS + j, 0.0, _GREATEST_EFFECTIVENESS)
        _bound(estimate, EFFECTIVENESS + m + j, _LEAST_CEILING, _GREATEST_EFFECTIVENESS)
    _bound(estimate, DRAG, _DRAG_RANGE[0], _DRAG_RANGE[1])
    _bound(estimate, LAG, 0.0, gains.lag_bound)
    publish(estimate)


def _bound(estimate: Estimate, i: int, least: float, most: float) -> None:
    """Project one state onto its bounds, and condition the others on it."""
    x, P = estimate.state, estimate.covariance
    excess = x[i] - min(max(x[i], least), most)
    if excess != 0.0:
        if P[i, i] > 0.0:
            x -= P[:, i] / P[i, i] * excess
        x[i] = min(max(x[i], least), most)
