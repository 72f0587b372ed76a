"""The vehicle model of the analysis, (11), (12), and its Properties 1-3."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from controller.quaternion import down_in_body, skew
from controller.restoring import parameters, regressor

Array = NDArray[np.float64]


class Model(NamedTuple):
    """Matrices of (11) in still water, about the body origin."""

    mass: Array  # (6, 6) kg, kg m, kg m2: M, rigid body plus added mass
    linear_damping: Array  # (6,) diagonal of D(0) [N s/m, N m s/rad]
    quadratic_damping: Array  # (6,) factor of |nu| in D [N s2/m2, N m s2/rad2]
    phi: Array  # (4,) true restoring parameters (12) [N, N m]


def coriolis(mass: Array, velocity_body: Array) -> Array:
    """Return C(nu), shape (6, 6), of `mass`, a constant matrix M, and nu, `velocity_body`, in Kirchhoff's form."""
    # (11).
    #
    # All in SI units, so [kg/s] and the like.
    #
    # With the momentum [a; b] = M nu it is [0 -S(a); -S(a) -S(b)], so that C nu = [w x a; v x a + w x b].
    momentum = mass @ velocity_body
    C = np.zeros((6, 6))
    S = skew(momentum[:3])
    C[:3, 3:] = -S
    C[3:, :3] = -S
    C[3:, 3:] = -skew(momentum[3:])
    return C


def damping(linear: Array, quadratic: Array, velocity_body: Array) -> Array:
    """Return the diagonal of D(nu), shape (6,) [N s/m, N m s/rad]: (11), of nu, `velocity_body`, in SI units."""
    # `linear` is the damping at rest, and `quadratic` its growth with |nu|.
    return linear + quadratic * np.abs(velocity_body)


def least_inertia(mass: Array) -> float:
    """Return the least eigenvalue of the symmetric part of M, in SI units: above 0 by Property 1."""
    return float(np.linalg.eigvalsh(0.5 * (mass + mass.T))[0])


def asymmetry(matrix: Array) -> float:
    """Return the greatest element of A - A^T over that of A: 0 where A is symmetric (Properties 1 and 3)."""
    return float(np.abs(matrix - matrix.T).max() / max(np.abs(matrix).max(), 1e-300))


def skew_defect(mass: Array, velocity_body: Array) -> float:
    """Return the deviation of dM/dt - 2 C(nu) from skew-symmetry (Property 2), over the greatest element of C [-]."""
    # `mass` and `velocity_body` as for `coriolis`.
    #
    # In body coordinates M is constant, so that C alone must be skew-symmetric.
    C = coriolis(mass, velocity_body)
    return float(np.abs(C + C.T).max() / max(np.abs(C).max(), 1e-300))


def restoring_defect(weight: float, buoyancy: float, r_G: Array, r_B: Array, quaternion: Array) -> float:
    """Return the difference of Z phi of (12) from weight and buoyancy at their centers [N, N m]."""
    # Units of arguments and result: weight, buoyancy [N]; r_G, r_B [m]; result [N or N m]
    k = down_in_body(quaternion)
    pull, push = weight * k, -buoyancy * k
    g = -np.concatenate([pull + push, np.cross(r_G, pull) + np.cross(r_B, push)])
    return float(np.abs(regressor(quaternion) @ parameters(weight, buoyancy, r_G, r_B) - g).max())
