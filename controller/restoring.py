"""Weight and buoyancy, linear in the unknown parameters: g(eta) = Z(eta) phi (12)."""

# phi = [W - B, x_G W - x_B B, y_G W - y_B B, z_G W - z_B B], in N and N m.

from __future__ import annotations

from typing import Annotated

import numpy as np
from numpy.typing import NDArray

from controller.quaternion import down_in_body, skew
from controller.stack_array import Array, Shape, Vector4, zeros

Regressor = Annotated[NDArray[np.float64], Shape(6, 4)]


def regressor(e: Vector4) -> Regressor:
    """Return Z(eta) of a unit quaternion `e`: (12), Z = [-k 0; 0 S(k)] with k = R^T e3."""
    Z, k = zeros(6, 4), down_in_body(e)
    Z[:3, 0], Z[3:, 1:] = -k, skew(k)
    return Z


def parameters(weight: float, buoyancy: float, r_G: Array, r_B: Array) -> Array:
    """Return phi (12), shape (4,) [N, N m], from `weight` and `buoyancy` [N], their centers `r_G` and `r_B` [m]."""
    return np.concatenate(([weight - buoyancy], weight * np.asarray(r_G) - buoyancy * np.asarray(r_B)))
