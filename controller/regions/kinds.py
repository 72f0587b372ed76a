"""Shapes told by their kind: the one that is meant is evaluated, and all but the simplest are compiled only once."""

from __future__ import annotations

from typing import Any

import numpy as np
from numba import types
from numpy.typing import NDArray

from controller.jit.function_pointer import declare, pointer_to
from controller.jit.jit import part
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


@part
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


@part
def evaluate_shape_of_attitude(kind: int, p: Array, e: Array, q: Array) -> EvaluationOfAttitude:
    """Evaluate a packed shape of attitude, told by its kind, at the position `p` [m, NED] and the attitude `e`."""
    if kind == FIRST_OF_ATTITUDE:
        return orientation(p, e, q)
    return visibility(p, e, q)


_NUMBERS: Any = types.float64[::1]
_Tuple: Any = types.UniTuple
declare(evaluate_shape, (types.int64, _NUMBERS, _NUMBERS), _Tuple(types.float64, 5))
declare(evaluate_shape_of_attitude, (types.int64, _NUMBERS, _NUMBERS, _NUMBERS), _Tuple(types.float64, 7))


def addresses_of(kinds: NDArray[np.int64]) -> tuple[int, int]:
    """Return the addresses of what evaluates shapes of place and of attitude; 0 where these kinds need it not."""
    place = np.any((kinds != SPHERE) & (kinds != DEPTH_BAND) & (kinds < FIRST_OF_ATTITUDE))
    return (
        pointer_to(evaluate_shape) if place else 0,
        pointer_to(evaluate_shape_of_attitude) if np.any(kinds >= FIRST_OF_ATTITUDE) else 0,
    )
