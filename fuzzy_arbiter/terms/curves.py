"""Smooth membership functions by name, of the kinds in `fuzzy_arbiter.terms.kinds`."""

from __future__ import annotations

from bisect import bisect_left
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from fuzzy_arbiter.checks import finite, finite_numbers, shown
from fuzzy_arbiter.errors import DefinitionError
from fuzzy_arbiter.shapes import Array, Membership
from fuzzy_arbiter.terms.expressions import Expression, evaluator
from fuzzy_arbiter.terms.kinds import KINDS
from fuzzy_arbiter.terms.parser import Node


@dataclass(frozen=True, slots=True)
class Curve(Membership):
    """A membership function of a named kind.

    Attributes
    ----------
    kind : str
        Name of the kind, such as ``gaussian``; `KINDS` lists all.
    parameters : tuple of float
        Parameters of the kind, in its order.
    height : float
        Factor of all degrees, above 0 and at most 1.

    Raises
    ------
    DefinitionError
        If there is no such kind, or the parameters are invalid for it.

    Examples
    --------
    >>> from fuzzy_arbiter.terms import Curve
    >>> Curve("s_shape", (0.0, 2.0))(0.5)
    0.125
    """

    kind: str
    parameters: tuple[float, ...]
    height: float = 1.0
    ends: tuple[float, ...] = field(init=False, repr=False, compare=False)
    trees: tuple[Node, ...] = field(init=False, repr=False, compare=False)
    _numbers: tuple[Callable[..., float], ...] = field(init=False, repr=False, compare=False)
    _arrays: tuple[Callable[..., Any], ...] = field(init=False, repr=False, compare=False)
    _jumps: tuple[float, ...] = field(init=False, repr=False, compare=False)

    def __post_init__(self) -> None:
        kind = KINDS.get(self.kind) if isinstance(self.kind, str) else None
        if kind is None:
            raise DefinitionError(f"curve is {shown(self.kind)}, expected one of {', '.join(KINDS)}")
        words = f"{self.kind} of {', '.join(kind.parameters)}"
        count = len(kind.parameters)
        numbers = finite_numbers(self.parameters) if isinstance(self.parameters, Sequence) else None
        if numbers is None or len(numbers) != count:
            raise DefinitionError(f"{words}: got {shown(self.parameters)}, expected {count} finite numbers")
        height = finite(self.height)
        if height is None or not 0.0 < height <= 1.0:
            raise DefinitionError(f"{words}: height is {shown(self.height)}, expected above 0 and at most 1")
        is_valid, expected = kind.valid
        if not is_valid(*numbers):
            raise DefinitionError(f"{words}: got {shown(numbers)}, expected {expected}")
        named = dict(zip(kind.parameters, numbers, strict=True))
        pieces = [(end, _tree(text, named, height)) for end, text in kind.pieces(*numbers)]
        ends, trees = zip(*pieces, strict=True)
        computed = {"parameters": numbers, "height": height, "ends": ends, "trees": trees}
        computed |= {f"_{kind}s": tuple(evaluator(tree, kind) for tree in trees) for kind in ("number", "array")}
        for key, value in computed.items():
            object.__setattr__(self, key, value)
        jumps = (x for i, x in enumerate(ends[:-1]) if abs(self._side(i, x) - self._side(i + 1, x)) > 1e-9)
        object.__setattr__(self, "_jumps", tuple(jumps))

    @property
    def polynomial(self) -> bool:  # type: ignore[override]  # depends on the kind
        """True if its pieces are polynomials."""
        return KINDS[self.kind].polynomial

    @property
    def jumps(self) -> bool:
        """True if there is a jump."""
        return bool(self._jumps)

    def _side(self, i: int, x: float) -> float:
        return self._numbers[i]({"x": x})

    def __call__(self, x: Any) -> Any:
        """Return the degree at a position; of a jump the greater one; NaN for NaN; degrees for an array."""
        if hasattr(x, "__len__"):
            return self.of_array(x)
        if x != x:
            return x
        i = bisect_left(self.ends, x)
        degree = self._side(i, x)
        if x == self.ends[i] and i + 1 < len(self.ends):
            degree = max(degree, self._side(i + 1, x))
        return min(max(degree, 0.0), 1.0)

    def of_many(self, positions: Array, /) -> Array:
        """Return the degrees at many positions, each as a call gives it, to rounding."""
        result = np.empty(len(positions))
        with np.errstate(all="ignore"):
            if len(self._arrays) == 1:
                result[:] = self._arrays[0]({"x": positions})
            else:
                piece = np.searchsorted(self.ends, positions)
                for i, degrees_of in enumerate(self._arrays):
                    inside = piece == i
                    if inside.any():
                        result[inside] = degrees_of({"x": positions[inside]})
        for end in self._jumps:
            result[positions == end] = self(end)
        np.minimum(np.maximum(result, 0.0, out=result), 1.0, out=result)
        if len(self._arrays) > 1:
            result[positions != positions] = np.nan
        return result

    def breaks(self, universe: tuple[float, float]) -> tuple[float, ...]:
        """Return the ends of its pieces within a universe."""
        return tuple(sorted({end for end in self.ends if universe[0] < end < universe[1]}))

    def features(self, universe: tuple[float, float]) -> tuple[float, ...]:
        """Return its breaks and the positions within a universe around which it changes."""
        positions = {*self.ends, *KINDS[self.kind].features(*self.parameters)}
        return tuple(sorted(x for x in positions if universe[0] < x < universe[1]))

    @property
    def monotonic(self) -> bool:  # type: ignore[override]  # depends on the kind
        """True if it only rises or only falls between its features."""
        return KINDS[self.kind].monotonic

    def place_of(self, degree: float) -> float:
        """Return the position, perhaps infinite, where a monotonic curve has a degree, for Tsukamoto's method."""
        inverse = KINDS[self.kind].inverse
        assert inverse is not None, self.kind
        named = dict(zip(KINDS[self.kind].parameters, self.parameters, strict=True))
        w = degree / self.height
        text = next(text for end, text in inverse(*self.parameters) if w <= end)
        return Expression(text)({**named, "w": w})

    @property
    def invertible(self) -> bool:
        """True if the curve only rises or only falls, so that `place_of` is defined."""
        return KINDS[self.kind].inverse is not None

    def __reduce__(self) -> tuple[Any, ...]:
        return Curve, (self.kind, self.parameters, self.height)


def _tree(text: str, named: dict[str, float], height: float) -> Node:
    tree = Expression(text).bound(named).tree
    return tree if height == 1.0 else tree * height if isinstance(tree, float) else ("*", height, tree)


def curve(kind: str, *parameters: float, height: float = 1.0) -> Membership:
    """Return a membership function of a named kind.

    Parameters
    ----------
    kind : str
        One of ``gaussian`` (mean, deviation), ``gaussian2`` (mean1, deviation1, mean2, deviation2), ``bell`` (center,
        width, slope), ``sigmoid`` (inflection, slope), ``sigmoid_difference`` and ``sigmoid_product`` (left, rising,
        falling, right), ``z_shape``, ``s_shape`` (start, end), ``pi_shape`` (foot1, top1, top2, foot2), ``cosine`` and
        ``spike`` (center, width), ``concave`` (inflection, end), ``arc`` and ``semi_ellipse`` (start, end), and
        ``singleton`` (position), which is 1 there and 0 elsewhere.
    *parameters : float
        Parameters of the kind, in its order.
    height : float
        Factor of all degrees.

    Returns
    -------
    Membership
        Membership function, which is called with a position and returns the degree.

    Raises
    ------
    DefinitionError
        If there is no such kind, or the parameters are invalid for it.

    Examples
    --------
    >>> from fuzzy_arbiter.terms import curve
    >>> round(curve("gaussian", 5.0, 2.0)(7.0), 4)
    0.6065
    """
    return Curve(kind, parameters, height)
