"""Shapes told by their kind: the one that is meant is evaluated, and all but the simplest are compiled only once."""

from __future__ import annotations

import functools
from typing import Any

import numpy as np
from numpy.typing import NDArray

from controller.by_address import INTEGER, INTEGERS, NUMBERS, address_of, array_at
from controller.compiled import compiled, lean
from controller.regions.box import box
from controller.regions.cone import cone
from controller.regions.cylinder import cylinder
from controller.regions.depth_band import DepthBand, depth_band
from controller.regions.ellipsoid import ellipsoid
from controller.regions.half_space import half_space
from controller.regions.orientation import Orientation, orientation
from controller.regions.pipe import pipe
from controller.regions.prism import prism
from controller.regions.shape import Array, Evaluation, EvaluationOfAttitude
from controller.regions.sphere import Sphere, sphere
from controller.regions.visibility import visibility

SPHERE, DEPTH_BAND = Sphere.kind, DepthBand.kind
FIRST_OF_ATTITUDE = Orientation.kind  # kinds from it on depend on attitude


@lean
def evaluate_shape(kind: int, p: Array, q: Array) -> Evaluation:
    """Evaluate a packed shape of position alone, told by its kind, at the position `p` [m, NED]."""
    if kind == 0:
        return sphere(p, q)
    if kind == 1:
        return depth_band(p, q)
    if kind == 2:
        return half_space(p, q)
    if kind == 3:
        return box(p, q)
    if kind == 4:
        return cylinder(p, q)
    if kind == 5:
        return ellipsoid(p, q)
    if kind == 6:
        return prism(p, q)
    if kind == 7:
        return pipe(p, q)
    return cone(p, q)


@lean
def evaluate_shape_of_attitude(kind: int, p: Array, e: Array, q: Array) -> EvaluationOfAttitude:
    """Evaluate a packed shape of attitude, told by its kind, at the position `p` [m, NED] and the attitude `e`."""
    if kind == FIRST_OF_ATTITUDE:
        return orientation(p, e, q)
    return visibility(p, e, q)


@compiled
def _evaluate_others(
    n: int,
    kinds_at: Any,
    signs_at: Any,
    offsets_at: Any,
    n_numbers: int,
    numbers_at: Any,
    shifts_at: Any,
    position_at: Any,
    quaternion_at: Any,
    values_at: Any,
    gradients_at: Any,
    turnings_at: Any,
    clearances_at: Any,
) -> int:
    """Evaluate all shapes but spheres and bands of depth, of arrays of `evaluate_packed` at these addresses."""
    kinds, signs, offsets = array_at(kinds_at, n), array_at(signs_at, n), array_at(offsets_at, n + 1)
    all_numbers, shifts = array_at(numbers_at, n_numbers), array_at(shifts_at, (n, 3))
    position, quaternion = array_at(position_at, 3), array_at(quaternion_at, 4)
    values, clearances = array_at(values_at, n), array_at(clearances_at, n)
    gradients, turnings = array_at(gradients_at, (n, 3)), array_at(turnings_at, (n, 3))
    for i in range(n):
        kind = kinds[i]
        if kind in (SPHERE, DEPTH_BAND):
            continue
        at = gradients[i]  # until the gradient comes
        for j in range(3):
            at[j] = position[j] - shifts[i, j]
        numbers = all_numbers[offsets[i] : offsets[i + 1]]
        tx, ty, tz = 0.0, 0.0, 0.0
        if kind < FIRST_OF_ATTITUDE:
            g, gx, gy, gz, distance = evaluate_shape(kind, at, numbers)
        else:
            g, gx, gy, gz, tx, ty, tz = evaluate_shape_of_attitude(kind, at, quaternion, numbers)
            distance = g
        sign = signs[i]
        values[i], clearances[i] = sign * g, -sign * distance
        gradients[i, 0], gradients[i, 1], gradients[i, 2] = sign * gx, sign * gy, sign * gz
        turnings[i, 0], turnings[i, 1], turnings[i, 2] = sign * tx, sign * ty, sign * tz
    return n


@functools.cache
def _address_of_others() -> int:
    arguments = (INTEGER, INTEGERS, NUMBERS, INTEGERS, INTEGER, *[NUMBERS] * 8)
    return address_of(_evaluate_others, arguments)


def others_of(kinds: NDArray[np.int64]) -> int:
    """Return the address of what evaluates all shapes but spheres and bands of depth; 0 if these kinds need it not."""
    return 0 if np.isin(kinds, (SPHERE, DEPTH_BAND)).all() else _address_of_others()
