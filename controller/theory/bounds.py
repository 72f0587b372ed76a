"""The inequalities of the proof: (35), (36) on the secondary error, (44) on W."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from controller.paper_law import Gains
from controller.theory.model import Model, damping

Array = NDArray[np.float64]


def norm_bound(errors: Array) -> float:
    """Return the upper bound (35) of |e_s|: the sum of the |e_si|; errors (n, 3)."""
    return float(np.sum(np.linalg.norm(errors, axis=1)))


def square_bound(errors: Array) -> float:
    """Return the upper bound (36) of |e_s|^2: n times the sum of the |e_si|^2. Arguments as `norm_bound`."""
    return float(len(errors) * np.sum(errors**2))


def decay_bound(model: Model, gains: Gains, y: Array, velocity_body: Array, sigma_c0: float) -> float:
    """Return the lower bound (44) of W of (41) [W]; velocity_body [m/s, rad/s], sigma_c0 [N s/m, N m s/rad]."""
    least_drag = np.min(damping(model.linear_damping, model.quadratic_damping, velocity_body))
    least_drag += min(gains.k_v1, gains.k_v2)
    least_pull = min(gains.sigma_p * gains.k_p1, gains.sigma_a * gains.k_p2)
    return float((least_drag - sigma_c0) * np.sum(velocity_body**2) + least_pull * np.sum(y**2))
