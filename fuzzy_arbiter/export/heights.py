"""Defuzzify a height function over n panels; `export` copies this source into its code."""

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


def integrate(
    height: Height, cuts: Sequence[float], start: float, end: float, low: float
) -> tuple[float, float, float]:
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


def integrate_panels(
    height: Height, cuts: Sequence[float], edges: Sequence[float], n: int, tolerance: float, total: float
) -> tuple[float, float, float]:
    """Return the area, its moment about the start, and the position that halves a total area, of several the middle."""
    area = 0.0
    moment = 0.0
    halvings = 0
    start = edges[0]
    positions = [edges[n]] * 2  # the first and the last one that halve the total
    ends = [edges[n]] * (n + 60)  # of panels, the next one last
    for k in range(n):
        ends[k] = edges[n - k]
    while n > 0:
        end = ends[n - 1]
        middle = (start + end) / 2
        coarse = integrate(height, cuts, start, end, edges[0])
        left = integrate(height, cuts, start, middle, edges[0])
        right = integrate(height, cuts, middle, end, edges[0])
        fine = left[0] + right[0]
        tolerance = max(tolerance, 1e-13 * (area + fine))
        noise = 4e-16 * (end - start) if end - start < 1e-6 * (ends[0] - edges[0]) else 0.0  # of degrees by rounding
        error = max(abs(fine - coarse[0]), left[2], right[2])
        moment_error = abs(left[1] + right[1] - coarse[1])
        converged = error <= tolerance + noise and moment_error <= (tolerance + noise) * (end - edges[0])
        if converged or n == len(ends) or halvings == 4096 or not start < middle < end:
            for i in range(2):
                target = total / 2 * (1.0 + (2 * i - 1) * 1e-11)
                if area < target <= area + fine:
                    inside = start
                    positions[i] = end
                    for _ in range(60):
                        middle = (inside + positions[i]) / 2
                        if area + integrate(height, cuts, start, middle, edges[0])[0] < target:
                            inside = middle
                        else:
                            positions[i] = middle
            area += fine
            moment += left[1] + right[1]
            start = end
            n -= 1
        else:
            ends[n] = middle
            n += 1
            halvings += 1
    return area, moment, (positions[0] + positions[1]) / 2


def center_of_area(height: Height, cuts: Sequence[float], edges: Sequence[float], n: int, is_bisector: int) -> float:
    """Return the centroid, or the position that halves the area, of several the middle one; NaN where there is none."""
    tolerance = 1e-13 * integrate_panels(height, cuts, edges, n, 1e300, 1e300)[0]
    area, moment, _ = integrate_panels(height, cuts, edges, n, tolerance, 1e300)
    if not area > 0.0:
        return NAN
    if is_bisector:
        return integrate_panels(height, cuts, edges, n, tolerance, area)[2]
    return min(max(edges[0] + moment / area, edges[0]), edges[n])


def find_maximum(height: Height, cuts: Sequence[float], start: float, end: float) -> float:
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


def plateau_end(height: Height, cuts: Sequence[float], top: float, x: float, outside: float) -> float:
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


def position_of_maximum(height: Height, cuts: Sequence[float], edges: Sequence[float], n: int, side: int) -> float:
    """Return the smallest (side -1), mean (0) or largest (1) position [-] of the maximum height; NaN if that is 0."""
    width = edges[n] - edges[0]
    top = 0.0
    tops = [edges[0]] * n
    for k in range(n):
        tops[k] = find_maximum(height, cuts, edges[k], edges[k + 1])
        top = max(top, height(tops[k], cuts))
    if not top > 0.0:
        return NAN
    length = 0.0
    moment = 0.0
    count = 0.0
    total = 0.0
    smallest = edges[n]
    largest = edges[0] - width
    for k in range(n):
        if height(tops[k], cuts) >= top * (1.0 - 1e-12):
            left = plateau_end(height, cuts, top, tops[k], edges[k])
            right = plateau_end(height, cuts, top, tops[k], edges[k + 1])
            middle = (left + right) / 2
            length += right - left
            moment += (right - left) * (middle - edges[0])
            if left - largest > 1e-9 * width:
                count += 1.0
                total += middle - edges[0]
            smallest = min(smallest, left)
            largest = right
    if side != 0:
        return smallest if side < 0 else largest
    return edges[0] + (moment / length if length > 1e-9 * width else total / count)
