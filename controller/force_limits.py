"""The forces that thrusters can give without a moment, by the facets of the set of their wrenches."""

from __future__ import annotations

import itertools

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

_SIGNS = [signs for signs in itertools.product((-1.0, 0.0, 1.0), repeat=3) if any(signs)]
DIRECTIONS: Array = np.array(_SIGNS) / np.linalg.norm(_SIGNS, axis=1)[:, None]
"""Unit vectors from the center of a cube to its faces, edges and corners, shape (26, 3)."""

_ROUNDING = 1e-9  # size of a product of unit vectors, and of a force as a fraction of the greatest limit, that is 0


def max_forces(matrix: Array, lower: Array, upper: Array, directions: Array, wrench: Array | float = 0.0) -> Array:
    """Return the maximum force of thrusters along each direction, without a moment, beside a constant wrench."""
    # With matrix (6, m), lower and upper (..., m) [N], directions (d, 3), wrench (6,) [N, N m], returns (..., d) [N]:
    # NaN where the limits exclude the wrench itself. The wrenches B u are a zonotope, on one side of each plane
    # n' w = h(n), the sum of the greatest n' b u. The ray along a direction leaves it at the first facet.
    normals = _facet_normals(matrix)
    pushes, along = normals @ matrix, normals[:, :3] @ directions.T
    gap = np.maximum(pushes * lower[..., None, :], pushes * upper[..., None, :]).sum(axis=-1)
    gap -= normals @ np.broadcast_to(wrench, 6)
    gap[np.abs(gap) < _ROUNDING * np.abs([lower, upper]).max()] = 0.0
    ends = np.divide(gap[..., None], along, out=np.full((*gap.shape, len(directions)), np.inf), where=along > _ROUNDING)
    forces: Array = ends.min(axis=-2)
    forces[(gap < 0.0).any(axis=-1)] = np.nan
    return forces


def _facet_normals(matrix: Array) -> Array:
    """Return unit vectors normal to each five columns, with both signs, among them those of all facets."""
    # columns of axes that no thruster pushes along make the facets of a flat set, too
    columns = matrix if np.linalg.matrix_rank(matrix) == 6 else np.hstack([matrix, np.eye(6)])
    units = columns / np.maximum(np.linalg.norm(columns, axis=0), np.finfo(float).tiny)
    fives = units.T[list(itertools.combinations(range(columns.shape[1]), 5))]
    normals = np.stack([(-1.0) ** i * np.linalg.det(np.delete(fives, i, axis=2)) for i in range(6)], axis=1)
    sizes = np.linalg.norm(normals, axis=1)
    normals = normals[sizes > _ROUNDING] / sizes[sizes > _ROUNDING, None]
    return np.concatenate([normals, -normals])
