"""Surfaces as triangles."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from controller.regions.shape import Array


@dataclass(frozen=True, eq=False)
class Mesh:
    """Triangles abc whose normals (b - a) x (c - a) point outward."""

    vertices: Array  # (n, 3) m, NED
    triangles: NDArray[np.intp]  # (m, 3) places in vertices


def closed_grid(points: Array) -> Mesh:
    """Return the mesh of a surface that closes in both directions of a grid, such as a ring.

    Parameters
    ----------
    points : ndarray, shape (rows, columns, 3)
        On the surface [m, NED]; along rows cross along columns points outward.

    Returns
    -------
    Mesh
        Two triangles for each point.
    """
    rows, columns = points.shape[:2]
    i, j = (of.ravel() for of in np.mgrid[:rows, :columns])
    a, b = i * columns + j, (i + 1) % rows * columns + j
    c, d = (i + 1) % rows * columns + (j + 1) % columns, i * columns + (j + 1) % columns
    return Mesh(points.reshape(-1, 3), np.vstack([np.column_stack([a, b, c]), np.column_stack([a, c, d])]))
