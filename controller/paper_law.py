"""The paper's law: equations (16)-(29), to the letter where it can be read, as resolved where it cannot."""

# It has no thrusters and no limits. With the paper's gains it commands tens of kilonewtons far from the goal; under a
# limit its adaptation (27) winds up. It is here for study, not for use on a vehicle.

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from controller.arithmetic import length3
from controller.quaternion import Vector3, error_parts, rotation_rows

Array = NDArray[np.float64]
Rows = tuple[Vector3, Vector3, Vector3]


class Gains(NamedTuple):
    """The scalars of section VII, which are its defaults.

    Examples
    --------
    >>> from controller import Gains
    >>> Gains(k_p1=10.0)._replace(k_q=5.0).k_q
    5.0
    """

    k_p1: float = 18.8  # N/m3, gain of the primary region (16)
    k_p2: float = 36.0  # N m, gain of the attitude error (26)
    k_q: float = 100.0  # (22), (26); cancels in (25) and (27), where beta_i k_q = alpha_i: it enters the analysis alone
    k_v1: float = 90.0  # N s/m, damping of translation (26)
    k_v2: float = 40.0  # N m s/rad, damping of rotation (26)
    sigma_p: float = 0.08  # 1/(m2 s), weight of position in the adaptation (27)
    sigma_a: float = 0.9  # rad/s, weight of attitude in the adaptation (27)
    gamma: float = 2.0  # s2/kg, s2/(kg m2): Gamma = gamma I (27)


def positive_part(value: float) -> float:
    """Return max(0, g) of a `value` g, as in (16), (17), (20) and (22)."""
    # NaN stays NaN, so that a lost measurement does not look like safety.
    return 0.0 if value <= 0.0 else value


def primary_error(value: float, gradient: Array) -> Array:
    """Return e_p, shape (3,): (20), of f, `value`, and its `gradient`; k_p1 times it is (18), the potential's."""
    return positive_part(value) * gradient


def secondary_parts(values: Array, gradients: Array, alphas: Array, k_q: float) -> Vector3:
    """Return e_s as `secondary_error` does, of alphas, shape (n,), of which beta_i = alpha_i / k_q."""
    x, y, z = 0.0, 0.0, 0.0
    for i in range(values.size):
        if not values[i] <= 0.0:
            norm = length3(gradients[i, 0], gradients[i, 1], gradients[i, 2])
            if not norm <= 0.0:
                length = alphas[i] / k_q * values[i] / norm
                x += length * gradients[i, 0]
                y += length * gradients[i, 1]
                z += length * gradients[i, 2]
    return x, y, z


def secondary_error(values: Array, gradients: Array, betas: Array) -> Array:
    """Return e_s, shape (3,): (21), (22); k_q times it is (19); values (n,), gradients (n, 3), betas (n,)."""
    e_s = np.empty(3)
    e_s[0], e_s[1], e_s[2] = secondary_parts(values, gradients, betas, 1.0)
    return e_s


def to_body(R: Rows, x: Vector3) -> Vector3:
    """Return R^T x, a world vector in body axes."""
    return (
        R[0][0] * x[0] + R[1][0] * x[1] + R[2][0] * x[2],
        R[0][1] * x[0] + R[1][1] * x[1] + R[2][1] * x[2],
        R[0][2] * x[0] + R[1][2] * x[1] + R[2][2] * x[2],
    )


def apply(
    e_p: Vector3,
    e_s: Vector3,
    e_att: Vector3,
    R: Rows,
    velocity_body: Array,
    gains: Gains,
    period: float,
    estimate: Array,
    tau: Array,
) -> None:
    """Write tau: (25) with (26), (29); then update the estimate over a period: (27) with (28)."""
    # with velocity_body [m/s, rad/s], gains [k_q R^T; 0], period [s], estimate [N, N m], tau [N, N m]
    k_p1, k_q, nu = gains.k_p1, gains.k_q, velocity_body
    # (12): Z = [-k 0; 0 S(k)] with k = R^T e3, the last row of R
    k = R[2]
    supported = cross_product(k, estimate[1], estimate[2], estimate[3])
    pushed = to_body(R, (k_p1 * e_p[0] + k_q * e_s[0], k_p1 * e_p[1] + k_q * e_s[1], k_p1 * e_p[2] + k_q * e_s[2]))
    for i in range(3):  # (25): Z phi-hat - K_0 e - K_s e_s - K_v nu
        tau[i] = -k[i] * estimate[0] - pushed[i] - gains.k_v1 * nu[i]
        tau[3 + i] = supported[i] - gains.k_p2 * e_att[i] - gains.k_v2 * nu[3 + i]

    # (27): -Gamma^-1 Z^T (nu + sigma J_e), of which Z^T = [-k^T 0; 0 -S(k)]
    ratio = k_q / k_p1
    off = to_body(R, (e_p[0] + ratio * e_s[0], e_p[1] + ratio * e_s[1], e_p[2] + ratio * e_s[2]))
    sinking = 0.0
    for i in range(3):
        sinking += k[i] * (nu[i] + gains.sigma_p * off[i])
    turning = cross_product(
        k, nu[3] + gains.sigma_a * e_att[0], nu[4] + gains.sigma_a * e_att[1], nu[5] + gains.sigma_a * e_att[2]
    )
    estimate[0] += period / gains.gamma * sinking
    for i in range(3):
        estimate[1 + i] += period / gains.gamma * turning[i]


def cross_product(k: Vector3, x: float, y: float, z: float) -> Vector3:
    """Return S(k) [x y z]^T = k x [x y z]^T: (4)."""
    return k[1] * z - k[2] * y, k[2] * x - k[0] * z, k[0] * y - k[1] * x


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
    """Compute the wrench of one control period, then update the estimate over it; velocity_body [m/s, rad/s]."""
    # with period [s], estimate [N, N m], tau [N, N m]
    f = positive_part(goal_value)
    e_p = (f * goal_gradient[0], f * goal_gradient[1], f * goal_gradient[2])
    e_s = secondary_parts(values, gradients, alphas, gains.k_q)
    e_att = error_parts(desired_quaternion, quaternion)[1:]
    apply(e_p, e_s, e_att, rotation_rows(quaternion), velocity_body, gains, period, estimate, tau)
