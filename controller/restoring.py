"""Weight and buoyancy, linear in the unknown parameters: g(eta) = Z(eta) phi (12)."""

# phi = [W - B, x_G W - x_B B, y_G W - y_B B, z_G W - z_B B], in N and N m.

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from controller.quaternion import down_parts

Array = NDArray[np.float64]


def write_regressor(e: Array, Z: Array) -> None:
    """Write Z(eta), shape (6, 4), of a unit quaternion `e`: (12), Z = [-k 0; 0 S(k)] with k = R^T e3."""
    x, y, z = down_parts(e)
    Z[:, :] = 0.0
    Z[0, 0], Z[1, 0], Z[2, 0] = -x, -y, -z
    Z[3, 2], Z[3, 3] = -z, y
    Z[4, 1], Z[4, 3] = z, -x
    Z[5, 1], Z[5, 2] = -y, x


def regressor(e: Array) -> Array:
    """Return Z(eta), shape (6, 4), as `write_regressor` writes it."""
    Z = np.empty((6, 4))
    write_regressor(e, Z)
    return Z


def parameters(weight: float, buoyancy: float, r_G: Array, r_B: Array) -> Array:
    """Return phi (12), shape (4,) [N, N m], from `weight` and `buoyancy` [N], their centers `r_G` and `r_B` [m]."""
    phi = np.empty(4)
    phi[0] = weight - buoyancy
    for i in range(3):
        phi[1 + i] = r_G[i] * weight - r_B[i] * buoyancy
    return phi
