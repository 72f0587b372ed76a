"""The reference engine: the same definition by the functions of scikit-fuzzy's control API, in its order of steps."""

from __future__ import annotations

import sys
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from functools import partial
from types import ModuleType
from typing import Any, ClassVar

import numpy as np

from fuzzy_arbiter.definition import Output, System, Variable
from fuzzy_arbiter.engines.engine import Defuzzifier, Engine
from fuzzy_arbiter.engines.grid import sampled
from fuzzy_arbiter.engines.supported import unsupported_reason
from fuzzy_arbiter.errors import EngineError
from fuzzy_arbiter.shapes import Array
from fuzzy_arbiter.terms.term import Term

_UNUSED = ("skfuzzy.cluster", "skfuzzy.fuzzymath._continuous_to_discrete")  # they import SciPy, which takes most time


@contextmanager
def _without_scipy() -> Iterator[None]:
    """Import scikit-fuzzy without the parts that need SciPy, unless it is there; later imports find it whole."""
    if "skfuzzy" in sys.modules:
        yield
        return
    for name in _UNUSED:
        sys.modules[name] = part = ModuleType(name)
        part.__dict__.update(__all__=(), continuous_to_discrete=None)
    try:
        yield
    finally:
        for name in [name for name in sys.modules if name.partition(".")[0] == "skfuzzy"]:
            del sys.modules[name]


with _without_scipy():
    from skfuzzy import centroid
    from skfuzzy.fuzzymath.fuzzy_ops import _interp_universe_fast, interp_membership


class ScikitEngine(Engine):
    """Fuzzify and defuzzify by scikit-fuzzy, one sample at a time."""

    # Inputs are interpolated between the knots of their terms, which is exact, outputs at `System.points`. For
    # the two triangles of section VI, with D the distance of two points as a part of the universe, the centroid is at
    # most D^2/6 of the universe off the exact one, and a range-normalized weight D^2/2: 5e-5 at 101 points.

    name: ClassVar[str] = "skfuzzy"

    def __init__(self, system: System) -> None:
        if system.implication != "min":
            raise EngineError(
                f"engine {self.name!r}: implication is {system.implication!r}, which scikit-fuzzy does not know; "
                "expected 'min', or engine 'exact'"
            )
        if reason := unsupported_reason(system):
            raise EngineError(f"engine {self.name!r}: {reason}, or engine 'exact'")
        degrees = {(v.name, term.name): self._interpolated(v, term) for v in system.inputs for term in v.terms}
        super().__init__(system, [_Sampled(output, system) for output in system.outputs], degrees)

    def _interpolated(self, variable: Variable, term: Term) -> Callable[[float], float]:
        if term.straight.jumps:
            raise EngineError(
                f"engine {self.name!r}: input {variable.name!r}: term {term.name!r} jumps, where scikit-fuzzy "
                "interpolates; expected a continuous shape, or engine 'exact' or 'grid'"
            )
        knots = np.array(variable.knots)
        return partial(_degree, knots, term.straight.of_many(knots))


def _degree(knots: Array, degrees: Array, x: Any) -> Any:
    degree = interp_membership(knots, degrees, x)
    return degree if isinstance(x, np.ndarray) else float(degree)


class _Sampled(Defuzzifier):
    """The centroid of one output, whose terms are sampled."""

    method = "scikit-fuzzy's own"

    def __init__(self, output: Output, system: System) -> None:
        self._positions, self._samples = sampled(output, system.points)
        names = {c.term for rule in system.rules for c in rule.conclusions if c.variable == output.name}
        self._concluded = [name in names for name in output.term_names]
        self._last: tuple[Sequence[float], float] = ((), 0.0)  # cuts and centroid: most samples change few outputs

    def value(self, cuts: Sequence[float], inputs: Sequence[float]) -> float:
        """Return the centroid for one sample."""
        last, value = self._last
        if last != cuts:
            value = self._centroid(cuts)
            self._last = cuts, value
        return value

    def _centroid(self, cuts: Sequence[float]) -> float:
        # scikit-fuzzy knows nothing of a term that no rule concludes, not even where it is 0
        every = zip(cuts, self._samples, self._concluded, strict=True)
        terms = [(cut, degrees) for cut, degrees, concluded in every if concluded or cut > 0.0]
        crossings = [_interp_universe_fast(self._positions, degrees, cut) for cut, degrees in terms]
        positions = np.sort(np.concatenate([self._positions, *crossings]))  # a position twice adds nothing
        outline = np.zeros_like(positions)
        for cut, degrees in terms:
            np.maximum(outline, np.minimum(cut, interp_membership(self._positions, degrees, positions)), out=outline)
        if not outline.any():
            return float("nan")
        return float(centroid(positions.tolist(), outline.tolist()))  # its loop is slow with NumPy's numbers
