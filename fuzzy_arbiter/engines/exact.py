"""The exact centroid of any piecewise-linear Mamdani system."""

from __future__ import annotations

from collections.abc import Sequence
from typing import ClassVar

import numpy as np

from fuzzy_arbiter.definition import System
from fuzzy_arbiter.engines.engine import Engine
from fuzzy_arbiter.engines.firing import Array
from fuzzy_arbiter.engines.sweep import centroid, outline


class ExactEngine(Engine):
    """Integrates the joined output terms exactly, over all their breakpoints."""

    name: ClassVar[str] = "exact"

    def __init__(self, system: System) -> None:
        self._outlines = [outline(v) for v in system.outputs]
        self._scaled = system.implication == "prod"
        super().__init__(system)

    def centroid(self, k: int, cuts: Sequence[float]) -> float:
        """Return the centroid of an output, exact to rounding."""
        return centroid(cuts, *self._outlines[k], self._scaled)

    def centroid_of_many(self, k: int, cuts: Array) -> Array:
        """Return the centroids of an output for many samples, exact to rounding."""
        return np.array([self.centroid(k, column) for column in cuts.T.tolist()])
