"""The engine for any system: exact wherever there is an exact value."""

from __future__ import annotations

import math
from collections.abc import Sequence
from contextlib import suppress
from typing import ClassVar

import numpy as np

from fuzzy_arbiter.definition import System, variable_names
from fuzzy_arbiter.engines.bands import centroids
from fuzzy_arbiter.engines.engine import Engine
from fuzzy_arbiter.engines.firing import Array, slots_of
from fuzzy_arbiter.engines.plain import curved
from fuzzy_arbiter.engines.quadrature import Quadrature
from fuzzy_arbiter.engines.sweep import LARGER, TINY, Outline, centroid, outline
from fuzzy_arbiter.engines.weighted import Weighted
from fuzzy_arbiter.errors import EngineError

EXACTLY = "exact integrals, to rounding"
_BLOCK = 8192  # number of samples evaluated at a time


class ExactEngine(Engine):
    """Evaluate any system."""

    # Straight terms exactly, over all their breakpoints; values as they are; else by quadrature.

    name: ClassVar[str] = "exact"

    def __init__(self, system: System) -> None:
        self.methods: dict[str, str] = {}
        self._ways: list[Outline | Weighted | Quadrature] = []
        self._scaled: list[bool] = []
        inputs = variable_names(system.inputs)
        for k, output in enumerate(system.outputs):
            slots = slots_of(system, output)
            implications = {slot.implication for slot in slots}
            self._scaled.append(implications == {"prod"})
            straight = not curved(output) and implications <= {"min", "prod"} and len(implications) == 1
            if output.weighted:
                self._ways.append(Weighted(output, inputs, variable_names(system.outputs[:k])))
                self.methods[output.name] = "weighted values, to rounding"
                continue
            if straight and (output.defuzzifier, output.aggregation) == ("centroid", "max"):
                with suppress(EngineError):  # more lines than a sweep should have
                    self._ways.append(outline(output))
                    self.methods[output.name] = EXACTLY
                    continue
            way = Quadrature(output, slots)
            self._ways.append(way)
            self.methods[output.name] = way.method
        super().__init__(system)

    def quadrature(self, name: str) -> bool:
        """Return True if an output is integrated by quadrature."""
        return any(
            o.name == name and isinstance(w, Quadrature) for o, w in zip(self.system.outputs, self._ways, strict=True)
        )

    def centroid(self, k: int, cuts: Sequence[float]) -> float:
        """Return the value of an output, with the error bound in `methods`."""
        way = self._ways[k]
        if isinstance(way, Quadrature):
            return way.value(cuts)
        if isinstance(way, Weighted):
            return way.value(cuts, [math.nan] * (len(self.system.inputs) + k))
        return float(centroid(cuts, *way, self._scaled[k]))

    def centroid_of_many(self, k: int, cuts: Array) -> Array:
        """Return the values of an output for many samples, with the error bound in `methods`."""
        way = self._ways[k]
        if isinstance(way, Quadrature):
            return way.values(cuts)
        assert not isinstance(way, Weighted)
        cuts = np.where(cuts.max(axis=0) < TINY, cuts * LARGER, cuts)
        result = np.empty(cuts.shape[1])
        for start in range(0, len(result), _BLOCK):
            block = slice(start, start + _BLOCK)
            result[block] = _centroids(cuts[:, block], way) if self._scaled[k] else centroids(cuts[:, block], way)
        return result

    def value(self, k: int, cuts: Sequence[float], inputs: Sequence[float]) -> float:
        """Return the value of an output for a sample."""
        way = self._ways[k]
        return way.value(cuts, inputs) if isinstance(way, Weighted) else self.centroid(k, cuts)

    def values(self, k: int, cuts: Array, inputs: Array) -> Array:
        """Return the values of an output for many samples."""
        way = self._ways[k]
        return way.values(cuts, inputs) if isinstance(way, Weighted) else self.centroid_of_many(k, cuts)


def _centroids(cuts: Array, shape: Outline) -> Array:
    """Return the centroids of scaled terms for many samples: `sweep.scaled` for each column of `cuts`, shape (n,)."""
    every, n = cuts, cuts.shape[1]
    area, moment = np.zeros(n), np.zeros(n)
    for piece in range(len(shape.places) - 1):
        lines = slice(shape.first[piece], shape.first[piece + 1])
        a, b = (np.reshape(side[lines], (-1, 1)) for side in (shape.left, shape.right))
        cuts = every[list(shape.term[lines])]
        terms = len(cuts)
        start, width = shape.places[piece] - shape.places[0], shape.places[piece + 1] - shape.places[piece]
        start_at, end_at = a * cuts, b * cuts
        # each against those before it
        others = [(start_at[t], end_at[t], start_at[:t], end_at[:t]) for t in range(1, terms)]
        breaks = [np.zeros((1, n)), np.ones((1, n)), *(_crossings(*pair, n) for pair in others)]
        places = np.sort(np.concatenate(breaks), axis=0)
        middles = (places[:-1] + places[1:]) / 2
        heights, starts, ends = np.zeros((3, *middles.shape))
        for t in range(terms):
            cut, rise = cuts[t], b[t] - a[t]
            degrees, lines = (a[t] + rise * middles) * cut, (a[t] + rise * places) * cut
            greatest = degrees > heights
            np.copyto(starts, lines[:-1], where=greatest)
            np.copyto(ends, lines[1:], where=greatest)
            np.maximum(heights, degrees, out=heights)
        x, w = start + places * width, np.diff(places, axis=0) * width
        for i, (width_i, y0, y1) in enumerate(zip(w, starts, ends, strict=True)):
            # one after another, as for one sample, to the same bits
            area += width_i * (y0 + y1) / 2
            moment += width_i * (x[i] * (2 * y0 + y1) + x[i + 1] * (y0 + 2 * y1)) / 6
    return np.asarray(shape.places[0] + moment / area)


def _crossings(a: Array, b: Array, c: Array, d: Array, n: int) -> Array:
    """Return the crossings of lines a..b with the line c..d, as fractions of the piece's width; 0 where none cross."""
    a, b, c, d = np.broadcast_arrays(a, b, c, d)
    meet = (a < c) != (b < d)
    shares = np.divide(a - c, (a - c) - (b - d), out=np.zeros(a.shape), where=meet)
    return np.asarray(np.broadcast_to(shares, (len(a), n)))
