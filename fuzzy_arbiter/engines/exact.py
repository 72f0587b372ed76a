"""The engines for any system: exact wherever there is an exact value, and by sums over samples."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from contextlib import suppress
from typing import Any, ClassVar

import numpy as np

from fuzzy_arbiter.definition import Output, System, variable_names
from fuzzy_arbiter.engines.clipped_centroid_batch import Centroid
from fuzzy_arbiter.engines.clipped_curves import ClippedCurves
from fuzzy_arbiter.engines.engine import Defuzzifier, Engine
from fuzzy_arbiter.engines.firing import slots_of
from fuzzy_arbiter.engines.quadrature import Quadrature
from fuzzy_arbiter.engines.supported import curved_term
from fuzzy_arbiter.errors import EngineError
from fuzzy_arbiter.shapes import Array
from fuzzy_arbiter.terms.norms import AGGREGATIONS, T_NORMS
from fuzzy_arbiter.terms.values import Constant, Value, place_of

_BLOCK = 2**20  # number of heights that are computed at a time
_MAXIMA = {("max", "min"), ("max", "prod")}
# aggregations and implications of outputs whose values follow from lines of terms alone
_BY_LINES = {
    "centroid": {("max", "min"), ("sum", "min"), ("sum", "prod")},
    **dict.fromkeys(("mom", "som", "lom"), _MAXIMA),
}
_EQUAL = 1.0 - 1e-12  # heights count as equal if their quotient is above this


class ExactEngine(Engine):
    """Evaluate any system."""

    # Straight terms exactly, over all their breakpoints; values as they are; else by quadrature.

    name: ClassVar[str] = "exact"

    def __init__(self, system: System) -> None:
        super().__init__(system, [self._defuzzifier(system, k) for k in range(len(system.outputs))])

    def _defuzzifier(self, system: System, k: int) -> Defuzzifier:
        output = system.outputs[k]
        if output.weighted:
            return Weighted(output, variable_names(system.inputs), variable_names(system.outputs[:k]))
        return self._area_defuzzifier(system, output)

    def _area_defuzzifier(self, system: System, output: Output) -> Defuzzifier:
        slots = slots_of(system, output)
        implications = {slot.implication for slot in slots}
        if (
            (output.defuzzifier, output.aggregation) == ("centroid", "max")
            and implications in ({"min"}, {"prod"})
            and not curved_term(output)
        ):
            with suppress(EngineError):  # more lines than an outline should have
                return Centroid(output, implications == {"prod"})
        joins = {(output.aggregation, implication) for implication in implications}
        if len(joins) == 1 and joins <= _BY_LINES.get(output.defuzzifier, set()):
            with suppress(EngineError):  # terms that are not smooth
                return ClippedCurves(output, slots)
        return Quadrature(output, slots)

    @property
    def methods(self) -> dict[str, str]:
        """Method of each output, with its error bound."""
        names = variable_names(self.system.outputs)
        return {name: str(one.method) for name, one in zip(names, self.defuzzifiers, strict=True)}


class GridEngine(ExactEngine):
    """Evaluate any system as MATLAB and simpful do, from `System.points` samples of each output."""

    name: ClassVar[str] = "grid"

    def _area_defuzzifier(self, system: System, output: Output) -> Defuzzifier:
        return _Sampler(output, system)


class _Sampler(Defuzzifier):
    """The value of one output from samples of its joined terms."""

    def __init__(self, output: Output, system: System) -> None:
        self.method = f"sums over {system.points} samples"
        self._defuzzifier = output.defuzzifier
        self._positions, degrees = sampled(output, system.points)
        slots = slots_of(system, output)
        self._slots = [(T_NORMS[slot.implication].array, degrees[slot.term]) for slot in slots]
        self._join = AGGREGATIONS[output.aggregation].array

    def values(self, cuts: Array, inputs: Array) -> Array:
        """Return the values for many samples."""
        size = max(1, _BLOCK // len(self._positions))
        parts = [self._defuzzified(cuts[:, i : i + size]) for i in range(0, cuts.shape[1], size)]
        return np.concatenate([np.empty(0), *parts])

    def _defuzzified(self, cuts: Array) -> Array:
        x, heights = self._positions, np.zeros((cuts.shape[1], len(self._positions)))
        for cut, (implication, degrees) in zip(cuts, self._slots, strict=True):
            heights = self._join(heights, implication(cut[:, None], degrees))
        if self._defuzzifier == "bisector":
            sums = np.cumsum(heights, axis=1)
            whole = sums[:, -1:]
            return np.where(whole[:, 0] > 0.0, x[np.argmax(sums >= whole / 2, axis=1)], np.nan)
        if self._defuzzifier != "centroid":
            heights = (heights >= heights.max(axis=1, keepdims=True) * _EQUAL) & (heights > 0.0)
        if self._defuzzifier in ("som", "lom"):
            index = heights.argmax(axis=1) if self._defuzzifier == "som" else -1 - heights[:, ::-1].argmax(axis=1)
            return np.where(heights.any(axis=1), x[index], np.nan)
        with np.errstate(invalid="ignore"):  # where all heights are 0
            return np.asarray((heights @ x) / heights.sum(axis=1))


def sampled(output: Output, points: int) -> tuple[Array, Array]:
    """Return the sampled positions of an output, shape (points,), and its terms there, (terms, points)."""
    if points * len(output.terms) > 2**25:
        raise EngineError(f"output {output.name!r}: {points} points are too many to sample, expected fewer")
    positions = np.linspace(*output.universe, points)
    if not (np.diff(positions) > 0.0).all():
        raise EngineError(f"output {output.name!r}: {points} points do not fit in {output.universe}")
    samples = np.array([term.membership.of_many(positions) for term in output.terms])
    for term, degrees in zip(output.terms, samples, strict=True):
        if not degrees.any():
            raise EngineError(
                f"output {output.name!r}: term {term.name!r} is 0 at all {points} points; expected more points"
            )
    return positions, samples


class Weighted(Defuzzifier):
    """The value of one output whose terms are values."""

    # Sugeno's terms may depend on the inputs. Tsukamoto's only rise or only fall, and their value is the position at
    # which they have the rule's strength.
    method = "weighted values, to rounding"

    def __init__(self, output: Output, inputs: Sequence[str], outputs: Sequence[str]) -> None:
        self._mean = output.defuzzifier == "average"
        self._values = [_function(term.shape, inputs, outputs) for term in output.terms]

    def value(self, cuts: Sequence[float], inputs: Sequence[float]) -> float:
        """Return the output's value for one sample."""
        total = weight = 0.0
        for cut, value in zip(cuts, self._values, strict=True):
            if cut > 0.0:
                total += cut * value(cut, inputs)
                weight += cut
        return total / weight if self._mean else total

    def values(self, cuts: Array, inputs: Array) -> Array:
        """Return the output's values for many samples."""
        total, weight = np.zeros((2, cuts.shape[1]))
        for cut, value in zip(cuts, self._values, strict=True):
            fires = cut > 0.0
            with np.errstate(all="ignore"):
                total += np.where(fires, cut * np.where(fires, value(cut, inputs.T), 0.0), 0.0)
            weight += cut
        return total / weight if self._mean else total


def _function(shape: Any, inputs: Sequence[str], outputs: Sequence[str]) -> Callable[[Any, Any], Any]:
    """Return a function from the strengths and the inputs to the values: numbers, or arrays for many samples."""
    if isinstance(shape, Constant):
        return lambda cut, columns: shape.value
    if isinstance(shape, Value):
        whole, names = shape.expression(inputs, outputs), (*inputs, *outputs)
        return lambda cut, columns: (whole.of_many if isinstance(columns, np.ndarray) else whole)(
            dict(zip(names, columns, strict=True))
        )

    def position(cut: Any, columns: Any) -> Any:
        if isinstance(cut, np.ndarray):  # a strength of 0 has no weight, so that its position does not matter
            return np.array([place_of(shape, w) if w > 0.0 else 0.0 for w in cut.tolist()])
        return place_of(shape, cut)

    return position
