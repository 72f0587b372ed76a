"""Membership functions: their common base, and the piecewise-linear ones, given by their points."""

from __future__ import annotations

from abc import ABC, abstractmethod
from bisect import bisect_left
from collections.abc import Iterator
from dataclasses import dataclass
from operator import itemgetter
from typing import Any, ClassVar

import numpy as np
from numpy.typing import NDArray

from fuzzy_arbiter.checks import finite, shown
from fuzzy_arbiter.errors import DefinitionError

Array = NDArray[np.float64]
Point = tuple[float, float]


class Membership(ABC):
    """A membership function: to what degree each position belongs to a term."""

    __slots__ = ()
    # true if it is a polynomial between its breaks, so that it can be integrated exactly
    polynomial: ClassVar[bool] = False
    monotonic: ClassVar[bool] = False  # true if it only rises or only falls between its features

    @abstractmethod
    def __call__(self, x: Any) -> Any:
        """Return the degree at a position, or the degrees at an array of them."""

    def of_array(self, x: object) -> Array:
        """Return the degrees at positions, an array of any shape."""
        positions = np.asarray(x, dtype=np.float64)
        return self.of_many(positions.ravel()).reshape(positions.shape)

    @abstractmethod
    def of_many(self, positions: Array, /) -> Array:
        """Return the degrees at many positions, each as a call gives it, to rounding."""

    @abstractmethod
    def breaks(self, universe: tuple[float, float]) -> tuple[float, ...]:
        """Return the positions in a universe where it bends or jumps, in rising order; between them it is smooth."""

    def features(self, universe: tuple[float, float]) -> tuple[float, ...]:
        """Return the positions within a universe around which it changes, in rising order; by default its breaks."""
        return self.breaks(universe)

    @property
    def invertible(self) -> bool:
        """True if it only rises or only falls, so that each degree has a position, for Tsukamoto's method."""
        return False

    def place_of(self, degree: float) -> float:
        """Return the position, perhaps infinite, at which an invertible function has a degree."""
        raise NotImplementedError

    def within(self, universe: tuple[float, float]) -> Membership:
        """Return the same function without parts that do not matter in a universe; by default the function itself."""
        return self

    def area(self, universe: tuple[float, float]) -> float:
        """Return the integral of the degree over a universe, by quadrature."""
        low, high = universe
        positions = np.unique([*np.linspace(low, high, 65), *self.features(universe)])
        nodes, weights = np.polynomial.legendre.leggauss(8)
        middle, half = (positions[:-1] + positions[1:]) / 2, np.diff(positions) / 2
        degrees = self.of_many((middle + nodes[:, None] * half).ravel()).reshape(len(nodes), -1)
        return float((weights @ degrees) @ half)


@dataclass(frozen=True, slots=True)
class Shape(Membership):
    """A piecewise-linear membership function, constant beyond its first and its last point.

    Points that change nothing are dropped at both ends, so that equal functions of the usual kinds are equal shapes.

    Attributes
    ----------
    points : tuple of (float, float)
        Positions, which never decrease, and degrees in [0, 1]. Two points of one position make a jump, where it has
        the greater of the two degrees.

    Raises
    ------
    DefinitionError
        If there is no point, or one is not finite, turns back, or has a degree outside [0, 1].

    Examples
    --------
    >>> from fuzzy_arbiter import Shape
    >>> Shape(((0, 1), (2, 0)))(0.5)
    0.75
    """

    points: tuple[Point, ...]
    polynomial: ClassVar[bool] = True
    monotonic: ClassVar[bool] = True

    def __post_init__(self) -> None:
        points = list(self._pairs())
        if not points:
            raise DefinitionError("shape: got no points, expected at least one")
        for (a, _), (b, _) in zip(points, points[1:], strict=False):
            if b < a:
                raise DefinitionError(f"shape: position {b} comes after {a}, expected positions that never decrease")
        for (a, _), (b, _) in zip(points, points[2:], strict=False):
            if a == b:
                hint = f"; one position alone is curve('singleton', {a})" if points[0][0] == points[-1][0] else ""
                raise DefinitionError(f"shape: more than two points at {a}, expected at most two for a jump{hint}")
        if finite(points[-1][0] - points[0][0]) is None:
            raise DefinitionError(f"shape: positions {points[0][0]} to {points[-1][0]}, expected a finite distance")
        while len(points) > 1 and points[0][1] == points[1][1]:
            del points[0]
        while len(points) > 1 and points[-1][1] == points[-2][1]:
            del points[-1]
        object.__setattr__(self, "points", tuple(points))

    def _pairs(self) -> Iterator[Point]:
        try:
            pairs = [(x, degree) for x, degree in self.points]
        except (TypeError, ValueError):
            raise DefinitionError(f"shape {shown(self.points)}: expected pairs of numbers (position, degree)") from None
        for x, degree in pairs:
            position, height = finite(x), finite(degree)
            if position is None or height is None or not 0.0 <= height <= 1.0:
                raise DefinitionError(
                    f"shape: point ({shown(x)}, {shown(degree)}), expected a finite position and a degree in [0, 1]"
                )
            yield position, height

    def __call__(self, x: Any) -> Any:
        """Return the degree at a position, or the degrees at an array of them."""
        if hasattr(x, "__len__"):
            return self.of_array(x)
        if x != x:
            return x
        points = self.points
        i = bisect_left(points, x, key=itemgetter(0))
        if i == len(points):
            return points[-1][1]
        b, right = points[i]
        if b == x:
            return max(right, points[i + 1][1]) if i + 1 < len(points) and points[i + 1][0] == x else right
        if i == 0:
            return right
        a, left = points[i - 1]
        return left + (right - left) * ((x - a) / (b - a))

    def of_many(self, positions: Array, /) -> Array:
        """Return the degrees at many positions, each as a call gives it; positions (n,), returns (n,)."""
        x, y = np.array(self.points).T
        if len(x) == 1:
            return np.full(len(positions), y[0])
        if len(x) == 2 and x[0] < x[1]:  # a ramp, which is met most often: nothing to look up
            degrees: Array = np.asarray(positions - x[0])
            with np.errstate(over="ignore", invalid="ignore"):  # beyond its ends, which are set below
                degrees /= x[1] - x[0]
                degrees *= y[1] - y[0]
                degrees += y[0]
            np.copyto(degrees, y[0], where=positions <= x[0])
            np.copyto(degrees, y[1], where=positions >= x[1])
            return degrees
        right = np.clip(np.searchsorted(x, positions), 1, len(x) - 1)  # index with x[right - 1] < position <= x[right]
        left = right - 1
        with np.errstate(divide="ignore", invalid="ignore", over="ignore"):  # at jumps, which are set below
            fraction = (positions - x[left]) / (x[right] - x[left])
            degrees = y[left] + (y[right] - y[left]) * fraction
        degrees[positions <= x[0]] = y[0]
        degrees[positions >= x[-1]] = y[-1]
        for i in range(len(x) - 1):
            if x[i] == x[i + 1]:
                degrees[positions == x[i]] = max(y[i], y[i + 1])
        return np.asarray(degrees)

    def breaks(self, universe: tuple[float, float]) -> tuple[float, ...]:
        """Return the positions of the points within a universe."""
        return tuple(sorted({x for x, _ in self.points if universe[0] < x < universe[1]}))

    @property
    def jumps(self) -> bool:
        """True if there is a jump."""
        return any(a == b for (a, _), (b, _) in zip(self.points, self.points[1:], strict=False))

    @property
    def invertible(self) -> bool:
        """True if it is a ramp from or to 0."""
        return len(self.points) == 2 and not self.jumps and min(y for _, y in self.points) == 0.0

    def place_of(self, degree: float) -> float:
        """Return the position at which a ramp has a degree."""
        (a, left), (b, right) = self.points
        return a + (b - a) * ((degree - left) / (right - left))

    def complement(self) -> Shape:
        """Return the shape with one minus this one's degree everywhere; raise `DefinitionError` if this one jumps."""
        if self.jumps:
            raise DefinitionError(
                f"shape {self.points}: a shape that jumps has no complement, expected a continuous one"
            )
        return Shape(tuple((x, 1.0 - degree) for x, degree in self.points))

    def within(self, universe: tuple[float, float]) -> Shape:
        """Return the shape without the points that do not matter in a universe; nothing is rounded.

        At most one point remains beyond each end; a constant shape has its one point at the universe's start.
        """
        points = list(self.points)
        low, high = universe
        # a jump at an end of the universe matters if its outer point is the higher one, whose degree counts there
        while len(points) > 1 and points[1][0] <= low and not (points[0][0] == low and points[0][1] > points[1][1]):
            del points[0]
        while (
            len(points) > 1 and points[-2][0] >= high and not (points[-1][0] == high and points[-1][1] > points[-2][1])
        ):
            del points[-1]
        inside = Shape(tuple(points))
        return inside if len(inside.points) > 1 else Shape(((low, inside.points[0][1]),))


def triangle(left: float, peak: float, right: float) -> Shape:
    """Return a triangle of degree 0 at left, 1 at peak, 0 at right; two equal positions make a vertical edge.

    Examples
    --------
    >>> from fuzzy_arbiter import triangle
    >>> triangle(0.0, 1.0, 3.0)(2.0)
    0.5
    """
    return trapezoid(left, peak, peak, right)


def trapezoid(left: float, rise: float, fall: float, right: float) -> Shape:
    """Return a trapezoid of degree 0 at left, 1 from rise to fall, 0 at right; equal positions make a vertical edge.

    Examples
    --------
    >>> from fuzzy_arbiter import trapezoid
    >>> trapezoid(0.0, 1.0, 2.0, 4.0)(3.0)
    0.5
    """
    top = ((rise, 1.0),) if rise == fall else ((rise, 1.0), (fall, 1.0))
    return Shape(((left, 0.0), *top, (right, 0.0)))


def rising(start: float, end: float) -> Shape:
    """Return a shoulder of degree 0 up to start, which rises to 1 at end and beyond.

    Examples
    --------
    >>> from fuzzy_arbiter import rising
    >>> rising(0.0, 2.0)(0.5)
    0.25
    """
    return Shape(((start, 0.0), (end, 1.0)))


def falling(start: float, end: float) -> Shape:
    """Return a shoulder of degree 1 up to start, which falls to 0 at end and beyond.

    Examples
    --------
    >>> from fuzzy_arbiter import falling
    >>> falling(0.0, 2.0)(0.5)
    0.75
    """
    return Shape(((start, 1.0), (end, 0.0)))


DEGREE = rising(0.0, 1.0)  # of an input that is a degree itself
