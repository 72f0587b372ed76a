"""Weight and buoyancy, linear in what the controller does not know: g(eta) = Z(eta) phi (12).

phi = [W - B, x_G W - x_B B, y_G W - y_B B, z_G W - z_B B], in N and N m.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from controller.jit.jit import compiled
from controller.quaternion import down_in_body, skew

Array = NDArray[np.float64]


@compiled
def regressor(e: Array) -> Array:
    """Return Z(eta), shape (6, 4), of a unit quaternion `e`: (12), Z = [-k 0; 0 S(k)] with k = R^T e3."""
    k = down_in_body(e)
    Z = np.zeros((6, 4))
    Z[:3, 0] = -k
    Z[3:, 1:] = skew(k)
    return Z


@compiled
def parameters(weight: float, buoyancy: float, r_G: Array, r_B: Array) -> Array:
    """Return phi (12), shape (4,) [N, N m], from `weight` and `buoyancy` [N], their centres `r_G` and `r_B` [m]."""
    phi = np.empty(4)
    phi[0] = weight - buoyancy
    for i in range(3):
        phi[1 + i] = r_G[i] * weight - r_B[i] * buoyancy
    return phi
