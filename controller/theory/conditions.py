"""The gain conditions (38) and (45): their validity, margin and range."""

# lambda_m of (34) is the greatest eigenvalue of M, since J^+ = blkdiag(R^T, I) is orthogonal. sigma_p is in the
# conditions on position, sigma_a in that on attitude.

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from controller.paper_law import Gains
from controller.theory.lyapunov import secondary_gain

Array = NDArray[np.float64]


class Fit(NamedTuple):
    """A condition `have` > `need`."""

    have: float
    need: float

    @property
    def holds(self) -> bool:
        """True if the condition holds."""
        return self.have > self.need


def greatest_inertia(mass: Array) -> float:
    """Return lambda_m [kg, kg m2] of (34)."""
    return float(np.linalg.eigvalsh(mass)[-1])


def potential_matrix(gradient_norm: float, gains: Gains) -> Array:
    """Return P, shape (6, 6): the part of potential and attitude in V, (38) on the left."""
    position = 0.5 * (gains.k_p1 + gains.sigma_p * gains.k_v1) / gradient_norm**2 if gradient_norm else np.inf
    attitude = gains.k_p2 + gains.sigma_a * gains.k_v2
    return np.diag([position] * 3 + [attitude] * 3)


def least_of_potential_test(mass: Array, gradient_norm: float, gains: Gains) -> float:
    """Return the least eigenvalue of P - sigma M sigma: (38), first and second condition as one matrix, above 0."""
    sigma = np.diag([gains.sigma_p] * 3 + [gains.sigma_a] * 3)
    return float(np.linalg.eigvalsh(potential_matrix(gradient_norm, gains) - sigma @ mass @ sigma)[0])


def potential_fits(mass: Array, gradient_norm: float, gains: Gains) -> tuple[Fit, Fit]:
    """Return (38), first and second condition, with the scalar lambda_m of the paper."""
    # Units of arguments: mass (6, 6) [kg, kg m2]
    #
    # The second compares the mass in kilograms with an inertia: lambda_m is 187.7 for ODIN, whose inertia is 8 kg m2.
    # The matrix test `least_of_potential_test` does not.
    P = potential_matrix(gradient_norm, gains)
    heaviest = greatest_inertia(mass)
    return Fit(float(P[0, 0]), gains.sigma_p**2 * heaviest), Fit(float(P[5, 5]), gains.sigma_a**2 * heaviest)


def secondary_fit(mass: Array, gradient_norms: Array, betas: Array, gains: Gains) -> Fit:
    """Return (38), third condition, over the active regions alone; without any it holds."""
    # Units of arguments: mass (6, 6) [kg, kg m2]
    if not len(betas):
        return Fit(math.inf, 0.0)
    steepest = float(np.max(gradient_norms))
    b_min = 1.0 / steepest**2 if steepest else math.inf
    have = 0.5 * secondary_gain(gains) * float(np.min(1.0 / betas)) * b_min
    return Fit(have, gains.sigma_p**2 * greatest_inertia(mass) * len(betas))


def greatest_gradient(mass: Array, gains: Gains) -> float:
    """Return the |df/dp| below which the matrix test of (38) holds; 0 if it holds nowhere, inf if everywhere."""
    # Units of arguments: mass (6, 6) [kg, kg m2]
    #
    # It follows from the Schur complement: the translation's part of sigma M sigma, plus the effect of the coupling to
    # rotation.
    sigma = np.diag([gains.sigma_p] * 3 + [gains.sigma_a] * 3)
    crossing = sigma @ mass @ sigma
    rotation = (gains.k_p2 + gains.sigma_a * gains.k_v2) * np.eye(3) - crossing[3:, 3:]
    if np.linalg.eigvalsh(rotation)[0] <= 0.0:
        return 0.0
    coupled = crossing[:3, :3] + crossing[:3, 3:] @ np.linalg.solve(rotation, crossing[3:, :3])
    need = float(np.linalg.eigvalsh(coupled)[-1])
    return math.sqrt(0.5 * (gains.k_p1 + gains.sigma_p * gains.k_v1) / need) if need > 0.0 else math.inf


def error_jacobian_bound(jacobian: Array) -> float:
    """Return the greatest eigenvalue of the symmetric part of de_p/dp, `jacobian`, (3, 3): the rate of e_p with p."""
    # For a sphere it is |df/dp|^2 + 2 f where f > 0.
    return float(np.linalg.eigvalsh(0.5 * (jacobian + jacobian.T))[-1])


def damping_fit(
    mass: Array, linear_damping: Array, jacobian_bound: float, gains: Gains, translation_alone: bool = False
) -> Fit:
    """Return (45), first condition: lambda_min[D] + lambda_min[K_v] against sigma c_0."""
    # Units of arguments: linear_damping [N s/m, N m s/rad]
    # The right side is the one term of sigma c_0 with de_p/dt alone, from the translational mass: the other terms of
    # (43) come on top unless they happen to cancel it, so this condition is necessary for the full one in general. (The
    # term with D's linear part is no multiple of |nu|^2 at all; (43) holds for it only together with the errors.)
    drag = np.array(linear_damping, dtype=float)
    bound = drag[:3].min() + gains.k_v1 if translation_alone else drag.min() + min(gains.k_v1, gains.k_v2)
    translation = float(np.linalg.eigvalsh(mass[:3, :3])[-1])
    return Fit(float(bound), gains.sigma_p * translation * jacobian_bound)


def gain_fits(gains: Gains) -> tuple[Fit, Fit]:
    """Return (45), second and third condition, of `gains`, with J_v read as blkdiag(R, I)."""
    # That leaves diag(k_p1 I, k_p2 I).
    min_gain = min(gains.k_p1, gains.k_p2)
    return Fit(min_gain, 0.0), Fit(gains.k_q, min_gain)


def sphere_radii(mass: Array, linear_damping: Array, radius: float, gains: Gains) -> tuple[float, float, float]:
    """Return the distances from the center of a spherical goal region within which conditions hold [m]."""
    # Units of arguments: linear_damping [N s/m, N m s/rad]
    potential = 0.5 * greatest_gradient(mass, gains)
    within = []
    for translation_alone in (False, True):
        have, per_unit = damping_fit(mass, linear_damping, 1.0, gains, translation_alone)
        # |df/dp|^2 + 2 f = 4 d^2 + 2 (d^2 - r^2) against have / per_unit
        square = (have / per_unit + 2.0 * radius**2) / 6.0 if per_unit else math.inf
        within.append(max(radius, math.sqrt(square)))
    return potential, within[0], within[1]
