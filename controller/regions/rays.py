"""Ray casting: the distances at which rays meet the first region, by steps as long as clearances allow."""

from __future__ import annotations

import math

from controller.arithmetic import hypotenuse
from controller.regions.kinds import CONVEX, FIRST_OF_ATTITUDE, evaluate_shape
from controller.regions.region_set import PackedRegions
from controller.regions.shape import Array, Evaluation
from controller.regions.shapes.ellipsoid import Ellipsoid
from controller.regions.shapes.pipe import Pipe
from controller.regions.shapes.prism import Prism
from controller.stack_array import zeros

TOUCHING = 1e-4  # m, clearance at which a ray has met a surface
MAX_STEPS = 64  # maximum number of steps along a ray, for each region
_PARALLEL = 1e-100  # component of a direction that counts as 0: squared, or as a divisor, it may leave float64's range

_ELLIPSOID = Ellipsoid.kind
_PIPE = Pipe.kind
_PRISM = Prism.kind


def ray_distances(regions: PackedRegions, origin: Array, directions: Array, farthest: float, distances: Array) -> None:
    """Find the distances along rays at which a region, at its present position, is violated; origin [m, NED]."""
    # Units of arguments: farthest [m]; distances [m]
    # A ray advances by the clearance, which changes by at most one meter a meter (sphere tracing). The clearance of a
    # convex shape that is kept out of is convex along the ray, so that its tangent allows longer steps and shows when a
    # ray passes by (Newton's method, from the side that never oversteps). Pipes are split into capsules.
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
            convex = sign < 0.0 and (kind in CONVEX or (kind == _PRISM and _is_convex(numbers)))
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
    """Shorten the distances of the rays that meet a shape earlier; `outward` is -1 for one kept within."""
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
    point = zeros(3)
    for k in range(distances.size):
        dx, dy, dz = directions[k, 0], directions[k, 1], directions[k, 2]
        if notched and abs(x * dy - y * dx) > radius * hypotenuse(dx, dy) + _PARALLEL:
            continue  # it passes by the circle and cannot meet the prism
        nearest = farthest if distances[k] > farthest else distances[k]
        here, way = first, 0.0
        for _ in range(MAX_STEPS):
            way += _stride(kind, convex, outward, here, dx, dy, dz)
            if not way < nearest:
                break
            point[0], point[1], point[2] = start[0] + way * dx, start[1] + way * dy, start[2] + way * dz
            here = evaluate_shape(kind, point, numbers)
            if outward * here[4] <= TOUCHING:
                break
        if way < nearest or math.isnan(way):
            distances[k] = way


def _stride(kind: int, convex: bool, outward: float, here: Evaluation, dx: float, dy: float, dz: float) -> float:
    """Return the length [m] of a safe step along a ray, outside a shape whose evaluation is `here`."""
    g, gx, gy, gz, distance = here
    # over or under a prism only its depths matter, which are convex
    if not (convex or (kind == _PRISM and outward > 0.0 and gx == 0.0 and gy == 0.0)):
        return outward * distance
    along = gx * dx + gy * dy + gz * dz
    if along >= -_PARALLEL:
        return math.inf
    if kind == _ELLIPSOID:  # its gradient is that of g alone: sqrt(g + 1) - 1 is convex, and nearly straight far away
        gauge = math.sqrt(g + 1.0)
        return -2.0 * gauge * (gauge - 1.0) / along
    return -distance * math.sqrt(gx * gx + gy * gy + gz * gz) / along


def _circle_about(prism: Array) -> tuple[float, float, float]:
    """Return center and radius of a circle about all corners of a packed prism [m]."""
    x, y, radius, n = 0.0, 0.0, 0.0, (prism.size - 2) // 2
    for i in range(2, prism.size, 2):
        x += prism[i] / n
        y += prism[i + 1] / n
    for i in range(2, prism.size, 2):
        radius = max(radius, hypotenuse(prism[i] - x, prism[i + 1] - y))
    return x, y, radius


def _is_convex(prism: Array) -> bool:
    """Return True if no corner of a packed prism turns inwards."""
    n = (prism.size - 2) // 2
    for i in range(n):
        a, b, c = 2 + 2 * i, 2 + 2 * ((i + 1) % n), 2 + 2 * ((i + 2) % n)
        ex, ey = prism[b] - prism[a], prism[b + 1] - prism[a + 1]
        if ex * (prism[c + 1] - prism[b + 1]) - ey * (prism[c] - prism[b]) < 0.0:
            return False
    return True
