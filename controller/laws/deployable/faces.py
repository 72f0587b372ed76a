"""Faces ahead of the vehicle, of regions with several faces."""

# Inside a box, the clearance is the distance to the nearest face. The face that the vehicle heads for becomes the
# nearest too late to brake. So a line along the velocity is followed to the point where it leaves the region, up to the
# stopping distance; the face found there is a plane with its own barrier. The component of the velocity towards faces
# that have barriers already is removed, so that the next face is found in a corner, too.

from __future__ import annotations

import numpy as np

from controller.linear_algebra import norm
from controller.regions.kinds import KINKED_INSIDE, KINKED_OUTSIDE
from controller.regions.region_set import PackedRegions, clearance_at, position_clearance
from controller.stack_array import Vector3

FACES = 2  # maximum number of faces besides the nearest that have barriers
_LINE_SAMPLES = 16  # a stride along a line, which ends with an evaluation, is at least the line's length over this
_HALVINGS = 6  # bisections of the interval in which the line leaves the region


def has_faces(kind: int, sign: float) -> bool:
    """Return True if the clearance of a region has a kink where two faces are equally near."""
    # An ellipsoid to stay in (`sign` above 0) has the kink along its long axes, a sphere at its center.
    return kind in KINKED_OUTSIDE or (sign > 0.0 and kind in KINKED_INSIDE)


def face_ahead(
    regions: PackedRegions, i: int, position: Vector3, nearest: Vector3, velocity: Vector3, reach: float, face: Vector3
) -> float:
    """Find the face of region `i` that the vehicle heads for, beside the nearest one; position [m, NED]."""
    # Units of arguments and result: velocity [m/s]; reach [m]; result [m]
    velocity -= min(float(velocity @ nearest), 0.0) * nearest
    speed = norm(velocity)
    if not speed > 1e-6:
        return np.inf
    clearance, low, high = clearance_at(regions, i, position), 0.0, 0.0
    while clearance > 0.0:
        if high >= reach:
            return np.inf
        low, high = high, min(high + max(clearance, reach / _LINE_SAMPLES), reach)
        clearance = clearance_at(regions, i, position + high / speed * velocity)
    for _ in range(_HALVINGS):
        middle = 0.5 * (low + high)
        if clearance_at(regions, i, position + middle / speed * velocity) > 0.0:
            low = middle
        else:
            high = middle
    point = position + low / speed * velocity
    distance = position_clearance(regions, i, point, face)
    return distance + float(face @ (position - point))
