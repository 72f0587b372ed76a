"""Values of joined terms from a function of their height, in exported code as they stand."""

# The height is smooth between the edges of panels but for where terms meet their cuts and each other. A panel is halved
# until the integral over it is that over its halves.

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np
from numpy.polynomial import legendre

NODES, WEIGHTS = (tuple(map(float, column)) for column in legendre.leggauss(8))
# factors of the heights at the nodes that sum to the height at the end, where that is smooth
ENDS = tuple(float(np.prod([(1.0 - y) / (x - y) for y in NODES if y != x])) for x in NODES)
NAN = float("nan")
Height = Callable[[float, Sequence[float]], float]


def integral(height: Height, cuts: Sequence[float], start: float, end: float, low: float) -> tuple[float, float, float]:
    """Return the area over an interval, its moment about a position, and the area that bends at its ends may hide."""
    area = 0.0
    moment = 0.0
    half = (end - start) / 2
    first = -height(start + 1e-9 * half, cuts)
    last = -height(end - 1e-9 * half, cuts)
    for i in range(8):
        x = (start + end) / 2 + half * NODES[i]
        y = height(x, cuts)
        area += WEIGHTS[i] * y * half
        moment += WEIGHTS[i] * y * half * (x - low)
        first += ENDS[7 - i] * y
        last += ENDS[i] * y
    return area, moment, (abs(first) + abs(last)) * (1.0 - NODES[7]) * half


def integrals(
    height: Height, cuts: Sequence[float], edges: Sequence[float], tolerance: float, target: float
) -> tuple[float, float, float]:
    """Return the area, its moment about the start, and the first position up to which the area reaches a target."""
    area = 0.0
    moment = 0.0
    start = edges[0]
    n = len(edges) - 1
    position = edges[n]
    ends = [edges[n]] * (n + 60)  # of panels, the next one last
    for k in range(n):
        ends[k] = edges[n - k]
    while n > 0:
        end = ends[n - 1]
        middle = (start + end) / 2
        whole = integral(height, cuts, start, end, edges[0])
        left = integral(height, cuts, start, middle, edges[0])
        right = integral(height, cuts, middle, end, edges[0])
        off = max(abs(left[0] + right[0] - whole[0]), left[2], right[2])
        off_moment = abs(left[1] + right[1] - whole[1])
        same = off <= tolerance and off_moment <= tolerance * (end - edges[0])
        if same or n == len(ends) or not start < middle < end:
            if area < target <= area + left[0] + right[0]:
                inside = start
                position = end
                for _ in range(60):
                    middle = (inside + position) / 2
                    if area + integral(height, cuts, start, middle, edges[0])[0] < target:
                        inside = middle
                    else:
                        position = middle
            area += left[0] + right[0]
            moment += left[1] + right[1]
            start = end
            n -= 1
        else:
            ends[n] = middle
            n += 1
    return area, moment, position


def center_of_area(height: Height, cuts: Sequence[float], edges: Sequence[float], halves: int) -> float:
    """Return the centroid, or the position that halves the area, of several the middle one; NaN where there is none."""
    tolerance = 1e-13 * integrals(height, cuts, edges, 1e300, 1e300)[0]
    area, moment, _ = integrals(height, cuts, edges, tolerance, 1e300)
    if not area > 0.0:
        return NAN
    if halves:
        first = integrals(height, cuts, edges, tolerance, area / 2 * (1.0 - 1e-11))[2]
        return (first + integrals(height, cuts, edges, tolerance, area / 2 * (1.0 + 1e-11))[2]) / 2
    return min(max(edges[0] + moment / area, edges[0]), edges[len(edges) - 1])


def highest(height: Height, cuts: Sequence[float], start: float, end: float) -> float:
    """Return a position of the maximum height in an interval."""
    best = start
    for i in range(33):
        x = start + (end - start) * i / 32 if i < 32 else end
        if height(x, cuts) > height(best, cuts):
            best = x
    left = max(best - (end - start) / 32, start)
    right = min(best + (end - start) / 32, end)
    for _ in range(80):
        first = left + (right - left) / 3
        second = right - (right - left) / 3
        if height(first, cuts) < height(second, cuts):
            left = first
        else:
            right = second
    return best if height(best, cuts) >= height(left, cuts) else left


def boundary(height: Height, cuts: Sequence[float], top: float, x: float, outside: float) -> float:
    """Return the last position from one of the maximum height towards another to which the height is constant."""
    inside = x
    if height(outside, cuts) >= top * (1.0 - 1e-12):
        inside = outside
    for _ in range(80):
        middle = (inside + outside) / 2
        if height(middle, cuts) >= top * (1.0 - 1e-12):
            inside = middle
        else:
            outside = middle
    return inside if height((x + inside) / 2, cuts) >= top * (1.0 - 1e-13) else x


def position_of_maximum(height: Height, cuts: Sequence[float], edges: Sequence[float], side: int) -> float:
    """Return the smallest (side -1), mean (0) or largest (1) position [-] of the maximum height; NaN if that is 0."""
    width = edges[len(edges) - 1] - edges[0]
    top = 0.0
    for k in range(len(edges) - 1):
        top = max(top, height(highest(height, cuts, edges[k], edges[k + 1]), cuts))
    if not top > 0.0:
        return NAN
    length = 0.0
    moment = 0.0
    count = 0.0
    total = 0.0
    first = edges[len(edges) - 1]
    last = edges[0] - width
    for k in range(len(edges) - 1):
        x = highest(height, cuts, edges[k], edges[k + 1])
        if height(x, cuts) >= top * (1.0 - 1e-12):
            left = boundary(height, cuts, top, x, edges[k])
            right = boundary(height, cuts, top, x, edges[k + 1])
            middle = (left + right) / 2
            length += right - left
            moment += (right - left) * (middle - edges[0])
            if left - last > 1e-9 * width:
                count += 1.0
                total += middle - edges[0]
            first = min(first, left)
            last = right
    if side != 0:
        return first if side < 0 else last
    return edges[0] + (moment / length if length > 1e-9 * width else total / count)
