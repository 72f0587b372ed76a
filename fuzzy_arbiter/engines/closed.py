"""The closed form: exact, and thousands of times faster than sampling."""

# If the cuts of an output's two terms are 1 - h and h for all inputs, its centroid is a function C(h) alone, piecewise
# cubic over quadratic. For prioritized criteria, with m the degree to which each asks for attention,
#
#     h_k = min(1 - m_1, 1 - m_2 ... 1 - m_(k-1), m_k),
#
# and for low = triangle (0, 0, 1), high = triangle (0, 1, 1) the joined area is 1/2 for every h and
#
#     C(h) = 1/3 + h^2 - 2/3 h^3,
#
# which scaled to [0, 1] is the smoothstep 3 h^2 - 2 h^3.

from __future__ import annotations

from bisect import bisect_right
from collections.abc import Sequence
from dataclasses import replace
from typing import ClassVar

import numpy as np

from fuzzy_arbiter.definition import Output, System
from fuzzy_arbiter.engines.engine import Engine, Shortcut, normalize_weights, normalize_weights_of_many
from fuzzy_arbiter.engines.firing import Array
from fuzzy_arbiter.engines.normal_form import Clause, Literal, high_clauses, ladder
from fuzzy_arbiter.engines.rational_pieces import Piece, pieces
from fuzzy_arbiter.engines.supported import unsupported_reason
from fuzzy_arbiter.errors import EngineError
from fuzzy_arbiter.hierarchy import DEGREE

SMOOTHSTEP = (0.0, 0.0, 3.0, -2.0)  # coefficients of 3 h^2 - 2 h^3, which stays within [0, 1]
_BLOCK = 8192  # number of samples evaluated at a time; longer arrays leave the caches and are allocated anew each time


class NoClosedFormError(EngineError):
    """Raised for a system that this engine cannot evaluate."""

    def __init__(self, reason: str) -> None:
        super().__init__(f"engine 'closed': {reason}")
        self.reason = reason


class _ClosedForm:
    """C(h) of one output, whose cuts are 1 - h and h."""

    method = "closed form"

    def __init__(self, forms: tuple[Piece, ...]) -> None:
        self._forms = forms

    def value(self, cuts: Sequence[float], inputs: Sequence[float]) -> float:
        """Return the value for one sample."""
        return _value(self._forms, cuts[1])

    def values(self, cuts: Array, inputs: Array) -> Array:
        """Return the values for many samples."""
        return _values(self._forms, cuts[1])


class ClosedEngine(Engine):
    """Evaluate C(h) for outputs of two terms whose cuts are 1 - h and h, which is proved from the rules."""

    name: ClassVar[str] = "closed"

    def __init__(self, system: System) -> None:
        clauses = _proved(system)
        if isinstance(clauses, str):
            raise NoClosedFormError(clauses)
        self.clauses = clauses
        self.ladder = ladder(system, clauses)
        self.raw, scaled = _pieces(system.outputs)
        self.scaled = self.raw if system.normalization == "none" else scaled
        super().__init__(system, [_ClosedForm(forms) for forms in self.raw])
        self._index = {v.name: i for i, v in enumerate(system.inputs)}
        self._shapes = {(v.name, t.name): t.membership for v in system.inputs for t in v.terms}
        self._cubic = _one_cubic(self.scaled)
        # true if such weights are then clipped to [0, 1]: between h = 0 and 1 a C(h) may lie beyond C(0) and C(1)
        self.clips = system.normalization != "none" and self._cubic != SMOOTHSTEP
        # prioritized criteria in the order of the inputs, which are the degrees themselves: nothing to look up
        self._plain = self._cubic is not None and self.ladder is not None and len(self.ladder) == len(system.inputs)
        for step, variable in zip(self.ladder or (), system.inputs, strict=False):
            name, term, affirmed = step
            plain = name == variable.name and affirmed and variable.universe == (0.0, 1.0)
            self._plain = self._plain and plain and self._shapes[name, term] == DEGREE

    def centroids(self, inputs: Sequence[float]) -> list[float]:
        """Return the raw value of each output for one sample; see `Engine`."""
        return [_value(forms, h) for forms, h in zip(self.raw, self._highs(inputs), strict=True)]

    def centroids_of_many(self, inputs: Array) -> Array:
        """Return the raw value of each output for many samples; see `Engine`."""
        highs = self._highs_of_many(inputs)
        return np.stack([_values(forms, h) for forms, h in zip(self.raw, highs, strict=True)], axis=1)

    def weights(self, inputs: Sequence[float]) -> tuple[float, ...]:
        """Return the normalized value of each output for one sample; see `Engine`."""
        result = [_value(forms, h) for forms, h in zip(self.scaled, self._highs(inputs), strict=True)]
        if self.clips:
            result = [min(max(weight, 0.0), 1.0) for weight in result]
        return normalize_weights(result, self.system.normalization)

    def weights_of_many(self, inputs: Array) -> Array:
        """Return the normalized value of each output for many samples; see `Engine`."""
        result = np.empty((len(inputs), len(self.system.outputs)))
        for start in range(0, len(inputs), _BLOCK):
            block = inputs[start : start + _BLOCK]
            highs = self._highs_of_many(block)
            if self._cubic is not None:
                values = _horner(self._cubic, highs)
            else:
                values = np.stack([_values(forms, h) for forms, h in zip(self.scaled, highs, strict=True)])
            if self.clips:
                np.clip(values, 0.0, 1.0, out=values)
            result[start : start + _BLOCK] = values.T
        return normalize_weights_of_many(result, self.system.normalization)

    def shortcut(self) -> Shortcut | None:
        """Return a faster function for the weights where the inputs are the criteria's degrees; see `Engine`."""
        whole = self.clips or self.system.normalization not in ("range", "none")  # more to be done with the weights
        if self._plain and not whole and self._cubic is not None and self._cubic[:2] == (0.0, 0.0):
            return _smooth_ladder(len(self.system.inputs), *self._cubic[2:])
        return None

    def _highs(self, inputs: Sequence[float]) -> list[float]:
        """Return the cut h of each output's second term."""
        if self.ladder is None:
            return [max(min(self._degree(x, inputs) for x in clause) for clause in forms) for forms in self.clauses]
        result = []
        unclaimed = 1.0
        for step in self.ladder:
            m = self._degree(step, inputs)
            result.append(min(m, unclaimed))
            unclaimed = min(unclaimed, 1.0 - m)
        return result

    def _degree(self, literal: Literal, inputs: Sequence[float]) -> float:
        variable, term, affirmed = literal
        degree = self._shapes[variable, term](inputs[self._index[variable]])
        return degree if affirmed else 1.0 - degree

    def _highs_of_many(self, inputs: Array) -> Array:
        """Return the cuts h, shape (outputs, n)."""
        if self._plain:
            degrees = inputs.T.copy()  # rows to be read one after another
        elif self.ladder is not None:
            degrees = np.stack([self._degrees(step, inputs) for step in self.ladder])
        else:
            known = {x: self._degrees(x, inputs) for forms in self.clauses for clause in forms for x in clause}
            return np.stack(
                [np.max([np.min([known[x] for x in c], axis=0) for c in forms], axis=0) for forms in self.clauses]
            )
        unclaimed = np.ones(len(inputs))
        rest = np.empty(len(inputs))
        for m in degrees:  # the degrees become the cuts
            np.subtract(1.0, m, out=rest)
            np.minimum(m, unclaimed, out=m)
            np.minimum(unclaimed, rest, out=unclaimed)
        return degrees

    def _degrees(self, literal: Literal, inputs: Array) -> Array:
        variable, term, affirmed = literal
        degrees = self._shapes[variable, term].of_many(inputs[:, self._index[variable]])
        return degrees if affirmed else 1.0 - degrees


def _proved(system: System) -> tuple[tuple[Clause, ...], ...] | str:
    """Return the clauses of each output's h, or the reason why there is no h."""
    if reason := unsupported_reason(system, curved_inputs=True):
        return reason
    if (system.conjunction, system.disjunction, system.implication) != ("min", "max", "min"):
        return f"norms are {system.conjunction}, {system.disjunction}, {system.implication}, expected min, max, min"
    for i, rule in enumerate(system.rules):
        if rule.weight != 1.0:
            return f"R{i + 1} has the weight {rule.weight!r}, expected 1"
    for output in system.outputs:
        if len(output.terms) != 2:
            return f"output {output.name!r} has the terms {', '.join(output.term_names)}, expected two"
    clauses = high_clauses(system)
    return clauses if isinstance(clauses, str) else tuple(clauses)


def _pieces(outputs: Sequence[Output]) -> tuple[tuple[tuple[Piece, ...], ...], tuple[tuple[Piece, ...], ...]]:
    """Return C(h) of each output, raw and scaled, computed once for outputs that differ in name alone."""
    patterns = [replace(output, name="any") for output in outputs]
    known = {pattern: pieces(pattern) for pattern in dict.fromkeys(patterns)}
    return tuple(known[pattern][0] for pattern in patterns), tuple(known[pattern][1] for pattern in patterns)


def _one_cubic(forms: Sequence[tuple[Piece, ...]]) -> tuple[float, ...] | None:
    """Return the coefficients of the cubic that all outputs share; None if they differ."""
    if len(set(forms)) > 1 or len(forms[0]) != 1 or forms[0][0].denominator != (1.0, 0.0, 0.0):
        return None
    return forms[0][0].numerator


def _smooth_ladder(n: int, n2: float, n3: float) -> Shortcut:
    """Return a function from the n degrees m to the n weights (n2 + n3 h) h^2; it returns None for invalid degrees."""

    def weights(degrees: Sequence[float]) -> list[float] | None:
        if len(degrees) != n:
            return None
        result = []
        unclaimed = 1.0  # degree to which no criterion of higher priority asks
        for m in degrees:
            if (type(m) is not float and type(m) is not int) or not 0.0 <= m <= 1.0:
                return None
            h = m if m < unclaimed else unclaimed
            result.append((n2 + n3 * h) * h * h)
            if 1.0 - m < unclaimed:
                unclaimed = 1.0 - m
        return result

    return weights


def _value(forms: tuple[Piece, ...], h: float) -> float:
    if len(forms) == 1:
        return forms[0](h)
    return forms[bisect_right(forms, h, key=_start) - 1](h)


def _start(piece: Piece) -> float:
    return piece.start


def _values(forms: tuple[Piece, ...], h: Array) -> Array:
    piece = np.searchsorted([p.start for p in forms], h, side="right") - 1
    t = h - np.array([p.start for p in forms])[piece]
    above, below = (np.array(c)[piece].T for c in zip(*((p.numerator, p.denominator) for p in forms), strict=True))
    return np.asarray(_horner(above, t) / _horner(below, t))


def _horner(coefficients: Sequence[float] | Array, t: Array) -> Array:
    """Evaluate a polynomial; coefficients that are the number 0 cost nothing."""
    result = coefficients[-1] * t
    for c in reversed(coefficients[1:-1]):
        if not (isinstance(c, float) and c == 0.0):
            result += c
        result *= t
    if not (isinstance(coefficients[0], float) and coefficients[0] == 0.0):
        result += coefficients[0]
    return result
