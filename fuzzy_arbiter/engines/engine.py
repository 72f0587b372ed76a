"""The base of all engines: from samples to centroids, and from centroids to weights."""

from __future__ import annotations

import functools
import math
import operator
from collections.abc import Callable, Sequence
from typing import Any, ClassVar, Protocol

import numpy as np

from fuzzy_arbiter.definition import Output, System
from fuzzy_arbiter.engines.firing import Array, Degrees, Firing
from fuzzy_arbiter.errors import EngineError
from fuzzy_arbiter.terms.values import Constant, Value

Shortcut = Callable[[Sequence[float]], list[float] | None]
_BLOCK = 8192  # number of samples that are evaluated together, so that they stay in the processor's cache
_EACH_BY_ITSELF = ("range", "none")  # normalizations that use one output at a time


class Defuzzifier(Protocol):
    """Value of one output from the cuts of its slots; inputs and earlier outputs matter to weighted outputs alone."""

    method: str  # how the value is computed, with its error bound

    def value(self, cuts: Sequence[float], inputs: Sequence[float]) -> float:
        """Return the value for one sample."""

    def values(self, cuts: Array, inputs: Array) -> Array:
        """Return the values for many samples; cuts (slots, n), inputs (n, inputs and earlier outputs), returns (n,)."""


class Engine:
    """A way to evaluate a system; it never changes, so that threads may share it."""

    name: ClassVar[str]

    def __init__(self, system: System, defuzzifiers: Sequence[Defuzzifier], degrees: Degrees | None = None) -> None:
        self.system = system
        self.defuzzifiers = defuzzifiers
        self.firing = Firing(system, degrees)
        self.scale = [] if system.normalization == "none" else [self._ends(k) for k in range(len(system.outputs))]

    def centroids(self, inputs: Sequence[float]) -> list[float]:
        """Return the raw value of each output for one sample."""
        cuts = self.firing.cuts(self.firing.strengths(inputs))
        result: list[float] = []
        for output, cut, defuzzifier in zip(self.system.outputs, cuts, self.defuzzifiers, strict=True):
            value = defuzzifier.value(cut, (*inputs, *result)) if any(cut) else math.nan
            if not math.isfinite(value):
                value = default_of(output)
            result.append(min(max(value, output.universe[0]), output.universe[1]) if output.lock_range else value)
        return result

    def centroids_of_many(self, inputs: Array) -> Array:
        """Return the raw value of each output for many samples; inputs (n, inputs), returns (n, outputs)."""
        result = np.empty((len(inputs), len(self.system.outputs)))
        uses_outputs = any(output.weighted for output in self.system.outputs)  # values may depend on earlier outputs
        for start in range(0, len(inputs), _BLOCK):
            block = slice(start, start + _BLOCK)
            known = inputs[block]
            for k, cuts in enumerate(self.firing.cuts_of_many(self.firing.strengths_of_many(known))):
                self._fill_fired(
                    k, cuts, np.column_stack([known, result[block, :k]]) if uses_outputs else known, result[block, k]
                )
                self._fill_defaults(k, result[max(0, start - 1) : start + _BLOCK, k])  # the last value before is kept
        return result

    def _fill_fired(self, k: int, cuts: Array, known: Array, values: Array) -> None:
        """Fill in the values of an output where rules fire, and NaN where none does."""
        fires = np.asarray(cuts.any(axis=0))
        if fires.all():
            values[:] = self.defuzzifiers[k].values(cuts, known)
        else:
            values[:] = math.nan
            values[fires] = self.defuzzifiers[k].values(cuts[:, fires], known[fires])

    def _fill_defaults(self, k: int, values: Array) -> None:
        """Fill in the values before or the default of an output where it has no value, and hold it in its range."""
        output = self.system.outputs[k]
        defined = np.isfinite(values)
        if output.lock_previous and defined.any():
            last = np.maximum.accumulate(np.where(defined, np.arange(len(values)), -1))
            values[last >= 0] = values[last[last >= 0]]
            defined = last >= 0
        values[~defined] = default_of(output)
        if output.lock_range:
            np.clip(values, *output.universe, out=values)

    def weights(self, inputs: Sequence[float]) -> tuple[float, ...]:
        """Return the normalized value of each output for one sample."""
        raw = self.centroids(inputs)
        if not self.scale:
            return tuple(raw)
        scaled = [min(max((c - low) / (high - low), 0.0), 1.0) for c, (low, high) in zip(raw, self.scale, strict=True)]
        return normalize_weights(scaled, self.system.normalization)

    def weights_of_many(self, inputs: Array) -> Array:
        """Return the normalized value of each output for many samples; inputs (n, inputs), returns (n, outputs)."""
        raw = self.centroids_of_many(inputs)
        if not self.scale:
            return raw
        low, high = np.array(self.scale).T
        return normalize_weights_of_many(np.clip((raw - low) / (high - low), 0.0, 1.0), self.system.normalization)

    def shortcut(self) -> Shortcut | None:
        """Return a faster function for `weights` that evaluates samples of plain numbers, if there is one."""
        return None

    def __reduce__(self) -> tuple[Any, ...]:
        return type(self), (self.system,)

    def _ends(self, k: int) -> tuple[float, float]:
        """Return the centroids that become 0 and 1: of the least and of the greatest term, each alone and whole."""
        output = self.system.outputs[k]
        if any(isinstance(term.shape, Value) and not isinstance(term.shape, Constant) for term in output.terms):
            raise EngineError(
                f"output {output.name!r}: its terms depend on the inputs, which leaves no range to normalize; expected "
                "normalization 'none'"
            )
        slots, unknown = self.firing.slots[k], [math.nan] * (len(self.system.inputs) + k)
        terms = sorted({slot.term for slot in slots})
        centroids = [self.defuzzifiers[k].value([float(slot.term == j) for slot in slots], unknown) for j in terms]
        if not centroids:
            raise EngineError(
                f"output {output.name!r}: no rule concludes on it, which leaves no range to normalize; expected one"
            )
        low, high = min(centroids), max(centroids)
        if not low < high:
            raise EngineError(
                f"output {output.name!r}: its terms have one centroid, {low:g}, which leaves no range to normalize; "
                "expected normalization 'none'"
            )
        return low, high


def normalize_weights(weights: Sequence[float], normalization: str) -> tuple[float, ...]:
    """Apply a normalization over all outputs to range-normalized weights."""
    if normalization in _EACH_BY_ITSELF:
        return tuple(weights)
    known = [w for w in weights if w == w] or [0.0]
    # not sum(), which newer Pythons round otherwise than exported code
    whole = functools.reduce(operator.add, known) if normalization == "sum" else max(known)
    return tuple(w / whole if whole > 0.0 else w * 0.0 for w in weights)


def normalize_weights_of_many(weights: Array, normalization: str) -> Array:
    """Apply a normalization over all outputs to range-normalized weights of many samples."""
    if normalization in _EACH_BY_ITSELF:
        return weights
    known = np.where(np.isnan(weights), 0.0, weights)
    whole = (np.sum if normalization == "sum" else np.max)(known, axis=1, keepdims=True)
    return np.asarray(np.divide(weights, whole, out=weights * 0.0, where=whole > 0.0))


def default_of(output: Output) -> float:
    """Return the value of an output for which no rule fires, or whose conclusion is not a number."""
    return math.nan if output.default is None else output.default
