"""Outputs whose terms are values: Sugeno's and Tsukamoto's."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any

import numpy as np

from fuzzy_arbiter.definition import Output
from fuzzy_arbiter.engines.engine import Defuzzifier
from fuzzy_arbiter.shapes import Array
from fuzzy_arbiter.terms.values import Constant, Value


class Weighted(Defuzzifier):
    """The value of one output whose terms are values."""

    # Sugeno's terms may depend on the inputs. Tsukamoto's only rise or only fall, and their value is the position at
    # which they have the rule's strength.
    method = "weighted values, to rounding"

    def __init__(self, output: Output, inputs: Sequence[str], outputs: Sequence[str]) -> None:
        self._mean = output.defuzzifier == "average"
        self._values = [value_function(term.shape, inputs, outputs) for term in output.terms]

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


def value_function(shape: Any, inputs: Sequence[str], outputs: Sequence[str]) -> Callable[[Any, Any], Any]:
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
            return np.array([shape.place_of(w) if w > 0.0 else 0.0 for w in cut.tolist()])
        return shape.place_of(cut)

    return position
