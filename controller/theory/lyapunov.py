"""V of (31) and its rate -W of (40), (41)."""

# Throughout y = J^+ e_Ts = [R^T (e_p + (k_q/k_p1) e_s); e_e] with J^+ = blkdiag(R^T, I), and sigma = diag(sigma_p I,
# sigma_a I). The lost dots of (39), (41) and (43) are restored: dy/dt is the sum of both terms with M nu.
#
# The last term of V comes in three forms, since (31) and (33) agree with each other, and with the normalized force of
# (22), only where |dg_i/dp| = 1: `printed_secondary` (31), `unit_gradient_secondary` (33), and `normalized_secondary`,
# the true potential of the force. (40) is an identity for the last one alone, with constant weights, in still water,
# and where the wrench (25) acts.

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from controller.paper_law import Gains, positive_part
from controller.quaternion import rate, skew
from controller.theory.equations_of_motion import Model, coriolis, damping

Array = NDArray[np.float64]


def mapped_error(e_p: Array, e_s: Array, e_att: Array, R: Array, gains: Gains) -> Array:
    """Return y = J^+ e_Ts, shape (6,): (28); e_p, e_s (3,), e_att (3,), R (3, 3)."""
    y = np.empty(6)
    y[:3] = R.T @ (e_p + (gains.k_q / gains.k_p1) * e_s)
    y[3:] = e_att
    return y


def mapped_error_rate(region_rate: Array, y: Array, error_quaternion: Array, R: Array, omega: Array) -> Array:
    """Return dy/dt, shape (6,): both dotted terms of (39); omega [rad/s]."""
    result = np.empty(6)
    result[:3] = R.T @ region_rate - skew(omega) @ y[:3]
    result[3:] = rate(error_quaternion, omega)[1:]  # (24)
    return result


def weighted(y: Array, gains: Gains) -> Array:
    """Return sigma y, shape (6,)."""
    result = gains.sigma_p * y
    result[3:] = gains.sigma_a * y[3:]
    return result


def primary_value(
    model: Model,
    gains: Gains,
    goal_value: float,
    error_quaternion: Array,
    y: Array,
    velocity_body: Array,
    estimate: Array,
) -> float:
    """Return V [N m] without its last sum: (31), (32); velocity_body [m/s, rad/s], estimate [N, N m]."""
    momentum = model.mass @ velocity_body
    wrong = model.phi - estimate
    turned = (1.0 - error_quaternion[0]) ** 2 + np.sum(error_quaternion[1:] ** 2)
    value: float = (
        0.5 * np.sum(velocity_body * momentum)
        + np.sum(weighted(y, gains) * momentum)
        + 0.5 * gains.gamma * np.sum(wrong * wrong)
        + (gains.k_p2 + gains.sigma_a * gains.k_v2) * turned
        + 0.5 * (gains.k_p1 + gains.sigma_p * gains.k_v1) * positive_part(goal_value) ** 2  # (32)
    )
    return value


def secondary_gain(gains: Gains) -> float:
    """Return k_q + sigma_p k_w of (31), with k_w = k_q k_v1 / k_p1."""
    return gains.k_q * (1.0 + gains.sigma_p * gains.k_v1 / gains.k_p1)


def printed_secondary(values: Array, gradients: Array, betas: Array, gains: Gains) -> float:
    """Return the last sum of (31): of (1/beta_i) |e_si|^2 / |dg_i/dp|^2, with the normalized e_si of (22)."""
    total = 0.0
    for i in range(values.size):
        square = gradients[i, 0] ** 2 + gradients[i, 1] ** 2 + gradients[i, 2] ** 2
        if not values[i] <= 0.0 and square > 0.0:
            total += betas[i] * values[i] ** 2 / square
    return 0.5 * secondary_gain(gains) * total


def unit_gradient_secondary(values: Array, betas: Array, gains: Gains) -> float:
    """Return the last sum of (31) in the form of (33), which is valid where |dg_i/dp| = 1; as `printed_secondary`."""
    total = 0.0
    for i in range(values.size):
        total += betas[i] * positive_part(values[i]) ** 2
    return 0.5 * secondary_gain(gains) * total


def normalized_secondary(values: Array, gradients: Array, clearances: Array, betas: Array, gains: Gains) -> float:
    """Return the potential of the normalized force (22) in the place of the last sum of (31); clearances (n,) [m]."""
    # It is beta_i times the integral of g_i along the normal, from the surface to the vehicle. Where g is at most
    # quadratic in the distance, with g = 0 on the surface, that is d (4 g - |dg/dp| d) / 6 at the distance d: exact for
    # spheres and depth bands, and for all shapes whose g is a distance. The normalized force of an ellipsoid has no
    # potential, because |dg/dp| varies over its level surfaces; for it this is an estimate.
    total = 0.0
    for i in range(values.size):
        if not values[i] <= 0.0:
            slope = math.sqrt(gradients[i, 0] ** 2 + gradients[i, 1] ** 2 + gradients[i, 2] ** 2)
            depth = abs(clearances[i])
            total += betas[i] * depth * (4.0 * values[i] - slope * depth) / 6.0
    return secondary_gain(gains) * total


def bracket(model: Model, gains: Gains, y: Array, y_rate: Array, velocity_body: Array) -> float:
    """Return the terms in braces of W [W]: (41), those that (43) bounds. Arguments as `value_rate`."""
    forces = coriolis(model.mass, velocity_body) @ velocity_body
    forces += damping(model.linear_damping, model.quadratic_damping, velocity_body) * velocity_body
    return np.sum(weighted(y, gains) * forces) - np.sum(weighted(y_rate, gains) * (model.mass @ velocity_body))


def value_rate(model: Model, gains: Gains, y: Array, y_rate: Array, velocity_body: Array) -> float:
    """Return dV/dt = -W [W]; y, y_rate (6,), velocity_body (6,) [m/s, rad/s]."""
    # (40), (41), read with the weights constant and J_v^+ K_0 e_T = [k_p1 R^T e_p; k_p2 e_e].
    drag = damping(model.linear_damping, model.quadratic_damping, velocity_body)
    drag[:3] += gains.k_v1
    drag[3:] += gains.k_v2
    pull = weighted(y, gains) * y
    spent = np.sum(drag * velocity_body**2) + gains.k_p1 * np.sum(pull[:3]) + gains.k_p2 * np.sum(pull[3:])
    return -(spent + bracket(model, gains, y, y_rate, velocity_body))


def lower_bound(
    model: Model,
    gains: Gains,
    goal_value: float,
    error_quaternion: Array,
    y: Array,
    velocity_body: Array,
    estimate: Array,
) -> float:
    """Return the lower bound (34), (37) of `primary_value` by completing the square, with the matrix sigma."""
    # V is at least a quarter of nu^T M nu, the terms of potential, attitude and estimate, less (sigma y)^T M sigma y;
    # the difference is (nu + 2 sigma y)^T M (nu + 2 sigma y) / 4. Arguments as `primary_value`.
    #
    # From there (34) splits into |e_p|^2 and the |e_si|^2, and so loses the factor k_q/k_p1 of (28) and the product of
    # the two: its last line holds where no secondary region is active.
    crossing = weighted(y, gains)
    still = primary_value(model, gains, goal_value, error_quaternion, y, np.zeros(6), estimate)
    kinetic = np.sum(velocity_body * (model.mass @ velocity_body))
    return still + 0.25 * kinetic - np.sum(crossing * (model.mass @ crossing))
