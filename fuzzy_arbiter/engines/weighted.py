"""Outputs of values: the mean of what the rules conclude, weighted by their strengths, or the sum."""

# Sugeno's terms are values that may depend on the inputs. Tsukamoto's only rise or only fall, and their value is the
# place where they have the rule's strength.

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np

from fuzzy_arbiter.definition import Output
from fuzzy_arbiter.shapes import Array
from fuzzy_arbiter.terms.values import Constant, Value, place_of


class Weighted:
    """The value of one output whose terms are values."""

    method = "weighted values, to rounding"

    def __init__(self, output: Output, inputs: Sequence[str], outputs: Sequence[str]) -> None:
        self._mean = output.defuzzifier == "average"
        shapes = [term.shape for term in output.terms]
        self._numbers = [_number(shape, inputs, outputs) for shape in shapes]
        self._arrays = [_array(shape, inputs, outputs) for shape in shapes]

    def value(self, cuts: Sequence[float], inputs: Sequence[float]) -> float:
        """Return the output's value for one sample."""
        total = weight = 0.0
        for cut, number in zip(cuts, self._numbers, strict=True):
            if cut > 0.0:
                total += cut * number(cut, inputs)
                weight += cut
        return total / weight if self._mean else total

    def values(self, cuts: Array, inputs: Array) -> Array:
        """Return the output's values for many samples."""
        total, weight = np.zeros((2, cuts.shape[1]))
        for cut, array in zip(cuts, self._arrays, strict=True):
            fires = cut > 0.0
            with np.errstate(all="ignore"):
                total += np.where(fires, cut * np.where(fires, array(cut, inputs), 0.0), 0.0)
            weight += cut
        return total / weight if self._mean else total


def _number(shape: object, inputs: Sequence[str], outputs: Sequence[str]) -> Callable[[float, Sequence[float]], float]:
    if isinstance(shape, Constant):
        value = shape.value
        return lambda cut, sample: value
    if isinstance(shape, Value):
        of = shape.number(inputs, outputs)
        return lambda cut, sample: of(sample)
    return lambda cut, sample: place_of(shape, cut)  # type: ignore[arg-type]  # the output has checked the shape


def _array(shape: object, inputs: Sequence[str], outputs: Sequence[str]) -> Callable[[Array, Array], Array]:
    if isinstance(shape, Value):
        of = shape.array(inputs, outputs)
        return lambda cut, samples: of(samples)
    # a strength of 0 has no weight, so that its position does not matter
    return lambda cut, samples: np.array([place_of(shape, w) if w > 0.0 else 0.0 for w in cut.tolist()])  # type: ignore[arg-type]
