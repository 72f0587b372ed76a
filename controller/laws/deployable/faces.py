"""Faces that lie ahead, of regions whose nearest face is not the one that matters.

Within a box, the clearance is the distance to the nearest face, and says nothing of the one that the vehicle is
heading for, until that becomes the nearest, when it is too late to brake. So the way ahead is followed to where it
would leave the region, as far as the vehicle could need for stopping; the face found there is a plane with a barrier of
its own. The way is that of the velocity, less its part towards the faces that have barriers already, so that in a
corner, where a nearer face hides it, the next one is found too.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from controller.jit.jit import inlined, part
from controller.jit.stack_array import zeros
from controller.regions import Ellipsoid, HalfSpace, Sphere
from controller.regions.region_set import PackedRegions, clearance_of_place, place_clearance

Array = NDArray[np.float64]

_SMOOTH = (Sphere.kind, HalfSpace.kind, Ellipsoid.kind)
FACES = 2  # that are looked for beside the nearest
_LOOKS = 16  # along a way at most
_HALVINGS = 6  # of the stretch in which it leaves the region


@part
def has_faces(kind: int) -> bool:
    """Return whether the clearance of a kind of region of place may bend where two faces are equally near."""
    return kind not in _SMOOTH


@part
def face_ahead(
    regions: PackedRegions, i: int, position: Array, nearest: Array, velocity: Array, reach: float, face: Array
) -> float:
    """Find the face of region `i` that a velocity leads to, beside the one that is nearest.

    Parameters
    ----------
    regions : PackedRegions
        Where they are now.
    i : int
        Which of them; of position alone.
    position : ndarray, shape (3,)
        Where the vehicle is [m, NED], within the region if it is to be kept within, else outside.
    nearest : ndarray, shape (3,)
        Slope of the clearance there, of length 1: the face that has a barrier already.
    velocity : ndarray, shape (3,)
        Against the region [m/s]; its part towards `nearest` is taken away.
    reach : float
        How far the way is followed [m].
    face : ndarray, shape (3,)
        Receives the slope of the clearance at the face.

    Returns
    -------
    float
        Distance of the vehicle to the plane of the face [m], infinite where there is none.
    """
    towards, speed = 0.0, 0.0
    for axis in range(3):
        towards += velocity[axis] * nearest[axis]
    for axis in range(3):
        velocity[axis] -= min(towards, 0.0) * nearest[axis]
        speed += velocity[axis] ** 2
    speed = np.sqrt(speed)
    if not speed > 1e-6:
        return np.inf
    point, room, within, beyond = zeros(3), zeros(3), 0.0, 0.0
    clearance = _clearance_along(regions, i, position, velocity, 0.0, point, room)
    while clearance > 0.0:
        if beyond >= reach:
            return np.inf
        within, beyond = beyond, min(beyond + max(clearance, reach / _LOOKS), reach)
        clearance = _clearance_along(regions, i, position, velocity, beyond / speed, point, room)
    for _ in range(_HALVINGS):
        middle = 0.5 * (within + beyond)
        if _clearance_along(regions, i, position, velocity, middle / speed, point, room) > 0.0:
            within = middle
        else:
            beyond = middle
    for axis in range(3):
        point[axis] = position[axis] + within / speed * velocity[axis]
    distance = place_clearance(regions, i, point, face)
    for axis in range(3):
        distance += face[axis] * (position[axis] - point[axis])
    return distance


@inlined
def _clearance_along(
    regions: PackedRegions, i: int, position: Array, velocity: Array, time: float, point: Array, room: Array
) -> float:
    """Return the clearance where a velocity leads in a time; `point` and `room` have shape (3,)."""
    for axis in range(3):
        point[axis] = position[axis] + time * velocity[axis]
    return clearance_of_place(regions, i, point, room)
