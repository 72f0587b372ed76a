"""The engine that sums over samples of the outputs' universes."""

from __future__ import annotations

from typing import ClassVar

import numpy as np

from fuzzy_arbiter.definition import Output, System
from fuzzy_arbiter.engines.defuzzification import HEIGHT_RATIO
from fuzzy_arbiter.engines.engine import Defuzzifier
from fuzzy_arbiter.engines.exact import ExactEngine
from fuzzy_arbiter.engines.firing import slots_of
from fuzzy_arbiter.errors import EngineError
from fuzzy_arbiter.shapes import Array
from fuzzy_arbiter.terms.norms import AGGREGATIONS, T_NORMS

_BLOCK = 2**20  # number of heights that are computed at a time


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
            heights = (heights >= heights.max(axis=1, keepdims=True) * HEIGHT_RATIO) & (heights > 0.0)
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
