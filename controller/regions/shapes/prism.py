"""Upright prism over a polygon: the complex shape of section V.B, such as a hexagon, without an equation."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from controller.arithmetic import hypotenuse
from controller.regions.entry import Entry
from controller.regions.geometry import clamp, product_distance
from controller.regions.numbers import LENGTH, Number
from controller.regions.shape import Array, Bounds, Evaluation, Vector2, require, require_finite
from controller.regions.triangle_mesh import Mesh


@dataclass(frozen=True)
class Prism:
    """All points over a polygon, given by its corners [m, north and east], between two depths [m].

    The polygon need not be convex, but its edges must not cross. g is the signed distance [m].

    Examples
    --------
    >>> from controller.regions import Prism
    >>> Prism(corners=((0.0, 0.0), (4.0, 0.0), (0.0, 3.0)), top=1.0, bottom=6.0).bounds()
    ((0.0, 0.0, 1.0), (4.0, 3.0, 6.0))
    """

    kind: ClassVar[int]
    unit: ClassVar[str] = "m"
    corners: tuple[Vector2, ...]
    top: float
    bottom: float

    def __post_init__(self) -> None:
        for corner in self.corners:
            require_finite("prism", corners=corner)
        require_finite("prism", top=self.top, bottom=self.bottom)
        require(len(self.corners) >= 3, "prism", "corners", f"{len(self.corners)} points", "3 or more")
        require(self.bottom > self.top, "prism", "bottom", self.bottom, f"a depth below top ({self.top} m)")
        require(abs(_signed_area(self.corners)) > 0.0, "prism", "corners", "of no area", "a polygon")
        require(
            not _touches_itself(self.corners), "prism", "corners", "crossing or touching itself", "a simple polygon"
        )

    def packed(self) -> tuple[float, ...]:
        """Return top, bottom, and the corners in the order in which the outward normal is to the right."""
        corners = self.corners if _signed_area(self.corners) > 0.0 else self.corners[::-1]
        return (self.top, self.bottom, *(x for corner in corners for x in corner))

    def numbers(self) -> tuple[Number, ...]:
        """Return name and unit of each number of `packed`."""
        return (
            Number("top", *LENGTH),
            Number("bottom", *LENGTH, above="top"),
            *(
                Number(f"corner[{i}].{axis}", *LENGTH)
                for i in range(1, len(self.corners) + 1)
                for axis in ("north", "east")
            ),
        )

    def bounds(self) -> Bounds:
        """Return the corners of the upright box about it."""
        north, east = zip(*self.corners, strict=True)
        return (min(north), min(east), self.top), (max(north), max(east), self.bottom)


def _signed_area(corners: tuple[Vector2, ...]) -> float:
    return sum(a[0] * b[1] - b[0] * a[1] for a, b in zip(corners, corners[1:] + corners[:1], strict=True)) / 2.0


def _touches_itself(corners: tuple[Vector2, ...]) -> bool:
    """Return True if edges that are no neighbors share a point, or neighbors more than their corner."""

    def side(a: Vector2, b: Vector2, c: Vector2) -> float:
        return (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0])

    def between(a: Vector2, b: Vector2, c: Vector2) -> bool:
        """Return True if c, a point of the line through a and b, is between them."""
        return min(a[0], b[0]) <= c[0] <= max(a[0], b[0]) and min(a[1], b[1]) <= c[1] <= max(a[1], b[1])

    def meet(a: Vector2, b: Vector2, c: Vector2, d: Vector2) -> bool:
        sides = side(a, b, c), side(a, b, d), side(c, d, a), side(c, d, b)
        if sides[0] * sides[1] < 0.0 and sides[2] * sides[3] < 0.0:
            return True
        ends = ((a, b, c), (a, b, d), (c, d, a), (c, d, b))
        return any(s == 0.0 and between(*end) for s, end in zip(sides, ends, strict=True))

    n = len(corners)
    edges = [(corners[i], corners[(i + 1) % n]) for i in range(n)]
    for i, (a, b) in enumerate(edges):
        _, c = edges[(i + 1) % n]
        folds_back = side(a, b, c) == 0.0 and (b[0] - a[0]) * (c[0] - b[0]) + (b[1] - a[1]) * (c[1] - b[1]) <= 0.0
        if a == b or folds_back:
            return True
        if any(meet(a, b, *edges[j]) for j in range(i + 2, n) if (j + 1) % n != i):
            return True
    return False


def prism(p: Array, q: Array) -> Evaluation:
    """Evaluate a packed `Prism` at the position `p`."""
    n = (q.size - 2) // 2
    nearest = math.inf
    gx, gy = 0.0, 0.0
    at_corner = False
    inside = False
    for i in range(n):
        j = i + 1 if i + 1 < n else 0
        ax, ay, bx, by = q[2 + 2 * i], q[3 + 2 * i], q[2 + 2 * j], q[3 + 2 * j]
        ex, ey = bx - ax, by - ay
        length = hypotenuse(ex, ey)
        x, y = p[0] - ax, p[1] - ay
        along = clamp((x * ex + y * ey) / (length * length), 0.0, 1.0)
        dx, dy = x - along * ex, y - along * ey
        distance = hypotenuse(dx, dy)
        if not distance >= nearest:  # so that NaN comes through
            nearest = distance
            at_corner = distance > 0.0 and (along == 0.0 or along == 1.0)
            if at_corner:
                gx, gy = dx / distance, dy / distance
            else:  # on both sides of an edge the signed distance grows along its outward normal
                gx, gy = ey / length, -ex / length
        # a ray towards east crosses the edge
        if (ax > p[0]) != (bx > p[0]) and p[1] < ay + (p[0] - ax) / ex * ey:
            inside = not inside
    if inside:
        nearest = -nearest
        if at_corner:
            gx, gy = -gx, -gy
    vertical = max(q[0] - p[2], p[2] - q[1])
    down = 1.0 if p[2] - q[1] >= q[0] - p[2] else -1.0
    g, of_flat, of_vertical = product_distance(nearest, vertical)
    return g, of_flat * gx, of_flat * gy, of_vertical * down, g


def surface(shape: Prism, limits: Bounds) -> Mesh:
    """Return its top, its bottom and its sides."""
    corners = np.array(shape.corners)
    following = np.roll(corners, -1, axis=0)
    if np.sum(corners[:, 0] * following[:, 1] - following[:, 0] * corners[:, 1]) < 0.0:
        corners = corners[::-1]
    n = len(corners)
    flat = np.array(_ears(corners))
    vertices = np.vstack([np.column_stack([corners, np.full(n, z)]) for z in (shape.top, shape.bottom)])
    sides = [t for i in range(n) for j in ((i + 1) % n,) for t in ((i, j, n + j), (i, n + j, n + i))]
    return Mesh(vertices, np.vstack([flat[:, ::-1], flat + n, sides]))


def _ears(corners: Array) -> list[tuple[int, int, int]]:
    """Return the triangles of a simple polygon, whose corners go around from north to east."""

    def side(a: int, b: int, c: int) -> float:
        u, v = corners[b] - corners[a], corners[c] - corners[a]
        return float(u[0] * v[1] - u[1] * v[0])

    left, triangles = [*range(len(corners))], []
    while len(left) > 3:
        for i, b in enumerate(left):
            a, c = left[i - 1], left[(i + 1) % len(left)]
            others = (p for p in left if p not in (a, b, c))
            if side(a, b, c) > 0.0 and not any(min(side(a, b, p), side(b, c, p), side(c, a, p)) >= 0.0 for p in others):
                triangles.append((a, b, c))
                break
        else:  # corners in a line make no ear
            i = next(i for i in range(len(left)) if side(left[i - 1], left[i], left[(i + 1) % len(left)]) <= 0.0)
            triangles.append((left[i - 1], left[i], left[(i + 1) % len(left)]))
        left.pop(i)
    return [*triangles, (left[0], left[1], left[2])]


_UNITS = {"corners": "m", "top": "m", "bottom": "m"}
_CORNERS = ((0.0, 0.0), (3.0, 0.0), (3.0, 2.0), (1.0, 0.5), (0.0, 2.0))
ENTRY = Entry(
    Prism, prism, Prism(_CORNERS, 1.0, 3.0), _UNITS,
    flat_faces=True, kinks="everywhere", convex=False, center=None, surface=surface,
)  # fmt: skip
