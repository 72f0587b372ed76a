"""The base of all engines: from samples to centroids, and from centroids to weights."""

from __future__ import annotations

import math
import operator
from collections.abc import Callable, Sequence
from functools import reduce
from typing import Any, ClassVar

import numpy as np

from fuzzy_arbiter.definition import Output, System
from fuzzy_arbiter.engines.firing import Degrees, Firing
from fuzzy_arbiter.errors import EngineError, InputError
from fuzzy_arbiter.shapes import Array
from fuzzy_arbiter.terms.values import Constant, Value

Shortcut = Callable[[Sequence[float]], list[float] | None]
_BLOCK = 8192  # number of samples that are evaluated together, so that they stay in the processor's cache
_EACH_BY_ITSELF = ("range", "none")  # normalizations that use one output at a time


class Defuzzifier:
    """Computes the value of an output from the cuts of its slots. Subclasses define `value`, `values` or both."""

    method: str  # how the value is computed, with its error bound

    def value(self, cuts: Sequence[float], inputs: Sequence[float]) -> float:
        """Return the value for one sample; inputs and earlier outputs matter to weighted outputs alone."""
        return float(self.values(np.array(cuts, dtype=np.float64)[:, None], np.array([inputs]))[0])

    def values(self, cuts: Array, inputs: Array) -> Array:
        """Return the values for many samples; cuts (slots, n), inputs (n, inputs and earlier outputs), returns (n,)."""
        return np.array([self.value(*row) for row in zip(cuts.T.tolist(), inputs.tolist(), strict=True)])


class Engine:
    """A way to evaluate a system, which threads may share: no decision depends on those before it."""

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
                if output.lock_previous:
                    raise InputError(
                        f"no rule fires for the output {output.name!r}, which keeps its previous value; expected a "
                        "batch, whose rows have one before"
                    )
                value = default_of(output)
            result.append(min(max(value, output.universe[0]), output.universe[1]) if output.lock_range else value)
        return result

    def centroids_of_many(self, inputs: Array) -> Array:
        """Return the raw value of each output for many samples; inputs (n, inputs), returns (n, outputs)."""
        result = np.empty((len(inputs), len(self.system.outputs)))
        for start in range(0, len(inputs), _BLOCK):
            known = inputs[start : start + _BLOCK]
            cuts_of_all = self.firing.cuts(self.firing.strengths(known))
            for k, (output, cuts) in enumerate(zip(self.system.outputs, cuts_of_all, strict=True)):
                column = result[start : start + _BLOCK, k]
                fires = np.asarray(cuts.any(axis=0))
                which = slice(None) if fires.all() else fires
                column[:] = math.nan
                column[which] = self.defuzzifiers[k].values(cuts[:, which], known[which])
                _fill_defaults(output, result[max(0, start - 1) : start + _BLOCK, k])  # the last value before is kept
                if any(later.weighted for later in self.system.outputs[k + 1 :]):  # values may depend on outputs
                    known = np.column_stack([known, column])
        return result

    def weights(self, inputs: Sequence[float]) -> tuple[float, ...]:
        """Return the normalized value of each output for one sample."""
        raw = self.centroids(inputs)
        if self.scale:
            raw = [min(max((c - low) / (high - low), 0.0), 1.0) for c, (low, high) in zip(raw, self.scale, strict=True)]
        return self.normalized(raw)

    def weights_of_many(self, inputs: Array) -> Array:
        """Return the normalized value of each output for many samples; inputs (n, inputs), returns (n, outputs)."""
        raw = self.centroids_of_many(inputs)
        if not self.scale:
            return raw
        low, high = np.array(self.scale).T
        return self.normalized_of_many(np.clip((raw - low) / (high - low), 0.0, 1.0))

    def normalized(self, weights: Sequence[float]) -> tuple[float, ...]:
        """Apply a normalization over all outputs to range-normalized weights of one sample."""
        if self.system.normalization in _EACH_BY_ITSELF:
            return tuple(weights)
        known = [w for w in weights if w == w] or [0.0]
        # not sum(), which newer Pythons round otherwise than exported code
        total = reduce(operator.add, known) if self.system.normalization == "sum" else max(known)
        return tuple(w / total if total > 0.0 else w * 0.0 for w in weights)

    def normalized_of_many(self, weights: Array) -> Array:
        """Apply a normalization over all outputs to range-normalized weights of many samples."""
        if self.system.normalization in _EACH_BY_ITSELF:
            return weights
        known = np.where(np.isnan(weights), 0.0, weights)
        # not np.sum(), which adds in another order
        total = reduce(np.add if self.system.normalization == "sum" else np.maximum, known.T)[:, None]
        return np.asarray(np.divide(weights, total, out=weights * 0.0, where=total > 0.0))

    def shortcut(self) -> Shortcut | None:
        """Return a faster function for `weights` that evaluates samples of plain numbers, if there is one."""
        return None

    def __reduce__(self) -> tuple[Any, ...]:
        return type(self), (self.system,)

    def _ends(self, k: int) -> tuple[float, float]:
        """Return the centroids that become 0 and 1: of the least and of the greatest term, each alone and whole."""
        output, slots = self.system.outputs[k], self.firing.slots[k]
        if any(isinstance(term.shape, Value) and not isinstance(term.shape, Constant) for term in output.terms):
            reason = "its terms depend on the inputs"
        elif not slots:
            reason = "no rule concludes on it"
        else:
            unknown = [math.nan] * (len(self.system.inputs) + k)
            centroids = [
                self.defuzzifiers[k].value([float(slot.term == j) for slot in slots], unknown)
                for j in sorted({slot.term for slot in slots})
            ]
            low, high = min(centroids), max(centroids)
            if low < high:
                return low, high
            reason = f"its terms have one centroid, {low:g}"
        raise EngineError(
            f"output {output.name!r}: {reason}, which leaves no range to normalize; "
            "expected another term, or normalization none"
        )


def _fill_defaults(output: Output, values: Array) -> None:
    """Fill in the values before or the default of an output where it has no value, and hold it in its range."""
    defined = np.isfinite(values)
    if output.lock_previous and defined.any():
        last = np.maximum.accumulate(np.where(defined, np.arange(len(values)), -1))
        values[last >= 0] = values[last[last >= 0]]
        defined = last >= 0
    values[~defined] = default_of(output)
    if output.lock_range:
        np.clip(values, *output.universe, out=values)


def default_of(output: Output) -> float:
    """Return the value of an output for which no rule fires, or whose conclusion is not a number."""
    return math.nan if output.default is None else output.default
