"""How far one sees from a place: where rays meet the first region, by going on as far as clearances allow."""

from __future__ import annotations

import math

from controller.arithmetic import hypotenuse
from controller.regions.kinds import FIRST_OF_ATTITUDE, evaluate_shape
from controller.regions.region_set import PackedRegions
from controller.regions.shape import Array, Evaluation
from controller.regions.shapes import ENTRIES
from controller.regions.shapes.ellipsoid import Ellipsoid
from controller.regions.shapes.pipe import Pipe
from controller.regions.shapes.prism import Prism
from controller.stack_array import zeros

TOUCHING = 1e-4  # m; so near a surface a ray has met it
LOOKS = 64  # along a ray, at a region

_ELLIPSOID = Ellipsoid.kind
_PIPE = Pipe.kind
_PRISM = Prism.kind
_CONVEX = tuple(entry.shape.kind for entry in ENTRIES.values() if entry.convex)


def ray_distances(regions: PackedRegions, origin: Array, directions: Array, farthest: float, distances: Array) -> None:
    """Find how far it is along rays to where a region, as it is now, is violated.

    A ray goes on by what the clearance allows, which changes by one metre a metre at the most (sphere tracing). Where a
    convex shape is kept out of, the clearance is convex along the ray, so that its tangent allows more, and tells when
    a ray passes by (Newton's method, from the side on which it never oversteps). Pipes are taken capsule by capsule.

    Parameters
    ----------
    regions : PackedRegions
        Those that depend on attitude are left out: they close no place.
    origin : ndarray, shape (3,)
        Where all rays begin [m, NED].
    directions : ndarray, shape (m, 3)
        Unit vectors, NED.
    farthest : float
        How far is looked [m].
    distances : ndarray, shape (m,)
        Receives the distances [m]: 0 everywhere if the origin is inside, or on the surface; infinite where nothing is
        met nearer than `farthest`; NaN where the numbers of a ray or of a region within reach are lost. Each ends where
        the clearance is at most `TOUCHING`. Along a shape that is kept within, or a prism that is not convex, a ray
        that has used up its `LOOKS` ends where it is: nearer than what it would meet, never farther.
    """
    distances[:] = math.inf
    start, piece = zeros(3), zeros(7)
    for i in range(regions.kinds.size):
        kind = regions.kinds[i]
        if kind >= FIRST_OF_ATTITUDE:
            continue
        for axis in range(3):
            start[axis] = origin[axis] - regions.shifts[i, axis]
        numbers = regions.numbers[regions.offsets[i] : regions.offsets[i + 1]]
        sign = regions.signs[i]
        if sign < 0.0 and kind == _PIPE:
            piece[0] = numbers[0]
            for first in range(1, numbers.size - 3, 3):
                piece[1:] = numbers[first : first + 6]
                _meet(kind, piece, 1.0, True, start, directions, farthest, distances)
        else:
            convex = sign < 0.0 and (kind in _CONVEX or (kind == _PRISM and _is_convex(numbers)))
            _meet(kind, numbers, -sign, convex, start, directions, farthest, distances)


def _meet(
    kind: int,
    numbers: Array,
    outward: float,
    convex: bool,
    start: Array,
    directions: Array,
    farthest: float,
    distances: Array,
) -> None:
    """Shorten the distances of those rays that meet a shape earlier; `outward` is -1 for one kept within."""
    first = evaluate_shape(kind, start, numbers)
    clearance = outward * first[4]
    if math.isnan(clearance):
        distances[:] = math.nan
    elif clearance <= 0.0:
        distances[:] = 0.0
    if not 0.0 < clearance < farthest:
        return
    notched = kind == _PRISM and not convex and outward > 0.0
    x, y, radius = _circle_about(numbers) if notched else (0.0, 0.0, 0.0)
    x, y = x - start[0], y - start[1]
    at = zeros(3)
    for k in range(distances.size):
        dx, dy, dz = directions[k, 0], directions[k, 1], directions[k, 2]
        if notched and abs(x * dy - y * dx) > radius * hypotenuse(dx, dy):
            continue  # it passes by the circle: no need to look
        nearest = farthest if distances[k] > farthest else distances[k]
        here, way = first, 0.0
        for _ in range(LOOKS):
            way += _stride(kind, convex, outward, here, dx, dy, dz)
            if not way < nearest:
                break
            at[0], at[1], at[2] = start[0] + way * dx, start[1] + way * dy, start[2] + way * dz
            here = evaluate_shape(kind, at, numbers)
            if outward * here[4] <= TOUCHING:
                break
        if way < nearest or math.isnan(way):
            distances[k] = way


def _stride(kind: int, convex: bool, outward: float, here: Evaluation, dx: float, dy: float, dz: float) -> float:
    """Return how far one may go on [m] from where a shape is `here` as evaluated, outside, and not meet it."""
    g, gx, gy, gz, distance = here
    # what is over or under a prism has only its depths to enter, which are convex
    if not (convex or (kind == _PRISM and outward > 0.0 and gx == 0.0 and gy == 0.0)):
        return outward * distance
    along = gx * dx + gy * dy + gz * dz
    if along >= 0.0:
        return math.inf
    if kind == _ELLIPSOID:  # its gradient is that of g alone: sqrt(g + 1) - 1 is convex, and nearly straight far away
        gauge = math.sqrt(g + 1.0)
        return -2.0 * gauge * (gauge - 1.0) / along
    return -distance * math.sqrt(gx * gx + gy * gy + gz * gz) / along


def _circle_about(prism: Array) -> tuple[float, float, float]:
    """Return middle and radius of a circle that holds all corners of a packed prism [m]."""
    x, y, radius, n = 0.0, 0.0, 0.0, (prism.size - 2) // 2
    for i in range(2, prism.size, 2):
        x += prism[i] / n
        y += prism[i + 1] / n
    for i in range(2, prism.size, 2):
        radius = max(radius, hypotenuse(prism[i] - x, prism[i + 1] - y))
    return x, y, radius


def _is_convex(prism: Array) -> bool:
    """Return whether no corner of a packed prism turns inwards."""
    n = (prism.size - 2) // 2
    for i in range(n):
        a, b, c = 2 + 2 * i, 2 + 2 * ((i + 1) % n), 2 + 2 * ((i + 2) % n)
        ex, ey = prism[b] - prism[a], prism[b + 1] - prism[a + 1]
        if ex * (prism[c + 1] - prism[b + 1]) - ey * (prism[c] - prism[b]) < 0.0:
            return False
    return True
