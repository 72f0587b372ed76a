"""The paper's law: equations (16)-(29), to the letter where it can be read, as resolved where it cannot."""

# It has no thrusters and no limits. With the paper's gains it commands tens of kilonewtons far from the goal; under a
# limit its adaptation (27) winds up. It is here for study, not for use on a vehicle.

from __future__ import annotations

from typing import NamedTuple

from controller.linear_algebra import cross, norm
from controller.quaternion import error, rotation_matrix
from controller.stack_array import Array, Matrix3, Rows3, Vector3, Vector4, Vector6, zeros


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


def primary_error(value: float, gradient: Vector3) -> Vector3:
    """Return e_p: (20), of f, `value`, and its `gradient`; k_p1 times it is (18), the potential's."""
    return positive_part(value) * gradient


def secondary_error(values: Array, gradients: Rows3, alphas: Array, k_q: float = 1.0) -> Vector3:
    """Return e_s: (21), (22), with beta_i = alpha_i / k_q; k_q times it is (19); values (n,), alphas (n,)."""
    e_s = zeros(3)
    for i in range(values.size):
        size = norm(gradients[i])
        if not values[i] <= 0.0 and not size <= 0.0:
            e_s += alphas[i] / k_q * values[i] / size * gradients[i]
    return e_s


def apply(
    e_p: Vector3,
    e_s: Vector3,
    e_att: Vector3,
    R: Matrix3,
    nu: Vector6,
    gains: Gains,
    period: float,
    estimate: Vector4,
    tau: Vector6,
) -> None:
    """Write tau: (25) with (26), (29); then update the estimate over a period: (27) with (28)."""
    # Units of arguments: nu [m/s, rad/s]; period [s]; estimate [N, N m]; tau [N, N m]
    k = R[2]  # (12): Z = [-k 0; 0 S(k)] with k = R^T e3
    # (25): Z phi-hat - K_0 e - K_s e_s - K_v nu
    tau[:3] = -k * estimate[0] - R.T @ (gains.k_p1 * e_p + gains.k_q * e_s) - gains.k_v1 * nu[:3]
    tau[3:] = cross(k, estimate[1:]) - gains.k_p2 * e_att - gains.k_v2 * nu[3:]
    # (27): -Gamma^-1 Z^T (nu + sigma J_e), of which Z^T = [-k^T 0; 0 -S(k)]
    J_e = R.T @ (e_p + gains.k_q / gains.k_p1 * e_s)
    estimate[0] += period / gains.gamma * (k @ (nu[:3] + gains.sigma_p * J_e))
    estimate[1:] += period / gains.gamma * cross(k, nu[3:] + gains.sigma_a * e_att)


def step(
    quaternion: Vector4,
    velocity_body: Vector6,
    desired_quaternion: Vector4,
    goal_value: float,
    goal_gradient: Vector3,
    values: Array,
    gradients: Rows3,
    alphas: Array,
    gains: Gains,
    period: float,
    estimate: Vector4,
    tau: Vector6,
) -> None:
    """Compute the wrench of one control period, then update the estimate over it; velocity_body [m/s, rad/s]."""
    # Units of arguments: period [s]; estimate [N, N m]; tau [N, N m]
    e_p, e_s = primary_error(goal_value, goal_gradient), secondary_error(values, gradients, alphas, gains.k_q)
    e_att, R = error(desired_quaternion, quaternion)[1:], rotation_matrix(quaternion)
    apply(e_p, e_s, e_att, R, velocity_body, gains, period, estimate, tau)
