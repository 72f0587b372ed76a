"""The forces that thrusters can give without a moment: by facets of the set of their wrenches, or linear programs."""

from __future__ import annotations

import functools
import itertools

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

_SIGNS = [signs for signs in itertools.product((-1.0, 0.0, 1.0), repeat=3) if any(signs)]
DIRECTIONS: Array = np.array(_SIGNS) / np.linalg.norm(_SIGNS, axis=1)[:, None]
"""Unit vectors from the center of a cube to its faces, edges and corners, shape (26, 3)."""

_ROUNDING = 1e-9  # size of a product of unit vectors, and of a force as a fraction of the maximum limit, that is 0
_MAX_COLUMNS = 16  # maximum number of columns for facets, whose number grows with its fifth power


def max_forces(matrix: Array, lower: Array, upper: Array, directions: Array, wrench: Array | float = 0.0) -> Array:
    """Return the maximum force of thrusters along each direction, without a moment, beside a constant wrench."""
    # With matrix (6, m), lower and upper (..., m) [N], directions (d, 3), wrench (6,) [N, N m], returns (..., d) [N]:
    # NaN where the limits exclude the wrench itself.
    arrays = [np.asarray(a, dtype=float) for a in (matrix, lower, upper, directions, np.broadcast_to(wrench, 6))]
    return _cached(*((a.tobytes(), a.shape) for a in arrays)).copy()


@functools.lru_cache(maxsize=16)
def _cached(*arrays: tuple[bytes, tuple[int, ...]]) -> Array:
    matrix, *others = (np.frombuffer(data).reshape(shape) for data, shape in arrays)
    # columns of axes that no thruster pushes along make the facets of a flat set, too
    columns = matrix if np.linalg.matrix_rank(matrix) == 6 else np.hstack([matrix, np.eye(6)])
    if columns.shape[1] > _MAX_COLUMNS:
        return _by_programs(matrix, *others)
    return _by_facets(matrix, _facet_normals(columns), *others)


def _by_facets(matrix: Array, normals: Array, lower: Array, upper: Array, directions: Array, wrench: Array) -> Array:
    """Return the distance along each direction to the first facet."""
    # The wrenches B u are a zonotope, on one side of each plane n' w = h(n), the sum of the maximum n' b u.
    projections, slopes = normals @ matrix, normals[:, :3] @ directions.T
    gap = np.maximum(projections * lower[..., None, :], projections * upper[..., None, :]).sum(axis=-1)
    gap -= normals @ wrench
    gap[np.abs(gap) < _ROUNDING * np.abs([lower, upper]).max()] = 0.0
    ends = np.divide(
        gap[..., None], slopes, out=np.full((*gap.shape, len(directions)), np.inf), where=slopes > _ROUNDING
    )
    forces: Array = ends.min(axis=-2)
    forces[(gap < 0.0).any(axis=-1)] = np.nan
    return forces


def _facet_normals(columns: Array) -> Array:
    """Return unit vectors normal to each five columns, with both signs, among them those of all facets."""
    units = columns / np.maximum(np.linalg.norm(columns, axis=0), np.finfo(float).tiny)
    subsets = units.T[list(itertools.combinations(range(columns.shape[1]), 5))]
    normals = np.stack([(-1.0) ** i * np.linalg.det(np.delete(subsets, i, axis=2)) for i in range(6)], axis=1)
    sizes = np.linalg.norm(normals, axis=1)
    normals = normals[sizes > _ROUNDING] / sizes[sizes > _ROUNDING, None]
    return np.concatenate([normals, -normals])


def _by_programs(matrix: Array, lower: Array, upper: Array, directions: Array, wrench: Array) -> Array:
    """Return the maximum s with B u = wrench + [s direction, 0] and u within its limits, by linear programs."""
    from scipy.optimize import linprog  # a slow import, a third of a command's start time

    m = matrix.shape[1]
    forces = np.full((*lower.shape[:-1], len(directions)), np.nan)
    for row in np.ndindex(lower.shape[:-1]):
        limits = list(zip(lower[row], upper[row], strict=True))
        if not linprog(np.zeros(m), A_eq=matrix, b_eq=wrench, bounds=limits).success:
            continue
        for i, direction in enumerate(directions):
            equal = np.column_stack([matrix, -np.r_[direction, np.zeros(3)]])
            cost, bounds = np.r_[np.zeros(m), -1.0], [*limits, (0.0, None)]
            program = linprog(cost, A_eq=equal, b_eq=wrench, bounds=bounds)
            forces[*row, i] = program.x[m] if program.success else 0.0  # where rounding excludes the wrench again
    return forces
