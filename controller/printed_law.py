"""The law as printed: equations (16)-(29), faithful to the letter where it can be read, as resolved where it cannot.

It knows no thrusters and no limits. With the paper's gains it asks for tens of kilonewtons far from the goal; under a
limit its adaptation (27) winds up. It is here to be studied, not to be put on a vehicle.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from controller.compiled import compiled
from controller.quaternion import error, rotation_matrix
from controller.restoring import regressor

Array = NDArray[np.float64]


class Gains(NamedTuple):
    """The scalars of section VII, which are its defaults."""

    k_p1: float = 18.8  # N/m3, on the primary region (16)
    k_p2: float = 36.0  # N m, on attitude (26)
    k_q: float = 100.0  # (22), (26); cancels in (25) and (27), where beta_i k_q = alpha_i: it enters the analysis alone
    k_v1: float = 90.0  # N s/m (26)
    k_v2: float = 40.0  # N m s/rad (26)
    sigma_p: float = 0.08  # 1/(m2 s), of position in the adaptation (27)
    sigma_a: float = 0.9  # rad/s, of attitude in the adaptation (27)
    gamma: float = 2.0  # s2/kg, s2/(kg m2): Gamma = gamma I (27)


@compiled
def violation(value: float) -> float:
    """Return max(0, g), as in (16), (17), (20) and (22); NaN stays NaN, lest a lost measurement looked like safety."""
    return 0.0 if value <= 0.0 else value


@compiled
def primary_potential(value: float, k_p1: float) -> float:
    """Return P_p [N m]: (16), of f."""
    return 0.5 * k_p1 * violation(value) ** 2


@compiled
def secondary_potential(values: Array, alphas: Array) -> float:
    """Return P_s: (17), of the g_i and alpha_i, each of shape (n,).

    The law follows its gradient only where |dg_i/dp| = 1: (19) normalises each gradient.
    """
    total = 0.0
    for i in range(values.size):
        total += 0.5 * alphas[i] * violation(values[i]) ** 2
    return total


@compiled
def primary_error(value: float, gradient: Array) -> Array:
    """Return e_p, shape (3,): (20), of f and its gradient; k_p1 times it is the gradient (18) of the potential."""
    return violation(value) * gradient


@compiled
def secondary_error(values: Array, gradients: Array, betas: Array) -> Array:
    """Return e_s, shape (3,): (21), (22); k_q times it is (19).

    Parameters
    ----------
    values : ndarray, shape (n,)
        g_i.
    gradients : ndarray, shape (n, 3)
        dg_i/dp; a region whose gradient is zero contributes nothing.
    betas : ndarray, shape (n,)
        alpha_i / k_q.
    """
    total = np.zeros(3)
    for i in range(values.size):
        if not values[i] <= 0.0:
            norm = math.sqrt(gradients[i, 0] ** 2 + gradients[i, 1] ** 2 + gradients[i, 2] ** 2)
            if not norm <= 0.0:
                total += (betas[i] * values[i] / norm) * gradients[i]
    return total


@compiled
def wrench(
    e_p: Array, e_s: Array, e_att: Array, R: Array, Z: Array, velocity_body: Array, estimate: Array, gains: Gains
) -> Array:
    """Return tau, shape (6,) [N, N m]: (25) with (26), (29).

    Parameters
    ----------
    e_p, e_s : ndarray, shape (3,)
        Region errors (20), (21), world frame.
    e_att : ndarray, shape (3,)
        Vector part of the error quaternion (23).
    R : ndarray, shape (3, 3)
        From body to world.
    Z : ndarray, shape (6, 4)
        Regressor (12).
    velocity_body : ndarray, shape (6,)
        nu [m/s, rad/s].
    estimate : ndarray, shape (4,)
        phi-hat [N, N m].
    gains : Gains
        K_0 = diag(k_p1 R^T, k_p2 I), K_s = [k_q R^T; 0], K_v = diag(k_v1 I, k_v2 I) (26).
    """
    tau = Z @ estimate
    tau[:3] -= R.T @ (gains.k_p1 * e_p + gains.k_q * e_s) + gains.k_v1 * velocity_body[:3]
    tau[3:] -= gains.k_p2 * e_att + gains.k_v2 * velocity_body[3:]
    return tau


@compiled
def estimate_rate(
    e_p: Array, e_s: Array, e_att: Array, R: Array, Z: Array, velocity_body: Array, gains: Gains
) -> Array:
    """Return d(phi-hat)/dt, shape (4,) [N/s, N m/s]: (27) with (28); arguments as `wrench`."""
    drive = velocity_body.copy()
    drive[:3] += gains.sigma_p * (R.T @ (e_p + (gains.k_q / gains.k_p1) * e_s))
    drive[3:] += gains.sigma_a * e_att
    return -(Z.T @ drive) / gains.gamma


@compiled
def step(
    quaternion: Array,
    velocity_body: Array,
    desired_quaternion: Array,
    goal_value: float,
    goal_gradient: Array,
    values: Array,
    gradients: Array,
    alphas: Array,
    gains: Gains,
    period: float,
    estimate: Array,
    tau: Array,
) -> None:
    """Compute the wrench of one control period, then carry the estimate over it.

    Parameters
    ----------
    quaternion, desired_quaternion : ndarray, shape (4,)
        Attitude from body to world, as it is and as it shall be.
    velocity_body : ndarray, shape (6,)
        nu [m/s, rad/s].
    goal_value : float
        f of the primary region (13).
    goal_gradient : ndarray, shape (3,)
        df/dp.
    values, gradients : ndarray, shape (n,), (n, 3)
        g_i and dg_i/dp of the secondary regions (14).
    alphas : ndarray, shape (n,)
        Gain of each region (section VII) times its weight from the arbiter (section VI).
    gains : Gains
        The law's own.
    period : float
        For how long the wrench is held [s]; (27) is integrated over it by Euler's rule.
    estimate : ndarray, shape (4,)
        phi-hat, updated in place after it was used.
    tau : ndarray, shape (6,)
        Receives the wrench [N, N m], body frame.
    """
    R = rotation_matrix(quaternion)
    Z = regressor(quaternion)
    e_p = primary_error(goal_value, goal_gradient)
    e_s = secondary_error(values, gradients, alphas / gains.k_q)
    e_att = error(desired_quaternion, quaternion)[1:]
    tau[:] = wrench(e_p, e_s, e_att, R, Z, velocity_body, estimate, gains)
    estimate += period * estimate_rate(e_p, e_s, e_att, R, Z, velocity_body, gains)
